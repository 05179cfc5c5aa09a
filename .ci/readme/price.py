"""Cost of a run to 1e-6 rad in a new process, with imports, search and compilation, on random bodies of all fields.

Ours is `integrate(scene, error=1e-6)`, with a full cache of compiled kernels. heyoka is built with base vectors and the numbers
of a body as parameters, at a tolerance with which its errors on these bodies are below 1e-6 rad. NumPy and this project's text
of heyoka's equations are imported before the clock starts. `python price.py SIDE FIELD INDEX` runs one side and prints JSON.
"""

from __future__ import annotations

import datetime
import json
import statistics
import subprocess
import sys
from collections.abc import Callable, Iterator
from time import perf_counter
from typing import Any

import numpy as np

ERROR, TOL = 1e-6, 1e-9
"""Target of `integrate`, rad, and tolerance of heyoka."""
OTHERS = range(2, 12)
"""Indices of further bodies of a field: the time of another body is the median of their first runs."""
AGAIN = 5
"""Further runs of each, the fastest of which is its next run."""
QUANTITIES = {
    "once": "one run",
    "other": "first run of another body",
    "next": "next run of the same body",
    "error": "largest error",
}
Run = Callable[[], Callable[[], Any]]
"""Runs a scene and returns a function for its final attitude (3, 3), whose conversion is not timed."""


def ours() -> Callable[[Any], Run]:
    """Return a function that prepares the run of a scene by this package."""
    import conservative as cv

    def prepare(scene: Any) -> Run:
        def run() -> Callable[[], Any]:
            trajectory = cv.integrate(scene, error=ERROR)
            return lambda: trajectory.R_WB[-1]

        return run

    return prepare


def heyoka(formulations: Any, to_body_axes: Any) -> Callable[[Any], Run]:
    """Return a function that prepares the run of a scene by heyoka; bodies share the compiled code of their field."""
    import heyoka as hy

    compiled: dict[Any, Any] = {}

    def prepare(scene: Any) -> Run:
        problem = formulations.base_vectors(scene)
        if problem.form not in compiled:
            compiled[problem.form] = hy.taylor_adaptive(problem.form.build(), [0.0] * 9, tol=TOL, fast_math=True)
        integrator = compiled[problem.form]

        def run() -> Callable[[], Any]:
            integrator.pars[:], integrator.state[:], integrator.time = problem.parameters, problem.start, 0.0
            integrator.propagate_until(scene.t_end)
            state, t = integrator.state.copy()[None, None], np.array([scene.t_end])
            return lambda: to_body_axes(t, formulations.gather([problem])(state), problem.axes.R_BF[None])[0]

        return run

    return prepare


def program(side: str, field: str, index: str) -> None:
    """Print the time of the first run since before the import, the time of a run of another body, and the error."""
    if side == "heyoka":
        from conservative.references.heyoka_equations import formulations
        from conservative.references.samples import to_body_axes
    begin = perf_counter()
    prepare = heyoka(formulations, to_body_axes) if side == "heyoka" else ours()
    from conservative.scenes.random_body import random_body

    scene = random_body(field, index=int(index))
    final = prepare(scene)()
    once, runs = perf_counter() - begin, [prepare(random_body(field, index=other)) for other in OTHERS]
    times = [[time_of(run) for _ in range(1 + AGAIN)] for run in runs]
    from conservative.attitude import angle_between
    from conservative.grid import Grid
    from conservative.references.truth import reference

    truth = reference(scene, Grid(scene.t_end, 1)).trajectory.R_WB[-1]
    error = float(angle_between(truth, np.reshape(final(), (3, 3))))
    other, again = statistics.median(first for first, *_ in times), statistics.median(min(more) for _, *more in times)
    print(json.dumps({"once": once, "other": other, "next": again, "error": error}))


def time_of(run: Run) -> float:
    """Return the wall time of a run, s."""
    begin = perf_counter()
    run()
    return perf_counter() - begin


def measure(side: str, field: str, index: int) -> dict[str, float]:
    """Return the times, s, and the error, rad, of one side in a new process."""
    command = [sys.executable, "-P", __file__, side, field, str(index)]
    done = subprocess.run(command, timeout=300, check=True, capture_output=True, text=True)
    result: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    return result


def price_rows(bodies: tuple[int, ...] = (0, 1), fields: tuple[str, ...] = ()) -> Iterator[dict[str, Any]]:
    """Yield the medians of the times and the largest error of each side, as rows of measured.csv."""
    from conservative.scenes.random_body import FIELDS

    common = {"scene": "price", "command": "python .ci/readme --price", "date": datetime.date.today().isoformat()}
    for side in ("conservative", "heyoka"):
        results = []
        for field in fields or FIELDS:
            measure(side, field, bodies[0])  # fills the cache
            results += [measure(side, field, index) for index in bodies]
        for key, quantity in QUANTITIES.items():
            pick, unit = (max, "rad") if key == "error" else (statistics.median, "s")
            value = pick([result[key] for result in results])
            yield common | {"name": side, "quantity": quantity, "unit": unit, "value": value}


if __name__ == "__main__":
    program(*sys.argv[1:])
