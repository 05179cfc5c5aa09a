"""The fourth screen of a report: what to use for each motion and error, with the command that repeats it."""

from __future__ import annotations

import math
import shlex
from collections import Counter

from conservative.benchmarks.speed_ratio import costs, credit
from conservative.benchmarks.studies import work_precision

from ..document.cells import DASH, numeric, tolerance
from ..document.model import Emphasis, Paragraph, Row, Section, Table, filled
from ..rows.names import MethodClass
from . import random_bodies
from .measured import Measured, of_scene
from .ratios import ratio_cell
from .scene_ratios import ratios_of_class
from .summary import ERRORS

HEADER = ("motion", "error, rad", "use", "µs per simulated s", "fastest engine or solver", "its time / ours", "repeat with")
_OWN = (
    "Install it: `pip install 'conservative-rotation[report,engines]'`. For your own body: `conservative new > my_body.toml`, "
    "then `conservative recommend my_body.toml --error 1e-6`. In Python, `import conservative as cv`; `cv.integrate(scene, "
    "error=1e-6)` chooses method and step."
)


def section(measured: Measured) -> Section:
    """Return the section."""
    rows: list[Row] = []
    families: dict[MethodClass, list[tuple[str, str]]] = {MethodClass.GENERAL: [], MethodClass.SOLUTION: []}
    for scene in measured.plan.scenes:
        points, general_times = of_scene(measured.points, scene.name), dict[float, float]()
        for kind, fastest in families.items():
            errors = ERRORS if kind is MethodClass.GENERAL else ERRORS[-1:]
            for side in ratios_of_class(costs(points, errors), kind, errors):
                if side.ours and side.ours.time < general_times.get(side.error, math.inf):  # a closed form has to be faster
                    general_times[side.error] = side.ours.time
                    line = points[points["name"] == side.ours.name]
                    line = line[[error <= side.error for error in credit(line["error"].tolist())]]
                    best = line.sort_values("time").iloc[0]
                    fastest.append((scene.name, str(best["family"])))
                    engine, cost = side.theirs.name if side.theirs else DASH, numeric(1e6 * side.ours.time)
                    argument = shlex.quote(measured.plan.arguments[scene.name])
                    command = f"conservative run {argument} -m {best['method']} --dt {best['dt']:.10g}"
                    rows.append([scene.name, tolerance(side.error), side.ours.name, cost, engine, ratio_cell(side), command])
    general, closed = families.values()
    parts = []
    if general:
        usual, won = Counter(family for _, family in general).most_common(1)[0]
        methods = [method for method in measured.plan.methods if method.family == usual]
        refused = [scene.name for scene in measured.plan.scenes if any(method.unsupported(scene) for method in methods)]
        but = f", which does not support {', '.join(refused)}" if refused else ""
        first = f"Take `{usual}`{but}: of our general integrators, it is the fastest in {won} of {len(general)} rows"
        parts.append(f"{first}; ✗ in the table: another is faster.")
    if closed:
        names = " and ".join(f"`{family}` ({scene})" for scene, family in closed)
        parts.append(f"Closed forms have no truncation error, but each solves only some motions: {names}.")
    random = random_bodies.sentence(measured.ratios) if measured.ratios else ""
    caption = "Our fastest method at each attitude error. Only the final state is stored. ✗: the other is faster."
    table = Table(HEADER, rows, caption)
    lead = Paragraph(" ".join(parts), Emphasis.LEAD) if parts else None
    blocks = filled(lead, Paragraph(f"{_OWN} {random}".strip()), table)
    return Section("What to use", blocks, "use", "What to use", source={"study": work_precision.STUDY.name})
