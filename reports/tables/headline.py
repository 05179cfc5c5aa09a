"""Where an engine beats us, in words."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise

from .work_precision import Contest


@dataclass(frozen=True)
class Statement:
    """What is found on a scene, in words; the scene is empty where that is about the whole report."""

    scene: str
    text: str


def statements(contests: Sequence[Contest]) -> list[Statement]:
    """Return, for each scene, where an engine is faster than anything of ours, or alone, and where ours is."""
    by_scene = groupby(contests, key=lambda c: c.scene)
    found = [Statement(scene, text) for scene, members in by_scene for text in _texts(list(members))]
    return found or [Statement("", "No engine and no method of ours was measured on error against time.")]


def _texts(contests: list[Contest]) -> Iterator[str]:
    lost = [c for c in contests if c.lost]
    if not any(c.theirs for c in contests):
        yield "no engine was measured."
    elif lost:
        yield from (_lost(engine, members) for engine, members in _by_engine(lost))
    else:
        yield "no engine beats us at any error that it reaches."
    won = [c for c in contests if not c.lost and c.theirs]
    if won:
        yield f"ours is faster at {_errors(won)}, by {_range([c.ratio for c in won])}."
    alone = [c for c in contests if c.theirs is None]
    if alone and any(c.theirs for c in contests):
        yield f"only ours reaches {_errors(alone)}."


def _by_engine(lost: list[Contest]) -> Iterator[tuple[str, list[Contest]]]:
    engines = dict.fromkeys(c.theirs.name for c in lost if c.theirs)
    return ((engine, [c for c in lost if c.theirs and c.theirs.name == engine]) for engine in engines)


def _lost(engine: str, members: list[Contest]) -> str:
    parts = []
    slower = [c for c in members if c.ours]
    if slower:
        parts.append(f"is faster than anything of ours at {_errors(slower)}, by {_range([1 / c.ratio for c in slower])}")
    alone = [c for c in members if not c.ours]
    if alone:
        parts.append(f"reaches {_errors(alone)}, which nothing of ours was measured to reach")
    return f"{engine} beats us: it {', and '.join(parts)}."


def _errors(contests: list[Contest]) -> str:
    """Return the errors, every decade in between left out where they are neighbours."""
    errors = [c.error for c in contests]
    neighbours = all(1 < a / b < 11 for a, b in pairwise(errors))
    text = f"{errors[0]:.0e} to {errors[-1]:.0e}" if neighbours and len(errors) > 2 else ", ".join(f"{e:.0e}" for e in errors)
    return f"{text} rad"


def _range(factors: list[float]) -> str:
    low, high = f"{min(factors):.2g}", f"{max(factors):.2g}"
    return f"{low} times" if low == high else f"{low} to {high} times"
