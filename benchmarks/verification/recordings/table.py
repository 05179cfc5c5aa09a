"""Recorded motions in files of simulators, loggers and telephones. Columns are found by their names, or named by the user."""

from __future__ import annotations

import gzip
import json
import math
import re
import warnings
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from io import TextIOWrapper
from itertools import chain, islice, product
from pathlib import Path
from typing import IO, Any

import numpy as np
from scipy.spatial.transform import Rotation

from conservative.attitude import Array
from conservative.check import LARGEST, SMALLEST
from conservative.errors import BadInput, MissingEngine
from conservative.files import open_file

from ..solution import States

ROWS, CHUNK = 2000, 50_000  # rows that are kept for fits, evenly chosen: this to twice as many; rows that are read at a time
LOOKED = 200  # lines among which the header and the first row of numbers are
LONGEST, MOST_COLUMNS, LONGEST_NAME = 1_000_000, 10_000, 200
"""Most characters of a line, and of the lines that are looked at; most columns; most letters of a name with a meaning."""
AT_ONCE = 64 * LONGEST
"""Most characters that are read at a time."""
OUTLIER = 1e4
"""Largest value relative to the median that digits are relative to: round-off of a value in error is not that of the others."""
UNITS = {
    **dict.fromkeys(
        ("deg/s", "deg_s", "deg_sec", "deg", "dps", "degrees", "degree", "°", "°/s", "deg s^-1", "deg s-1"), math.pi / 180
    ),
    **dict.fromkeys(
        ("rad/s", "rad_s", "rad_sec", "rad", "radians", "rad s^-1", "rad s-1", "rad.s-1", "rad*s^-1", "1/s", "-", ""), 1.0
    ),
    **dict.fromkeys(("rpm", "rev/min", "r/min"), math.pi / 30) | dict.fromkeys(("s", "sec", "secs", "seconds"), 1.0),
    **dict.fromkeys(("mdps",), math.pi / 180e3) | dict.fromkeys(("mrad/s", "mrad"), 1e-3) | {"min": 60.0, "rev/s": 2 * math.pi},
    **dict.fromkeys(("ms", "msec"), 1e-3)
    | dict.fromkeys(("us", "usec", "µs", "μs"), 1e-6)
    | dict.fromkeys(("ns", "nsec"), 1e-9),
}
_SUFFIX = r"[_-](deg_s|rad_s|deg_sec|rad_sec|dps|rpm|degrees|deg|radians|rad|seconds|msec|usec|nsec|ms|us|ns|s)(?=_|$)"
_AXES: tuple[Sequence[str], ...] = ("xyz", "123", "012", ("roll", "pitch", "yaw"))
_MATRIX = tuple([row + column for row in digits for column in digits] for digits in ("123", "012"))
_LONG = r"(.*(?:gyro(?:scope)?(?:adc)?|angular(?:velocity|rates?)|ang(?:vel|rate)|bodyrates?|rotationrates?|omega)[a-z]*?|"
_RATES = _LONG + r"w|wwbb|wrss|wbn|wb|wbi|gyr|rates?|(?=[pqr]$))"
_ORDER = "(?:wxyz|xyzw)"
_LETTERS = "q|qwb|qib|qbi|qbn|qnb|qbl|qrs|epbn|rot|att"
_QUATERNION = rf"((?:.*(?:quat(?:ernion)?q?|orientation|rotation|attitude)|{_LETTERS}){_ORDER}?)"
COLUMNS: dict[str, tuple[str, Sequence[Sequence[str]]]] = {
    "time": (r"(.*?)(times?(?:stamps?)?|secondselapsed|elapsed(?:secs)?|seconds|secs?|t|headerstamp|stamp)", ()),
    "rates": (rf"{_RATES}([xyz0123pqr]|roll|pitch|yaw)", (*_AXES, "pqr")),
    "quaternion": (rf"{_QUATERNION}([wxyz0-4])", ("wxyz", "0123", "1234")),
    "matrix": (r"(r|m|c|rwb|dcm|rotation|matrix|rotmat|cbn|rotationmatrix)([0-3]{2})", _MATRIX),
    "angles": (r"(.*euler(?:angles?)?(?:deg|rad)?|angles?|(?=roll|pitch|yaw))([xyz123]|roll|pitch|yaw)", _AXES),
    "aircraft angles": (r"(.*?attitude|.*?)(phi|theta|psi)", (("phi", "theta", "psi"),)),
    "axis and angle": (r"(axisangle|axis)([xyz123]|angle)", (("x", "y", "z", "angle"), ("1", "2", "3", "angle"))),
    "rotation vector": (r"(r|rv|rotvec|rotationvector|rvec|so3)([xyz123])", ("xyz", "123")),
    "modified Rodrigues": (r"(sigma|sigmabn|mrp|sigmabr)([123012])", ("123", "012")),
    "Rodrigues": (r"(rodrigues|crp|gibbs)([123xyz])", ("123", "xyz")),
}
"""For each quantity a pattern of the letters and digits of a name without its unit, and complete sets of its last group."""
ATTITUDES: Mapping[str, int] = {
    "quaternion": 4,
    "matrix": 9,
    "angles": 3,
    "aircraft angles": 3,
    "axis and angle": 4,
    "rotation vector": 3,
    "modified Rodrigues": 3,
    "Rodrigues": 3,
}
"""Kinds of attitudes, best first, with their numbers of columns."""
_MOVING = re.compile(r"lvlh|vvlh|rtn|rsw|hill|qbl|qlb|orbit|sigmabr|relative|ned")
_HORIZON = re.compile(r"latitude|longitude|altitudemsl|geodetic")
SHORT = {"time": "time", "rates": "w", "quaternion": "q", "matrix": "R", "angles": "euler", "rotation vector": "rotvec"} | {
    "modified Rodrigues": "mrp",
    "Rodrigues": "crp",
}
"""Quantities as `--columns` calls them."""
_STK = {
    "AttitudeTimeQuaternions": "time q_x q_y q_z q_w",
    "AttitudeTimeQuatScalarFirst": "time q_w q_x q_y q_z",
    "AttitudeTimeQuatAngVels": "time q_x q_y q_z q_w w_x_deg_s w_y_deg_s w_z_deg_s",
    "AttitudeTimeDCM": "time R_11 R_21 R_31 R_12 R_22 R_32 R_13 R_23 R_33",
}
"""Column names of the tables of an STK attitude file (.a), whose rows follow the keyword. Its matrices map to body axes."""
_AEM = {"FIRST": "time q_w q_x q_y q_z", "LAST": "time q_x q_y q_z q_w"}
"""Column names of quaternions in a CCSDS Attitude Ephemeris Message (504.0-B), by QUATERNION_TYPE."""
_UNREADABLE = OSError, ValueError, TypeError, EOFError, RecursionError, zlib.error
"""Errors of files that are damaged, and of values such as JSON in a thousand brackets."""


