"""Fields that depend on time (orbits, functions) against the textbook equations; satellites against theory."""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipj, ellipk

import conservative as cv
from conservative.attitude import angle_between, hat, orthonormality, rotation_about
from conservative.invariants import JACOBI_INTEGRAL
from conservative.method_info import MethodInfo
from conservative.references.solvers.scipy import SciPy
from conservative.scenes import satellites

from ..sampling import sampled

TURN = rotation_about((1, -2, 0.5), 1.1)
INERTIA = TURN @ np.diag((0.9, 1.7, 1.2)) @ TURN.T
R_WB0 = rotation_about((0.3, -0.5, 0.8), 0.7)
RATES = np.array((1.2, -2.0, 0.7))
ORBIT = cv.Orbit(1.3, (0.2, 0.5, 0.9))
ACROSS = np.cross(ORBIT.normal_W, (1, 0.3, 0))
POINT, ANCHOR = np.array((0.3, -0.2, 0.4)), np.array((1.0, 0.5, -0.8))
T_END = 4.0
COM = 2.5 * POINT


def _at(t, vector):
    """Return a vector that turns with the orbit, by Rodrigues' formula."""
    n, angle = ORBIT.normal_W, ORBIT.rate * t
    return np.cos(angle) * vector + np.sin(angle) * np.cross(n, vector) + (1 - np.cos(angle)) * (n @ vector) * n


def _gradient_torque(t, R):
    e = ACROSS / np.linalg.norm(ACROSS)
    u = R.T @ _at(t, e)
    return 3 * ORBIT.rate**2 * np.cross(u, INERTIA @ u)


def _spring_torque(t, R):
    arm = _at(t, ANCHOR) - R @ POINT
    return np.cross(POINT, R.T @ (3 * (1 - 0.4 / np.linalg.norm(arm)) * arm))


def _gravity_torque(t, R):
    return np.cross(R.T @ _at(t, np.array((0, 0, 1.0))), 4 * COM)


FIELDS = {
    "satellite": (ORBIT.gravity_gradient(INERTIA, ACROSS), _gradient_torque),
    "spring": (cv.Turning(cv.LinearSpring(3.0, POINT, ANCHOR, 0.4), ORBIT), _spring_torque),
    "gravity": (cv.Turning(cv.UniformGravity(4.0, COM), ORBIT), _gravity_torque),
    "two functions": (
        cv.Turning(cv.FunctionPotential(lambda R: 4 * R[2] @ COM, lambda R: 4 * np.outer((0, 0, 1), COM)), ORBIT),
        _gravity_torque,
    ),
}


def scene(field="satellite", t_end=T_END):
    return cv.Scene("turning", cv.RigidBody(INERTIA), R_WB0, RATES, t_end, FIELDS[field][0])


def textbook(torque, t, start=(R_WB0, RATES), inertia=INERTIA):
    """Return attitudes (n, 3, 3) and rates (n, 3) of R' = R hat(w), J w' = J w x w + torque."""

    def derivative(t, y):
        R, w = y[:9].reshape(3, 3), y[9:]
        return np.concatenate([(R @ hat(w)).ravel(), np.linalg.solve(inertia, np.cross(inertia @ w, w) + torque(t, R))])

    y0 = np.concatenate([np.ravel(start[0]), start[1]])
    found = solve_ivp(derivative, (0, t[-1]), y0, "DOP853", t, rtol=1e-13, atol=1e-14).y.T
    return found[:, :9].reshape(-1, 3, 3), found[:, 9:]


@pytest.mark.parametrize("field", sampled(FIELDS, 2, ["satellite"]))  # the crossing turns a spring
def test_projected_follows_the_textbook(field):
    end = 0.4 if field == "two functions" else T_END
    found = cv.integrate(scene(field, end), 0.02, cv.Projected(), sample_every=5)
    R, w = textbook(FIELDS[field][1], found.t)
    assert angle_between(R, found.R_WB).max() < 3e-12  # measured up to 3.1e-13
    assert np.abs(w - found.w_WB_B).max() < 3e-12
    still = cv.integrate(found.scene.rename("still", potential=found.scene.potential.potential), 0.02, cv.Projected())
    assert angle_between(R[-1], still.R_WB[-1]) > 0.005  # the fixed field differs: measured 0.01 to 0.9


