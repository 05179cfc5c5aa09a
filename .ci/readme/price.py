"""What a run to an attitude error costs in a new process, with imports, search and compilation, on random bodies of all fields.

Ours is `integrate(scene, error=1e-6)`, also with an empty cache of compiled kernels. heyoka is built with base vectors and the
numbers of a body as parameters, at a tolerance with which its errors on these bodies are below 1e-6 rad. NumPy and this project's
text of heyoka's equations are imported before the clock starts. This file is also the program that runs in each process.
"""

from __future__ import annotations

import datetime
import json
import os
import statistics
import subprocess
import sys
from collections import defaultdict
from collections.abc import Callable, Iterator
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any

import numpy as np

ERROR, TOL = 1e-6, 1e-9
"""Target of `integrate`, rad, and tolerance of heyoka."""
OTHERS = range(2, 12)
"""Indices of further bodies of a field, each of which is run once: the time of another body is the median."""
OURS, EMPTY, HEYOKA = "conservative", "conservative, empty cache", "heyoka"
QUANTITIES = {"once": "one run", "other": "first run of another body", "error": "largest error"}
Prepare = Callable[[Any], Callable[[], Any]]
"""Prepares the first run of a scene, which returns its final attitude (3, 3) or a function that computes it."""


def ours() -> Prepare:
    """Return how `integrate` runs a scene."""
    import conservative as cv

    return lambda scene: lambda: cv.integrate(scene, error=ERROR).R_WB[-1]


def heyoka(formulations: Any, to_body_axes: Any) -> Prepare:
    """Return how heyoka runs a scene; bodies share the compiled code of their field."""
    import heyoka as hy

    compiled: dict[Any, Any] = {}

    def prepare(scene: Any) -> Callable[[], Any]:
        problem = formulations.base_vectors(scene)
        if problem.form not in compiled:
            compiled[problem.form] = hy.taylor_adaptive(problem.form.build(), [0.0] * 9, tol=TOL, fast_math=True)
        integrator = compiled[problem.form]

        def run() -> Any:
            integrator.pars[:], integrator.state[:], integrator.time = problem.parameters, problem.start, 0.0
            integrator.propagate_until(scene.t_end)
            states = integrator.state.copy()[None, None]
            return lambda: to_body_axes(
                np.array([scene.t_end]), formulations.gather([problem])(states), problem.axes.R_BF[None]
            )[0]

        return run

    return prepare


def equations() -> tuple[Any, Any]:
    """Import this project's text of heyoka's equations, which is not heyoka's time."""
    from conservative.references.heyoka_equations import formulations
    from conservative.references.samples import to_body_axes

    return formulations, to_body_axes


def timed(work: Callable[[], Any]) -> tuple[float, Any]:
    """Return the wall time of a call, s, and its result."""
    begin = perf_counter()
    result = work()
    return perf_counter() - begin, result


def program(side: str, field: str, index: str) -> None:
    """Print the time of the first run since before the import, the time of a run of another body, and the error."""
    texts = () if side == OURS else equations()
    begin = perf_counter()
    prepare = heyoka(*texts) if texts else ours()
    from conservative.scenes.random_body import random_body

    scene = random_body(field, index=int(index))
    final = prepare(scene)()
    once = perf_counter() - begin
    other = statistics.median(timed(prepare(random_body(field, index=each)))[0] for each in OTHERS)
    from conservative.attitude import angle_between
    from conservative.grid import Grid
    from conservative.references.truth import reference

    truth = reference(scene, Grid(scene.t_end, 1)).trajectory.R_WB[-1]
    error = float(angle_between(truth, np.reshape(final() if callable(final) else final, (3, 3))))
    print(json.dumps({"once": once, "other": other, "error": error}))


def measure(side: str, field: str, index: int, cache: str) -> dict[str, float]:
    """Return the times, s, and the error, rad, of one side in a process with a folder for compiled kernels."""
    command = [sys.executable, "-P", __file__, HEYOKA if side == HEYOKA else OURS, field, str(index)]
    variables = {**os.environ, "NUMBA_CACHE_DIR": cache}
    done = subprocess.run(command, env=variables, timeout=300, check=True, capture_output=True, text=True)
    found: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    return found


def measure_all() -> dict[str, list[dict[str, float]]]:
    """Return the results of each side on two bodies of each field; the first run of a field has an empty cache."""
    from conservative.scenes.random_body import FIELDS

    found: dict[str, list[dict[str, float]]] = defaultdict(list)
    for field in FIELDS:
        with TemporaryDirectory() as cache:
            for side, index in ((EMPTY, 0), (OURS, 0), (OURS, 1), (HEYOKA, 0), (HEYOKA, 1)):
                found[side].append(measure(side, field, index, cache))
    return found


def price_rows(found: dict[str, list[dict[str, float]]]) -> Iterator[dict[str, Any]]:
    """Yield the medians of the times and the largest error of each side, as rows of measured.csv."""
    common = {"scene": "price", "command": "python .ci/readme --price", "date": datetime.date.today().isoformat()}
    for side, bodies in found.items():
        for key, quantity in QUANTITIES.items():
            pick, unit = (max, "rad") if key == "error" else (statistics.median, "s")
            yield common | {"name": side, "quantity": quantity, "unit": unit, "value": pick([body[key] for body in bodies])}


if __name__ == "__main__":
    program(*sys.argv[1:])