@dataclass(frozen=True)
class Options:
    """How the columns are to be read; None where header and numbers decide.

    `quaternion`, "wxyz" or "xyzw", is the order of numbered columns. `euler`, such as zyx, is the sequence of angles about axes
    that turn along. `world` is True for rates in world axes, and `units`, "deg" or "rad", are those of columns that name
    none; "deg/s" or "rad/s" are those of rates only.
    `columns`, such as `time=1,w=2:3:4`, names columns by their names or numbers from 1.
    """

    quaternion: str | None = None
    euler: str | None = None
    world: bool = False
    units: str | None = None
    columns: str | None = None


@dataclass
class Layout:
    """How a file is read: its lines before the rows, separator, and the names and units of the columns that are used."""

    names: list[str]
    skip: int = 0
    separator: str | None = ","
    comma: bool = False
    used: dict[str, dict[str, float]] = field(default_factory=dict)
    unused: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    end: str | None = None

    @property
    def attitude(self) -> str | None:
        """The kind of the attitudes in the file, None without them."""
        return next((kind for kind in ATTITUDES if kind in self.used), None)

    @property
    def doubt(self) -> str:
        """The sentence on columns that look like attitudes or rates and are not compared; "" without them."""
        return ""

    @property
    def numbered(self) -> bool:
        """Whether the quaternion's columns are numbered, so that their order is open. MuJoCo's qpos are scalar first."""
        keys = [_split(name)[0] for name in self.used.get("quaternion", ())]
        return bool(keys) and keys[0][-1:] not in [*"wxyz"] and not re.match(f"qpos|.*{_ORDER}.$", keys[0])

    @property
    def places(self) -> list[int]:
        """The places of the columns that are used: time, rates, attitude."""
        return [self.names.index(name) for part in self.used.values() for name in part]

    @property
    def sizes(self) -> Array:
        """The units of these columns in SI units."""
        return np.array([size for part in self.used.values() for size in part.values()])


@dataclass(frozen=True, eq=False)
class Recording:
    """A recorded motion at times t (n,), s, which are those of the file; it has `rows` rows, of which n are kept for fits.

    `shape` (n,) has what is measured before attitudes are repaired: norms of quaternions minus 1, or |R'R - 1| of matrices.
    `order_known` is False if the order of quaternions is a guess. `digits` are the largest round-off of times, s, attitudes,
    rad, and rates, rad/s, that the digits in the file stand for. `path` is None for a motion that is not a file.
    """

    t: Array
    data: States
    shape: Array | None = None
    order_known: bool = True
    degrees: bool = False
    rows: int = 0
    digits: tuple[float, float, float] = (0.0, 0.0, 0.0)
    layout: Layout = field(default_factory=lambda: Layout([]))
    options: Options = field(default_factory=Options)
    path: Path | None = None
    origin: int = 0

    def label(self, text: str) -> str:
        """Return a description of rows after the name of the file."""
        return text if self.path is None else f"{self.path}: {text}"

    def stream(self) -> Iterator[tuple[Array, States, Array | None]]:
        """Yield times, motion and shape of all rows, in chunks."""
        if self.path is None or self.rows == len(self.t):
            yield self.t, self.data, self.shape
            return
        for values in _values(self.path, self.layout, self.origin):
            yield _read_values(values * self.layout.sizes, self.layout, self.options)