@pytest.mark.parametrize("field", FIELDS)
def test_the_jacobi_integral_is_conserved_and_energy_is_not(field):
    end = 0.6 if field == "two functions" else 300.0
    found = cv.integrate(scene(field, end), 0.02, cv.Projected())
    (invariant,) = found.scene.invariants
    assert invariant.name == JACOBI_INTEGRAL
    assert np.abs(found.drift(invariant)).max() < 4e-15  # measured up to 1.2e-15
    assert orthonormality(found.R_WB).max() < 1e-14
    assert np.ptp(found.energy) > 0.01 * found.scene.energy_scale
    kinetic = np.sum((found.w_WB_B @ INERTIA) * found.w_WB_B, axis=1) / 2
    normal_momentum = found.momentum_W @ ORBIT.normal_W
    by_hand = kinetic + found.scene.potential.energy_at(found.R_WB, found.t) - ORBIT.rate * normal_momentum
    assert np.ptp(by_hand) < 1e-13 * invariant.scale


def test_taylor_conserves_the_jacobi_integral_and_follows_projected():
    found = cv.integrate(scene(t_end=300.0), 0.05, cv.Taylor())
    assert np.abs(found.drift(found.scene.invariants[0])).max() < 4e-15  # measured 1.1e-15
    assert np.ptp(found.energy) > 0.01 * found.scene.energy_scale
    short = cv.integrate(scene(), 0.05, cv.Taylor()), cv.integrate(scene(), 0.0125, cv.Projected(), sample_every=4)
    assert angle_between(short[0].R_WB, short[1].R_WB).max() < 3e-13


def test_taylor_refuses_other_fields_that_turn():
    assert "right angles" in cv.Taylor().unsupported(scene("spring"))
    assert "functions" in cv.Taylor().unsupported(scene("two functions"))


def test_a_field_that_turns_about_its_own_axis_stays():
    gravity = cv.UniformGravity(4.0, COM)
    turned = cv.Scene("turned", cv.RigidBody(INERTIA), R_WB0, RATES, 3.0, cv.Turning(gravity, cv.Orbit(0.9, (0, 0, 2))))
    pair = [cv.integrate(each, 0.02, cv.Projected()) for each in (turned, turned.rename("still", potential=gravity))]
    assert angle_between(pair[0].R_WB, pair[1].R_WB).max() < 1e-13


@pytest.mark.parametrize("time", [2.0**-40, 2.0**40])
def test_motions_of_any_speed(time):
    field = cv.Orbit(ORBIT.rate / time, ORBIT.normal_W).gravity_gradient(INERTIA, ACROSS)
    slow = cv.Scene("slow", cv.RigidBody(INERTIA), R_WB0, RATES / time, T_END * time, field)
    found = cv.integrate(slow, 0.02 * time, cv.Projected())
    assert angle_between(found.R_WB, cv.integrate(scene(), 0.02, cv.Projected()).R_WB).max() < 1e-13


def test_a_run_that_loses_the_integral_is_cut():
    class Losing(cv.Method):
        family, role, order, conserves = "losing", cv.Role.OURS, 8, frozenset({JACOBI_INTEGRAL})
        label, method_info = "losing", MethodInfo(supports=frozenset(cv.Feature))

        def prepare(self, scene, grid):
            good = cv.Projected().prepare(scene, grid)()
            w = good.w_WB_B * np.where(good.t < 2, 1, 1.01)[:, None]
            return lambda: cv.Trajectory(scene, good.t, good.R_WB, w, self.label)

    found = Losing().run(scene(), 0.1)
    assert isinstance(found.failure, cv.NotConserved)
    assert JACOBI_INTEGRAL in str(found.outcome)
    assert found.t[-1] < 2


@dataclass(frozen=True)
class Unaware(cv.Method):
    """A method that does not know of fields that depend on time."""

    family, role, order, label = "unaware", cv.Role.OURS, 1, "unaware"

    def unsupported(self, scene):
        return None

    def prepare(self, scene, grid):
        raise AssertionError("a run was prepared")


@pytest.mark.parametrize("method", ["reduced", "convected", "gauss", "lame", "substepped", Unaware()], ids=str)
def test_methods_without_support_for_time_refuse(method):
    for each in (scene(), shaken()):
        with pytest.raises(cv.Unsupported, match=r"a turning field|a potential that depends on time"):
            cv.integrate(each, 0.1, method)


@pytest.mark.parametrize("name", ["heyoka", "precise"])
def test_references_refuse_functions_of_time(name):
    with pytest.raises(cv.Unsupported):
        cv.integrate(shaken(), 0.1, name)


def test_support_for_time_is_that_of_the_inner_method():
    assert Unaware().unsupported(cv.scenes.brick_flip()) is None
    assert cv.Substepped("projected").unsupported(scene()) is None


def test_energy_is_not_a_function_of_the_attitude_alone():
    field = scene().potential
    assert not isinstance(field, cv.Potential)
    for name in ("energy", "gradient", "finite_derivative"):
        assert not hasattr(field, name)


