"""The timed call of an engine, compared with the shortest correct script of a user, and the ratio of their times.

The scripts are independent of the adapters. Each body is the brick, in principal axes, and a run is one step, or what
an adaptive solver needs for `SHORT` s. Both sides are prepared `COPIES` times, because the place of data in memory makes a
loop several percent slower for the life of a process; the fastest counts.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from conservative import registry
from conservative.benchmarks.measures.timing import time_interleaved
from conservative.grid import Grid

SHORT, STEP, COPIES, ROUNDS = 0.05, 0.01, 4, 200
pytestmark = pytest.mark.attack
SAMPLES = 20
SCENE = registry.scene("brick_flip")
MOMENTS, Q0, W0 = SCENE.body.moments, np.array([1.0, 0.0, 0.0, 0.0]), SCENE.w_WB_B0
Script = Callable[[], Callable[[], Any]]
"""Prepares a script, which returns states that end with the rates: the last one, or several."""


def heyoka_integrator(tol: float) -> Any:
    """Return heyoka's integrator of quaternion and rates, with its start."""
    import heyoka as hy

    q, w = hy.make_vars("q0", "q1", "q2", "q3"), hy.make_vars("w1", "w2", "w3")
    rates = [
        -0.5 * (q[1] * w[0] + q[2] * w[1] + q[3] * w[2]),
        0.5 * (q[0] * w[0] + q[2] * w[2] - q[3] * w[1]),
        0.5 * (q[0] * w[1] + q[3] * w[0] - q[1] * w[2]),
        0.5 * (q[0] * w[2] + q[1] * w[1] - q[2] * w[0]),
        *(hy.par[i] * (w[(i + 1) % 3] * w[(i + 2) % 3]) for i in range(3)),
    ]
    J = MOMENTS
    gyroscopic = [(J[1] - J[2]) / J[0], (J[2] - J[0]) / J[1], (J[0] - J[1]) / J[2]]
    start = np.concatenate([Q0, W0])
    return hy.taylor_adaptive(list(zip([*q, *w], rates, strict=True)), start, tol=tol, pars=gyroscopic), start


def heyoka_final() -> Callable[[], Any]:
    """Return a run of heyoka that keeps the final state."""
    integrator, start = heyoka_integrator(1e-9)
    state = integrator.state

    def run() -> Any:
        state[:] = start
        integrator.time = 0.0
        integrator.propagate_until(SHORT)
        return state

    return run


def heyoka_samples() -> Callable[[], Any]:
    """Return a run of heyoka that keeps samples."""
    integrator, start = heyoka_integrator(1e-9)
    state, times = integrator.state, np.linspace(0, SHORT, SAMPLES + 1)

    def run() -> Any:
        state[:] = start
        integrator.time = 0.0
        return integrator.propagate_grid(times)[-1]

    return run


def derivative() -> Callable[[float, Any], Any]:
    """Return the right-hand side, compiled, without the overhead of a new array in compiled code."""
    from numba import njit

    @njit
    def fill(out, y, J1, J2, J3):  # type: ignore[no-untyped-def]
        q0, q1, q2, q3, a, b, c = y[0], y[1], y[2], y[3], y[4], y[5], y[6]
        out[0], out[1] = -0.5 * (q1 * a + q2 * b + q3 * c), 0.5 * (q0 * a + q2 * c - q3 * b)
        out[2], out[3] = 0.5 * (q0 * b + q3 * a - q1 * c), 0.5 * (q0 * c + q1 * b - q2 * a)
        out[4], out[5], out[6] = (J2 - J3) / J1 * b * c, (J3 - J1) / J2 * c * a, (J1 - J2) / J3 * a * b

    J = MOMENTS.tolist()

    def slope(t: float, y: Any) -> Any:
        out = np.empty(7)
        fill(out, y, *J)
        return out

    return slope


def scipy_compiled(name: str) -> Callable[[], Any]:
    """Return a run of one of SciPy's compiled loops."""
    from scipy.integrate import ode

    start, rate = np.concatenate([Q0, W0]), np.sqrt(2 * SCENE.energy_scale / MOMENTS.max())
    solver = ode(derivative()).set_integrator(name, rtol=1e-9, atol=1e-9 * min(1.0, rate), nsteps=10**6)

    def run() -> Any:
        solver.set_initial_value(start, 0.0)
        return solver.integrate(SHORT)

    return run


def scipy_python() -> Callable[[], Any]:
    """Return a run of `solve_ivp`."""
    from scipy.integrate import solve_ivp

    start, slope, rate = np.concatenate([Q0, W0]), derivative(), np.sqrt(2 * SCENE.energy_scale / MOMENTS.max())
    tolerances = {"rtol": 1e-9, "atol": 1e-9 * np.repeat([1.0, rate], [4, 3])}
    return lambda: solve_ivp(slope, (0.0, SHORT), start, "DOP853", **tolerances).y.T


