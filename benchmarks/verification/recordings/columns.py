"""The meaning of columns: by their names, as simulators and loggers write them, or as the user names them."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import chain
from pathlib import Path

from conservative.errors import BadInput

from .layout import ATTITUDES, ORDER, Layout, Options
from .names import LONGEST_NAME, UNITS, split_name
from .units import no_unit

MOST_COLUMNS = 10_000
"""Largest number of columns of a file."""
MOVES = "an attitude relative to a frame that moves"
HORIZON = "angles to the local horizon, which moves; --euler zyx if they turn body to inertial axes"
SEQUENCE = "their sequence is not known; add --euler with it, such as --euler zyx"
_AXES: tuple[Sequence[str], ...] = ("xyz", "123", "012", ("roll", "pitch", "yaw"))
_MATRIX = tuple([row + column for row in digits for column in digits] for digits in ("123", "012"))
_LONG = r"(.*(?:gyro(?:scope)?(?:adc)?|angular(?:velocity|rates?)|ang(?:vel|rate)|bodyrates?|rotationrates?|omega)[a-z]*?|"
_RATES = _LONG + r"w|wwbb|wrss|wbn|wb|wbi|gyr|rates?|(?=[pqr]$))"
_LETTERS = "q|qwb|qib|qbi|qbn|qnb|qbl|qrs|epbn|rot|att"
_QUATERNION = rf"((?:.*(?:quat(?:ernion)?q?|orientation|rotation|attitude)|{_LETTERS}){ORDER}?)"
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
_MOVING = re.compile(r"lvlh|vvlh|qbl|qlb|orbit|sigmabr|relative")
_MOVING_WORD = re.compile(r"(q|quat(ernion)?|att(itude)?|euler)?(rtn|rsw|hill|ned)[a-z0-9]?")  # combined and aligned end in ned
_HORIZON = re.compile(r"latitude|longitude|altitudemsl|geodetic")
_SPREAD = re.compile(r"covariance|variance|bias|std|uncertainty|sigma(?=gyro|w|att)")
_LOOKS = re.compile(
    r"quat|orientation|attitude|euler|roll|pitch|yaw|heading|bank(angle)?$|rotmat|dcm|rotvec|rodrigues|mrp|axisangle|gyro|"
    r"ang(ular)?(vel|rate)|omega|bodyrate|rotationrate|^(phi|theta|psi)$|^w[xyz]$"
)
"""Names of attitudes and rates, more than are understood."""
_OTHERWISE = re.compile(
    r"acc|torque|moment|cmd|command|set(point)?$|setpoint|target|desired|demand|reference|error|temp|count|valid|status|flag|"
    r"mode|trim|control|aileron|elevator|rudder|range|limit|energy|norm"
)
"""Names of other values of attitudes and rates, which are no motion of the body."""
_FRACTIONS = re.compile(r"(.*?)(nanosec(?:ond)?s?|nsecs?|microsec(?:ond)?s?|usecs?)")
SHORT = {"time": "time", "rates": "w", "quaternion": "q", "matrix": "R", "angles": "euler", "rotation vector": "rotvec"} | {
    "modified Rodrigues": "mrp",
    "Rodrigues": "crp",
}
"""Quantities as `--columns` calls them."""


def choose(path: Path, layout: Layout, options: Options) -> Layout:
    """Find the columns of each quantity in the file, and the sizes of their units; give a reason for every unused column."""
    names = layout.names
    if len(names) > MOST_COLUMNS:
        raise BadInput("run", f"{path} with {len(names)} columns", f"a table of at most {MOST_COLUMNS} columns")
    chosen = _by_option(path, names, options.columns) if options.columns else _by_name(path, layout)
    _leave_moving(layout, chosen, options)
    kinds = [kind for kind in ATTITUDES if kind in chosen]
    for kind in kinds[1:]:
        layout.also[kind] = chosen.pop(kind)
        layout.unused |= dict.fromkeys(layout.also[kind], f"the {kinds[0]} is compared, and these columns with it")
    if "time" not in chosen or not (chosen.get("rates") or kinds):
        missing = "attitudes or rates" if "time" in chosen else "the time"
        raise BadInput(
            "run", f"{path} without columns of {missing}: {_understood(names, chosen, layout)}", _hint(names, chosen, layout)
        )
    if kinds[:1] in (["angles"], ["aircraft angles"]):
        _sort_angles(layout, chosen, kinds[0], options)
        kinds = ["angles"] if "angles" in chosen else []
        if not kinds and not chosen.get("rates"):
            raise BadInput("run", f"{path} with angles whose sequence is not known", "their sequence, such as --euler zyx")
    for kind in ("time", "rates", *kinds[:1]):
        layout.used[kind] = _find_sizes(path, layout, kind, chosen[kind], options) if kind in chosen else {}
    taken = [name for part in layout.used.values() for name in part]
    if len(set(taken)) < len(taken) or any(names.count(name) > 1 for name in taken):
        twice = next(name for name in taken if names.count(name) > 1 or taken.count(name) > 1)
        raise BadInput("run", f"{path} with two columns {twice!r}", "--columns with their numbers, such as time=1,w=2:3:4")
    for name in names:
        if name not in taken:
            layout.unused.setdefault(name, "neither a time nor an attitude nor a rate by its name")
    others = {name for part in layout.also.values() for name in part}
    if not options.columns:
        layout.doubtful = [name for name in _find_looks(layout) if name not in others]
    return layout


def _find_sizes(path: Path, layout: Layout, kind: str, names: Sequence[str], options: Options) -> dict[str, float]:
    """Return the sizes of the units of columns, nan for those that no name and no option has."""
    if kind == "time" and len(names) == 2:  # seconds and their fractions
        return dict(zip(names, [1.0, 1e-6 if re.search("micro|usec", names[1].lower()) else 1e-9], strict=True))
    usual: str | None = "s" if kind == "time" else "rad"
    texts, united = [split_name(name)[1] for name in names], kind in ("rates", "angles", "rotation vector")
    if None in texts and united:
        usual = None if "/" in (options.units or "") and kind != "rates" else options.units
        layout.notes += ["unit"] * (usual is not None)
    if not united and kind != "time":  # a unit behind a quaternion is no unit
        return dict.fromkeys(names, 1.0)
    sizes = [math.nan if (unit := text or usual) is None else UNITS.get(unit, 0.0) for text in texts]
    if 0.0 in sizes:
        raise no_unit(path, names)
    return dict(zip(names, sizes, strict=True))


def _find_looks(layout: Layout) -> list[str]:
    """Return the columns that are not used and look like parts of the motion."""
    members, whole = list[str](), {name: split_name(name)[0] for name in layout.unused}
    sets = Counter(key[:-1] for key in whole.values() if re.fullmatch("q(?!pos|vel)[a-z]*[wxyz0-4]", key))
    for name, key in whole.items():
        last = split_name(re.split(r"[./:]", name)[-1])[0]
        last = last if len(last) > 2 else key
        looks = _LOOKS.search(last) or sets[key[:-1]] > 2
        if layout.unused[name] in (MOVES, HORIZON, SEQUENCE) or (
            looks and not _OTHERWISE.search(last) and not _SPREAD.search(key)
        ):
            members.append(name)
    return members


def _leave_moving(layout: Layout, chosen: dict[str, list[str]], options: Options) -> None:
    """Leave out attitudes relative to a frame that moves, with the reason."""
    horizon = any(_HORIZON.search(split_name(name)[0]) for name in layout.names)
    for kind in ATTITUDES.keys() & chosen.keys():
        members, reason = chosen[kind], ""
        if not options.columns and any(map(_moves, members)):
            reason = MOVES
        elif horizon and "angles" in kind and options.euler is None:
            reason = HORIZON
        if reason:
            layout.unused |= dict.fromkeys(members, reason)
            del chosen[kind]


def _moves(name: str) -> bool:
    """Return whether the name of an attitude names a frame that moves."""
    parts = re.split(r"[^a-z0-9]+", re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name).lower())
    return bool(_MOVING.search(split_name(name)[0][:-1])) or any(_MOVING_WORD.fullmatch(word) for word in parts)


def _sort_angles(layout: Layout, chosen: dict[str, list[str]], kind: str, options: Options) -> None:
    """Put angles into the order of their sequence: zyx for yaw, pitch and roll, also if they are called psi, theta and phi."""
    sequence = options.euler or "zyx"
    named = {split_name(name)[0][-3:]: name for name in chosen[kind]}
    letters = [{"oll": "x", "tch": "y", "yaw": "z", "phi": "x", "eta": "y", "psi": "z"}.get(key, "") for key in named]
    if all(letters):
        by_axis = dict(zip(letters, named.values(), strict=True))
        if set(sequence) == set("xyz"):
            chosen["angles"] = [by_axis[axis] for axis in sequence]
        elif kind == "aircraft angles" or "phi" in named:  # Euler's own: precession phi, nutation theta, spin psi
            chosen["angles"] = chosen[kind] if options.columns else [named[key] for key in ("phi", "eta", "psi")]
        else:
            raise BadInput("euler", repr(sequence), f"a sequence of x, y and z for {', '.join(chosen[kind])}")
        if options.euler is None:
            layout.notes.append(f"{', '.join(chosen['angles'])} are read as yaw, pitch and roll (--euler zyx).")
        if kind != "angles":
            del chosen[kind]
    elif options.euler is None:
        layout.unused |= dict.fromkeys(chosen.pop(kind), SEQUENCE)
    elif {split_name(name)[0][-1:] for name in chosen[kind]} == set("xyz") == set(sequence):
        by_axis = {split_name(name)[0][-1:]: name for name in chosen[kind]}
        chosen[kind] = [by_axis[axis] for axis in sequence]


def _choose_time(layout: Layout, split: Mapping[str, str], matches: Sequence[str]) -> list[str]:
    """Return the column of the time, or the two of seconds and their fractions; other times are unused, with it as reason."""
    plain = {re.sub(r"[^a-z0-9]", "", name.lower()): name for name in layout.names if len(name) <= LONGEST_NAME}
    for key, name in plain.items():
        if (match := _FRACTIONS.fullmatch(key)) and (
            whole := next(
                (plain[match[1] + end] for end in ("sec", "secs", "second", "seconds") if match[1] + end in plain), ""
            )
        ):
            return [whole, name]
    order = {"secondselapsed": 0, "t": 1, "time": 2}

    def rank(name: str) -> tuple[bool, bool, bool, int, int]:
        key = split[name]
        stamped = key.endswith("headerstamp")  # the time of the measurement, and not of its arrival
        return key != "secondselapsed", not stamped, name.strip() == "T", len(key), order.get(key, 3)  # T: a temperature

    times = sorted(matches, key=rank)
    layout.unused |= dict.fromkeys(times[1:], f"another time; {times[0]} is used" if times else "")
    return times[:1]


def _by_name(path: Path, layout: Layout) -> dict[str, list[str]]:
    """Return the columns of each quantity by their names."""
    names = layout.names
    chosen: dict[str, list[str]] = {}
    split = {name: split_name(name)[0] for name in names}
    spread = [name for name, key in split.items() if _SPREAD.search(key)]
    layout.unused |= dict.fromkeys(spread, "a deviation or a bias by its name")
    split |= dict.fromkeys(spread, "")
    if {"axisx", "axis1"} & {*split.values()}:
        split = {name: "axisangle" if key == "angle" else key for name, key in split.items()}
    for kind, (pattern, complete) in COLUMNS.items():
        matches = {name: match for name, key in split.items() if (match := re.fullmatch(pattern, key))}
        if not matches:  # Sat.Q1 and /fdm/velocities/p: the last part of a path
            last = {name: re.split(r"[./:]", name)[-1] for name in names}
            ends = {name: split_name(end)[0] for name, end in last.items() if end != name}
            matches = {name: match for name, key in ends.items() if (match := re.fullmatch(pattern, key))}
            split |= {name: ends[name] for name in matches}
        if kind == "time":
            times = _choose_time(layout, split, [*matches])
            chosen |= {kind: times} if times else {}
            continue
        sets: dict[str, dict[str, str]] = {}
        for name, match in matches.items():
            sets.setdefault(match[1], {}).setdefault(match[2], name)
        full: dict[str, list[str]] = {}
        for prefix, parts in sets.items():
            for keys in complete:
                if parts.keys() >= set(keys):
                    full.setdefault(prefix, [parts[key] for key in keys])
        if len(full) > 1:
            short = SHORT.get(kind, kind)
            offered = " or ".join(f"--columns {short}={':'.join(members)}" for members in full.values())
            raise BadInput("run", f"{path} with several sets of {kind}: {'; '.join(map(', '.join, full.values()))}", offered)
        for prefix, members in full.items():
            # Names such as orientation_xyzw_0 number the components, scalar last.
            numbered = prefix.endswith("xyzw") and not split_name(members[0])[0].endswith("w")
            chosen[kind] = [*members[-1:], *members[:-1]] if numbered else members
    place = {split[name]: name for name in names}
    for skip in (3, 0):  # MuJoCo: a free joint has seven positions and six rates, a ball joint four and three
        positions = [place.get(f"qpos{i}", "") for i in range(skip, skip + 4)]
        rates = [place.get(f"qvel{i}", "") for i in range(skip, skip + 3)]
        if all(positions + rates) and f"qpos{skip + 4}" not in place and f"qvel{skip + 3}" not in place:
            chosen |= {"rates": rates, "quaternion": positions}
            break
    return chosen


def _by_option(path: Path, names: list[str], text: str) -> dict[str, list[str]]:
    """Return the columns that `--columns` names."""
    chosen, kinds = {}, {short: kind for kind, short in SHORT.items()}
    counts = {"time": 1, "rates": 3} | dict(ATTITUDES)
    for part in re.split(r",(?=[^=,]*=)", text):
        short, _, members = part.partition("=")
        kind, columns = kinds.get(short.strip()), [member.strip() for member in members.split(":")]
        columns = [
            names[int(column) - 1]
            if column not in names and re.fullmatch("[0-9]{1,9}", column) and 0 < int(column) <= len(names)
            else column
            for column in columns
        ]
        if kind is None or any(column not in names for column in columns) or len(columns) != counts[kind]:
            allowed = (
                f"such as time=1,w=2:3:4 with {', '.join(SHORT.values())} and columns of {path.name}: {', '.join(names)[:300]}"
            )
            raise BadInput("columns", repr(part), allowed)
        letters = {split_name(column)[0][-1:]: column for column in columns}
        by_letter = kind == "quaternion" and letters.keys() == set("wxyz")
        chosen[kind] = [letters[letter] for letter in "wxyz"] if by_letter else columns
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
        groups.setdefault(re.sub(r"[xyz0-9]", "*", split_name(name)[0]), []).append(name)
    likely = sorted(
        (sorted(group) for group in groups.values() if len(group) == 3), key=lambda group: "g" not in group[0].lower()
    )
    if all(name.isdigit() for name in names):
        return "the columns by number, such as --columns time=1,w=2:3:4 --units rad, or time=1,q=2:3:4:5"
    w = [name for name in names if name in chosen.get("rates", ())] or [*(likely or [rest])[0], "X", "Y", "Z"][:3]
    attitude = next((f",{SHORT[kind]}={':'.join(chosen[kind])}" for kind in ATTITUDES if kind in chosen and kind in SHORT), "")
    rates = f",w={':'.join(w)}" if likely or not attitude or "X" not in w else ""
    return f"the columns by name or number, such as --columns time={times[0]}{rates}{attitude} --units rad"
