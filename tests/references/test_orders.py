"""Orders and drifts of the engines as measured facts. What depends on an engine's version says which one was measured."""

from importlib.metadata import version

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import angle_between
from conservative.method import Grid
from conservative.references.engines.mujoco import MuJoCo
from conservative.references.engines.pinocchio import Pinocchio
from conservative.references.precise import Precise

STEPS = (40, 80, 160, 320)

mujoco_4 = pytest.mark.skipif(version("mujoco") != "4.0.0", reason="measured with MuJoCo 4.0.0; it changes between versions")
METHODS = [
    *(pytest.param(method, marks=mujoco_4, id=method.name) for method in MuJoCo.variants()),
    *(pytest.param(method, id=method.name) for method in Pinocchio.variants()),
]


def errors(scene, method):
    """Return errors at the end for each number of steps: attitude, rates, energy, world momentum."""
    truth = Precise(113).prepare(scene, Grid(scene.t_end / 4, 4))()
    rows = []
    for n in STEPS:
        found = method.prepare(scene, Grid(scene.t_end / n, n, n))()
        rows.append(
            [
                angle_between(truth.R_WB[-1], found.R_WB[-1]),
                np.abs(truth.w_WB_B[-1] - found.w_WB_B[-1]).max(),
                abs(found.energy[-1] - truth.energy[0]),
                np.linalg.norm(found.momentum_W[-1] - truth.momentum_W[-1]),
            ]
        )
    return np.array(rows)


def slopes(values):
    """Return orders from a log-log fit over all steps."""
    return -np.polyfit(np.log(STEPS), np.log(values), 1)[0]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", ["free", "heavy"])
def test_observed_order_is_the_one_claimed(method, name, request):
    attitude, rates, energy, momentum = slopes(errors(request.getfixturevalue(name), method))
    # Measured over both scenes: 0.98 to 1.01 and 3.96 to 4.01.
    assert attitude == pytest.approx(method.order, abs=0.1)
    assert rates == pytest.approx(method.order, abs=0.1)
    assert momentum > method.order - 0.1
    assert energy > method.order - 0.1


# Relative drift of energy on the brick after 6 s of steps of 0.01 s: (method, least, most).
DRIFTS = [("Euler", 0.2, 0.25), ("RK4", -3e-8, -1e-8), ("implicit", -0.2, -0.15)]
DRIFTS += [("implicitfast", -0.2, -0.15), ("discrete", -0.2, -0.15)]


@mujoco_4
@pytest.mark.parametrize(("integrator", "least", "most"), DRIFTS)  # measured 0.224, -1.7e-8, -0.168, -0.168, -0.168
def test_energy_drift_of_mujoco_on_the_brick(integrator, least, most):
    found = cv.integrate(cv.scenes.brick_flip(), 0.01, MuJoCo(integrator))
    assert least < found.energy[-1] / found.energy[0] - 1 < most


@mujoco_4
def test_implicitfast_and_discrete_are_semi_implicit_euler_on_a_ball_joint(heavy):
    """The implicit treatment of the gyroscopic term that they give a free joint is not given to a ball joint."""
    euler, *others = (MuJoCo(name).run(heavy, 0.01) for name in ("Euler", "implicitfast", "discrete"))
    for other in others:
        assert angle_between(euler.R_WB, other.R_WB).max() < 1e-12  # measured 0