def read(path: Path, options: Options) -> Recording:
    """Return the motion in a file: CSV, STK attitudes, Parquet or JSON lines, gzipped or not. Every row is checked, in chunks.

    Raises `BadInput` for files, columns, options and rows that cannot be used, and `MissingEngine` for Parquet without pyarrow.
    """
    if options.euler is not None and not re.fullmatch("(?!.*(.)\\1)[xyz]{3}", options.euler):
        raise BadInput("euler", repr(options.euler), "three of the letters x, y, z without equal neighbours, such as zyx")
    layout, origin = _choose(path, _look(path), options), 0
    _require_use(layout, options)
    kept: list[Array] = []
    every, rows, last = 1, 0, -math.inf
    for values in _values(path, layout, origin):
        rest = values[:, 1 + len(layout.used["rates"]) :]
        square = layout.attitude == "matrix"
        with np.errstate(all="ignore"):
            wrong = {
                "a value that is not a finite number": ~np.isfinite(values).all(axis=1),
                f"a value beyond {LARGEST:g}": (np.abs(values) > LARGEST).any(axis=1),
                "a time that is not later than that of the row before": np.diff(values[:, 0], prepend=last) <= 0,
                "a quaternion of norm 0": np.linalg.norm(rest, axis=1) < (1e-3 if layout.attitude == "quaternion" else -1),
                "a matrix that is not a rotation": square and np.linalg.det(rest.reshape(-1, 3, 3)) < 1e-3,
            }
        for what, bad in wrong.items():
            if np.any(bad):
                at = int(np.argmax(bad))
                column = np.array([*chain(*layout.used.values())])[~(np.abs(values[at]) <= LARGEST)].tolist()
                where = f", column {column[0]}" if column else ""
                raise BadInput(
                    "run", f"{path}, row {rows + 1 + at}{where}: {what}", "a file in which that row is repaired or removed"
                )
        if not rows and len(values):
            _guess_time(values, layout)
            _find_units(path, values, layout, options)
        kept.append(values[-rows % every :: every])
        rows, last = rows + len(values), values[-1, 0] if len(values) else last
        while sum(map(len, kept)) > 2 * ROWS:
            kept, every = [np.concatenate(kept)[::2]], 2 * every
    if rows < 2:
        raise BadInput("run", f"{path} with {rows} rows", "a header and two rows or more")
    raw = np.concatenate(kept)
    if (duration := float(last - raw[0, 0]) * float(layout.sizes[0])) < SMALLEST:
        raise BadInput("run", f"{path} with rows within {duration:g} s", f"times that differ by {SMALLEST:g} s or more")
    t, data, shape = _read_values(raw * layout.sizes, layout, options)
    known = options.quaternion is not None or not layout.numbered
    degrees = any(abs(size - math.pi / 180) < 1e-6 for size in layout.used["rates"].values())
    digits = _digits(raw, layout)
    return Recording(t, data, shape, known, degrees, rows, digits, layout, options, path, origin)


def _require_use(layout: Layout, options: Options) -> None:
    """Raise `BadInput` for an option that applies to none of the columns."""
    if options.euler is not None and layout.attitude != "angles":
        raise BadInput("euler", f"{options.euler!r}, for a file without columns of angles that it applies to", "no --euler")
    if options.quaternion is not None and not layout.numbered:
        raise BadInput("quaternion", f"{options.quaternion!r}, for a file without numbered quaternions", "no --quaternion")
    if options.world and (not layout.used["rates"] or layout.attitude is None):
        got = "'world', for a file without attitudes" if layout.used["rates"] else "'world', for a file without rates"
        raise BadInput("rates", got, "body, or a file with attitudes to convert them")
    if options.units is not None and "unit" not in layout.notes:
        raise BadInput("units", f"{options.units!r}, for a file whose columns name their units", "no --units")


def _read_values(values: Array, layout: Layout, options: Options) -> tuple[Array, States, Array | None]:
    """Return times, motion and shape of rows in SI units."""
    count, kind = 1 + len(layout.used["rates"]), layout.attitude
    w, rest, R, shape = values[:, 1:4] if count > 1 else None, values[:, count:], None, None
    if w is not None:
        w = np.where(np.abs(w) < SMALLEST, 0.0, w)  # no scene has such rates
    if kind == "quaternion":
        shape = np.linalg.norm(rest, axis=1) - 1
        R = Rotation.from_quat(rest, scalar_first=options.quaternion != "xyzw").as_matrix()
    elif kind == "matrix":
        R = rest.reshape(-1, 3, 3)
        shape = np.abs(np.swapaxes(R, 1, 2) @ R - np.eye(3)).max(axis=(1, 2))
        U, _, V = np.linalg.svd(R)
        R = U @ V
    elif kind in ("angles", "aircraft angles"):
        sequence = (options.euler or "zyx") if kind == "angles" else "zyx"
        R = Rotation.from_euler(sequence.upper(), rest).as_matrix()
    elif kind == "rotation vector":
        R = Rotation.from_rotvec(rest).as_matrix()
    elif kind == "axis and angle":
        size = np.linalg.norm(rest[:, :3], axis=1, keepdims=True)  # an angle of 0 may have an axis of 0
        R = Rotation.from_rotvec(rest[:, 3:] * rest[:, :3] / np.where(size == 0, 1, size)).as_matrix()
    elif kind == "modified Rodrigues":
        R = Rotation.from_mrp(rest).as_matrix()
    elif kind == "Rodrigues":
        R = Rotation.from_quat(np.column_stack([np.ones(len(rest)), rest]), scalar_first=True).as_matrix()
    if options.world and w is not None and R is not None:
        w = (w[:, None] @ R)[:, 0]
    return values[:, 0], (R, w), shape


