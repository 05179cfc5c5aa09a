"""The meaning of columns: by the words of their names and by their numbers, or as the user names them."""

from __future__ import annotations

import contextlib
import re
import shlex
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from itertools import chain
from pathlib import Path

import numpy as np

from conservative.attitude import Array
from conservative.errors import BadInput

from .candidates import Sample, compared_with, decide_sets, decide_time
from .layout import ATTITUDES, Layout, Options
from .names import ANGLES, GREEK, parse
from .quantities import HORIZON, find_sets, is_moving, is_world, looks, other
from .times import FRACTIONS, find_times, is_counter
from .units import find_sizes

MOST_COLUMNS = 10_000
"""Largest number of columns of a file."""
MOST_GUESSED = 60
"""Largest number of columns among which a rotation is searched, for an example."""
ROTATION = 1e-3
"""Largest departure of the square of a norm from the one of a rotation."""
MOVES = "an attitude relative to a frame that moves"
PLACES = "angles to the local horizon, which moves; --euler zyx if they turn body to inertial axes"
SEQUENCE = "their sequence is not known; add --euler with it, such as --euler zyx"
PART = "a part of an attitude or of rates by its name, without the other parts"
ROTATES = "a rotation by their numbers, and not by their names"
NOTHING = "neither a time nor an attitude nor a rate by its name"
SHORT = {"time": "time", "rates": "w", "quaternion": "q", "matrix": "R", "angles": "euler", "rotation vector": "rotvec"} | {
    "axis and angle": "axis",
    "modified Rodrigues": "mrp",
    "Rodrigues": "crp",
}
"""Quantities as `--columns` calls them."""
_AXES = dict(zip((*ANGLES, *GREEK), "xyzxyz", strict=True))


def choose(path: Path, layout: Layout, options: Options, sample: Sample) -> Layout:
    """Find the columns of each quantity in the file, and the sizes of their units; give a reason for every unused column.

    `sample` reads the first rows of columns, where names leave a choice.
    """
    names = layout.names
    if len(names) > MOST_COLUMNS:
        raise BadInput("run", f"{path} with {len(names)} columns", f"a table of at most {MOST_COLUMNS} columns")
    named = _by_option(path, layout, options.columns) if options.columns else {}
    sets = {} if named.keys() - {"time"} else _find_quantities(layout, options)
    times = [named["time"]] if "time" in named else find_times(names)
    if not times or not (sets or named.keys() - {"time"}):
        missing = "attitudes or rates" if times else "the time"
        chosen = {kind: some[0] for kind, some in sets.items()} | named
        got = f"{path} without columns of {missing}: {_understood(names, times, chosen, layout)}"
        raise BadInput("run", got, _hint(names, times, chosen, layout, sample))
    _choose_attitude(path, sets, layout, options)
    times = (
        times if named.get("time") else decide_time(times, [name for some in sets.values() for name in some[0]], layout, sample)
    )
    readings = decide_sets(times, sets, layout, options, sample) if sets else [{**named, "time": time} for time in times]
    if len(readings) > 1:
        raise _ask(path, names, readings)
    chosen = readings[0]
    if "angles" in chosen:
        _sort_angles(path, layout, chosen, options)
    for kind in ("time", "rates", *ATTITUDES):
        if kind in chosen or kind == "rates":
            layout.used[kind] = find_sizes(path, layout, kind, chosen[kind], options) if kind in chosen else {}
    if not options.columns and not options.world and "rates" in chosen and is_world(chosen["rates"]):
        got = f"{path} with rates in axes that do not turn along, by their names: {', '.join(chosen['rates'])}"
        raise BadInput("run", got, f"--rates world and attitudes; or, for body axes, {name_columns(chosen, names)}")
    counts = Counter(name for part in chosen.values() for name in part)
    if twice := [name for name, count in counts.items() if count > 1]:
        raise BadInput("columns", repr(options.columns), f"each column once, and not {twice[0]!r} twice")
    reasons = {name: other(name) or (PART if looks(name) else NOTHING) for name in names} | layout.unused
    layout.unused = {name: reasons[name] for name in names if name not in counts}
    if named.keys() <= {"time"}:
        rest = [name for name, reason in layout.unused.items() if reason == NOTHING]
        layout.unused |= dict.fromkeys(chain(*_guess(rest, sample).values()), ROTATES)
        layout.doubtful = _find_doubtful(layout)
    return layout


