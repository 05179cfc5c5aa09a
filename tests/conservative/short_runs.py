"""Short runs of every kernel, and the names of the kernels that a run in plain Python reaches.

`python short_runs.py FILE [N]` stores the trajectories of every Nth run in FILE (npz), and with NUMBA_DISABLE_JIT=1 prints the
functions of `conservative.kernels` that were not called.
"""

from __future__ import annotations

import importlib
import inspect
import pkgutil
import sys
from collections.abc import Callable, Iterator
from functools import partial
from itertools import islice

import numpy as np

import conservative as cv
from conservative import kernels
from conservative.attitude import rotation_about
from conservative.batch import Batch
from conservative.drifts import find_reference, measure_drifts
from conservative.grid import Grid
from conservative.method import Method
from conservative.methods.many import Block

HOOK = np.array([0.0, 0.1, 0.4])
TURN = rotation_about((3, -1, 2), 1.3)
BODY = cv.RigidBody(TURN @ np.diag([1.0, 1.4, 2.0]) @ TURN.T)
OTHER = ("conservative.kernels.compiler", "conservative.kernels.compiler.signals")
"""Modules that short runs in plain Python do not call: how kernels are compiled, and what long runs reach."""


def in_field(name: str, potential: cv.Potential | cv.Turning) -> cv.Scene:
    """Return a body without symmetry in a field."""
    return cv.Scene(name, BODY, rotation_about((1, 0.2, -1), 0.7), (0.3, -2.0, 1.0), 2.0, potential)


def scenes() -> list[cv.Scene]:
    """Return a scene for each kind of field, and free bodies at rest, in turned axes, and on polhodes about either axis."""
    quartic = cv.FunctionPotential(lambda R: (R[2] @ HOOK) ** 4, lambda R: np.outer([0, 0, 1], 4 * (R[2] @ HOOK) ** 3 * HOOK))
    growing = cv.FunctionPotential(
        lambda R, t: (1 + t) * R[2] @ HOOK, lambda R, t: (1 + t) * np.outer([0, 0, 1], HOOK), time_dependent=True
    )
    orbit = cv.Orbit(0.7, (0, 0, 1))
    heavy = in_field("heavy", cv.UniformGravity(3.0, (0.2, 0.1, 0.4)))
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
        in_field("growing", growing).rename("growing", dt=1e-3),  # nothing holds its energy where steps are long
        in_field("satellite", orbit.gravity_gradient(BODY.inertia, (1, 0, 0))),
        cv.scenes.volterra_gyrostat(),
        heavy.rename("gyrostat", body=cv.RigidBody(BODY.inertia, rotor_momentum=(0.4, -0.7, 1.1))),
        heavy.rename("loads", torque=cv.Torque((0.3, 0.1, -0.2), "world"), damping=cv.Damping(0.05 * np.eye(3))),
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
    cv.Splitting(),
    cv.NoSquish(),
    cv.Rattle(),
    cv.LieVariational(4),
    cv.Taylor(),
    cv.Taylor(5),
    cv.Taylor(tolerance=1e-12),
    *cv.Textbook().settings_for("variants"),
)


def runs() -> Iterator[tuple[str, Callable[[], cv.Trajectory | Block | None]]]:
    """Yield names and runs: short steps, and steps so long that a branch must be continued or ends."""
    for scene in scenes():
        for method in METHODS:
            if method.unsupported(scene):
                continue
            # Kicks over 50 radians amplify round-off to 4e-3. Explicit steps that are too long overflow, an error in Python.
            factors = ((1, 8),) if isinstance(method, cv.Textbook) else ((1, 8), (40, 3), (200, 2))
            for factor, n in ((1, 8), (4, 3)) if isinstance(method, cv.Splitting) else factors:
                dt = min(scene.dt * factor, 0.9 * method.longest_step(scene))
                yield f"{scene.name}, {method.name}, {factor}", partial(method.solve, scene, Grid(dt, n, 2))
            for factor, n in ((1, 33 if scene.free else 8), (40, 3)):
                dt = min(scene.dt * factor, 0.9 * method.longest_step(scene))
                yield f"{scene.name}, {method.name}, many, {factor}", partial(run_many, scene, method, Grid(dt, n, 16))
        yield f"{scene.name}, between, 1", partial(cv.integrate, scene, scene.dt, t_eval=(0.3 * scene.dt, 7.7 * scene.dt))
    for field, dt in (("lagrange_top", 0.5), ("brick_flip", 1.0)):
        scene = getattr(cv.scenes, field)()
        yield f"{scene.name}, many, long", partial(run_many, scene, cv.Reduced(), Grid(dt, 5))


def run_many(scene: cv.Scene, method: Method, grid: Grid) -> Block | None:
    """Return the block of three bodies with different rates, or None if the method runs them one at a time."""
    bodies = Batch(scene, np.tile(scene.R_WB0, (3, 1, 1)), np.outer((1.0, 0.9, -1.1), scene.w_WB_B0), None, {})
    with np.errstate(all="ignore"):  # compiled, a body that fails goes on in its lane without a word
        run = method.prepare_many(bodies, grid)
        block = run and run()
        if block:
            measure_drifts(bodies, find_reference(bodies), grid, grid.t, block.R_WB, block.w_WB_B)
    return block


def numbers(found: cv.Trajectory | Block | None) -> np.ndarray:
    """Return attitudes and relative rates of finished bodies, and the number of steps or who finished, as one array."""
    if found is None:
        return np.empty(0)
    if isinstance(found, Block):
        R_WB, w_WB_B, ends = found.R_WB[found.finished], found.w_WB_B[found.finished], found.finished
    else:
        R_WB, w_WB_B, ends = found.R_WB, found.w_WB_B, [found.counters.steps]
    size = max(np.linalg.norm(w_WB_B, axis=-1).max(initial=0.0), 1e-3)  # a body at rest may have rates of 1e-17 rad/s
    return np.concatenate([R_WB.ravel(), w_WB_B.ravel() / size, ends])


def functions() -> dict[str, str]:
    """Return the names of all functions of the kernels by file and name of their code."""
    found = {}
    for module in pkgutil.walk_packages(kernels.__path__, "conservative.kernels."):
        if module.name in OTHER:
            continue
        for name, value in vars(importlib.import_module(module.name)).items():
            if inspect.isfunction(value) and value.__module__ == module.name:
                found[f"{value.__code__.co_filename}:{value.__code__.co_name}"] = f"{module.name}.{name}"
    return found


def main(file: str, every: int = 1) -> None:
    """Store the trajectories of every such run; print the functions that nothing called."""
    called: set[str] = set()

    def note(frame, event, _) -> None:
        if event == "call" and "kernels" in frame.f_code.co_filename:
            called.add(f"{frame.f_code.co_filename}:{frame.f_code.co_name}")

    if not kernels.COMPILED:
        sys.setprofile(note)
    found = {name: numbers(run()) for name, run in islice(runs(), 0, None, every)}
    sys.setprofile(None)
    np.savez(file, **found)
    if not kernels.COMPILED:
        print("\n".join(name for code, name in functions().items() if code not in called))


if __name__ == "__main__":
    main(sys.argv[1], *map(int, sys.argv[2:]))
