"""One side of the table of prices, in a new process: `python -P price_program.py SIDE SCENE OTHER`.

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

Functions = tuple[Callable[[float], Any], Callable[[], tuple[str, Any]]]
"""Functions that run a scene again, with rates times a factor, and that return the method and the final attitude."""
Side = tuple[float, Callable[[Any], Functions]]
"""Time before the import, and a function that runs a scene for the first time."""


def ours() -> Side:
    """Return `integrate` with a target error, and then with the method and the step size that it chose."""
    begin = perf_counter()
    import conservative as cv

    def first(scene: Any) -> Functions:
        found = cv.integrate(scene, error=ERROR)
        choice: Any = found.choice

        def again(factor: float) -> None:
            start = scene.rename(scene.name, w_WB_B0=scene.w_WB_B0 * factor)
            cv.integrate(start, choice.dt, choice.method, sample_every=round(scene.t_end / choice.dt))

        return again, lambda: (choice.method.name, found.R_WB[-1])

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

        again(1.0)
        states = formulations.gather([problem])(integrator.state.copy()[None, None])
        return again, lambda: ("heyoka", to_body_axes(np.array([scene.t_end]), states, problem.axes.R_BF[None])[0])

    return begin, first


def main(side: str, name: str, other_name: str) -> None:
    """Print the times."""
    begin, first = {"ours": ours, "heyoka": heyoka}[side]()
    from conservative import registry

    again, read = first(registry.scene(name))
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