def _choose_attitude(path: Path, sets: dict[str, list[list[str]]], layout: Layout, options: Options) -> None:
    """Leave the best kind of attitudes in the sets of columns; the others are compared with it."""
    kinds = [kind for kind in ATTITUDES if kind in sets]
    unknown = [] if options.euler else [members for members in sets.get("angles", ()) if parse(members[0]).label not in _AXES]
    if unknown and kinds != ["angles"]:  # other attitudes show their sequence
        kinds = [*(kind for kind in kinds if kind != "angles"), "angles"]
    elif unknown:
        sets["angles"] = [members for members in sets["angles"] if members not in unknown]
        layout.unused |= dict.fromkeys(_flat(unknown), SEQUENCE)
        if not sets["angles"] and not sets.pop("angles") and not sets:
            raise _no_sequence(path, unknown[0])
    for kind in kinds[1:]:
        layout.also += [(kind, members) for members in sets.pop(kind)]
    layout.unused |= {name: compared_with(kinds[0]) for _, members in layout.also for name in members}


def _flat(lists: Iterable[Sequence[str]]) -> list[str]:
    return [name for some in lists for name in some]


def _find_quantities(layout: Layout, options: Options) -> dict[str, list[list[str]]]:
    """Return the sets of columns of each quantity by their names, without those that are no motion of the body."""
    sets: dict[str, list[list[str]]] = {}
    horizon = any(HORIZON.intersection(parse(name).words) for name in layout.names)
    speeds = any(parse(name).words in (("v", "x"), ("vx",), ("v", "1")) for name in layout.names)
    for kind, members in find_sets(layout.names):
        reason = ""
        if kind in ATTITUDES and is_moving(members):
            reason = MOVES
        elif horizon and "angles" in kind and options.euler is None:
            reason = PLACES
        elif kind == "rotation vector" and speeds and parse(members[0]).words[:1] == ("r",):
            reason = "positions, next to velocities, by their names"
        if reason:
            layout.unused |= dict.fromkeys(members, reason)
        else:
            kind = "angles" if kind == "aircraft angles" else kind
            sets.setdefault(kind, []).append(_by_order(kind, members))
    for kind, members in _find_joints(layout.names).items():
        sets.setdefault(kind, []).append(members)
    return sets


def _find_joints(names: Sequence[str]) -> dict[str, list[str]]:
    """Return rates and attitudes of MuJoCo's only joint: seven positions and six rates, or four and three."""
    place = {parse(name).words: name for name in names}
    for skip in (3, 0):
        positions = [place.get(("qpos", str(i)), "") for i in range(skip, skip + 5)]
        rates = [place.get(("qvel", str(i)), "") for i in range(skip, skip + 4)]
        if all(positions[:4] + rates[:3]) and not positions[4] and not rates[3]:
            return {"rates": rates[:3], "quaternion": positions[:4]}
    return {}


def _by_order(kind: str, members: list[str]) -> list[str]:
    """Return the columns of a quaternion scalar first, if their names have the order."""
    words = parse(members[0]).words
    return (
        [*members[-1:], *members[:-1]]
        if kind == "quaternion" and "xyzw" in words and parse(members[0]).label.isdigit()
        else members
    )


def _find_doubtful(layout: Layout) -> list[str]:
    """Return the columns that are not used and look like parts of the motion."""
    others, decided = set(_flat(members for _, members in layout.also)), set(layout.decided)
    parts = Counter(parse(name).words[:-1] for name in layout.unused if parse(name).words[:-1] == ("q",))
    return [
        name
        for name, reason in layout.unused.items()
        if name not in others
        and name not in decided
        and (reason in (MOVES, PLACES, SEQUENCE, ROTATES) or looks(name) or parts[parse(name).words[:-1]] > 2)
    ]


