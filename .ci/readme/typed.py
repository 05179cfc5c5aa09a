"""The rows of typed tolerances: `Taylor(tolerance=t)` and heyoka with `tol=t`, neither with the error known.

Random bodies of the study `random`, the first of its seed: the time of the motion, final state only, called as the study calls
it, in several processes that take turns; and the largest attitude error at its instants. heyoka has its fastest frame.
"""

from __future__ import annotations

import datetime
import statistics
from collections import defaultdict
from collections.abc import Iterator
from typing import Any

from conservative.attitude import angle_between
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.measures.processes import PROCESSES, Processes
from conservative.benchmarks.speed_ratio import Cheapest, Ratios, SpeedRatio
from conservative.benchmarks.studies.case import Case
from conservative.benchmarks.studies.random import SAMPLES, random_study
from conservative.benchmarks.studies.speed import keep_end, time_runs
from conservative.grid import Grid
from conservative.method import Method
from conservative.methods.taylor import Taylor
from conservative.references.solvers.heyoka import Heyoka

BODIES = 10
TOLERANCES = tuple(10.0**-k for k in range(3, 13))
COMMAND = "python .ci/readme --typed"
OURS, HEYOKA = "ours", "heyoka"


def settings(tolerance: float) -> dict[str, Method]:
    """Return both sides at a tolerance."""
    return {OURS: Taylor(tolerance=tolerance), HEYOKA: Heyoka(tolerance, "lean")}


def typed_rows(seed: int) -> Iterator[dict[str, Any]]:
    """Yield heyoka's time over ours per field and tolerance, over all fields, and the errors, as rows of measured.csv."""
    study = random_study((Taylor(), Heyoka()), BODIES, seed, processes=PROCESSES)
    speed_ratios: dict[tuple[str, float], list[SpeedRatio]] = defaultdict(list)
    errors: dict[tuple[str, float], list[float]] = defaultdict(list)
    with Processes(study.processes) as processes:
        for scene, drawn in zip(study.scenes, study.drawn, strict=True):
            grid = Grid(scene.t_end / SAMPLES, SAMPLES)
            truth, ready, sides = study.truth(scene, grid).trajectory.R_WB, {}, {}
            for tolerance in TOLERANCES:
                for side, method in settings(tolerance).items():
                    found = method.prepare(scene, grid)().R_WB
                    errors[side, tolerance].append(float(angle_between(truth, found).max()))
                    case = Case(study.name, scene, method, keep_end(grid), drawn)
                    run = case.method.prepare(scene, case.grid)
                    run()
                    ready[case, Measure.TIME] = case, run
                    sides[method.name] = side, tolerance
            times: dict[tuple[str, float], list[float]] = defaultdict(list)
            for row in time_runs(study, ready, processes):
                times[sides[row.method]].append(row.value)
            for tolerance in TOLERANCES:
                both = [Cheapest(min(each), side, tuple(each)) for side in (OURS, HEYOKA) for each in [times[side, tolerance]]]
                speed_ratios[drawn.field, tolerance].append(SpeedRatio(scene.name, tolerance, *both))
    common = {"name": "typed tolerance", "unit": "1", "method": "", "version": "", "command": COMMAND}
    common |= {"date": datetime.date.today().isoformat()}
    every = {
        ("all fields", t): [each for (_, at), found in speed_ratios.items() if at == t for each in found] for t in TOLERANCES
    }
    for (field, tolerance), found in {**speed_ratios, **every}.items():
        ratios, place = Ratios(tuple(found)), common | {"scene": f"{field} {tolerance:g}"}
        values = dict(zip(("", ", low", ", high"), (ratios.ratio, *ratios.interval), strict=True))
        for end, value in {**values, ", smallest": ratios.worst, ", largest": ratios.best}.items():
            yield place | {"quantity": f"heyoka's time over ours{end}", "value": value}
    for (side, tolerance), found in errors.items():
        for name, value in {"median": statistics.median(found), "largest": max(found)}.items():
            place = common | {"scene": f"all fields {tolerance:g}", "unit": "rad", "method": settings(tolerance)[side].name}
            yield place | {"quantity": f"{side}, {name} error", "value": value}
