"""Every wrong method is caught by the checks listed for it, every right one passes all of them."""

import importlib.util
import json
import sys
from pathlib import Path

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import angle_between, from_quaternion, orthonormality, rotation_about
from conservative.scenes.turned_frame import in_body_frame

# tests are imported by path, so what lies beside them is too
_spec = importlib.util.spec_from_file_location("negative_controls", Path(__file__).with_name("negative_controls.py"))
controls = importlib.util.module_from_spec(_spec)
sys.modules[_spec.name] = controls
_spec.loader.exec_module(controls)

STATES = json.loads((Path(__file__).parents[1] / "data" / "reference_states.json").read_text())["cases"]
ROUND_OFF = 1e-11
SCENES = {"free": cv.scenes.brick_flip(disturbance=0.7), "top": cv.scenes.asymmetric_top()}
DT = {"free": 0.02, "top": 0.05}
STEPS = 60
RIGHT = (
    cv.Reduced(),
    cv.Reduced(4),
    cv.Convected(tol=1e-13),
    cv.Gauss(4),
    controls.Control(controls.built_right),
)


def run(method, kind, scene=None, steps=STEPS, dt=None):
    dt = dt or DT[kind]
    return cv.integrate(scene or SCENES[kind], dt, method, t_end=steps * dt)


def drift(method, kind, name):
    trajectory = run(method, kind)
    invariant = next(each for each in trajectory.scene.invariants if each.name == name)
    value = invariant.evaluate(trajectory.R_WB, trajectory.w_WB_B)
    return np.abs(value - value[0]).max() / invariant.scale


def order(method, kind):
    """Observed order towards the reference state, after 1 s (free) or 10 s (top); the claimed one where all is round-off."""
    case, scene = {
        "free": ("brick_flip", cv.scenes.brick_flip()),
        "top": ("asymmetric_heavy_top", cv.scenes.asymmetric_top()),
    }[kind]
    state = STATES[case]["states"][0]
    truth = from_quaternion(np.array([float(number) for number in state["q"]]))
    end = float(state["t"])
    errors = [angle_between(truth, cv.integrate(scene, end / n, method, t_end=end).R_WB[-1]) for n in (200, 400)]
    return np.log2(errors[0] / errors[1]) if errors[1] > ROUND_OFF else method.order


def reversal(method, kind):
    """How far from the start a run forth and back ends, rad."""
    forth = run(method, kind)
    back = forth.scene.rename("back", R_WB0=_rotation(forth.R_WB[-1]), w_WB_B0=-forth.w_WB_B[-1])
    return angle_between(forth.R_WB[0], run(method, kind, back).R_WB[-1])


def _rotation(R):
    """The rotation next to R, which a wrong method may have let drift."""
    u, _, v = np.linalg.svd(R)
    return u @ v


CHECKS = {
    "energy": lambda m: all(drift(m, kind, "energy") < ROUND_OFF for kind in SCENES),
    "momentum": lambda m: drift(m, "free", "momentum") < ROUND_OFF,
    "vertical momentum": lambda m: drift(m, "top", "vertical momentum") < ROUND_OFF,
    "orthonormality": lambda m: all(orthonormality(run(m, kind).R_WB).max() < ROUND_OFF for kind in SCENES),
    "order, free": lambda m: order(m, "free") > m.order - 0.1,
    "order, top": lambda m: order(m, "top") > m.order - 0.1,
    "reversal": lambda m: all(reversal(m, kind) < ROUND_OFF for kind in SCENES),
}

CAUGHT_BY = {
    "no_gyroscopic_term": {"momentum", "vertical momentum", "order, free", "order, top", "reversal"},
    "wrong_coriolis_sign": {"momentum", "vertical momentum", "order, free", "order, top", "reversal"},
    "clamped_momentum": {"energy", "momentum", "vertical momentum", "order, top", "reversal"},
    "projected_energy": {"momentum", "vertical momentum", "reversal"},
    "drifting_quaternion": set(CHECKS),
    "late_torque": {"energy", "vertical momentum", "order, top", "reversal"},
    "product_of_means": {"energy"},
}
"""The table: which checks catch which control."""


def caught(method):
    return {name for name, passes in CHECKS.items() if not passes(method)}


@pytest.mark.parametrize("states", controls.WRONG, ids=lambda states: states.__name__)
def test_wrong_method_is_caught(states):
    found = caught(controls.Control(states))
    assert found, f"{states.__name__} passes every check"
    assert found == CAUGHT_BY[states.__name__]


@pytest.mark.parametrize("method", RIGHT, ids=lambda method: method.name)
def test_right_method_passes_every_check(method):
    assert caught(method) == set()


def test_every_check_catches_something_and_every_control_is_in_the_table():
    assert set().union(*CAUGHT_BY.values()) == set(CHECKS)
    assert set(CAUGHT_BY) == {states.__name__ for states in controls.WRONG}
    assert all(CAUGHT_BY.values())


def test_control_built_right_is_the_map_of_reduced():
    for kind, scene in SCENES.items():
        scene = in_body_frame(scene, rotation_about((1, 2, 3), 0.7), "turned")
        ours, plain = (run(method, kind, scene) for method in (cv.Reduced(), controls.Control(controls.built_right)))
        assert angle_between(ours.R_WB, plain.R_WB).max() < 1e-12  # measured 2e-15