def _sort_angles(path: Path, layout: Layout, chosen: dict[str, list[str]], options: Options) -> None:
    """Put angles into the order of their sequence: zyx for yaw, pitch and roll, also if they are called psi, theta and phi."""
    members, sequence = chosen["angles"], options.euler or "zyx"
    labels = {parse(name).label: name for name in members}
    if labels.keys() <= set(_AXES) and len(labels) == 3:
        by_axis = {_AXES[label]: name for label, name in labels.items()}
        if set(sequence) == set("xyz"):
            chosen["angles"] = [by_axis[axis] for axis in sequence]
        elif set(labels) == set(GREEK):  # Euler's own: precession phi, nutation theta, spin psi
            chosen["angles"] = members if options.columns else [labels[word] for word in GREEK]
        elif not options.columns:
            raise BadInput("euler", repr(sequence), f"a sequence of x, y and z for {', '.join(members)}")
        if options.euler is None:
            layout.notes.append(f"{', '.join(chosen['angles'])} are read as yaw, pitch and roll (--euler zyx).")
    elif options.euler is None:
        raise _no_sequence(path, members)
    elif labels.keys() == set("xyz") == set(sequence):
        chosen["angles"] = [labels[axis] for axis in sequence]


def _no_sequence(path: Path, names: Sequence[str]) -> BadInput:
    got = f"{path} with angles whose sequence is not known: {', '.join(names)}"
    return BadInput("run", got, "their sequence, such as --euler zyx")


def _by_option(path: Path, layout: Layout, text: str) -> dict[str, list[str]]:
    """Return the columns that `--columns` names. A time may be divided by a number: Frame/200."""
    chosen, kinds, names = {}, {short: kind for kind, short in SHORT.items()}, layout.names
    counts = {"time": 1, "rates": 3} | dict(ATTITUDES)
    for part in re.split(r",(?=[^=,]*=)", text):
        short, _, members = part.partition("=")
        kind, columns = kinds.get(short.strip()), [member.strip() for member in members.split(":")]
        divisor = 1.0
        if (
            kind == "time"
            and columns[0] not in names
            and (match := re.fullmatch(r"(.*)/([0-9]{1,9}(?:\.[0-9]+)?)", columns[0]))
        ):
            columns, divisor = [match[1], *columns[1:]], float(match[2])
        columns = [
            names[int(column) - 1]
            if column not in names and re.fullmatch("[0-9]{1,9}", column) and 0 < int(column) <= len(names)
            else column
            for column in columns
        ]
        pair = kind == "time" and len(columns) == 2 and parse(columns[1]).all[-1:] and parse(columns[1]).all[-1] in FRACTIONS
        unknown = kind is None or any(column not in names for column in columns) or divisor == 0
        if kind is None or unknown or (len(columns) != counts[kind] and not pair):
            allowed = (
                f"such as time=1,w=2:3:4 with {', '.join(SHORT.values())} and columns of {path.name}: {', '.join(names)[:300]}"
            )
            raise BadInput("columns", repr(part), allowed)
        letters = {parse(column).label: column for column in columns}
        by_letter = kind == "quaternion" and letters.keys() == set("wxyz")
        chosen[kind] = [letters[letter] for letter in "wxyz"] if by_letter else _by_order(kind, columns)
        if divisor != 1:
            layout.steps[columns[0]] = 1 / divisor
    return chosen


def name_columns(chosen: Mapping[str, Sequence[str]], names: Sequence[str], counted: bool = False) -> str:
    """Return the option `--columns` that names columns, by their numbers where names cannot be written there.

    The time is divided by 200 if it is `counted`.
    """

    def short(name: str) -> str:
        plain = re.fullmatch(r"[\w./\[\]-]+", name) and not name.isdigit() and name.isascii()
        return name if plain else str(names.index(name) + 1)

    parts = [
        f"{SHORT[kind]}={':'.join(map(short, members))}{'/200' * (counted and kind == 'time')}"
        for kind, members in chosen.items()
    ]
    euler = " --euler zyx" * ("angles" in chosen and parse(chosen["angles"][0]).label in _AXES)
    return f"--columns {shlex.quote(','.join(parts))}{euler}"


