"""One side of the table of prices, in a new process: `python -P price_program.py SIDE SCENE OTHER`.

It prints as JSON: the wall time, s, since before the import of the package until the first run has ended, the same for `RUNS`
starts of the body one after the other, the time of the first run of another body, and the method and the final attitude (9) of
the first run. NumPy, which both sides need, is imported before, and so is the part of this project that writes heyoka's
equations.
"""

from __future__ import annotations

import json
import statistics
import sys
from collections.abc import Callable
from time import perf_counter
from typing import Any

import numpy as np

ERROR = 1e-6
"""Target of `integrate`, rad."""
TOL = 1e-9
"""Tolerance of heyoka, with which its errors on the bodies of the study are below `ERROR`."""
RUNS = 1000
OTHERS = range(2, 12)
"""Indices of the other bodies, each of which is run once: the time of another body is the median."""

Functions = tuple[Callable[[], Any], Callable[[float], Any], Callable[[], tuple[str, Any]]]
"""Functions that run a scene, run it again with rates times a factor, and return the method and the final attitude."""
Side = tuple[float, Callable[[Any], Functions]]
"""Time before the import, and a function that prepares the first run of a scene."""


def ours() -> Side:
    """Return `integrate` with a target error, and then with the method and the step size that it chose."""
    begin = perf_counter()
    import conservative as cv

    def first(scene: Any) -> Functions:
        found: list[Any] = []

        def run() -> None:
            found[:] = [cv.integrate(scene, error=ERROR)]

        def again(factor: float) -> None:
            choice = found[0].choice
            start = scene.rename(scene.name, w_WB_B0=scene.w_WB_B0 * factor)
            cv.integrate(start, choice.dt, choice.method, sample_every=round(scene.t_end / choice.dt))

        return run, again, lambda: (found[0].choice.method.name, found[0].R_WB[-1])

    return begin, first


def heyoka() -> Side:
    """Return heyoka with base vectors and numbers of bodies as parameters, so that bodies share the compiled code."""
    from conservative.references.heyoka_equations import formulations
    from conservative.references.samples import to_body_axes

    begin = perf_counter()
    import heyoka as hy

    compiled: dict[Any, Any] = {}

    def first(scene: Any) -> Functions:
        problem = formulations.base_vectors(scene)
        if problem.form not in compiled:
            compiled[problem.form] = hy.taylor_adaptive(problem.form.build(), [0.0] * 9, tol=TOL, fast_math=True)
        integrator = compiled[problem.form]

        def again(factor: float) -> None:
            integrator.pars[:] = problem.parameters
            integrator.time = 0.0
            integrator.state[:] = problem.start
            integrator.state[-3:] *= factor
            integrator.propagate_until(scene.t_end)

        final: list[Any] = []

        def run() -> None:
            again(1.0)
            final[:] = [integrator.state.copy()[None, None]]

        def read() -> tuple[str, Any]:
            states = formulations.gather([problem])(final[0])
            return "heyoka", to_body_axes(np.array([scene.t_end]), states, problem.axes.R_BF[None])[0]

        return run, again, read

    return begin, first


def time_of(first: Callable[[Any], Functions], scene: Any) -> float:
    """Return the wall time, s, of the first run of a body, prepared, in a field whose code is compiled.

    For heyoka, its parameters and its initial state are prepared; for ours the scene is.
    """
    run, *_ = first(scene)
    begin = perf_counter()
    run()
    return perf_counter() - begin


def main(side: str, name: str, other_name: str) -> None:
    """Print the times."""
    begin, first = {"ours": ours, "heyoka": heyoka}[side]()
    from conservative import registry

    run, again, read = first(registry.scene(name))
    run()
    once = perf_counter() - begin
    for number in range(1, RUNS):
        again(1 + 1e-6 * number)
    thousand = perf_counter() - begin
    other = statistics.median(time_of(first, registry.scene(f"{other_name.rpartition('=')[0]}={index}")) for index in OTHERS)
    method, final = read()
    print(json.dumps({"once": once, "thousand": thousand, "other": other, "method": method, "final": np.ravel(final).tolist()}))


if __name__ == "__main__":
    main(*sys.argv[1:])
