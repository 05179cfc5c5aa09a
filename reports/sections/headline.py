"""Where an engine beats us, in words: first what is lost, by how much, and where; solutions of integrable motions apart."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise

import pandas as pd

from conservative.benchmarks.contest import Contest, cheapest, costs
from conservative.benchmarks.studies.each_step import ERROR

from ..document.cells import factor, tolerance
from ..rows.names import OF_ENGINES, MethodClass, of_classes
from ..rows.points import DECADES
from .random_bodies import ANY, RandomRatios, count_bodies
from .scene_contests import EachStep, sides

TIE = 1.1
"""Ratio of two times below which neither is called faster: reports differ by as much."""


@dataclass(frozen=True)
class Statement:
    """What is found on a scene, in words; no scene where that is about the whole report; `lost` where we are beaten."""

    scene: str
    text: str
    lost: bool = False


def of_points(points: pd.DataFrame) -> list[Statement]:
    """Return what is found in the points of all scenes: of general integrators, then of solutions of integrable motions."""
    reached = costs(points, DECADES)
    return [*statements(sides(reached, MethodClass.GENERAL)), *_solutions(sides(reached, MethodClass.SOLUTION))]


def of_random_bodies(found: Iterable[RandomRatios]) -> list[Statement]:
    """Return on how many random bodies of each field an engine is faster, or alone in getting there, and by how much."""
    against = [contest for contest in found if contest.engine == ANY and contest.contests]
    fields = dict.fromkeys(contest.field for contest in against)
    return [_random(field, [contest for contest in against if contest.field == field]) for field in fields]


def _random(field: str, members: list[RandomRatios]) -> Statement:
    where = f"random bodies, {field}"
    lost = [(1 / pair.ratio, contest.error) for contest in members for pair in contest.both if pair.ratio < 1]
    alone = sum(contest.only_theirs for contest in members)
    if not (lost or alone):
        decades = f"{tolerance(members[0].error)} to {tolerance(members[-1].error)} rad"
        count = len(members[0].contests)
        bodies = count_bodies(count) if count == 1 else f"any of {count_bodies(count)}"
        return Statement(where, f"no engine is faster than our general integrators on {bodies}, at {decades}.")
    total = sum(len(contest.contests) for contest in members)
    most, error = max(lost, default=(1.0, 0.0))
    slower = f"an engine is faster than our general integrators in {len(lost)} of {total} cases (a body and a decade), "
    slower += f"by up to {factor(most)} times, at {tolerance(error)} rad"
    parts = [*([slower] if lost else []), *([f"only an engine gets there in {alone} of {total} cases"] if alone else [])]
    return Statement(where, f"{'; '.join(parts)}.", lost=True)


def first_lost(found: Iterable[Statement]) -> tuple[Statement, ...]:
    """Return statements with what is lost first."""
    return tuple(sorted(found, key=lambda each: not each.lost))


def statements(contests: Sequence[Contest]) -> list[Statement]:
    """Return, for each scene, where an engine is faster than our general integrators, or alone, and where they are."""
    by_scene = groupby(contests, key=lambda c: c.scene)
    found = [Statement(scene, text, lost) for scene, members in by_scene for text, lost in _texts(list(members))]
    return found or [Statement("", "no engine and no method of ours was measured on error against time.")]


def _texts(contests: list[Contest]) -> Iterator[tuple[str, bool]]:
    lost = [c for c in contests if c.lost]
    if not any(c.theirs for c in contests):
        yield "no engine was measured.", False
    elif lost:
        yield from ((_lost(engine, members), True) for engine, members in _by_engine(lost))
    else:
        yield "no engine beats our general integrators at any error that it reaches.", False
    won = [c for c in contests if not c.lost and c.theirs]
    if won:
        yield (
            f"our general integrators are {_range([c.ratio for c in won])} as fast as the cheapest engine, at {_errors(won)}.",
            False,
        )
    alone = [c for c in contests if c.theirs is None]
    if alone and any(c.theirs for c in contests):
        yield f"only our general integrators reach {_errors(alone)}.", False


def _solutions(contests: Sequence[Contest]) -> Iterator[Statement]:
    """Yield what our solutions of integrable motions do against the engines, where there are both."""
    for scene, members in groupby((c for c in contests if c.ours and c.theirs), key=lambda c: c.scene):
        both = list(members)
        names = ", ".join(dict.fromkeys(c.ours.name for c in both if c.ours))
        fast = f"is {_range([c.ratio for c in both])} as fast as the cheapest engine, at {_errors(both)}"
        yield Statement(scene, f"{names}, which solves integrable motions only, {fast}.", any(c.lost for c in both))


def of_each_step(scene: str, each: EachStep) -> Iterator[Statement]:
    """Yield who is faster where each of a scene's own steps is kept, and where the end alone is, for each class of ours."""
    kept = (
        f"with a sample at each {each.interval:.3g} s (our conversion of an engine's state included), at {tolerance(ERROR)} rad"
    )
    steps = f"steps of {each.interval:.3g} s, at which a solver need not stop"
    alone = f"where the end alone is kept of {steps}, at {tolerance(ERROR)} rad"
    for found, where in ((each.kept, kept), (each.alone, alone)):
        for kind in (MethodClass.GENERAL, MethodClass.SOLUTION) if len(found) else ():
            ours, engine = cheapest(of_classes(found, kind)), cheapest(of_classes(found, *OF_ENGINES))
            if ours and engine:
                ratio = engine.time / ours.time
                yield Statement(scene, f"{_faster((f'{ours.name} ({kind})', engine.name), ratio)}, {where}.", ratio < 1 / TIE)


def _faster(names: tuple[str, str], ratio: float) -> str:
    if max(ratio, 1 / ratio) < TIE:
        return f"{names[0]} and {names[1]} take the same time to {TIE - 1:.0%}".replace("%", " %")
    one, other = names if ratio >= 1 else names[::-1]
    return f"{one} is {factor(max(ratio, 1 / ratio))} times as fast as {other}"


def _by_engine(lost: list[Contest]) -> Iterator[tuple[str, list[Contest]]]:
    engines = dict.fromkeys(c.theirs.name for c in lost if c.theirs)
    return ((engine, [c for c in lost if c.theirs and c.theirs.name == engine]) for engine in engines)


def _lost(engine: str, members: list[Contest]) -> str:
    slower, alone = ([c for c in members if bool(c.ours) is there] for there in (True, False))
    parts = []
    if slower:
        parts.append(f"is {_range([1 / c.ratio for c in slower])} as fast as our general integrators, at {_errors(slower)}")
    if alone:
        parts.append(f"reaches {_errors(alone)}, which none of them was measured to reach")
    return f"{engine} {', and '.join(parts)}."


def _errors(contests: list[Contest]) -> str:
    """Return the errors, every decade in between left out where they are neighbours."""
    errors = [c.error for c in contests]
    if len(errors) > 2 and all(1 < a / b < 11 for a, b in pairwise(errors)):
        return f"{tolerance(errors[0])} to {tolerance(errors[-1])} rad"
    return f"{', '.join(map(tolerance, errors))} rad"


def _range(factors: list[float]) -> str:
    low, high = factor(min(factors)), factor(max(factors))
    return f"{low} times" if low == high else f"{low} to {high} times"
