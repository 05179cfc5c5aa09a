"""Short runs of every kernel, and the names of the kernels that a run in plain Python reaches.

`python short_runs.py FILE` stores the trajectories in FILE (npz), and with NUMBA_DISABLE_JIT=1 prints the functions of
`conservative.kernels` that were not called.
"""

from __future__ import annotations

import importlib
import inspect
import pkgutil
import sys
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

import conservative as cv
from conservative import kernels
from conservative.attitude import rotation_about
from conservative.method import Grid, Method

HOOK = np.array([0.0, 0.1, 0.4])
TURN = rotation_about((3, -1, 2), 1.3)
BODY = cv.RigidBody(TURN @ np.diag([1.0, 1.4, 2.0]) @ TURN.T)
OTHER = ("conservative.kernels", *(f"conservative.kernels.{name}" for name in ("signals", "simd", "simd_llvm", "series_llvm")))
"""Modules that are not run as plain Python: how kernels are compiled, what they are then made of, what long runs reach."""
BASES = ("finite_torque", "energy", "body_torque", "finite_derivative", "slope", "implements")
"""Functions that fields implement, and what registers them."""


def in_field(name: str, potential: cv.Potential) -> cv.Scene:
    """A body without symmetry in a field."""
    return cv.Scene(name, BODY, rotation_about((1, 0.2, -1), 0.7), (0.3, -2.0, 1.0), 2.0, potential)


def scenes() -> list[cv.Scene]:
    """A scene of each kind of field; free ones in axes of their own and not, at rest, and on polhodes about either axis."""
    quartic = cv.FunctionPotential(lambda R: (R[2] @ HOOK) ** 4, lambda R: np.outer([0, 0, 1], 4 * (R[2] @ HOOK) ** 3 * HOOK))
    return [
        cv.scenes.brick_flip(),
        cv.Scene("about the least axis", BODY, TURN, TURN @ [2.0, 0.1, 0.2], 2.0),
        cv.scenes.symmetric_body(),
        cv.scenes.separatrix(),
        cv.scenes.lagrange_top(),
        cv.scenes.asymmetric_top(),
        cv.scenes.hanging_rest(),
        in_field("sprung", cv.LinearSpring(3.0, (0.2, 0.1, 0.4), (0.5, 0.0, 0.3), 0.1)),
        in_field("attracted", cv.PointAttraction(2.0, (0.2, 0.1, 0.4), (1.5, 0.0, 0.3))),
        in_field("gradient", cv.GravityGradient(0.7, BODY.inertia, (1, 0, 1))),
        in_field("function", quartic),
    ]


METHODS: tuple[Method, ...] = (
    cv.Convected(),
    cv.Reduced(),
    cv.Reduced(4, frame="auto"),
    cv.Gauss(2),
    cv.Gauss(5),
    cv.Lame(),
    cv.MoserVeselov(),
    cv.MoserVeselov(6),
    cv.Projected(),
    cv.Taylor(),
    cv.Taylor(5),
    cv.Taylor(12, 1e-12),
)


def runs() -> Iterator[tuple[str, Callable[[], cv.Trajectory]]]:
    """Yield names and runs: short steps, and steps so long that a branch must be continued or ends."""
    for scene in scenes():
        for method in METHODS:
            if method.unsupported(scene):
                continue
            for factor, n in ((1, 8), (40, 3), (200, 2)):
                dt = min(scene.dt * factor, 0.9 * method.longest_step(scene))
                yield f"{scene.name}, {method.name}, {factor}", partial(method.solve, scene, Grid(dt, n, 2))


def numbers(trajectory: cv.Trajectory) -> np.ndarray:
    """Attitudes and rates, relative to the largest, and steps, as one array."""
    size = np.linalg.norm(trajectory.w_WB_B, axis=1).max() or 1.0
    return np.concatenate([trajectory.R_WB.ravel(), trajectory.w_WB_B.ravel() / size, [trajectory.counters.steps]])


def functions() -> dict[str, str]:
    """Names of all functions of the kernels by file and name of their code."""
    found = {}
    for module in pkgutil.iter_modules(kernels.__path__, "conservative.kernels."):
        if module.name in OTHER:
            continue
        for name, value in vars(importlib.import_module(module.name)).items():
            if inspect.isfunction(value) and value.__module__ == module.name and name not in BASES:
                found[f"{value.__code__.co_filename}:{value.__code__.co_name}"] = f"{module.name}.{name}"
    return found


def main(file: str) -> None:
    """Store all trajectories; print the functions that nothing called."""
    called: set[str] = set()

    def note(frame, event, _) -> None:
        if event == "call" and "kernels" in frame.f_code.co_filename:
            called.add(f"{frame.f_code.co_filename}:{frame.f_code.co_name}")

    if not kernels.COMPILED:
        sys.setprofile(note)
    found = {name: numbers(run()) for name, run in runs()}
    sys.setprofile(None)
    np.savez(file, **found)
    if not kernels.COMPILED:
        print("\n".join(name for code, name in functions().items() if code not in called))


if __name__ == "__main__":
    main(sys.argv[1])