def _ask(path: Path, names: Sequence[str], readings: Sequence[Mapping[str, list[str]]]) -> BadInput:
    """Return the question which of several readings of a file is meant, with the option for each."""
    first = readings[0]
    kind = next(kind for kind in first if any(reading[kind] != first[kind] for reading in readings))
    several = dict.fromkeys(", ".join(reading[kind]) for reading in readings)
    what = "several times" if kind == "time" else f"several sets of {kind}"
    options = " or ".join(name_columns(reading, names) for reading in readings[:9])
    return BadInput("run", f"{path} with {what}, which differ: {'; '.join(several)[:600]}", options)


def _understood(
    names: Sequence[str], times: Sequence[Sequence[str]], chosen: Mapping[str, Sequence[str]], layout: Layout
) -> str:
    """Return the meaning found for each column."""
    kinds = {name: "time" for some in times for name in some} | {
        name: kind for kind, members in chosen.items() for name in members
    }
    return "; ".join(
        f"{name}: {kinds.get(name) or layout.unused.get(name) or other(name) or 'not known'}" for name in names[:40]
    )[:600]


def _guess(names: Sequence[str], sample: Sample) -> dict[str, list[str]]:
    """Return neighbouring columns whose numbers are a rotation: matrices, or quaternions of norm 1; {} without any."""
    numbers, some = dict[str, Array](), names[:MOST_GUESSED]
    try:
        numbers = dict(zip(some, sample(some).T, strict=True)) if some else {}
    except BadInput:  # one of them has text
        for name in some:
            with contextlib.suppress(BadInput):
                numbers[name] = sample([name])[:, 0]
    for kind, size, norm in (("matrix", 9, 3), ("quaternion", 4, 1)):
        for start in range(len(numbers) - size + 1):
            members = [*numbers][start : start + size]
            x = np.column_stack([numbers[name] for name in members])
            x = x[np.isfinite(x).all(axis=1)]
            with np.errstate(all="ignore"):
                off = np.abs((x**2).sum(axis=1) - norm)
            if len(x) > 1 and (off < ROTATION).all() and (np.ptp(x, axis=0) > ROTATION).sum() > 1:
                return {kind: members}
    return {}


def _hint(
    names: Sequence[str], times: Sequence[Sequence[str]], chosen: dict[str, list[str]], layout: Layout, sample: Sample
) -> str:
    """Return the option that names the columns of this file, with three columns that differ by their axes if there are such."""
    if names == [str(i + 1) for i in range(len(names))]:
        if len(names) < 4:
            return "a time and three columns or more"
        text = name_columns({"time": [names[0]]} | (_guess(names[1:], sample) or {"rates": names[1:4]}), names)
        return f"the columns by number, such as {text}{' --units rad' * ('w=' in text)}"
    taken = {*_flat(chosen.values()), *layout.unused}
    free = [name for name in names if name not in taken]
    likely = next((name for name in free if re.search("time|date|stamp|clock", name.lower())), None)
    counter = next((name for name in free if is_counter(name)), None) if likely is None else None
    time = [*times[0]] if times else [some for some in (likely, counter, *free) if some is not None][:1]
    if not time:
        return "a file with a column of times"
    groups: dict[str, list[str]] = {}
    for name in names:
        if name not in time and name not in taken and not other(name):
            groups.setdefault(re.sub(r"[xyz0-9]", "*", "".join(parse(name).words) or name), []).append(name)
    sets = sorted(
        (sorted(group) for group in groups.values() if len(group) == 3), key=lambda group: "g" not in group[0].lower()
    )
    chosen = chosen or dict(find_sets([name for name in names if name not in time], others=True))
    chosen = chosen or _guess(names, sample)
    if not chosen:
        rest = sorted((name for name in names if name not in time and not other(name)), key=len)
        chosen = {"rates": sets[0] if sets else rest[:3]}
        if len(chosen["rates"]) < 3:
            return "columns of attitudes or rates; --columns time=NAME,w=X:Y:Z names them"
    chosen = {"time": time} | {kind: members for kind, members in chosen.items() if kind in SHORT and kind != "time"}
    if not times and counter is not None:
        return (
            f"a column of times. If column {counter!r} counts rows, 200 a second: {name_columns(chosen, names, counted=True)}"
        )
    text = name_columns(chosen, names)
    units = {parse(name).unit for name in chosen.get("rates", ())}
    return f"the columns by name or number, such as {text}{' --units rad' * (None in units)}"