def mujoco(integrator: str) -> Callable[[], Any]:
    """Return a step of MuJoCo without the parts that one body does not need."""
    import mujoco as mj

    off = [
        *("CONSTRAINT", "EQUALITY", "FRICTIONLOSS", "LIMIT", "CONTACT", "SPRING", "DAMPER", "PASSIVE", "GRAVITY", "CLAMPCTRL"),
        *("WARMSTART", "FILTERPARENT", "ACTUATION", "REFSAFE", "SENSOR", "MIDPHASE", "EULERDAMP", "AUTORESET", "NATIVECCD"),
        *("ISLAND", "MULTICCD"),
    ]
    spec = mj.MjSpec()
    spec.option.timestep, spec.option.integrator = STEP, getattr(mj.mjtIntegrator, f"mjINT_{integrator.upper()}")
    spec.option.disableflags = sum(int(getattr(mj.mjtDisableBit, f"mjDSBL_{name}", 0)) for name in off)
    body = spec.worldbody.add_body(mass=1.0, inertia=MOMENTS, explicitinertial=True)
    body.add_joint(type=mj.mjtJoint.mjJNT_FREE)
    model = spec.compile()
    data = mj.MjData(model)
    qpos, qvel, start = data.qpos, data.qvel, (np.array([0, 0, 0, *Q0]), np.array([0, 0, 0, *W0]))

    def run() -> Any:
        qpos[:], qvel[:] = start
        mj.mj_step(model, data)
        return qvel

    return run


def pinocchio_euler() -> Callable[[], Any]:
    """Return a step of the semi-implicit Euler method with Pinocchio."""
    import pinocchio as pin

    model = pin.Model()
    joint = model.addJoint(0, pin.JointModelSpherical(), pin.SE3.Identity(), "body")
    model.appendBodyToJoint(joint, pin.Inertia(1.0, np.zeros(3), np.diag(MOMENTS)), pin.SE3.Identity())
    data, torque, start = model.createData(), np.zeros(3), np.roll(Q0, -1)

    def run() -> Any:
        v = W0 + STEP * pin.aba(model, data, start, W0, torque)
        pin.integrate(model, start, STEP * v)
        return v

    return run


ONE, ADAPTIVE, GRID = Grid(STEP, 1), Grid(SHORT, 1), Grid(SHORT / SAMPLES, SAMPLES)
CALLS: dict[str, tuple[str, Grid, Script]] = {
    "heyoka, final state": ("heyoka:tol=1e-9", ADAPTIVE, heyoka_final),
    f"heyoka, {SAMPLES} samples": ("heyoka:tol=1e-9", GRID, heyoka_samples),
    "SciPy, `ode` with dop853": ("scipy:rtol=1e-9,loop=compiled", ADAPTIVE, lambda: scipy_compiled("dop853")),
    "SciPy, `ode` with lsoda": ("scipy:LSODA,rtol=1e-9,loop=compiled", ADAPTIVE, lambda: scipy_compiled("lsoda")),
    "SciPy, `solve_ivp`": ("scipy:rtol=1e-9", ADAPTIVE, scipy_python),
    "MuJoCo, a step of RK4": ("mujoco:RK4", ONE, lambda: mujoco("RK4")),
    "MuJoCo, a step of Euler": ("mujoco:Euler", ONE, lambda: mujoco("Euler")),
    "Pinocchio, a step of Euler": ("pinocchio:Euler", ONE, pinocchio_euler),
}


def prepare(method: str, grid: Grid) -> Callable[[], Any]:
    """Return the loop of a method that studies time."""
    run: Any = registry.method(method).prepare(SCENE, grid)
    assert run().ok
    own_loop: Callable[[], Any] = run.own_loop
    return own_loop


def compare(name):
    """Return the runs of an engine, timed and as a script. Raise AssertionError if their final states differ."""
    method, grid, script = CALLS[name]
    expected = registry.method(method).prepare(SCENE, grid)().w_WB_B
    runs = {}
    for copy in range(COPIES):
        timed, written = prepare(method, grid), script()
        found = np.array(written(), ndmin=2)[-1, -3:]
        np.testing.assert_allclose(found, expected[-1] @ SCENE.body.R_BP, rtol=1e-12, atol=1e-12)
        runs |= {("timed", copy): timed, ("script", copy): written}
    return runs


@pytest.mark.parametrize("name", CALLS)
def test_a_timed_call_does_what_the_shortest_script_does(name, capsys):
    timings = time_interleaved(compare(name), ROUNDS, 1e-4)
    timed, script = (min(timings[side, copy].minimum for copy in range(COPIES)) for side in ("timed", "script"))
    with capsys.disabled():
        print(f"\n{name}: {1e6 * timed:.3g} us timed, {1e6 * script:.3g} us by the script, ratio {timed / script:.3g}")
    assert min(timed, script) > 2e-7  # s: both make their run


def test_a_script_with_another_step_is_found(monkeypatch):
    monkeypatch.setitem(globals(), "STEP", 0.02)  # of the scripts only
    with pytest.raises(AssertionError, match="Mismatched"):
        compare("MuJoCo, a step of RK4")
