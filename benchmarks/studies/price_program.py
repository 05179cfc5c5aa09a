"""One side of the study of prices, in a new process: `python -P price_program.py SIDE SCENE OTHER`.

It prints as JSON: the wall time, s, since before the import of the package until the first run has ended, the same for `RUNS`
starts of the body one after the other, the time of the first run of another scene, and the method and the final attitude (9) of
the first run. NumPy, which both sides need, is imported before, and so is the part of this project that writes heyoka's
equations.
"""

from __future__ import annotations

import json
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

Side = tuple[float, Callable[[Any], Any], Callable[[float], Any]]
"""Time before the import; a function that runs a scene for the first time; one that runs it again with rates times a factor.

The first function returns one for the method and the final attitude."""


def ours() -> Side:
    """Return the functions of `integrate` with a target error, and of the method and the step size that it chose."""
    begin = perf_counter()
    import conservative as cv

    last: list[Any] = []

    def first(scene: Any) -> Any:
        found = cv.integrate(scene, error=ERROR)
        last[:] = scene, found.choice
        return lambda: (last[1].method.name, found.R_WB[-1])

    def again(factor: float) -> None:
        scene, choice = last
        start = scene.rename(scene.name, w_WB_B0=scene.w_WB_B0 * factor)
        cv.integrate(start, choice.dt, choice.method, sample_every=round(scene.t_end / choice.dt))

    return begin, first, again


def heyoka() -> Side:
    """Return the functions of heyoka: base vectors, numbers of bodies as parameters, so that bodies share the compiled code."""
    from conservative.references.heyoka_equations import formulations
    from conservative.references.samples import to_body_axes

    begin = perf_counter()
    import heyoka as hy

    compiled: dict[Any, Any] = {}
    last: list[Any] = []

    def first(scene: Any) -> Any:
        problem = formulations.base_vectors(scene)
        if problem.form not in compiled:
            compiled[problem.form] = hy.taylor_adaptive(problem.form.build(), [0.0] * 9, tol=TOL, fast_math=True)
        last[:] = compiled[problem.form], problem, scene.t_end
        states = formulations.gather([problem])(again(1.0).copy()[None, None])
        return lambda: ("heyoka", to_body_axes(np.array([scene.t_end]), states, problem.axes.R_BF[None])[0])

    def again(factor: float) -> Any:
        integrator, problem, t_end = last
        integrator.pars[:] = problem.parameters
        integrator.time = 0.0
        integrator.state[:] = problem.start
        integrator.state[-3:] *= factor
        integrator.propagate_until(t_end)
        return integrator.state

    return begin, first, again


def main(side: str, name: str, other_name: str) -> None:
    """Print the times."""
    begin, first, again = {"ours": ours, "heyoka": heyoka}[side]()
    from conservative import registry

    read = first(registry.scene(name))
    once = perf_counter() - begin
    for number in range(1, RUNS):
        again(1 + 1e-6 * number)
    thousand = perf_counter() - begin
    begin = perf_counter()
    first(registry.scene(other_name))
    other = perf_counter() - begin
    method, final = read()
    print(json.dumps({"once": once, "thousand": thousand, "other": other, "method": method, "final": np.ravel(final).tolist()}))


if __name__ == "__main__":
    main(*sys.argv[1:])
