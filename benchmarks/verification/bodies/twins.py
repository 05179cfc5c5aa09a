"""Left and right links of a robot: pairs by name, and the map between them, from the places of their joints and shapes."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from conservative.attitude import Array
from conservative.references.model_files.pieces import Piece
from conservative.references.model_files.robot_links import RobotLink

_LEFT = {"left": "right", "l": "r", "fl": "fr", "rl": "rr", "bl": "br", "hl": "hr", "lf": "rf", "lh": "rh", "lb": "rb"}
_OTHER = {**_LEFT, **{right: left for left, right in _LEFT.items()}}
_WORDS = re.compile(r"[A-Z]+(?=[A-Z][a-z])|[A-Z]?[a-z]+|[A-Z]+|[^A-Za-z]+")
SAME_PLACE = 0.02
"""Largest distance of two points that are the same in both twins, relative to the size of the link."""


@dataclass(frozen=True, eq=False)
class Pair:
    """Two links that are mirror images or copies of each other by their names.

    `maps` are the orthogonal maps (3, 3) from the axes of the left link to those of the right one that fit the joints and
    shapes on both; none if their joints or shapes differ, so that only quantities without axes can be compared.
    """

    left: RobotLink
    right: RobotLink
    maps: Sequence[Array]

    @cached_property
    def best(self) -> Array | None:
        """The map with the smallest difference, or None without maps."""
        if not self.maps:
            return None
        return min(self.maps, key=lambda turn: sum(self._differences(turn)))

    def _differences(self, turn: Array) -> tuple[float, float]:
        left, right = part_of(self.left), part_of(self.right)
        size = np.sqrt(np.trace(right.inertia) / right.mass) if right.mass and np.trace(right.inertia) > 0 else 1.0
        centre = float(np.linalg.norm(turn @ left.com - right.com) / size)
        scale = np.linalg.norm(right.inertia) or 1.0
        return centre, float(np.linalg.norm(turn @ left.inertia @ turn.T - right.inertia) / scale)

    def mirrored(self, of_right: bool) -> Piece | None:
        """Return the right link that the left one asks for, or the other way round; None without a map."""
        if self.best is None:
            return None
        source, turn = (self.left, self.best) if of_right else (self.right, self.best.T)
        part = part_of(source)
        return Piece(part.mass, turn @ part.com, turn @ part.inertia @ turn.T, part.rounding)


def part_of(link: RobotLink) -> Piece:
    """Return mass, centre of mass and inertia of a link in its own axes."""
    own = link.link
    return Piece(own.mass, np.zeros(3), own.inertia, own.rounding).place(own.frame)


def find_pairs(links: Sequence[RobotLink]) -> list[Pair]:
    """Return the pairs of left and right links that have a mass. A link is not the twin of a link that carries it."""
    by_name = {link.name: link for link in links}
    pairs = []
    for link in filter(lambda link: _is_left(link.name), links):
        # `left_arm::l` is the twin of `right_arm::r`, or of `right_arm::l` if both models have a link `l`.
        names = (other_side(link.name), other_side(link.name, first=True))
        pairs += [(link, by_name[name]) for name in names if name in by_name][:1]
    plane = _mirror([(left.link.pose[:3, 3], right.link.pose[:3, 3]) for left, right in pairs])
    children: dict[str, list[RobotLink]] = {}
    for link in links:
        children.setdefault(link.parent, []).append(link)
    return [
        Pair(left, right, _maps(left, right, plane, children))
        for left, right in pairs
        if left.link.mass > 0 and right.link.mass > 0 and left.written and right.written
        if not (_carries(left, right, by_name) or _carries(right, left, by_name))
    ]


def _carries(link: RobotLink, other: RobotLink, by_name: Mapping[str, RobotLink]) -> bool:
    """Return True if a link is between the root and another one."""
    seen = set[str]()
    while other.parent in by_name and other.parent not in seen:
        if other.parent == link.name:
            return True
        seen.add(other.parent)
        other = by_name[other.parent]
    return False


def other_side(name: str, first: bool = False) -> str:
    """Return a name with left and right exchanged, or only the `first` one; "" if it has neither."""
    words = _WORDS.findall(name)
    sides = [number for number, word in enumerate(words) if word.lower() in _OTHER]
    for number in sides[:1] if first else sides:
        words[number] = _like(_OTHER[words[number].lower()], words[number])
    return "".join(words) if sides else ""


def _is_left(name: str) -> bool:
    sides = [word.lower() for word in _WORDS.findall(name) if word.lower() in _OTHER]
    return bool(sides) and sides[0] in _LEFT


def _like(text: str, model: str) -> str:
    return text.upper() if model.isupper() else text.capitalize() if model[0].isupper() else text


def _mirror(places: Sequence[tuple[Array, Array]]) -> Array:
    """Return the reflection (3, 3) that maps the left places to the right ones best, up to a shift along its axis."""
    if not places:
        return np.diag([1.0, -1.0, 1.0])
    left, right = (np.array(side) for side in zip(*places, strict=True))

    def misfit(axis: int) -> float:
        across = np.delete(right - left, axis, axis=1)
        sums = (right + left)[:, axis]
        apart = np.abs(right - left)[:, axis].max()
        return float(np.median(np.linalg.norm(across, axis=1)) + np.median(np.abs(sums - np.median(sums)))) / (apart or 1e-9)

    signs = np.ones(3)
    signs[min((1, 0, 2), key=misfit)] = -1
    return np.diag(signs)


def _maps(left: RobotLink, right: RobotLink, plane: Array, children: dict[str, list[RobotLink]]) -> list[Array]:
    world = right.link.pose[:3, :3].T @ plane @ left.link.pose[:3, :3]
    candidates = [world, *(np.diag(signs) for signs in product((1.0, -1.0), repeat=3))]
    points = [_marks(link, children.get(link.name, [])) for link in (left, right)]
    shared = [key for key in points[0] if key in points[1]]
    if not shared:
        return candidates
    a, b = (np.array([marks[key] for key in shared]) for marks in points)
    size = max(np.abs(a).max(), np.abs(b).max()) or 1.0
    return [turn for turn in candidates if np.abs(a @ turn.T - b).max() < SAME_PLACE * size]


def _marks(link: RobotLink, children: Sequence[RobotLink]) -> dict[str, Array]:
    """Return points of a link, in its axes, by names that its twin has as well."""
    base = np.linalg.inv(link.link.pose)
    marks = {}
    for child in children:
        name = child.name if _is_left(child.name) or not other_side(child.name) else other_side(child.name)
        marks[f"child {name}"] = (base @ child.link.pose)[:3, 3]
    for visual in (True, False):
        if points := [shape.points for shape in link.shapes if shape.visual is visual]:
            whole = np.vstack(points)
            marks[f"middle {visual}"] = (whole.min(axis=0) + whole.max(axis=0)) / 2
    return marks
