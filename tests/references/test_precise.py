"""Multi-precision solutions against published states of 30 digits, and against double precision."""

import json
from pathlib import Path

import mpmath
import numpy as np
import pytest

import conservative as cv
from conservative.attitude import angle_between
from conservative.grid import Grid
from conservative.references.precise import Precise
from conservative.references.solvers.scipy import SciPy

from ..sampling import sampled
from .exact_trials import states_in_digits

CASES = json.loads((Path(__file__).parents[1] / "data" / "reference_states.json").read_text())["cases"]


def moment_of(case):
    moment = case["weight_com_B"]
    return moment if any(float(x) for x in moment) else None


FIRST = ("asymmetric_heavy_top", "brick_flip_1e-12", "gazebo_box")


@pytest.mark.parametrize(
    ("name", "last"), [*((name, 1) for name in FIRST), *(pytest.param(name, None, marks=pytest.mark.slow) for name in CASES)]
)
def test_thirty_digits_of_every_reference_state(name, last):
    case, states = CASES[name], CASES[name]["states"][:last]
    times = [state["t"] for state in states]
    q, w = states_in_digits(case["J"], case["q0"], case["w0"], times, moment_of(case), bits=208)
    with mpmath.workprec(208):
        for state, row in zip(states, zip(q, w, strict=True), strict=True):
            expected, computed = state["q"] + state["w"], [*row[0], *row[1]]
            off = max(abs(mpmath.mpf(x) - y) / max(abs(y), mpmath.mpf("1e-3")) for x, y in zip(expected, computed, strict=True))
            assert off < 2e-28  # measured 8.6e-29 where the file's own inputs have 30 digits, 5e-30 elsewhere


def test_more_bits_change_no_double(heavy):
    coarse, fine = (Precise(bits).prepare(heavy, Grid(0.5, 4))() for bits in (80, 128))
    assert angle_between(coarse.R_WB, fine.R_WB).max() < 1e-15  # measured 0
    np.testing.assert_allclose(coarse.w_WB_B, fine.w_WB_B, rtol=1e-15)
    assert fine.label.endswith("/128 bits")
    assert fine.counters.steps > 0


def test_inertia_with_off_diagonal_terms_in_many_digits(heavy):
    """Compare with the same body in its principal axes."""
    with mpmath.workprec(200):
        s = mpmath.sqrt(mpmath.mpf(1) / 3)
        # A half turn about (1, 1, 1)/sqrt 3, B = 2 n n' - 1, is its own inverse.
        B = mpmath.matrix([[mpmath.mpf(2) / 3 - (i == j) for j in range(3)] for i in range(3)])
        J = B * mpmath.diag([1, 2, mpmath.mpf("2.5")]) * B
        w = B * mpmath.matrix(["0.3", "-0.4", "1.1"])
        m = B * mpmath.matrix(["0.1", "0.7", "-0.2"])
        q, v = states_in_digits(J.tolist(), [0, -s, -s, -s], list(w), ["1.5"], list(m), bits=160)
        q_P, v_P = states_in_digits(
            [1, 2, "2.5"], [1, 0, 0, 0], ["0.3", "-0.4", "1.1"], ["1.5"], ["0.1", "0.7", "-0.2"], bits=160
        )
        assert max(abs(x - y) for x, y in zip(B * mpmath.matrix(v[0]), v_P[0], strict=True)) < mpmath.mpf(
            "1e-43"
        )  # measured 2e-48
        # q times the half turn is q_P: its scalar part is -q_vec . n, up to the sign of a quaternion.
        scalar = s * (q[0][1] + q[0][2] + q[0][3])
        assert abs(abs(scalar) - abs(q_P[0][0])) < mpmath.mpf("1e-43")


@pytest.mark.parametrize("name", sampled(["sprung_body", "attracted_body", "gravity_gradient_body"], 1, leave=["sprung_body"]))
def test_other_fields_agree_with_their_own_gradients(name):
    """Compare with SciPy, which uses only the gradient of a function."""
    scene = getattr(cv.scenes, name)(t_end=2.0)
    field = cv.FunctionPotential(scene.potential.energy, scene.potential.gradient)
    truth = Precise(80).run(scene, 0.5)
    other = SciPy(rtol=3e-14).run(scene.rename("through its gradient", potential=field), 0.5)
    assert angle_between(truth.R_WB, other.R_WB).max() < 1e-12  # measured 1.4e-13
    drift = np.ptp(truth.energy) / scene.energy_scale
    assert drift < 1e-14  # measured 4e-16


def test_a_potential_without_expressions_is_unsupported(heavy):
    class OwnGravity(cv.UniformGravity):
        """A field of a user."""

    assert "Python functions" in Precise().unsupported(
        heavy.rename("unknown", potential=cv.FunctionPotential(lambda R: R[2, 2], lambda R: np.diag((0, 0, 1.0))))
    )
    reason = Precise().unsupported(heavy.rename("unknown", potential=OwnGravity(1.0, (0, 0, 1))))
    assert "OwnGravity" in reason
    assert "FIELDS" in reason


@pytest.mark.parametrize("bits", [0, 52, 4097, 128.0, "many", True, float("nan")])
def test_bad_bits(bits):
    with pytest.raises(cv.BadInput, match=r"bits: got .*; expected an integer from 53"):
        Precise(bits)
