"""The verdict of a report: the first figure and table, and the cases in which an engine is faster."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import groupby, pairwise

import pandas as pd

from conservative.benchmarks.contest import Contest, cheapest, costs
from conservative.benchmarks.studies.each_step import ERROR

from ..document.cells import factor, tolerance
from ..document.model import Emphasis, Item, Items, Paragraph, Section, filled
from ..rows.names import OF_ENGINES, MethodClass, of_classes
from ..rows.points import DECADES
from . import random_bodies
from . import summary as summaries
from .measured import Measured
from .random_bodies import ANY, RandomRatios, count_bodies
from .scene_contests import EachStep, each_step, sides
from .scenes import families_figure
from .summary import Summary

TIE = 1.1
"""Ratio of two times below which neither is called faster; it is the difference between reports."""


def section(measured: Measured, of_scenes: dict[str, Summary]) -> Section:
    """Return the section: about random bodies if the report has some, else about a scene, if possible without a closed form."""
    if measured.ratios:
        about = "Random bodies"
        summary = random_bodies.summary(measured.rows, measured.ratios, measured.long_drifts)
    else:
        about = min(measured.plan.scenes, key=lambda scene: scene.integrable).name
        summary = of_scenes[about]
    source = measured.source
    together = (
        "within one study of this report, which was interrupted and resumed"
        if source.resumed
        else "within this report: they were measured in interleaved rounds of one process"
    )
    quick = " This is a quick run: fewer steps, fewer rounds of timing." if measured.plan.quick else ""
    beaten = Section("Where an engine beats us", [Paragraph(_BEATEN), Items(list(_statements(measured)))])
    blocks = filled(
        Paragraph(summary.sentence, Emphasis.LEAD),
        families_figure(summary, "first", about),
        replace(summary.classes, caption=f"{about}: µs of computing per simulated second, by class of methods"),
        Paragraph(f"{summaries.TERMS} {summaries.SAMPLE_TERMS}", Emphasis.NOTE),
        Paragraph(f"{summaries.CAVEAT} Compare times only {together}.{quick}", Emphasis.NOTE),
        beaten,
    )
    return Section(f"Verdict: {about}", blocks, "verdict", "Verdict")


_BEATEN = (
    "Errors at which an engine is faster come first. The fastest method of a class is compared with the fastest engine "
    "at each decade of the largest attitude error. Times between two measured points are interpolated log-log and not "
    "extrapolated. The error of a point is the largest of its own and of all finer points, so isolated good results are "
    "ignored."
)


def _statements(measured: Measured) -> Iterator[Item]:
    """Yield all results, those that we lose first."""
    items = [*of_random_bodies(measured.ratios), *of_points(measured.points)]
    for scene in measured.plan.scenes:
        items += of_each_step(scene.name, each_step(measured.scene_rows, scene.name))
    yield from sorted(items, key=lambda item: not item.marked)


def of_points(points: pd.DataFrame) -> list[Item]:
    """Return the results on all scenes: of our general integrators, then of our closed forms."""
    reached = costs(points, DECADES)
    return [*statements(sides(reached, MethodClass.GENERAL)), *_solutions(sides(reached, MethodClass.SOLUTION))]


def of_random_bodies(ratios: Iterable[RandomRatios]) -> list[Item]:
    """Return in how many cases an engine is faster on the random bodies of each field, or alone in reaching the error."""
    against = [contest for contest in ratios if contest.engine == ANY and contest.contests]
    fields = dict.fromkeys(contest.field for contest in against)
    return [_random(field, [contest for contest in against if contest.field == field]) for field in fields]


def _random(field: str, members: list[RandomRatios]) -> Item:
    where = f"random bodies, {field}"
    lost = [(1 / pair.ratio, contest.error) for contest in members for pair in contest.both if pair.ratio < 1]
    alone = sum(contest.only_theirs for contest in members)
    if not (lost or alone):
        decades = f"{tolerance(members[0].error)} to {tolerance(members[-1].error)} rad"
        count = len(members[0].contests)
        bodies = count_bodies(count) if count == 1 else f"any of {count_bodies(count)}"
        return Item(f"no engine is faster than our general integrators on {bodies}, at {decades}.", where)
    total = sum(len(contest.contests) for contest in members)
    most, error = max(lost, default=(1.0, 0.0))
    parts = []
    if lost:
        cases = f"an engine is faster than our general integrators in {len(lost)} of {total} cases (a body and a decade)"
        parts.append(f"{cases}, by up to {factor(most)} times, at {tolerance(error)} rad")
    if alone:
        parts.append(f"only an engine reaches the error in {alone} of {total} cases")
    return Item(f"{'; '.join(parts)}.", where, marked=True)


def statements(contests: Sequence[Contest]) -> list[Item]:
    """Return the errors on each scene at which an engine is faster than our general integrators, or alone, and the others."""
    by_scene = groupby(contests, key=lambda c: c.scene)
    found = [Item(text, scene, marked) for scene, members in by_scene for text, marked in _texts(list(members))]
    return found or [Item("no engine and no method of ours was measured on error against time.")]


def _texts(contests: list[Contest]) -> Iterator[tuple[str, bool]]:
    """Yield the results on one scene, and whether we lose."""
    lost = [c for c in contests if c.lost]
    if not any(c.theirs for c in contests):
        yield "no engine was measured.", False
    elif not lost:
        yield "no engine beats our general integrators at any error that it reaches.", False
    for engine in dict.fromkeys(c.theirs.name for c in lost if c.theirs):
        members = [c for c in lost if c.theirs and c.theirs.name == engine]
        slower, alone = ([c for c in members if bool(c.ours) is there] for there in (True, False))
        parts = []
        if slower:
            parts.append(f"is {_range([1 / c.ratio for c in slower])} as fast as our general integrators, at {_errors(slower)}")
        if alone:
            parts.append(f"reaches {_errors(alone)}, which none of them was measured to reach")
        yield f"{engine} {', and '.join(parts)}.", True
    won = [c for c in contests if not c.lost and c.theirs]
    if won:
        times = f"{_range([c.ratio for c in won])} as fast as the cheapest engine, at {_errors(won)}"
        yield f"our general integrators are {times}.", False
    alone = [c for c in contests if c.theirs is None]
    if alone and any(c.theirs for c in contests):
        yield f"only our general integrators reach {_errors(alone)}.", False


def _solutions(contests: Sequence[Contest]) -> Iterator[Item]:
    for scene, members in groupby((c for c in contests if c.ours and c.theirs), key=lambda c: c.scene):
        both = list(members)
        names = ", ".join(dict.fromkeys(c.ours.name for c in both if c.ours))
        fast = f"is {_range([c.ratio for c in both])} as fast as the cheapest engine, at {_errors(both)}"
        yield Item(f"{names}, which solves integrable motions only, {fast}.", scene, any(c.lost for c in both))


def of_each_step(scene: str, each: EachStep) -> Iterator[Item]:
    """Yield which side is faster with every step stored, and with the final state only, for each class of ours."""
    at = f"at {tolerance(ERROR)} rad"
    kept = f"with a sample at each {each.interval:.3g} s (including our conversion of an engine's state), {at}"
    alone = f"final state only, in steps of {each.interval:.3g} s, at which a solver need not stop, {at}"
    for found, where in ((each.kept, kept), (each.alone, alone)):
        for kind in (MethodClass.GENERAL, MethodClass.SOLUTION) if len(found) else ():
            ours, engine = cheapest(of_classes(found, kind)), cheapest(of_classes(found, *OF_ENGINES))
            if ours and engine:
                ratio = engine.time / ours.time
                yield Item(f"{_faster((f'{ours.name} ({kind})', engine.name), ratio)}, {where}.", scene, ratio < 1 / TIE)


def _faster(names: tuple[str, str], ratio: float) -> str:
    if max(ratio, 1 / ratio) < TIE:
        return f"{names[0]} and {names[1]} take the same time to {TIE - 1:.0%}".replace("%", " %")
    one, other = names if ratio >= 1 else names[::-1]
    return f"{one} is {factor(max(ratio, 1 / ratio))} times as fast as {other}"


def _errors(contests: list[Contest]) -> str:
    """Return the errors; of neighbouring decades only the first and the last."""
    errors = [c.error for c in contests]
    if len(errors) > 2 and all(1 < a / b < 11 for a, b in pairwise(errors)):
        return f"{tolerance(errors[0])} to {tolerance(errors[-1])} rad"
    return f"{', '.join(map(tolerance, errors))} rad"


def _range(factors: list[float]) -> str:
    low, high = factor(min(factors)), factor(max(factors))
    return f"{low} times" if low == high else f"{low} to {high} times"
