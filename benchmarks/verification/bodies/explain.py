"""The mistakes that explain the body that an engine has after loading a file."""

from __future__ import annotations

from itertools import combinations

from conservative.references.model_files.pieces import Link, Piece, distance, join_links

from ..finding import Cause
from ..mistakes.bodies import BODIES, FITTED, BodyMistake

EQUAL = 10.0
"""Explanations that leave up to so many times the error of the best one explain a body equally well."""
ROUND_OFF = 1e-8
"""Relative error that round-off may leave. Measured with planted mistakes: up to 4e-12."""


def find_causes(links: list[Link], seen: Piece, tolerance: float) -> tuple[Cause, ...]:
    """Return the mistakes that turn the links of a file into the body that an engine has: all that explain it equally well.

    Single mistakes are tried first, then pairs, then those with fitted numbers. Errors are relative, as those of `distance`.
    """
    wanted = join_links(links)
    of = distance(wanted, seen)
    for count in (1, 2):
        found = [
            Cause(tuple(each.key for each in mistakes), ". ".join(each.sentence for each in mistakes), left, of)
            for mistakes in combinations(BODIES, count)
            if (left := _left(links, mistakes, seen, tolerance)) < tolerance
        ]
        if found:
            return _best(found)
    for mistake in FITTED:
        numbers, part = mistake.fit(wanted, seen)
        if (left := distance(part, seen, wanted)) < tolerance:
            return (Cause((mistake.key,), mistake.state(numbers), left, of, numbers),)
    return ()


def _left(links: list[Link], mistakes: tuple[BodyMistake, ...], seen: Piece, tolerance: float) -> float:
    """Return the error that mistakes leave; infinity if they do not change the body, or leave no mass."""
    changed = links
    for mistake in mistakes:
        changed = mistake.change(changed)
    wanted, part = join_links(links), join_links(changed)
    return distance(part, seen, wanted) if part.mass and distance(wanted, part) > tolerance else float("inf")


def _best(causes: list[Cause]) -> tuple[Cause, ...]:
    allowed = max(EQUAL * min(each.left for each in causes), ROUND_OFF)
    return tuple(each for each in causes if each.left <= allowed)
