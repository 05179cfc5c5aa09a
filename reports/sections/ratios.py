"""The ratios of times at each decade of the error, engines against ours."""

from __future__ import annotations

from conservative.benchmarks.speed_ratio import SpeedRatio, costs
from conservative.benchmarks.studies import each_step, random, work_precision

from ..document.cells import DASH, grade_ratio, tolerance
from ..document.model import Block, Cell, Emphasis, Grade, Paragraph, Row, Section, Style, Table
from ..rows.names import MethodClass
from ..rows.points import DECADES
from .measured import Measured
from .random_bodies import ANY, RandomRatios
from .scene_ratios import ratios_of_class

_RATIOS = (
    "The time of the fastest engine or ODE solver divided by our fastest method's time, at each decade of the largest "
    "attitude error. ✓: ours is faster. ✗: the other is faster. ≈: open, 1 is within the interval, or 5 % from a ratio that "
    "one process measured. In parentheses is the interval of 95 % over processes, if several measured the times. Random "
    "bodies have the geometric mean, its interval over bodies and processes, and the number of bodies on which an engine is "
    "faster beyond the body's interval, or alone in reaching the error. Times between two measured points are interpolated "
    "log-log and not extrapolated. The error of a point is the largest of its own and of all finer points, so isolated good "
    "results are ignored."
)


def section(measured: Measured) -> Section:
    """Return the section."""
    source = {"study": tuple(module.STUDY.name for module in (random, work_precision, each_step))}
    blocks: list[Block] = [ratio_table(measured), Paragraph(_RATIOS, Emphasis.NOTE)]
    return Section("Where an engine is faster", blocks, "ratios", source=source)


def ratio_table(measured: Measured) -> Table:
    """Return the ratios at each decade: a row for each field of random bodies, then for each scene and class of ours."""
    rows: list[tuple[str, MethodClass, dict[float, Cell], str]] = []
    fields: dict[str, dict[float, Cell]] = {}
    for part in measured.ratios:
        if part.engine == ANY:
            fields.setdefault(part.field, {})[part.error] = _random_cell(part)
    rows += [(f"random bodies, {field}", MethodClass.GENERAL, cells, DASH) for field, cells in fields.items()]
    for scene in measured.plan.scenes:
        points, every_step = measured.points[measured.points["scene"] == scene.name], measured.every_step[scene.name]
        runs = {scene.name: costs(points, DECADES)}
        runs |= {f"{scene.name}, {label}": reached for label, reached in every_step.runs.items()} if every_step else {}
        for label, reached in runs.items():
            for kind in (MethodClass.GENERAL, MethodClass.SOLUTION):
                speed_ratios = ratios_of_class(reached, kind)
                if any(speed_ratio.ours for speed_ratio in speed_ratios):
                    cells = {speed_ratio.error: ratio_cell(speed_ratio) for speed_ratio in speed_ratios}
                    faster = (
                        speed_ratio.theirs
                        for speed_ratio in speed_ratios
                        if speed_ratio.theirs and cells[speed_ratio.error].grade is Grade.BAD
                    )
                    names = dict.fromkeys(cost.name for cost in faster)
                    rows.append((label, kind, cells, ", ".join(names) or DASH))
    errors = [error for error in DECADES if any(error in cells for _, _, cells, _ in rows)]
    body: list[Row] = [
        [label, kind.value, *(cells.get(error, DASH) for error in errors), winners] for label, kind, cells, winners in rows
    ]
    caption = "The time of the fastest engine or solver divided by ours, by attitude error, rad"
    return Table(
        ["motion", "our methods", *map(tolerance, errors), "faster engine"],
        body,
        caption,
        Style.FILTERED,
    )


def ratio_cell(speed_ratio: SpeedRatio) -> Cell:
    """Return the ratio, or the side that is alone in reaching the error."""
    if speed_ratio.ours and speed_ratio.theirs:
        return grade_ratio(speed_ratio.ratio, digits=2, interval=speed_ratio.interval)
    return (
        Cell(Grade.BAD.mark("engine only"), Grade.BAD) if speed_ratio.theirs else Cell(Grade.GOOD.mark("ours only"), Grade.GOOD)
    )


def _random_cell(ratios: RandomRatios) -> Cell:
    note = f"{ratios.lost} of {len(ratios.speed_ratios)}" if ratios.lost else ""
    if ratios.lost and not ratios.both:
        return Cell(Grade.BAD.mark("engine only"), Grade.BAD, note)
    return grade_ratio(ratios.ratio, note, digits=2, interval=ratios.interval)
