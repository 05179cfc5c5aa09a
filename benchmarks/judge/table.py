"""Recorded motions in CSV, Parquet and JSON-lines files. Columns are found by their names."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation

from conservative.attitude import Array
from conservative.errors import BadInput, MissingEngine

from .motion import States

ROWS, CHUNK = 2000, 100_000  # rows that are kept, evenly chosen: this to twice as many; rows that are read at a time
UNITS = {
    **dict.fromkeys(("deg/s", "deg_s", "deg", "dps"), math.pi / 180),
    **dict.fromkeys(("rad/s", "rad_s", "rad", "s"), 1.0) | {"ms": 1e-3, "us": 1e-6},
}
_AXES: tuple[Sequence[str], ...] = ("xyz", "123", ("roll", "pitch", "yaw"))
_MATRIX = tuple([row + column for row in digits for column in digits] for digits in ("123", "012"))
_RATES = r"(w|omega|wwbb|gyro|(?:body)?rates?|(?:body)?ang(?:ular)?(?:vel(?:ocity)?|rate)(?:wrtei)?|(?=[pqr]$))"
COLUMNS: dict[str, tuple[str, Sequence[Sequence[str]]]] = {
    "time": (r"(time|timestamp|(?=t$))(t?)", ([""], "t")),
    "rates": (rf"{_RATES}([xyz123pqr]|roll|pitch|yaw)", (*_AXES, "pqr")),
    "quaternion": (r"(q|qwb|quat|quaternion|orientation|rotation|attitude)([wxyz0-4])", ("wxyz", "0123", "1234")),
    "matrix": (r"(r|m|rwb|dcm|rotation|matrix)([0-3]{2})", _MATRIX),
    "angles": (r"(euler|eulerangles?|angles?|(?=roll|pitch|yaw))([xyz123]|roll|pitch|yaw)", _AXES),
}
"""For each quantity a pattern of the letters and digits of a name without its unit, and complete sets of its last group."""


@dataclass(frozen=True, eq=False)
class Recording:
    """A recorded motion at times t (n,), s, which are those of the file; it has `rows` rows.

    `norm` (n,) has the norms of quaternions, whose order wxyz is a guess unless `order_known`. `ignored` are columns of angles.
    """

    t: Array
    data: States
    norm: Array | None
    order_known: bool
    degrees: bool
    ignored: list[str]
    rows: int


def read(path: Path, quaternion: str | None, euler: str | None, world: bool, units: str | None) -> Recording:
    """Return the motion in a file (.parquet, .jsonl, .ndjson, .json, or else CSV). Every row is checked, in chunks.

    `quaternion`, "wxyz" or "xyzw", is the order of numbered columns. `euler`, such as zyx, is the sequence of angles about axes
    that turn along. `world` is True for rates in world axes, and `units`, "deg" or "rad", are those of columns that name none.
    Raises `BadInput` for files, columns and rows that cannot be used, and `MissingEngine` without pyarrow, for Parquet.
    """
    if euler is not None and not re.fullmatch("[xyz]{3}", euler):
        raise BadInput("euler", repr(euler), "three of the letters x, y, z, such as zyx")
    kept: list[Array] = []
    found: dict[str, dict[str, float]] = {}
    every, rows, last = 1, 0, -math.inf
    for frame in _chunks(path):
        found = found or _choose(path, list(map(str, frame.columns)), euler, units)
        sizes = {name: size for kind, names in found.items() if kind != "ignored" for name, size in names.items()}
        values = frame[list(sizes)].apply(pd.to_numeric, errors="coerce").to_numpy(float)
        rest = values[:, 1 + len(found["rates"]) :]
        wrong = {
            "a value that is not a finite number": ~np.isfinite(values).all(axis=1),
            "a time that is not later than that of the row before": np.diff(values[:, 0], prepend=last) <= 0,
            "a quaternion of norm 0": np.linalg.norm(rest, axis=1) < (1e-3 if "quaternion" in found else -1),
            "a matrix that is not a rotation": "matrix" in found and np.linalg.det(rest.reshape(-1, 3, 3)) < 1e-3,
        }
        for what, bad in wrong.items():
            if np.any(bad):
                got = f"{path}, row {rows + 1 + np.argmax(bad)}: {what}"
                raise BadInput("run", got, "a file in which that row is repaired")
        kept.append(values[-rows % every :: every])
        rows, last = rows + len(values), values[-1, 0]
        while sum(map(len, kept)) > 2 * ROWS:
            kept, every = [np.concatenate(kept)[::2]], 2 * every
    if rows < 2:
        raise BadInput("run", f"{path} with {rows} rows", "a header and two rows or more")
    values = np.concatenate(kept) * list(sizes.values())
    rest, R, w = values[:, 1 + len(found["rates"]) :], None, values[:, 1:4] if found["rates"] else None
    numbered = "quaternion" in found and next(iter(found["quaternion"]))[-1].isdigit()
    if "quaternion" in found:
        R = Rotation.from_quat(rest, scalar_first=quaternion != "xyzw" or not numbered).as_matrix()
    elif "matrix" in found:
        R = Rotation.from_matrix(rest.reshape(-1, 3, 3)).as_matrix()
    elif euler is not None and "angles" in found:
        R = Rotation.from_euler(euler.upper(), rest).as_matrix()
    if world and w is not None:
        if R is None:
            raise BadInput("rates", "'world', for a file without attitudes", "body, or a file with attitudes to convert them")
        w = (w[:, None] @ R)[:, 0]
    norm, known = np.linalg.norm(rest, axis=1) if "quaternion" in found else None, quaternion is not None or not numbered
    degrees = any(size < 1 for size in found["rates"].values())
    return Recording(values[:, 0], (R, w), norm, known, degrees, list(found["ignored"]), rows)


def _chunks(path: Path) -> Iterator[pd.DataFrame]:
    try:
        if path.suffix == ".parquet":
            from pyarrow.parquet import ParquetFile

            yield from (batch.to_pandas() for batch in ParquetFile(path).iter_batches(CHUNK))
        elif path.suffix in (".jsonl", ".ndjson", ".json"):
            yield from pd.read_json(path, lines=True, chunksize=CHUNK)
        else:
            with path.open(encoding="utf-8-sig") as stream:
                separator = max(",;\t", key=stream.readline().count)
            yield from pd.read_csv(path, sep=separator, chunksize=CHUNK, skipinitialspace=True, index_col=False)
    except ImportError:
        raise MissingEngine("pyarrow", "pyarrow") from None
    except (OSError, ValueError) as error:  # pandas and pyarrow raise ValueErrors for another format
        reason = str(error).strip().splitlines()[0]
        raise BadInput("run", f"{path} ({reason})", "a table: CSV, Parquet (.parquet) or JSON lines (.jsonl)") from None


def _choose(path: Path, names: list[str], euler: str | None, units: str | None) -> dict[str, dict[str, float]]:
    """Return the columns of each quantity that the file has, and the sizes of their units in SI units."""
    found: dict[str, dict[str, float]] = {"time": {}, "rates": {}, "ignored": {}}
    split = {name: _split(name) for name in names}
    for kind, (pattern, complete) in COLUMNS.items():
        if kind == "angles" and euler is not None:
            complete = ([_AXES[2]["xyz".index(axis)] for axis in euler], euler, "123")
        sets: dict[str, dict[str, str]] = {}
        for name, (key, _) in split.items():
            if match := re.fullmatch(pattern, key):
                sets.setdefault(match[1], {}).setdefault(match[2], name)
        full = ([parts[one] for one in each] for parts in sets.values() for each in complete if parts.keys() >= set(each))
        chosen = next(full, [])
        usual = {"time": "s", "rates": "rad" if "wwbb" in sets else units, "angles": units}.get(kind, "rad")
        if kind == "angles" and euler is None:
            found["ignored"] = dict.fromkeys(chosen, 1.0)
        elif chosen and (kind in found or len(found) == 3):  # the first kind of attitudes
            texts = [str(split[name][1] or usual) for name in chosen]
            if not set(texts) <= UNITS.keys():
                got = f"{path}, columns {', '.join(chosen)}, without a known unit"
                header = re.sub(r"\s*[(\[].*", "", chosen[0])
                raise BadInput("run", got, f"a header such as {header} (deg/s), or one without a unit and --units deg or rad")
            found[kind] = {name: UNITS[text] for name, text in zip(chosen, texts, strict=True)}
    if not found["time"] or not (found["rates"] or len(found) > 3):
        got = f"{path} without columns of {'attitudes or rates' if found['time'] else 'the time'}: {', '.join(names)[:300]}"
        allowed = "columns such as time, w_x (rad/s), w_y (rad/s), w_z (rad/s), q_w, q_x, q_y, q_z; angles need --euler zyx"
        raise BadInput("run", got, allowed)
    return found


def _split(name: str) -> tuple[str, str | None]:
    """Return the letters and digits of a column's name without its unit, and the unit."""
    text = name.strip().lower()
    match = re.search(r"[(\[]([^)\]]*)[)\]]$", text) or re.search(r"_(deg_s|rad_s|dps|deg|rad|ms|us|s)(?=_|$)", text)
    rest = text[: match.start()] + text[match.end() :] if match else text
    return re.sub(r"[^a-z0-9]", "", rest), match[1].strip() if match else None
