"""The study of prices: what a run to an attitude error costs in a new process, with imports, search and compilation.

The scenes are random bodies, two in each field. Ours is `integrate(scene, error=1e-6)`, and then the chosen method and step
size; heyoka is built and run with a tolerance that is safe for this error (see `price_program`). Further runs of a body start
with other rates, one after the other. The error of the final attitude is measured for both.

On the first body of each field ours also runs with an empty cache of compiled kernels, as right after the installation. The
other runs have a full one, as all later processes. heyoka has no cache.
"""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from conservative import registry
from conservative.attitude import angle_between
from conservative.errors import MissingEngine
from conservative.grid import Grid
from conservative.method import Method
from conservative.references.engines.heyoka import Heyoka
from conservative.scene import Scene
from conservative.scenes.random_body import FIELDS, random_body

from ..measures.measure import Measure, Value
from ..measures.measurement import Measurement
from . import price_program
from .case import Case, outcome_of_error
from .selection import Missing
from .study import Progress, Study

MEASURES = {"once": Measure.PRICE_ONCE, "thousand": Measure.PRICE_THOUSAND, "other": Measure.PRICE_OTHER}
EMPTY = "empty cache"
"""Way of a process without compiled kernels."""


def scenes() -> tuple[Scene, ...]:
    """Return two random bodies in each field."""
    return tuple(random_body(field, index=index) for field in FIELDS for index in (0, 1))


def findings(study: Study, progress: Progress) -> Iterator[Measurement]:
    """Yield prices and errors of both sides on each scene; of two scenes in a row, each is the other body of the other one."""
    tell = study.count(progress, 1)
    for number in range(0, len(study.scenes), 2):
        pair = study.scenes[number : number + 2]
        with TemporaryDirectory() as cache:
            for scene, other in zip(pair, reversed(pair), strict=True):
                tell(f"{scene.name}: new processes")
                for side, way in [("ours", EMPTY)] * (scene is pair[0]) + [("ours", ""), ("heyoka", "")]:
                    yield from measure_side(study, scene, other, side, way, cache)


def measure_side(study: Study, scene: Scene, other: Scene, side: str, way: str, cache: str) -> Iterator[Measurement]:
    """Yield prices and error of one side on a scene, in a process with a folder for compiled kernels."""
    grid = Grid(scene.t_end, 1)
    command = [sys.executable, "-P", str(Path(price_program.__file__)), side, scene.name, other.name]
    try:
        method: Method = Heyoka(price_program.TOL, "base_vectors")
        truth = study.truth(scene, grid).trajectory
    except MissingEngine as error:
        case = Case(study.name, scene, Missing("heyoka", error=error), grid)
        yield case.row(Value(Measure.PRICE_ONCE, math.nan), outcome_of_error(case.method, error, study.skip_missing))
        return
    variables, limit = {**os.environ, "NUMBA_CACHE_DIR": cache}, 5 * study.hang_limit
    done = subprocess.run(command, env=variables, timeout=limit, check=True, capture_output=True, text=True)
    found = json.loads(done.stdout.splitlines()[-1])
    if side == "ours":
        method = registry.method(found["method"])
    case = Case(study.name, scene, method, grid, way=way)
    final = np.reshape(found["final"], (3, 3))
    yield from case.rows(Value(measure, found[name]) for name, measure in MEASURES.items())
    yield case.row(Value(Measure.ATTITUDE_FINAL, float(angle_between(truth.R_WB[-1], final))))
