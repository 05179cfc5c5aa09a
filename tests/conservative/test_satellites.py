"""Satellites: libration by elliptic functions, stability by linearised equations, and what a fixed direction would miss."""

import numpy as np
import pytest
from scipy.special import ellipj, ellipk

import conservative as cv
from conservative.attitude import angle_between, rotation_about
from conservative.scenes import satellites

RATE = satellites.RATE


def _libration(scene, amplitude, t):
    """Attitudes (n, 3, 3) of the pendulum a'' = -W^2 sin a cos a from rest at the amplitude, in axes that turn."""
    J1, J2, J3 = scene.body.moments
    modulus = np.sin(amplitude)
    slow = RATE * np.sqrt(3 * (J2 - J1) / J3)
    _, cn, dn, _ = ellipj(slow * t, modulus**2)
    angles = np.arcsin(modulus * cn / dn) + RATE * t
    return np.array([rotation_about((0, 0, 1), angle) for angle in angles]), 4 * ellipk(modulus**2) / slow


@pytest.mark.parametrize("amplitude", [0.01, 0.5, 1.5])
def test_libration_is_that_of_a_pendulum(amplitude):
    scene = cv.scenes.librating_satellite(amplitude)
    found = cv.integrate(scene, 20.0, cv.Projected())
    truth, period = _libration(scene, amplitude, found.t)
    assert angle_between(truth, found.R_WB).max() < 1e-12  # measured 1.2e-14, 4.9e-15 and, near the separatrix, 2.3e-13
    assert 0.5 * satellites.PERIOD < period < 3 * satellites.PERIOD


def _textbook_jacobian(scene):
    """The linearised motion of (small turn, rates) about rest in the orbit by differences, in time units of 1/rate.

    The motion in axes of the orbit: turn' = w - R' n, J w' = J w x w + 3 u x J u, all in body axes, with R = exp(turn).
    """
    J, n, e = scene.body.inertia, np.array((0, -1.0, 0)), np.array((0, 0, 1.0))

    def derivative(x):
        size = np.linalg.norm(x[:3])
        R = rotation_about(x[:3], size) if size else np.eye(3)
        w, u = x[3:], R.T @ e
        return np.concatenate([w - R.T @ n, np.linalg.solve(J, np.cross(J @ w, w) + 3 * np.cross(u, J @ u))])

    rest, step = np.concatenate([np.zeros(3), n]), 1e-5
    columns = [(derivative(rest + step * d) - derivative(rest - step * d)) / (2 * step) for d in np.eye(6)]
    return np.stack(columns, axis=1)


def _growth(k1, k3):
    """The largest growth by Hughes's polynomials, in units of the rate."""
    moments = satellites.moments_of(k1, k3)
    pitch = np.sqrt(complex(-3 * (moments[0] - moments[2]) / moments[1]))
    squares = np.roots([1, 1 + 3 * k1 + k1 * k3, 4 * k1 * k3]).astype(complex)
    return max(abs(pitch.real), *np.abs(np.sqrt(squares).real))


CASES = {
    "Lagrange's region": (0.6, 0.3, True),
    "DeBra's and Delp's region": (-0.08, -0.2, True),
    "unstable in pitch": (0.3, 0.6, False),
    "unstable in roll and yaw": (0.4, -0.3, False),
    "unstable by resonance": (-0.3, -0.6, False),
}


@pytest.mark.parametrize("case", CASES)
def test_small_disturbances_do_what_the_linearised_equations_say(case):
    k1, k3, stable = CASES[case]
    J1, J2, J3 = satellites.moments_of(k1, k3)
    assert pytest.approx(k1) == (J2 - J3) / J1
    assert pytest.approx(k3) == (J2 - J1) / J3
    growth = _growth(k1, k3)
    scene = cv.scenes.stable_satellite(k1, k3, 1e-9, t_end=1.0)
    by_differences = np.linalg.eigvals(_textbook_jacobian(scene)).real.max()
    assert by_differences == pytest.approx(growth, abs=1e-5)
    assert (growth < 1e-9) == stable
    window = 8.0 if stable else 4.0 / growth
    found = cv.integrate(scene, 0.01 / RATE, cv.Projected(), t_end=3 * window / RATE)
    rest = scene.potential.orbit.R_WO(found.t) @ (scene.R_WB0 @ rotation_about(satellites.DISTURBED_ABOUT, -1e-9))
    away = angle_between(rest, found.R_WB)
    late, later = (away[(found.t * RATE > start) & (found.t * RATE <= start + window)].max() for start in (window, 2 * window))
    if stable:
        assert away.max() < 1e-8
    else:
        assert np.log(later / late) / window == pytest.approx(
            growth, rel=0.1
        )  # measured up to 5 %: what oscillates has no smooth envelope


def test_the_registered_satellites_are_what_their_names_say():
    stable, unstable = cv.scenes.stable_satellite(), cv.scenes.unstable_satellite()
    for scene, largest in ((stable, (0.0, 0.01)), (unstable, (0.5, np.pi))):
        found = cv.integrate(scene, scene.dt, cv.Projected())
        rest = scene.potential.orbit.R_WO(found.t) @ (scene.R_WB0 @ rotation_about(satellites.DISTURBED_ABOUT, -1e-3))
        assert largest[0] < angle_between(rest, found.R_WB).max() < largest[1]


def test_a_direction_that_stays_in_the_world_is_another_motion():
    """What a field that does not turn makes of the tumbling satellite after one orbit: 15.66 degrees of attitude."""
    scene = cv.scenes.tumbling_satellite()
    still = scene.rename("still", potential=scene.potential.potential)
    ends = [cv.integrate(each, scene.dt, cv.Projected()).R_WB[-1] for each in (scene, still)]
    assert np.degrees(angle_between(*ends)) == pytest.approx(15.66, abs=0.01)


@pytest.mark.parametrize(("k1", "k3", "argument"), [(1.0, 0.2, "k1"), (0.2, -1.0, "k3"), (float("nan"), 0.2, "k1")])
def test_ratios_that_no_body_has_are_refused(k1, k3, argument):
    with pytest.raises(cv.BadInput) as caught:
        cv.scenes.stable_satellite(k1, k3)
    assert caught.value.argument == argument
