"""The mistakes that explain why a pair of a body that an engine saves, sets or scales differs."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from conservative.attitude import from_quaternion
from conservative.errors import BadInput, IntegrationFailed
from conservative.references.model_files.pieces import Link, Piece, join_links, make_pose

from ..finding import Cause
from ..mistakes.bodies import LOADED
from ..mistakes.mistake import Mistake
from ..mistakes.wrapped import KEPT, SAVED
from .pairs import Description, Samples, to_principal
from .runner import NotAvailable

SHARE = 1e-3
"""Share of a difference that a mistake may leave if it explains the difference."""
LEAST = 1e-9
"""Moment of a body whose inertia is lost, relative to the trace of the inertia: engines refuse a moment of 0."""
TIED = 10.0
"""Ratio of what two mistakes leave up to which they explain a difference equally well."""


def find_causes(second: Description, error: float, allowed: float, apart: Callable[[Description], float]) -> tuple[Cause, ...]:
    """Return the mistakes of the catalogue with which a body moves as the second description does.

    Parameters
    ----------
    second
        The second description, whose motion is not right.
    error, allowed
        The difference of both motions, and the allowed one.
    apart
        Function that returns how far the motion of a body in the axes of `second`, described as usual, is from the second one.

    Several mistakes are returned if they leave about as little.
    """
    found = dict[tuple[str, ...], Cause]()
    for mistake, numbers, body in _candidates(second):
        other = replace(second, variant="", mass=body.mass, com=body.com, inertia=body.inertia)
        if not (body.mass > 0 and other.possible):
            continue
        with suppress(BadInput, NotAvailable, IntegrationFailed):
            left = apart(other)
            before = found.get((mistake.key,))
            if left <= max(allowed, SHARE * error) and not (before and before.left <= left):
                sentence = mistake.sentence.format(**numbers)
                found[mistake.key,] = Cause(
                    (mistake.key,), sentence, left, error, MappingProxyType(dict(numbers)), mistake.remedy
                )
    least = min((cause.left for cause in found.values()), default=math.nan)
    return tuple(cause for cause in found.values() if cause.left <= max(allowed, TIED * least))


def _candidates(second: Description) -> Iterator[tuple[Mistake, dict[str, float], Piece]]:
    """Yield mistakes, their numbers, and the bodies that they make of a description; of bodies with equal moments one."""
    numbers = second.numbers
    frame = make_pose(second.com, from_quaternion(numbers["q_com"]))
    links = [Link(np.eye(4), second.mass, frame, np.diag(numbers["moments_com"]))]
    made = [join_links(links)]
    choices: list[tuple[Mistake, dict[str, float], Piece]] = [
        (mistake, {}, join_links(mistake.change(links))) for mistake in (*KEPT, *LOADED)
    ]
    for rounded in SAVED:
        choices += [(rounded, {"digits": digits}, join_links(changed)) for digits, changed in rounded.bodies(links)]
    least = LEAST * float(np.trace(second.inertia))
    for mistake, values, part in choices:
        lost = np.linalg.eigvalsh(part.inertia)[0] < least
        body = replace(part, inertia=part.inertia + least * np.eye(3)) if lost else part
        if not any(_same(body, other, bool(second.gravity)) for other in made):
            if mistake not in SAVED:
                made.append(body)
            yield mistake, values, body


def _same(body: Piece, other: Piece, held: bool) -> bool:
    """Whether two bodies move equally: a free one if the ratios of its moments are, one with weight if all numbers are."""
    if held and (not np.array_equal(body.com, other.com) or body.mass != other.mass):
        return False
    size = np.trace(other.inertia)
    factor = 1.0 if held else size / np.trace(body.inertia)
    return bool(np.abs(factor * body.inertia - other.inertia).max() <= 1e-14 * size)


def usual(second: Description) -> tuple[Description, Callable[[Samples], Samples]]:
    """Return a body in principal axes, as every engine takes it, and the map of its motion to the axes of the description."""
    turned, R_GP = to_principal(second)
    return turned, lambda samples: (samples[0] @ R_GP.T, samples[1] @ R_GP.T)
