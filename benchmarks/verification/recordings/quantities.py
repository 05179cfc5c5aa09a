"""Quantities of a motion: the words of their columns, their complete sets of columns, and words of other quantities."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from .names import ANGLES, ARCS, GREEK, LABELS, LETTERS, OTHER_UNITS, TURNS, parse, vocabulary

XYZ: tuple[tuple[str, ...], ...] = (tuple("xyz"), tuple("123"), tuple("012"))
_MATRIX = tuple(tuple(row + column for row in digits for column in digits) for digits in ("123", "012", "xyz"))
_FLAT = tuple("123456789"), tuple("012345678")


@dataclass(frozen=True)
class Quantity:
    """A quantity: sets of words that name it, short words that do, complete sets of its columns, and sets without any word.

    Short words need the company of short words only: w_x and w_BN_x are rates, and w_thrust_x is not.
    """

    kind: str
    named: tuple[frozenset[str], ...]
    short: frozenset[str]
    sets: tuple[tuple[str, ...], ...]
    bare: tuple[tuple[str, ...], ...] = ()


def _all(*texts: str) -> tuple[frozenset[str], ...]:
    return tuple(frozenset(text.split()) for text in texts)


QUANTITIES = (
    Quantity(
        "rates",
        _all("gyro", "omega", "angular velocity", "angular rate", "angular speed", "body rate", "rotation rate")
        + _all("rotation velocity", "twist angular"),
        vocabulary("w rate"),
        (*XYZ, ANGLES, tuple("pqr")),
        (tuple("pqr"),),
    ),
    Quantity(
        "quaternion",
        _all("quaternion", "orientation", "rotation", "attitude"),
        vocabulary("q rot"),
        (
            tuple("wxyz"),
            *((first, *rest) for first in ("r", "real", "s", "scalar") for rest in ("ijk", "xyz")),
            tuple("0123"),
            tuple("1234"),
        ),
    ),
    Quantity("quaternion", (), frozenset("e"), (tuple("0123"),)),
    Quantity("matrix", _all("dcm", "matrix"), vocabulary("r m c rotation"), (*_MATRIX, *_FLAT)),
    Quantity("axis and angle", _all("axis"), frozenset(), ((*"xyz", "angle"), (*"123", "angle"))),
    Quantity("angles", _all("euler", "angle", "attitude", "orientation"), frozenset(), (ANGLES,), (ANGLES,)),
    Quantity("angles", _all("euler", "angle"), frozenset(), XYZ),
    Quantity("aircraft angles", _all("euler", "angle", "attitude", "orientation"), frozenset(), (GREEK,), (GREEK,)),
    Quantity("rotation vector", _all("rotation vector", "rot vector", "so 3"), vocabulary("r rv"), XYZ),
    Quantity("modified Rodrigues", _all("mrp", "modified rodrigues"), frozenset(("sigma",)), XYZ),
    Quantity("Rodrigues", _all("rodrigues", "gibbs", "crp"), frozenset(), XYZ),
)
"""The quantities; the first one with words and a complete set of columns counts."""
_LOOKS = [part for quantity in QUANTITIES for part in quantity.named if part not in _all("angle", "axis", "matrix")]
_LOOKS += _all(*ANGLES, "rot")
_ALONE = [*((word,) for word in GREEK), *(("w", axis) for axis in "xyz")]
OTHERS = {
    "a deviation, a bias or an error": "covariance cov variance var std stddev deviation uncertainty bias biases drift noise "
    "error err residual innovation rms sigma accuracy offset confidence correction",
    "a command, a reference, a target or a limit": "cmd command commanded setpoint sp target desired des demand demanded "
    "reference ref goal trim stick rc limit limits range max min nominal guidance",
    "a derivative, a load, a momentum or an energy": "acc accel acceleration dot derivative deriv jerk torque torques moment "
    "force momentum impulse energy power pdot qdot rdot",
    "a temperature": "temp temperature temperatur",
    "of another part": "wheel wheels rw rotor motor gimbal propeller servo joint esc",
    "a count, a state or a magnitude": "count counter status flag flags mode valid quality reset enable enabled norm magnitude "
    "absolute absolut abs total id control aileron elevator rudder throttle gain delta",
    "a position, a linear velocity or a pressure": "position pos linear pressure altitude",
}
"""Words of other quantities, by what they are."""
_REASONS = {word: reason for reason, words in OTHERS.items() for word in words.split()}
MOVING = vocabulary("lvlh vvlh orbit orbital rtn rsw hill ned relative bl lb br")
"""Words of frames that move."""
HORIZON = vocabulary("latitude longitude geodetic msl lat lon")
"""Words of places, next to which angles are relative to the horizon."""
_BIASES = ("b", "w"), ("b", "g"), ("b", "a"), ("bw",), ("bg",), ("ba",)
_ATTITUDE = vocabulary("orientation attitude rotation rot")
_WORLD = vocabulary("world global")
_POINTS = vocabulary("imu sensor body device est estimated estimate true truth meas measured filtered filter gt inertial")
_LONGEST_FRAME = 3


def other(name: str) -> str:
    """Return the reason why a column is no part of a motion by its name; "" if it may be."""
    words = parse(name).words
    if words[:1] == ("sigma",) and all(len(word) < 3 for word in words[1:]):  # modified Rodrigues parameters
        return ""
    if words[:2] in _BIASES or words[:1] in _BIASES:
        return "a bias by its name"
    return next((f"{_REASONS[word]} by its name" for word in words if word in _REASONS), "")


def is_moving(names: Sequence[str]) -> bool:
    """Return whether an attitude is relative to a frame that moves, by its names."""
    return any(MOVING.intersection(parse(name).words) for name in names)


def is_world(names: Sequence[str]) -> bool:
    """Return whether rates are in axes that do not turn along, by their names."""
    return any(_WORLD.intersection(parse(name).words) for name in names)


def looks(name: str) -> bool:
    """Return whether a column looks like a part of a motion, by the words that name a quantity."""
    parsed = parse(name)
    words = frozenset(parsed.words)
    if parsed.unit in OTHER_UNITS or other(name):
        return False
    return any(part <= words for part in _LOOKS) or parsed.words in _ALONE


def find_sets(names: Sequence[str], others: bool = False) -> Iterator[tuple[str, list[str]]]:
    """Yield the complete sets of columns of quantities, each with its kind, in the order of the file.

    Letters name parts before numbers do: gyro_1_x, gyro_2_x and gyro_3_x are no set. With `others` commands and references are
    sets, too.
    """
    usable = [name for name in names if parse(name).words and parse(name).unit not in OTHER_UNITS]
    usable = usable if others else [name for name in usable if not other(name)]
    taken = set[str]()
    for numbers in (False, True):
        groups: dict[tuple[tuple[str, ...], int], dict[str, list[str]]] = {}
        for name in usable:
            if name in taken:
                continue
            for stem, label in [*_stems(name, numbers), *_bare_angle(name)]:
                groups.setdefault(stem, {}).setdefault(label, []).append(name)
        found = [
            (kind, [members[label][number] for label in labels])
            for (stem, part), members in groups.items()
            for kind, labels in _kinds(stem, part, members)
            for number in range(min(len(members[label]) for label in labels))
        ]
        for kind, columns in sorted(found, key=lambda some: -len(some[1])):  # a matrix before its rows
            if not taken.intersection(columns):
                taken.update(columns)
                yield kind, columns


def _stems(name: str, numbers: bool) -> Iterator[tuple[tuple[tuple[str, ...], int], str]]:
    """Yield the words of a name with a star in the place of a label, the start of its last part, and the label."""
    parsed = parse(name)
    words = parsed.words
    for i, word in enumerate(words):
        if word.isdigit() == numbers and (word in LABELS or word.isdigit()):
            yield ((*words[:i], "*", *words[i + 1 :]), parsed.part), word
            pair = words[i : i + 2]
            if len(pair) == 2 and len(word) == len(pair[1]) == 1 and (numbers or set(pair) <= LETTERS):
                yield ((*words[:i], "*", *words[i + 2 :]), min(parsed.part, i)), "".join(pair)


def _bare_angle(name: str) -> Iterator[tuple[tuple[tuple[str, ...], int], str]]:
    """Yield the angle next to axis_x, axis_y and axis_z."""
    if parse(name).words in (("angle",), ("rotation", "angle")):
        yield (("axis", "*"), 0), "angle"


def _kinds(stem: tuple[str, ...], part: int, members: dict[str, list[str]]) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield the kind and the labels of the first quantity that words and labels stand for."""
    words, numbers = frozenset(stem) - {"*"}, {label for label in members if label.isdigit()}
    company = stem[part:]
    if {"wxyz", "xyzw"} & words:
        words |= {"quaternion"}
    turning = ANGLES[0] in members and words & {"rate", "speed"}
    for quantity in QUANTITIES:
        named = any(named <= words for named in quantity.named) or (quantity.kind == "rates" and turning)
        short = _is_short(company, quantity.short)
        for labels in quantity.sets:
            complete = numbers == {*labels} if labels[-1].isdigit() else all(label in members for label in labels)
            if not complete or (labels in _FLAT and company[0] in "mc"):  # c1 to c9 are channels
                continue
            units = {parse(members[label][0]).unit for label in labels}
            rates = units <= TURNS.keys()
            turned = quantity.kind == "angles" and labels in XYZ and words & _ATTITUDE and units <= ARCS.keys()
            spoken = quantity.kind == "rates" and rates and labels not in XYZ[1:] and not words & {"quaternion", "euler"}
            if named or short or spoken or turned or (labels in quantity.bare and _is_bare(company, labels, rates)):
                yield quantity.kind, labels
        if named and quantity.kind == "rates":
            return


def _is_short(company: tuple[str, ...], short: frozenset[str]) -> bool:
    """Return whether a short word names a quantity: behind words only, and before short words of frames."""
    at = next((i for i, word in enumerate(company) if word in short), None)
    if at is None:
        return False
    before, after = company[:at], company[at + 1 :]
    return all(len(word) > 1 or word.isdigit() or (word == "*" and at == 1) for word in before) and all(
        word == "*" or len(word) <= _LONGEST_FRAME or word.isdigit() or word in _POINTS | _WORLD | MOVING | {"wxyz", "xyzw"}
        for word in after
    )


def _is_bare(company: tuple[str, ...], labels: tuple[str, ...], rates: bool) -> bool:
    """Return whether labels without a word of the quantity are its columns: p, q and r stand alone, or with a unit of rates."""
    rest = [word for word in company if word != "*"]
    if labels == tuple("pqr"):
        return not rest or rates or all(word in _POINTS for word in rest)
    return not {"rate", "speed", "velocity", "axis"}.intersection(rest)