def test_the_direction_that_an_error_names_is_accepted():
    orbit = cv.Orbit(1.0, (0.3, -0.4, 1.2))
    with pytest.raises(cv.BadInput) as caught:
        orbit.gravity_gradient(INERTIA, (1, 0, 1))
    named = str(caught.value).rpartition("such as ")[2]
    orbit.gravity_gradient(INERTIA, [float(x) for x in named.strip("[]()").split(",")])


def test_a_field_that_depends_on_the_time_has_a_default_method():
    scene = cv.scenes.tumbling_satellite(t_end=60.0)
    found = cv.integrate(scene, dt=20)
    assert found.ok
    assert "reduced" not in found.label
    assert cv.integrate(cv.scenes.brick_flip(), dt=0.01, t_end=0.1).label.endswith("/reduced")


MOMENT = np.array((0.3, -0.5, 1.2))


def _strength(t):
    return 1 + 0.5 * np.sin(2 * t)


def _energy(R, t):
    return _strength(t) * (R[2] @ MOMENT)


def _gradient(R, t):
    return _strength(t) * np.outer((0, 0, 1), MOMENT)


def _static_energy(R):
    return R[2] @ MOMENT


def _static_gradient(R):
    return np.outer((0, 0, 1), MOMENT)


FIELD = cv.FunctionPotential(_energy, _gradient, axis_W=(0, 0, 1), time_dependent=True)


def shaken(potential=FIELD, t_end=2.0):
    return cv.Scene("shaken", cv.RigidBody(INERTIA), R_WB0, RATES, t_end, potential)


def test_projected_and_scipy_follow_the_textbook():
    t = np.linspace(0, 2, 5)
    R, w = textbook(lambda t, R: _strength(t) * np.cross(R[2], MOMENT), t)
    found = cv.integrate(shaken(), 0.025, cv.Projected(), sample_every=20)
    assert angle_between(R, found.R_WB).max() < 1e-12  # measured 1.3e-14
    assert np.abs(w - found.w_WB_B).max() < 1e-12
    assert angle_between(R, cv.integrate(shaken(), 0.5, SciPy()).R_WB).max() < 1e-10  # measured 1.1e-12
    still = cv.integrate(shaken(cv.UniformGravity(1.0, MOMENT)), 0.025, cv.Projected())
    assert angle_between(R[-1], still.R_WB[-1]) > 0.01  # measured 0.3


def test_nothing_is_conserved_but_the_momentum_about_its_axis():
    found = cv.integrate(shaken(), 0.05, cv.Projected())
    (momentum,) = found.scene.invariants
    assert momentum.name == "momentum along the field's axis"
    assert np.abs(found.drift(momentum)).max() < 4e-15  # measured 1.0e-15
    assert np.ptp(found.energy) > 0.1
    by_hand = np.sum((found.w_WB_B @ INERTIA) * found.w_WB_B, axis=1) / 2
    by_hand += [_energy(R, t) for R, t in zip(found.R_WB, found.t, strict=True)]
    np.testing.assert_allclose(found.energy, by_hand, rtol=1e-14)


def test_without_an_axis_nothing_is_put_back():
    free_of_axis = shaken(cv.FunctionPotential(_energy, _gradient, time_dependent=True), 0.5)
    assert free_of_axis.invariants == ()
    found = cv.integrate(free_of_axis, 0.05, cv.Projected())
    assert found.counters.iterations == 0
    assert "drift" not in found._repr_html_()


def test_a_slow_motion_is_done_in_units_of_our_own():
    unit = 2.0**40
    slow = cv.FunctionPotential(
        lambda R, t: _energy(R, t / unit) / unit**2, lambda R, t: _gradient(R, t / unit) / unit**2, time_dependent=True
    )
    there = cv.Scene("slow", cv.RigidBody(INERTIA), R_WB0, RATES / unit, unit, slow)
    found, known = (cv.integrate(each, 0.05 * each.t_end, cv.Projected()) for each in (there, shaken(FIELD, 1.0)))
    assert angle_between(found.R_WB, known.R_WB).max() < 1e-13


