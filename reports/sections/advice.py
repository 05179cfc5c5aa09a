"""The fourth screen of a report: what to use for each motion and error, with the command that repeats it."""

from __future__ import annotations

from collections import Counter

import pandas as pd

from conservative.benchmarks.contest import credit

from ..document.cells import DASH, grade_ratio, numeric, tolerance
from ..document.model import Emphasis, Paragraph, Row, Section, Table, filled
from ..rows.names import OF_ENGINES, MethodClass, of_classes
from . import random_bodies
from .measured import Measured, of_scene
from .summary import ERRORS

HEADER = ("motion", "error, rad", "use", "step, s", "µs per simulated s", "fastest engine", "engine / ours", "repeat with")
_OWN = (
    "For your own body: `conservative new > my_body.toml`, then `conservative recommend my_body.toml --error 1e-6`. "
    "In Python, `cv.integrate(scene, error=1e-6)` chooses method and step."
)


def section(measured: Measured) -> Section:
    """Return the section."""
    rows: list[Row] = []
    general: Counter[str] = Counter()
    closed = {}
    for scene in measured.plan.scenes:
        points = of_scene(measured.points, scene.name)
        for error in ERRORS:
            best, engine = (fastest(of_classes(points, *kinds), error) for kinds in ((MethodClass.GENERAL,), OF_ENGINES))
            if best is not None:
                general[str(best["family"])] += 1
                rows.append(_row(scene.name, tolerance(error), best, engine))
        best = fastest(of_classes(points, MethodClass.SOLUTION), ERRORS[-1])
        if best is not None:
            closed[scene.name] = str(best["family"])
            rows.append(_row(scene.name, f"{tolerance(ERRORS[-1])}, closed form", best, engine))
    parts = [f"Take `{general.most_common(1)[0][0]}` for bodies in general."] if general else []
    if closed:
        names = " and ".join(f"`{family}` ({scene})" for scene, family in closed.items())
        parts.append(f"Closed forms are faster and have no truncation error, but each solves only its motions: {names}.")
    random = random_bodies.sentence(measured.ratios) if measured.ratios else ""
    table = Table(
        HEADER, rows, "Coarsest setting that reaches each error, final state only", source={"study": "work_precision"}
    )
    lead = Paragraph(" ".join(parts), Emphasis.LEAD) if parts else None
    blocks = filled(lead, Paragraph(f"{_OWN} {random}".strip()), table)
    return Section("What to use", blocks, "use", "What to use")


def fastest(points: pd.DataFrame, error: float) -> pd.Series[float] | None:
    """Return the fastest point that is credited with an error (see `contest.credit`); None without one."""
    lines = (line[[each <= error for each in credit(line["error"].tolist())]] for _, line in points.groupby("name", sort=False))
    reached = [point for line in lines for _, point in line.iterrows()]
    return min(reached, key=lambda point: float(point["time"]), default=None)


def _row(scene: str, error: str, best: pd.Series[float], engine: pd.Series[float] | None) -> Row:
    theirs = [DASH, DASH] if engine is None else [engine["name"], grade_ratio(engine["time"] / best["time"], digits=2)]
    command = f"conservative run {scene} -m {best['method']} --dt {best['dt']:.10g}"
    return [scene, error, best["name"], numeric(best["dt"]), numeric(1e6 * best["time"]), *theirs, command]