def _digits(raw: Array, layout: Layout) -> tuple[float, float, float]:
    """Return the largest round-off of times, s, attitudes, rad, and rates, rad/s, that the digits of rows stand for."""
    count = 1 + len(layout.used["rates"])
    t, gaps = raw[:, 0], np.diff(raw[:, 0])
    uniform = np.ptp(gaps) <= 8 * np.spacing(np.abs(t).max()) if len(gaps) else True
    off = t - np.rint((t - t[0]) / gaps.min()) * gaps.min() - t[0]
    time = 0.0 if uniform else min(_quantum(t[:, None]), float(np.abs(off).max()))
    time = max(time, float(np.spacing(np.abs(t).max()) / 2))
    parts = [_quantum(part) * float(np.abs(size).max()) if part.size else 0.0 for part, size in (
        (raw[:, count:], layout.sizes[count:]), (raw[:, 1:count], layout.sizes[1:count])
    )]  # fmt: skip
    factor = {"quaternion": 2.0, "modified Rodrigues": 4.0, "Rodrigues": 4.0}.get(layout.attitude or "", 1.0)
    return time * float(layout.sizes[0]), parts[0] * factor, parts[1]


def _quantum(values: Array) -> float:
    """Return half of the last digit, or of the last bit, that all values of a kind have, of the largest that is no outlier."""
    sizes = np.abs(values[values != 0])
    largest = min(float(sizes.max()), OUTLIER * float(np.median(sizes))) if sizes.size else 1.0
    x = np.unique(values[:: max(1, len(values) // 500)])
    x = x[np.abs(x) >= SMALLEST]
    if len(x) < 5:  # of a constant nothing can be learned
        return largest * 2.0**-53
    near, half, unit = 4 * np.spacing(np.abs(x)), 0.0, np.zeros_like(x)
    exponent, whole = np.floor(np.log10(np.abs(x))), math.floor(math.log10(largest))
    for digits in range(3, 16):
        unit = 10.0 ** (exponent - digits + 1)
        if (np.abs(np.rint(x / unit) * unit - x) <= near).all():
            half = 0.5 * 10.0 ** (whole - digits + 1)
            break
    else:
        unit[:] = 0.0
    with np.errstate(over="ignore"):
        single = x.astype(np.float32)
    if (np.abs(single - x) <= unit / 2 + near).all():  # single precision, also if printed with nine digits
        half = max(half, largest * 2.0**-24)
    return max(half, largest * 2.0**-53)


def _open(path: Path) -> IO[str]:
    stream: Any = open_file(path)
    packed = stream.read(2) == b"\x1f\x8b"
    stream.seek(0)
    if packed:  # a GzipFile closes only a file that it has opened itself
        stream.close()
        stream = gzip.GzipFile(path)
    return TextIOWrapper(stream, encoding="utf-8-sig", errors="replace")


def _each_line(stream: IO[str]) -> Iterator[str]:
    number = 0
    while line := stream.readline(LONGEST + 1):
        number += 1
        if len(line) > LONGEST:
            raise ValueError(f"line {number} has more than {LONGEST} characters")
        yield line


def _chunks(lines: Iterable[str], count: int, size: int) -> Iterator[list[str]]:
    """Yield lists of lines: of a number of lines at most, and up to the line that exceeds a number of characters."""
    chunk, length = list[str](), 0
    for line in lines:
        chunk.append(line)
        length += len(line)
        if len(chunk) == count or length > size:
            yield chunk
            chunk, length = [], 0
    if chunk:
        yield chunk


def _ending(path: Path) -> str:
    return (path.with_suffix("") if path.suffix == ".gz" else path).suffix.lower()


def _fail(path: Path, reason: object) -> BadInput:
    text = (str(reason).strip().splitlines() or ["empty"])[0]
    return BadInput("run", f"{path} ({text})", "a table: CSV, STK attitudes (.a), Parquet (.parquet) or JSON lines (.jsonl)")


def _look(path: Path) -> Layout:
    """Return the layout of a file, without the meaning of its columns."""
    try:
        if _ending(path) == ".parquet":
            return Layout([str(name) for name in _parquet(path).schema_arrow.names])
        with _open(path) as stream:
            lines = next(_chunks(_each_line(stream), LOOKED, LONGEST), [])
    except ImportError:
        raise MissingEngine("pyarrow", "pyarrow") from None
    except _UNREADABLE as error:
        raise _fail(path, error) from None
    if _ending(path) in (".jsonl", ".ndjson", ".json"):
        try:
            return Layout(list(_flat(json.loads(lines[0]))))
        except (ValueError, IndexError, AttributeError, TypeError, RecursionError):
            raise _fail(path, "its first line is not a JSON object") from None
    keys = {key.strip(): value.strip() for key, _, value in (line.partition("=") for line in lines)}
    if "CCSDS_AEM_VERS" in keys:
        return _look_at_aem(path, keys, [line.strip() for line in lines])
    for number, line in enumerate(lines):
        if (word := line.strip()) in _STK:
            names = _STK[word].split()
            axes = next((each.split()[1:] for each in lines if each.split()[:1] == ["CoordinateAxes"]), [""])
            moving = dict.fromkeys(names[1:5], "") if re.search(r"(?i)lvlh|vvlh|fixed|vnc|nadir", " ".join(axes)) else {}
            found = Layout(names, number + 1, None, end="END")
            found.unused.update(dict.fromkeys(moving, f"their axes, {' '.join(axes)}, move"))
            return found
    first = next((i for i, line in enumerate(lines) if _separate(line) is not None), None)
    if first is None:
        raise _fail(path, "it has no row of numbers" if any(line.strip() for line in lines) else "it is empty")
    separator, fields = _separate(lines[first]) or (",", [])
    comma = separator != "," and any(re.fullmatch(r"[-+]?\d+,\d+([eE][-+]?\d+)?", each) for each in fields)
    names, before = [], [line.strip() for line in lines[:first] if line.strip()]
    for line in reversed(before):
        words = _words(line.lstrip("#% "), separator)
        if len(words) == len(fields) + (line.lstrip().startswith(("#", "%")) and words[:1] == [""]):
            units = [word.strip("()[] ").lower() for word in words]
            if not names and len(before) > 1 and all(each in UNITS or len(each) < 2 for each in units):
                names = [f" ({unit})" if unit not in ("", "-") else "" for unit in units]  # a line of units below the names
                continue
            names = [word + unit for word, unit in zip(words, names or [""] * len(words), strict=True)]
            break
    return Layout(names or [str(i + 1) for i in range(len(fields))], first, separator, comma)


def _look_at_aem(path: Path, keys: Mapping[str, str], lines: list[str]) -> Layout:
    """Return the layout of a CCSDS Attitude Ephemeris Message with quaternions from an inertial frame to body axes."""
    kind = keys.get("ATTITUDE_TYPE"), keys.get("QUATERNION_TYPE", "LAST"), keys.get("ATTITUDE_DIR", "A2B")
    if kind[0] != "QUATERNION" or kind[1] not in _AEM or kind[2] != "A2B" or "DATA_START" not in lines:
        raise _fail(path, f"a CCSDS message of {', '.join(map(str, kind))}; QUATERNION, FIRST or LAST, A2B are read")
    return Layout(_AEM[kind[1]].split(), lines.index("DATA_START") + 1, None, end="DATA_STOP")


def _words(line: str, separator: str | None) -> list[str]:
    """Return the fields of a line; a separator in quotation marks is none."""
    if '"' in line and separator is not None:
        line = re.sub(r'"([^"]*)"', lambda match: match[1].replace(separator, " "), line)
    return [word.strip().strip('"').strip() for word in line.strip("\r\n").split(separator)]


def _separate(line: str) -> tuple[str | None, list[str]] | None:
    """Return the separator of a row of numbers and its fields; None for another line."""
    if not line.strip() or line.lstrip().startswith(("#", "%")):
        return None
    for separator in (";", "\t", ",", None):
        words = _words(line, separator)
        while words and words[-1] == "":
            words.pop()
        numbers = sum(bool(re.fullmatch(r"[-+]?(\d+[.,]?\d*|[.,]\d+)([eE][-+]?\d+)?|nan|NaN", word)) for word in words)
        if len(words) > 1 and numbers >= max(2, len(words) // 2) and (numbers or words[0][:4].isdigit()):
            return separator, words
    return None


def _parquet(path: Path) -> Any:
    from pyarrow.parquet import ParquetFile

    open_file(path).close()  # refuses a pipe or a device
    return ParquetFile(path)


def _flat(record: Mapping[str, Any], before: str = "") -> dict[str, Any]:
    """Return a JSON object with names such as angular_velocity.x for nested ones."""
    out: dict[str, Any] = {}
    for name, value in record.items():
        parts = dict(enumerate(value)) if isinstance(value, list) else value if isinstance(value, dict) else None
        out |= {f"{before}{name}": value} if parts is None else _flat({str(k): v for k, v in parts.items()}, f"{before}{name}.")
    return out


def _values(path: Path, layout: Layout, origin: int) -> Iterator[Array]:
    """Yield the numbers in the columns that are used, in chunks of rows."""
    names, places = [name for part in layout.used.values() for name in part], layout.places
    try:
        if _ending(path) == ".parquet":
            for batch in _parquet(path).iter_batches(CHUNK, columns=names):
                yield np.column_stack([batch.column(name).to_numpy(zero_copy_only=False).astype(float) for name in names])
            return
        with _open(path) as stream:
            if _ending(path) in (".jsonl", ".ndjson", ".json"):
                for lines in _chunks(_each_line(stream), CHUNK, AT_ONCE):
                    records = [_record(line) for line in lines if line.strip()]
                    yield np.array([[_number(record.get(name)) for name in names] for record in records]).reshape(
                        -1, len(names)
                    )
                return
            done = 0
            for lines in _chunks(_lines(islice(_each_line(stream), layout.skip, None), layout), CHUNK, AT_ONCE):
                yield _parse(path, lines, layout, places, done)
                done += len(lines)
    except _UNREADABLE as error:
        if isinstance(error, BadInput):
            raise
        raise _fail(path, error) from None


def _record(line: str) -> dict[str, Any]:
    try:
        return _flat(json.loads(line))
    except AttributeError:
        raise ValueError(f"not a JSON object: {line[:40].strip()!r}") from None


def _lines(lines: Iterable[str], layout: Layout) -> Iterator[str]:
    for line in lines:
        if layout.end is not None and line.startswith(layout.end):
            return
        if line.strip() and not line.lstrip().startswith(("#", "%")):
            yield line


def _number(value: Any) -> float:
    try:
        return math.nan if isinstance(value, bool) else float(value)
    except (TypeError, ValueError, OverflowError):
        return math.nan


def _parse(path: Path, lines: list[str], layout: Layout, places: list[int], done: int) -> Array:
    """Return the numbers in lines; name the row and the column that has none."""
    if layout.comma:
        lines = [line.replace(",", ".") for line in lines]
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return np.loadtxt(lines, delimiter=layout.separator, usecols=places, ndmin=2, quotechar='"', comments=None)
    except ValueError:
        rows = [_words(line, layout.separator) for line in lines]
    dates = bool(re.match(r"\d{4}-\d\d-\d\d", rows[0][places[0]])) if rows else False
    out = np.full((len(rows), len(places)), np.nan)
    for number, row in enumerate(rows):
        for i, place in enumerate(places):
            text = row[place] if place < len(row) else ""
            try:
                out[number, i] = (
                    np.datetime64(text.rstrip("Z"), "ns").astype(np.int64) * 1e-9 if dates and i == 0 else float(text)
                )
            except ValueError:
                got = f"{path}, row {done + number + 1}, column {layout.names[place]}: {text!r}"
                raise BadInput("run", got, "a number there, or the row removed; decimals with one sign throughout") from None
    return out


def _guess_time(values: Array, layout: Layout) -> None:
    """Guess the unit of large unnamed times from their size: seconds, milliseconds, microseconds or nanoseconds since 1970."""
    (name, size), *_ = layout.used["time"].items()
    if size == 1.0 and _split(name)[1] is None and values[0, 0] > 1e11:
        power = 3 * int(1 + (values[0, 0] > 1e14) + (values[0, 0] > 1e17))
        layout.used["time"] = {name: 10.0**-power}
        layout.notes.append(f"{name} is read as a time since 1970 in 1e-{power} s, because of its size.")


def _choose(path: Path, layout: Layout, options: Options) -> Layout:
    """Find the columns of each quantity that the file has, and the sizes of their units; give a reason for every other one."""
    names = layout.names
    if len(names) > MOST_COLUMNS:
        raise BadInput("run", f"{path} with {len(names)} columns", f"a table of at most {MOST_COLUMNS} columns")
    chosen = _given(path, names, options.columns) if options.columns else _by_name(path, names, options)
    _leave_moving(layout, chosen, options)
    kinds = [kind for kind in ATTITUDES if kind in chosen]
    for kind in kinds[1:]:
        layout.unused |= dict.fromkeys(chosen.pop(kind), f"the {kinds[0]} is compared instead")
    if "time" not in chosen or not (chosen.get("rates") or kinds):
        missing = "attitudes or rates" if "time" in chosen else "the time"
        raise BadInput(
            "run", f"{path} without columns of {missing}: {_understood(names, chosen, layout)}", _hint(names, chosen, layout)
        )
    if kinds[:1] in (["angles"], ["aircraft angles"]):
        _sort_angles(layout, chosen, kinds[0], options)
        kinds = ["angles"] if "angles" in chosen else []
    for kind in ("time", "rates", *kinds[:1]):
        if kind not in chosen:
            layout.used[kind] = {}
            continue
        usual: str | None = "s" if kind == "time" else "rad"
        texts = [_split(name)[1] for name in chosen[kind]]
        if None in texts and kind in ("rates", "angles", "rotation vector"):
            usual = None if "/" in (options.units or "") and kind != "rates" else options.units
            layout.notes += ["unit"] * (usual is not None)
        plain = kind not in ("time", "rates", "angles", "rotation vector")  # a unit behind a quaternion is no unit
        sizes = [math.nan if (unit := text or usual) is None else 1.0 if plain else UNITS.get(unit, 0.0) for text in texts]
        if 0.0 in sizes:
            raise _no_unit(path, chosen[kind])
        layout.used[kind] = dict(zip(chosen[kind], sizes, strict=True))
    taken = [name for part in layout.used.values() for name in part]
    if len(set(taken)) < len(taken) or any(names.count(name) > 1 for name in taken):
        twice = next(name for name in taken if names.count(name) > 1 or taken.count(name) > 1)
        raise BadInput("run", f"{path} with two columns {twice!r}", "--columns with their numbers, such as time=1,w=2:3:4")
    for name in names:
        if name not in taken:
            layout.unused.setdefault(name, "neither a time nor an attitude nor a rate by its name")
    return layout


def _leave_moving(layout: Layout, chosen: dict[str, list[str]], options: Options) -> None:
    """Leave out attitudes relative to a frame that moves, and say so."""
    horizon = any(_HORIZON.search(_split(name)[0]) for name in layout.names)
    for kind in ATTITUDES.keys() & chosen.keys():
        members, reason = chosen[kind], ""
        if not options.columns and any(_MOVING.search(_split(name)[0][:-1]) for name in members):
            reason = "attitudes relative to a frame that moves are not judged"
        elif horizon and "angles" in kind and options.euler is None:
            reason = "angles to the local horizon, which moves; --euler zyx if they turn body to inertial axes"
        if reason or members[0] in layout.unused:
            layout.unused |= {name: reason or layout.unused[name] for name in members}
            del chosen[kind]


def _no_unit(path: Path, names: Sequence[str]) -> BadInput:
    header = re.sub(r"\s*[(\[].*", "", names[0])
    allowed = f"a header such as {header} (deg/s), or one without a unit and --units deg or rad"
    return BadInput("run", f"{path}, columns {', '.join(names)}, without a known unit", allowed)


def _find_units(path: Path, values: Array, layout: Layout, options: Options) -> None:
    """Find units that no column names: attitudes and rates agree in one choice of units only, or their format defines them."""
    parts, some, (time, *_) = layout.used, values[:400], layout.used["time"]
    open_ = [kind for kind, part in parts.items() if any(map(math.isnan, part.values()))]
    turns = some[:, 1 + len(parts["rates"]) :]
    short = layout.attitude == "rotation vector" and np.linalg.norm(turns, axis=1).max() < 2.1 * math.pi
    usual = [1.0 if short and kind == layout.attitude else _usual(parts[kind]) for kind in open_]
    known = (parts["time"][time], *usual)
    whole = _split(time)[1] is None and known[0] == 1.0 and bool((some[:, 0] == np.rint(some[:, 0])).all())
    choices = [(1.0, 1e-3, 1e-6, 1e-9) if whole else known[:1], *[(1.0, math.pi / 180)] * len(open_)]
    found: list[tuple[float, Any]] = []

    def choose(sizes: Sequence[Any]) -> None:
        for kind, size in zip(("time", *open_), sizes, strict=True):
            parts[kind] = dict.fromkeys(parts[kind], size)

    for sizes in product(*choices) if layout.attitude and parts["rates"] and len(some) > 2 else ():
        choose(sizes)
        orders = (options.quaternion,) if options.quaternion or not layout.numbered else ("wxyz", "xyzw")
        off = [_disagreement(some * layout.sizes, layout, replace(options, quaternion=order)) for order in orders]
        found.append((min(off), sizes))
    found.sort()
    if len(found) > 1 and found[0][0] < 0.1 and found[1][0] > 0.5:
        for kind, size, expected in zip(("time", *open_), found[0][1], known, strict=True):
            if size != expected:
                unit = f"{size:g} s" if kind == "time" else "rad" if size == 1.0 else "deg"
                layout.notes.append(f"{', '.join(parts[kind])}: read in {unit}, because only so do attitudes and rates agree.")
        known = found[0][1]
    if None in known:
        raise _no_unit(path, [*parts[open_[0]]])
    choose(known)


def _disagreement(values: Array, layout: Layout, options: Options) -> float:
    """Return the difference between turns from row to row and the mean rates there, relative to the smaller of them."""
    t, (R, w), _ = _read_values(values, layout, options)
    assert R is not None
    assert w is not None
    turned = Rotation.from_matrix(np.swapaxes(R[:-1], 1, 2) @ R[1:]).as_rotvec()
    expected = (w[:-1] + w[1:]) / 2 * np.diff(t)[:, None]
    return float(np.linalg.norm(turned - expected) / (min(np.linalg.norm(turned), np.linalg.norm(expected)) or 1.0))


def _usual(names: Iterable[str]) -> float | None:
    """Return the unit of columns that name none, where their format defines it: ROS, MuJoCo, Basilisk, and this package."""
    key = _split(next(iter(names)))[0]
    return 1.0 if re.search(r"wwbb|angularvelocity[xyz]|qvel|omegabnb|sigma", key) else None


def _sort_angles(layout: Layout, chosen: dict[str, list[str]], kind: str, options: Options) -> None:
    """Put angles into the order of their sequence: zyx for yaw, pitch and roll, also if they are called psi, theta and phi."""
    sequence = options.euler or "zyx"
    named = {_split(name)[0][-3:]: name for name in chosen[kind]}
    letters = [{"oll": "x", "tch": "y", "yaw": "z", "phi": "x", "eta": "y", "psi": "z"}.get(key, "") for key in named]
    if all(letters):
        by_axis = dict(zip(letters, named.values(), strict=True))
        if set(sequence) != set("xyz"):
            raise BadInput("euler", repr(sequence), f"a sequence of x, y and z for {', '.join(chosen[kind])}")
        chosen["angles"] = [by_axis[axis] for axis in sequence]
        if options.euler is None:
            layout.notes.append(f"{', '.join(chosen['angles'])} are read as yaw, pitch and roll (--euler zyx).")
        if kind != "angles":
            del chosen[kind]
    elif options.euler is None:
        layout.unused |= dict.fromkeys(
            chosen.pop(kind), "their sequence is not known; add --euler with it, such as --euler zyx"
        )
    elif {_split(name)[0][-1:] for name in chosen[kind]} == set("xyz") == set(sequence):
        by_axis = {_split(name)[0][-1:]: name for name in chosen[kind]}
        chosen[kind] = [by_axis[axis] for axis in sequence]


def _by_name(path: Path, names: list[str], options: Options) -> dict[str, list[str]]:
    """Return the columns of each quantity by their names."""
    chosen: dict[str, list[str]] = {}
    split = {name: _split(name)[0] for name in names}
    if {"axisx", "axis1"} & {*split.values()}:
        split = {name: "axisangle" if key == "angle" else key for name, key in split.items()}
    for kind, (pattern, complete) in COLUMNS.items():
        matches = {name: match for name, key in split.items() if (match := re.fullmatch(pattern, key))}
        if not matches:  # Sat.Q1 and /fdm/velocities/p: the last part of a path
            last = {name: re.split(r"[./:]", name)[-1] for name in names}
            ends = {name: _split(end)[0] for name, end in last.items() if end != name}
            matches = {name: match for name, key in ends.items() if (match := re.fullmatch(pattern, key))}
            split |= {name: ends[name] for name in matches}
        if kind == "time":
            order = {"secondselapsed": 0, "t": 1, "time": 2}
            times = sorted(matches, key=lambda name: (len(split[name]), order.get(split[name], 3)))
            times = [name for name in names if split[name] == "secondselapsed"] or times
            chosen |= {kind: times[:1]} if times else {}
            continue
        sets: dict[str, dict[str, str]] = {}
        for name, match in matches.items():
            sets.setdefault(match[1], {}).setdefault(match[2], name)
        full: dict[str, list[str]] = {}
        for prefix, parts in sets.items():
            for each in complete:
                if parts.keys() >= set(each):
                    full.setdefault(prefix, [parts[one] for one in each])
        if len(full) > 1:
            short = SHORT.get(kind, kind)
            offered = " or ".join(f"--columns {short}={':'.join(members)}" for members in full.values())
            raise BadInput("run", f"{path} with several sets of {kind}: {'; '.join(map(', '.join, full.values()))}", offered)
        for prefix, members in full.items():
            numbered = prefix.endswith("xyzw") and not _split(members[0])[0].endswith("w")
            chosen[kind] = [*members[-1:], *members[:-1]] if numbered else members
    place = {split[name]: name for name in names}
    for joint, skip in (
        ("qvel", 3),
        ("qvel", 0),
    ):  # MuJoCo: a free joint has seven positions and six rates, a ball four and three
        positions = [place.get(f"qpos{i}", "") for i in range(skip, skip + 4)]
        rates = [place.get(f"{joint}{i}", "") for i in range(skip, skip + 3)]
        if all(positions + rates) and f"qpos{skip + 4}" not in place and f"qvel{skip + 3}" not in place:
            chosen |= {"rates": rates, "quaternion": positions}
            break
    return chosen


def _given(path: Path, names: list[str], text: str) -> dict[str, list[str]]:
    """Return the columns that `--columns` names."""
    chosen, kinds = {}, {short: kind for kind, short in SHORT.items()}
    counts = {"time": 1, "rates": 3} | dict(ATTITUDES)
    for part in re.split(r",(?=[^=,]*=)", text):
        short, _, members = part.partition("=")
        kind, found = kinds.get(short.strip()), [each.strip() for each in members.split(":")]
        found = [
            names[int(each) - 1]
            if each not in names and re.fullmatch("[0-9]{1,9}", each) and 0 < int(each) <= len(names)
            else each
            for each in found
        ]
        if kind is None or any(each not in names for each in found) or len(found) != counts[kind]:
            allowed = (
                f"such as time=1,w=2:3:4 with {', '.join(SHORT.values())} and columns of {path.name}: {', '.join(names)[:300]}"
            )
            raise BadInput("columns", repr(part), allowed)
        letters = {_split(each)[0][-1:]: each for each in found}
        chosen[kind] = [letters[each] for each in "wxyz"] if kind == "quaternion" and letters.keys() == set("wxyz") else found
    return chosen


def _understood(names: Sequence[str], chosen: Mapping[str, Sequence[str]], layout: Layout) -> str:
    """Return the meaning found for each column."""
    kinds = {name: kind for kind, members in chosen.items() for name in members}
    return "; ".join(f"{name}: {kinds.get(name) or layout.unused.get(name) or 'not known'}" for name in names)[:600]


def _hint(names: Sequence[str], chosen: Mapping[str, Sequence[str]], layout: Layout) -> str:
    """Return the option that names the columns of this file, with three columns that differ by their axes if there are such."""
    taken = {*chain(*chosen.values()), *layout.unused}
    times = [
        *chosen.get("time", ()),
        *(name for name in names if re.search("time|date|stamp|frame|sec", name.lower())),
        names[0],
    ]
    rest = [name for name in names if name != times[0] and name not in taken]
    groups: dict[str, list[str]] = {}
    for name in rest:
        groups.setdefault(re.sub(r"[xyz0-9]", "*", _split(name)[0]), []).append(name)
    likely = sorted(
        (sorted(group) for group in groups.values() if len(group) == 3), key=lambda group: "g" not in group[0].lower()
    )
    if all(name.isdigit() for name in names):
        return "the columns by number, such as --columns time=1,w=2:3:4 --units rad, or time=1,q=2:3:4:5"
    w = [name for name in names if name in chosen.get("rates", ())] or [*(likely or [rest])[0], "X", "Y", "Z"][:3]
    known = next((f",{SHORT[kind]}={':'.join(chosen[kind])}" for kind in ATTITUDES if kind in chosen and kind in SHORT), "")
    rates = f",w={':'.join(w)}" if likely or not known or "X" not in w else ""
    return f"the columns by name or number, such as --columns time={times[0]}{rates}{known} --units rad"


def _split(name: str) -> tuple[str, str | None]:
    """Return the letters and digits of a column's name without its unit, and the unit."""
    text = name.strip().lower() if len(name) <= LONGEST_NAME else ""  # the time of some patterns grows with the square
    match = re.search(r"[(\[]([^)\]]*[a-z°^/][^)\]]*)[)\]]$", text) or re.search(_SUFFIX, text)
    match = match or re.search(r"(?<=^time)([mun]s)$", text)  # TimeUS of ArduPilot
    if match is None and (comma := re.search(r",\s*([^,]+)$", text)) and comma[1].strip() in UNITS:
        match = comma
    rest = text[: match.start()] + text[match.end() :] if match else text
    rest = re.sub(r"^(field|data)\.", "", rest.lstrip("#%_ "))
    key = re.sub(r"^(roll|pitch|yaw)(?:speed|rate)$", r"rate\1", re.sub(r"[^a-z0-9]", "", rest))
    return key, match[1].strip() if match else None