@pytest.mark.parametrize(
    ("make", "argument", "hint"),
    [
        (lambda: cv.Orbit(0, (0, 0, 1)), "rate", "above 0"),
        (lambda: cv.Orbit(1, (0, 0, 0)), "normal_W", "not all 0"),
        (lambda: cv.Orbit(1, (0, 0, 1)).gravity_gradient(INERTIA, (1, 0, 1)), "direction_W", "at right angles"),
        (lambda: cv.Orbit(1, (0, 0, 1)).gravity_gradient(INERTIA, (0, 0, 1)), "direction_W", "at right angles"),
        (lambda: cv.Turning(FIELDS["satellite"][0], ORBIT), "potential", "does not depend on the time"),
        (lambda: cv.Turning(cv.UniformGravity, ORBIT), "potential", "does not depend on the time"),
        (lambda: cv.Turning(FIELD, cv.Orbit(1, (0, 0, 1))), "potential", "does not depend on the time"),
        (lambda: cv.Turning(cv.UniformGravity(1, POINT), 1.0), "orbit", "an Orbit"),
        (lambda: cv.FunctionPotential(_energy, _gradient), "gradient", ""),
        (lambda: cv.FunctionPotential(_static_energy, _gradient, time_dependent=True), "energy", ""),
        (lambda: cv.FunctionPotential(_energy, _static_gradient, time_dependent=True), "gradient", ""),
        (lambda: cv.FunctionPotential(_energy, lambda R, t: _gradient(R, 0.0), time_dependent=True), "gradient", ""),
        (lambda: cv.FunctionPotential(_energy, _gradient, axis_W=(1, 0, 0), time_dependent=True), "axis_W", ""),
        (lambda: cv.FunctionPotential(_energy, _gradient, time_dependent=1), "time_dependent", ""),
        (lambda: cv.scenes.stable_satellite(1.0, 0.2), "k1", ""),
        (lambda: cv.scenes.stable_satellite(0.2, -1.0), "k3", ""),
        (lambda: cv.scenes.stable_satellite(float("nan"), 0.2), "k1", ""),
    ],
)
def test_unusable_arguments_are_refused(make, argument, hint):
    with pytest.raises(cv.BadInput) as caught:
        make()
    assert caught.value.argument == argument
    assert hint in str(caught.value)


def test_a_value_without_a_time_is_refused():
    for function in (FIELD.energy, FIELD.gradient):
        with pytest.raises(cv.PotentialFailed, match="attitude and time"):
            function(R_WB0)
    defaulted = cv.FunctionPotential(lambda R, t=0.0: _energy(R, t), lambda R, t=0.0: _gradient(R, t), time_dependent=True)
    with pytest.raises(cv.PotentialFailed, match="attitude and time"):
        defaulted.energy(R_WB0)
    static = cv.FunctionPotential(_static_energy, _static_gradient)
    with pytest.raises(cv.PotentialFailed, match="attitude alone"):
        static.energy(R_WB0, 1.0)


RATE = satellites.RATE


def _libration(scene, amplitude, t):
    """Return attitudes (n, 3, 3) of the pendulum a'' = -W^2 sin a cos a from rest in turning axes, and its period, s."""
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


def _growth(k1, k3):
    """Return the largest growth by Hughes's polynomials, in units of the orbital rate."""
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
def test_small_disturbances_grow_as_the_linearised_equations_predict(case):
    k1, k3, stable = CASES[case]
    J1, J2, J3 = satellites.moments_of(k1, k3)
    assert pytest.approx(k1) == (J2 - J3) / J1
    assert pytest.approx(k3) == (J2 - J1) / J3
    growth = _growth(k1, k3)
    assert (growth < 1e-9) == stable
    scene = cv.scenes.stable_satellite(k1, k3, 1e-9, t_end=1.0)
    window = 8.0 if stable else 4.0 / growth
    found = cv.integrate(scene, 0.01 / RATE, cv.Projected(), t_end=3 * window / RATE)
    rest = scene.potential.orbit.R_WO(found.t) @ (scene.R_WB0 @ rotation_about(satellites.DISTURBED_ABOUT, -1e-9))
    away = angle_between(rest, found.R_WB)
    late, later = (away[(found.t * RATE > start) & (found.t * RATE <= start + window)].max() for start in (window, 2 * window))
    if stable:
        assert away.max() < 1e-8
    else:
        assert np.log(later / late) / window == pytest.approx(growth, rel=0.1)  # measured up to 5 %: oscillations


def test_the_registered_satellites_are_stable_and_unstable():
    stable, unstable = cv.scenes.stable_satellite(), cv.scenes.unstable_satellite()
    for scene, largest in ((stable, (0.0, 0.01)), (unstable, (0.5, np.pi))):
        found = cv.integrate(scene, scene.dt, cv.Projected())
        rest = scene.potential.orbit.R_WO(found.t) @ (scene.R_WB0 @ rotation_about(satellites.DISTURBED_ABOUT, -1e-3))
        assert largest[0] < angle_between(rest, found.R_WB).max() < largest[1]


def test_a_fixed_direction_is_another_motion():
    """Without the rotation of the field, the attitude of the tumbling satellite is off by 15.66 degrees after one orbit."""
    scene = cv.scenes.tumbling_satellite()
    still = scene.rename("still", potential=scene.potential.potential)
    ends = [cv.integrate(each, scene.dt, cv.Projected()).R_WB[-1] for each in (scene, still)]
    assert np.degrees(angle_between(*ends)) == pytest.approx(15.66, abs=0.01)
