"""The mistakes that explain the body that an engine has after loading a file."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np

from conservative.references.model_files.pieces import Link, Piece, distance, join_links

from ..finding import Cause
from ..mistakes.bodies import FITTED, LOADED, BodyMistake

EQUAL = 10.0
"""Largest error of an explanation, relative to the best one, that explains a body equally well."""
ROUND_OFF = 1e-8
"""Relative error that round-off may leave. Measured with planted mistakes: up to 4e-12."""


def find_causes(links: list[Link], seen: Piece, tolerance: float) -> tuple[Cause, ...]:
    """Return the mistakes that turn the links of a file into the body that an engine has: all that explain it equally well.

    Single mistakes are tried first, then pairs, then those with fitted numbers. Errors are relative to the body of the file, or
    to that with the mistake if its inertia is larger: an engine in single precision has a large inertia with a large error.
    """
    wanted = join_links(links)
    for count in (1, 2):
        explanations = [
            cause
            for mistakes in combinations(LOADED, count)
            if (cause := _try(links, mistakes, seen, tolerance)) and cause.left < tolerance
        ]
        if explanations:
            allowed = max(EQUAL * min(explanation.left for explanation in explanations), ROUND_OFF)
            return tuple(explanation for explanation in explanations if explanation.left <= allowed)
    for mistake in FITTED:
        numbers, part = mistake.fit(wanted, seen)
        cause = _compare((mistake.key,), mistake.sentence.format(**numbers), wanted, part, seen)
        if cause.left < tolerance:
            return (replace(cause, numbers=numbers),)
    return ()


def _try(links: list[Link], mistakes: tuple[BodyMistake, ...], seen: Piece, tolerance: float) -> Cause | None:
    """Return the explanation by mistakes; None if they do not change the body, or leave no mass."""
    changed = links
    for mistake in mistakes:
        changed = mistake.change(changed)
    wanted, part = join_links(links), join_links(changed)
    if not part.mass or distance(wanted, part) <= tolerance:
        return None
    sentences = ". ".join(mistake.sentence for mistake in mistakes)
    return _compare(tuple(mistake.key for mistake in mistakes), sentences, wanted, part, seen)


def _compare(keys: tuple[str, ...], sentence: str, wanted: Piece, part: Piece, seen: Piece) -> Cause:
    scale = part if np.linalg.norm(part.inertia) > np.linalg.norm(wanted.inertia) else wanted
    return Cause(keys, sentence, distance(part, seen, scale), distance(wanted, seen, scale))
