"""Figures that others have printed, measured again; sources and results: benchmarks/published.md.

A row of tests/data/published_figures.csv has the body and its start (`motion`, one of `MOTIONS`), what is run (`method`, or
`truth` for a figure of the motion itself), its step `dt` in seconds, what is measured (`quantity`, a function of this file),
and the numbers that were printed and that we measured (none if our adapters cannot). `note` has the reason of a difference.
`difference`, `allowed`, `result` and `digit` follow from both numbers by the rule of `compare`.
"""

import csv
from decimal import Decimal
from functools import lru_cache
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import conservative as cv
from conservative import registry
from conservative.attitude import angle_between, from_quaternion, rotation_about, to_quaternion
from conservative.grid import Grid, grid_for
from conservative.references.truth import reference
from conservative.shapes import MassDistribution

from ..bodies import impossible_body
from ..environments import ROOT

with (ROOT / "tests" / "data" / "published_figures.csv").open(encoding="utf-8", newline="") as stream:
    FIGURES = [SimpleNamespace(**row) for row in csv.DictReader(stream)]
LATE = 10
"""Programs that print all digits of a double print their round-off too: only figures that differ before have a reason."""
FLOOR = 1e-11
"""Relative round-off of a measured number, on another machine."""
START = np.eye(3)
HEAVY_TOP = cv.RigidBody((15.234375, 0.46875, 15.234375)), cv.UniformGravity(147.15, (0, 1, 0)), (0, 150, -4.61538)
MUJOCO_BOX = (0.13 / 3, 0.1 / 3, 0.05 / 3)  # half sides 0.1, 0.2, 0.3 m, mass 1 kg
# The third world axis against the angular momentum h, the second along (0.1 h_2, -0.1 h_1, 0) in body axes.
SPACECRAFT_TURNED = [
    [-0.5949911016440638, 0.19039715252610037, 0.7808549886338284],
    [0.3047757271037837, 0.9524241471993241, 0.0],
    [-0.743705146635912, 0.23798564692349183, -0.624712323174166],
]


def free(moments, rates, t_end, start=START):
    return cv.Scene("published", cv.RigidBody(moments), start, rates, t_end)


def heavy_top(t_end):
    body, gravity, rates = HEAVY_TOP
    return cv.Scene("published", body, START, rates, t_end, gravity)


MOTIONS = {
    "brick": free((13, 5, 10), (0, 0.05, 10), 6),
    "cone": cv.scenes.lagrange_top(),
    "hairer": free((0.6, 0.8, 1), (3, 0.5, -0.9), 10),
    "simo": cv.Scene(
        "published", cv.RigidBody((5, 5, 1)), rotation_about((1, 0, 0), 0.05), (0, 0, 50), 10, cv.UniformGravity(20, (0, 0, 1))
    ),
    "heavy-top": heavy_top(2),
    "heavy-top-10-ms": heavy_top(0.01),
    "heavy-top-200-ms": heavy_top(0.2),
    "spacecraft": free((500, 200, 300), (0.5, -0.4, 0.7), 10),
    "spacecraft-turned": free((500, 200, 300), (0.5, -0.4, 0.7), 10, SPACECRAFT_TURNED),
    "gazebo-box": free((0.80833333, 0.68333333, 0.14166667), (0.1, 5, 0.1), 10),
    "mujoco-box": free(MUJOCO_BOX, (1, 2, 3), 5),
    "mujoco-box-1-s": free(MUJOCO_BOX, (1, 2, 3), 1),
    "mujoco-box-middle": free(MUJOCO_BOX, (0.05, 5, 0.05), 100),
    "mujoco-box-fast": free(MUJOCO_BOX, (20, 0.05, 0.05), 100),
    "drake-cylinder": free((0.04, 0.04, 0.02), (1, 1, 1), 5),
    "drake-benchmark": free((0.04, 0.04, 0.02), (2, 4, 6), 10),
    "newton-body": free((0.2, 0.5, 0.4), (0.7, -0.5, 0.9), 0.2),
    "jsbsim-top": free((10, 20, 26), (1, 15, 1), 10),
    "jsbsim-start": free((10, 20, 26), (1, 15, 1), 0.1),  # before the first-order methods have lost the motion
}

# The circular orbit of RUN_10A at the semi-major axis of its initial state, and the long axis 5 and 1 degrees off the vertical.
RATE = 0.0011362601963379464  # rad/s
OFF = rotation_about((0, 0, 1), np.radians(5)) @ rotation_about((0, 1, 0), np.radians(1))
CYLINDER = np.diag((500.0, 12250.0, 12250.0))
EARTH = 7.292115e-5  # rotation, rad/s
BRICK = (0.00189422, 0.006211019, 0.007194665)  # slug ft^2


@lru_cache(maxsize=1)
def fall():
    """Return the fall of check case 3 without drag: position and velocity, SI, in the equator's plane, as a function of time.

    It starts at rest relative to the rotating Earth at 30,000 ft, in gravity with J2.
    """
    gravity, radius, flattening = 3.986004418e14, 6378137.0, 1.5 * 1.08262668355e-3

    def slope(_, y):
        r = np.hypot(*y[:2])
        return [*y[2:], *(-gravity / r**3 * (1 + flattening * (radius / r) ** 2) * y[:2])]

    start = [radius + 30000 * 0.3048, 0, 0, EARTH * (radius + 30000 * 0.3048)]
    return solve_ivp(slope, (0, 30), start, method="DOP853", rtol=1e-13, atol=1e-9, dense_output=True).sol


def air(t):
    """Return density times airspeed, slug/(ft^2 s), with the density of the US standard atmosphere of 1976 below 11 km."""
    x, y, u, v = fall()(t)
    h = 6356766 / (1 + 6356766 / (np.hypot(x, y) - 6378137))  # geopotential altitude, m
    temperature = 288.15 - 0.0065 * h
    density = 101325 * (temperature / 288.15) ** (9.80665 / (287.05287 * 0.0065)) / (287.05287 * temperature)
    return density * np.hypot(u + EARTH * y, v - EARTH * x) * 0.3048**2 / 14.593902937206364


def damped_brick(t_end):
    """Return the brick of check case 3: the moments have coefficients -1 times rate, length and half of 1/V, in ft and slug."""
    area, lengths = 2 / 9, np.array((1, 2, 1)) / 3
    damping = cv.Damping(area / 4 * np.diag(lengths**2), air)
    return cv.Scene("published", cv.RigidBody(BRICK), START, np.radians((10, 20, 30)), t_end, damping=damping)


def station(rates):
    """Return the space station of RUN_9A and RUN_9B, whose attitude in the file takes inertial to body components."""
    inertia = [[1.02e8, -6.96e6, -5.48e6], [-6.96e6, 0.91e8, 5.90e5], [-5.48e6, 5.90e5, 1.64e8]]
    turn = from_quaternion((0.2368106365237557, 0.7173117043670278, -0.6140880728910785, 0.2286492509067215)).T
    torque = cv.Torque(lambda t: (10.0 * (1000 <= t < 2000), 0, 0), breaks=(1000, 2000))
    return cv.Scene("published", cv.RigidBody(inertia), turn, rates, 28800, torque=torque)


# y' = (y2 y3, -y1 y3, -0.51 y1 y2) in units SCALE of the rates of a body with these moments.
KROGH, SCALE = (2.0, 3.0, 1.0), np.sqrt((1.53, 0.51, 3.0))
BOX = MassDistribution(10, (0, 0, 0), (0.80833333, 0.68333333, 0.14166667))
MOTIONS |= {
    "gazebo-flight": cv.Scene("published", BOX, START, (0.1, 5, 0.1), 10, BOX.gravity(9.8), v_WB0=(-2, 2, 8)),
    "eulr": cv.Scene(
        "published",
        impossible_body((0.5, 2, 3)),
        START,
        (1, 0, 0.9),
        20,
        torque=cv.Torque(
            lambda t: (0, 0, np.sin(t) ** 2 / 4 if 3 * np.pi <= t <= 4 * np.pi else 0), breaks=(3 * np.pi, 4 * np.pi)
        ),
    ),
    "nesc-brick": free(BRICK, np.radians((10, 20, 30)), 30),
    "nesc-damped": damped_brick(30),
    "nesc-damped-5-s": damped_brick(5),
    "jeod-station": station((0, 0, 0)),
    "jeod-station-turning": station((0, -0.001134454274550824, 0)),
    "jeod-cylinder": cv.Scene(
        "published",
        cv.RigidBody(CYLINDER),
        OFF,
        OFF.T @ (0, 0, RATE),
        28800,
        cv.Orbit(RATE, (0, 0, 1)).gravity_gradient(CYLINDER, (1, 0, 0)),
    ),
    "krogh": free(KROGH, SCALE * (0, 1, 1), 20),
    "krogh-12": free(KROGH, SCALE * (0, 1, 1), 12),
    "solfec-pendulum": cv.Scene(
        "published",
        cv.RigidBody((1, 1, 1)),
        rotation_about((0, 1, 0), np.pi / 2),
        (0, 0, 0),
        26,
        cv.UniformGravity(np.pi**2, (0, 0, -1)),
    ),
    "poinsot-symmetric": free((1, 1.1, 1), (0.5, 10, 0), 20),
    "poinsot-flip": free((0.3, 0.35, 0.4), (0.1, 15, 0.1), 60),
    "tiny-body": cv.scenes.tiny_body(),
}

# Examples 0 to 4 of Algorithm 903: moments, momentum in body axes and, column by column, attitude.
FRB_EXACT, FRB = (1, 1.648785782711929, 1.9720127096641928), (1, 1.0126869887825154, 3.306237422473038)
FRB_START = np.array(
    [
        [-0.139359936806125, -0.414251479478192, -0.899430108326112],
        [-0.726901415681411, -0.574008408466476, 0.376999574124619],
        [-0.672453076350874, 0.706335655874678, -0.221126211350745],
    ]
).T
FRB_FIELD = np.array((9.5586303547238536e-05, 4.8777318247201465e-04, -8.6772148817192390e-04))  # N m, in its world axes
FRB_SIZE = np.linalg.norm(FRB_FIELD)
FRB_TURN = rotation_about(np.cross(FRB_FIELD, (0, 0, 1)), np.arccos(FRB_FIELD[2] / FRB_SIZE))  # its axes to ours, field upwards


def with_momentum(moments, momentum, t_end, start=START, potential=None):
    return cv.Scene("published", impossible_body(moments), start, np.divide(momentum, moments), t_end, potential)


FRB_MOMENTUM = (-0.709894965287627, -0.685144717153487, 0.163174308075589)
MOTIONS |= {
    "frb-0": with_momentum(FRB_EXACT, FRB_MOMENTUM, 0.1, FRB_START),
    "frb-1": with_momentum(
        FRB,
        (-0.34790957088547336, -0.19822914599675923, -0.91633189192763642),
        5000,
        FRB_TURN,
        cv.UniformGravity(FRB_SIZE, (0, 0, 1)),
    ),
    "frb-2": with_momentum(FRB_EXACT, FRB_MOMENTUM, 0.1),
    "frb-3": with_momentum(FRB, (-0.609860759302936, 0.761660947972381, 0.218957654801698), 10),
    "frb-4": with_momentum(FRB, (-0.544332842491675, 0.729131780907662, -0.414811526666455), 10),
    "spiers": with_momentum((1, 1 / 1.4, 1 / 2), (0.6, -0.4, 0.7), 1),
}


def solve(motion, method, grid):
    """Return the trajectory by a method, or by the truth."""
    if method == "truth":
        return reference(MOTIONS[motion], grid).trajectory
    trajectory = registry.method(method).solve(MOTIONS[motion], grid)
    assert trajectory.ok, trajectory.failure
    return trajectory


@lru_cache(maxsize=2)
def _every_step(motion, method, dt):
    return solve(motion, method, grid_for(MOTIONS[motion], dt))


def every_step(figure, method=None):
    return _every_step(figure.motion, method or figure.method, float(figure.dt))


@lru_cache(maxsize=100)
def _end(motion, method, dt):
    return solve(motion, method, grid_for(MOTIONS[motion], dt, sample_every=2**50))


def end(figure, method=None, part=1):
    """Return the start and the end of the run, with a part of its step."""
    return _end(figure.motion, method or figure.method, float(figure.dt) / part)


def true_end(figure, part=1):
    return end(figure, "truth", part)


def spin(figure):  # the second world component of the angular velocity, rad/s
    return world_rates(end(figure))[1]


def world_rates(trajectory):
    return trajectory.R_WB[-1] @ trajectory.w_WB_B[-1]


def quaternion(figure):
    q = to_quaternion(end(figure).R_WB[-1])
    return q * np.sign(q[0])


def quaternion_to_body(figure):  # of the transformation of components from world to body
    q = to_quaternion(every_step(figure).R_WB[-1].T)
    return q * np.sign(q[0])


def modified_rodrigues(figure):
    q = quaternion(figure)
    return q[1:] / (1 + q[0])


def displacement(figure):  # of the centre of mass, m, world axes
    return np.diff(end(figure).R_WB @ MOTIONS[figure.motion].potential.com_B, axis=0)[0]


def turn_of_a_step(figure):  # degrees
    R = solve(figure.motion, figure.method, Grid(float(figure.dt), 1)).R_WB
    return np.degrees(angle_between(R[1], R[0]))


def energy(figure):
    return end(figure).energy[-1]


def energy_ratio(figure):
    return end(figure).energy[-1] / end(figure).energy[0]


def largest_energy_ratio(figure):
    E = every_step(figure).energy
    return E.max() / E[0]


def energy_drift(figure):
    return drift(every_step(figure).energy)


def momentum_length_drift(figure):
    return drift(np.linalg.norm(every_step(figure).momentum_W, axis=1))


def vertical_momentum_drift(figure):
    return drift(every_step(figure).momentum_W[:, 2])


def drift(values):
    return np.abs(values / values[0] - 1).max()


def momentum_drift(figure):
    L = every_step(figure).momentum_W
    return np.linalg.norm(L - L[0], axis=1).max() / np.linalg.norm(L[0])


def momentum_change(figure):  # kg m^2/s
    return np.linalg.norm(np.diff(end(figure).momentum_W, axis=0))


def relative_momentum_change(figure):
    return momentum_change(figure) / np.linalg.norm(end(figure).momentum_W[0])


def element_error(figure):
    return np.abs(end(figure).R_WB[-1] - true_end(figure).R_WB[-1]).max()


def world_rate_error(figure):
    return np.abs(world_rates(end(figure)) - world_rates(true_end(figure))).max()


def attitude_error(figure):
    return angle_between(every_step(figure).R_WB, every_step(figure, "truth").R_WB).max()


def order_of_attitude(figure):
    errors = [angle_between(end(figure, part=k).R_WB[-1], true_end(figure, k).R_WB[-1]).item() for k in (1, 2)]
    return np.log2(errors[0] / errors[1])


def rates_error(figure, method=None, part=1):
    return np.linalg.norm(end(figure, method, part).w_WB_B[-1] - true_end(figure, part).w_WB_B[-1])


def order_of_rates(figure):
    return np.log2(rates_error(figure) / rates_error(figure, part=2))


def rates_error_over_that_of_euler(figure):
    return rates_error(figure) / rates_error(figure, "jsbsim:RectEuler")


def halving_ratio(figure):  # of the quaternion's error against a step 16 times shorter, as MuJoCo's test has it
    coarse, fine, best = (to_quaternion(end(figure, part=k).R_WB[-1]) for k in (1, 2, 16))
    return np.divide(*(min(np.linalg.norm(q - best), np.linalg.norm(q + best)) for q in (coarse, fine)))


def position_ratio(figure):  # of the centre of mass's error
    com = MOTIONS[figure.motion].potential.com_B
    return np.divide(*(np.linalg.norm((end(figure, part=k).R_WB[-1] - true_end(figure, k).R_WB[-1]) @ com) for k in (1, 2)))


def flight_energy_error(figure):  # relative to the initial energy
    trajectory = every_step(figure)
    total = next(invariant for invariant in trajectory.scene.invariants if invariant.name == "total energy")
    start = trajectory.scene.initial_value(total)
    return np.abs(trajectory.drift(total)).max() * total.scale / start


def flight_position_error(figure):  # of the centre of mass, m
    trajectory = every_step(figure)
    flight = trajectory.scene.flight
    c, _ = flight.centre(trajectory.R_WB, trajectory.w_WB_B, *trajectory.place)
    return np.linalg.norm(c - flight.fall(trajectory.scene, trajectory.t)[0], axis=1).max()


def rates(figure):
    return every_step(figure).w_WB_B[-1]


def third_rate_in_degrees(figure):
    return np.degrees(rates(figure)[2])


def rates_in_degrees(figure):
    return np.degrees(end(figure).w_WB_B[-1])


def rates_error_at_every_sample(figure):
    return np.abs(every_step(figure).w_WB_B - every_step(figure, "truth").w_WB_B).max()


def euler_angles_in_north_east_down(figure):  # yaw, pitch, roll; the axes turn about the first one as the body moves east
    x, y, *_ = fall()(end(figure).t[-1])
    R = rotation_about((1, 0, 0), -np.arctan2(y, x)) @ end(figure).R_WB[-1]
    return np.degrees((np.arctan2(R[1, 0], R[0, 0]), -np.arcsin(R[2, 0]), np.arctan2(R[2, 1], R[2, 2])))


def libration(figure):  # of the first body axis in the orbit's plane and out of it, rad
    trajectory = every_step(figure)
    (x, y, z), turn = trajectory.R_WB[:, :, 0].T, RATE * trajectory.t
    return trajectory.t, np.arctan2(y * np.cos(turn) - x * np.sin(turn), x * np.cos(turn) + y * np.sin(turn)), np.arcsin(z)


def in_plane_period(figure):
    return period(*libration(figure)[:2])


def out_of_plane_period(figure):
    return period(*libration(figure)[::2])


def in_plane_amplitude(figure):
    return np.degrees(np.abs(libration(figure)[1]).max())


def out_of_plane_amplitude(figure):
    return np.degrees(np.abs(libration(figure)[2]).max())


def period(t, x):  # mean over the run
    i = np.flatnonzero((x[:-1] < 0) & (x[1:] >= 0))
    times = t[i] - x[i] * (t[i + 1] - t[i]) / (x[i + 1] - x[i])
    return np.diff(times).mean()


def krogh_state(figure):
    return end(figure).w_WB_B[-1] / SCALE


def period_of_the_first_rate(figure):
    return period(every_step(figure).t, every_step(figure).w_WB_B[:, 0])


def periods_of_the_first_rate(figure):
    return every_step(figure).t[-1] / period_of_the_first_rate(SimpleNamespace(**vars(figure) | {"motion": "krogh"}))


def period_of_the_second_rate(figure):
    return period(every_step(figure).t, every_step(figure).w_WB_B[:, 1])


def swing(figure):
    return period(every_step(figure).t, every_step(figure).w_WB_B[:, 1])


def ten_swings(figure):
    return 10 * swing(figure)


def energy_above_rest(figure):
    return energy(figure) + MOTIONS[figure.motion].potential.scale()


def turn(figure):
    return angle_between(*end(figure).R_WB)


def body_momentum(figure):
    return MOTIONS[figure.motion].body.inertia @ end(figure).w_WB_B[-1]


def attitude_column_by_column(figure):
    return end(figure).R_WB[-1].T.ravel()


def attitude_in_the_axes_of_the_field(figure):
    return (FRB_TURN.T @ end(figure).R_WB[-1]).T.ravel()


def quaternion_with_the_printed_sign(figure):
    q = to_quaternion(end(figure).R_WB[-1])
    return q * np.sign(q[0] * float(figure.printed.split()[0]))


def order_of_the_energy_error_of_a_step(figure):
    errors = [np.diff(solve(figure.motion, figure.method, Grid(float(figure.dt) / part, 1)).energy).item() for part in (1, 2)]
    return np.log2(errors[0] / errors[1])


class Comparison(NamedTuple):
    """Whether a figure agrees, the largest difference with the unit of its number, and the first digit that differs.

    If numbers differ, the largest is that of these. Difference and unit are None for bounds, the digit also if all agree.
    """

    agrees: bool
    difference: Decimal | None = None
    unit: Decimal | None = None
    digit: int | None = None


def compare_numbers(relation, printed, measured):
    """Compare measured numbers with printed ones, both decimals with spaces between them.

    A bound has to hold. Any other number may differ from the printed one by a unit of the last printed digit, because programs
    round digits or cut them off. That is the only tolerance.
    """
    pairs = [tuple(map(Decimal, pair)) for pair in zip(printed.split(), measured.split(), strict=True)]
    if relation != "=":
        return Comparison(all(each < bound if relation == "<" else each > bound for bound, each in pairs))
    units = [Decimal(1).scaleb(int(number.as_tuple().exponent)) for number, _ in pairs]
    differences = [abs(each - number) for number, each in pairs]
    _, difference, unit = max((d > u, d, u) for d, u in zip(differences, units, strict=True))
    digits = [n.adjusted() - d.adjusted() + 1 for (n, _), d, u in zip(pairs, differences, units, strict=True) if d > u]
    return Comparison(not digits, difference, unit, max(1, min(digits)) if digits else None)


def compare(figure, measured=None):
    return compare_numbers(figure.relation, figure.printed, measured or figure.measured)


def is_repeated(stored, measured):
    """Return whether a number rounds to the stored one, or differs by round-off."""
    value = Decimal(stored)
    unit = Decimal(1).scaleb(int(value.as_tuple().exponent))
    return abs(Decimal(repr(float(measured))) - value) <= max(unit, Decimal(FLOOR) * abs(value))


def cases():
    """Return a parameter for each figure that can be measured. Figures of engines in environments are marked."""
    inside = registry.list_engines()
    for figure in FIGURES:
        family, _, version = figure.method.partition(":")[0].partition("@")
        engine = f"{family}@{version}" if version else family
        marks = [pytest.mark.engine(engine)] if version or family in inside else []
        if figure.measured:
            yield pytest.param(figure, id=f"{figure.source}-{figure.name}", marks=marks)


@pytest.mark.slow
@pytest.mark.parametrize("figure", list(cases()))
def test_a_published_figure(figure):
    measured = np.atleast_1d(globals()[figure.quantity](figure)).tolist()
    assert compare(figure, " ".join(map(repr, measured))).agrees == compare(figure).agrees, measured
    if figure.relation == "=":
        assert all(map(is_repeated, figure.measured.split(), measured)), measured


@pytest.mark.parametrize(
    ("relation", "printed", "measured", "agrees", "digit"),
    [
        ("=", "0.6", "0.5", True, None),  # a unit of the last digit
        ("=", "0.60", "0.5", False, 1),
        ("=", "0.60", "0.5899", False, 2),
        ("=", "-1.20e3", "-1190", True, None),
        ("=", "-1.20e3", "1200", False, 1),
        ("=", "1.2345 0.50", "1.2347 0.50", False, 5),  # each number has the unit of its own last digit
        ("=", "1.2345 0.50", "1.2346 0.51", True, None),
        ("=", "1.0000", "1.0000", True, None),
        ("=", "0", "3.05", False, 1),
        ("<", "0.5", "0.5", False, None),
        ("<", "0.51", "0.5", True, None),
        (">", "0.51", "0.5", False, None),
        ("<", "1 1", "0.5 2", False, None),
    ],
)
def test_the_comparison_with_printed_numbers(relation, printed, measured, agrees, digit):
    found = compare_numbers(relation, printed, measured)
    assert (found.agrees, found.digit) == (agrees, digit)
    assert (found.difference is None) == (relation != "=")


def test_a_number_that_is_missing_is_not_compared():
    with pytest.raises(ValueError, match="shorter"):
        compare_numbers("=", "1 2", "1")


@pytest.mark.parametrize(("measured", "repeated"), [(0.33, True), (0.341, False), (0.319, False)])
def test_a_measured_number_is_repeated_to_its_last_digit(measured, repeated):
    assert is_repeated("0.33", measured) == repeated


def test_a_difference_that_other_round_off_cannot_explain_has_a_reason():
    missing = [figure for figure in FIGURES if not figure.note and (not figure.measured or not late_or_none(compare(figure)))]
    assert not [figure.name for figure in missing]


def late_or_none(each):
    return each.agrees or (each.digit is not None and each.digit >= LATE)


@pytest.mark.parametrize("figure", FIGURES, ids=lambda figure: f"{figure.source}-{figure.name}")
def test_the_stored_result_follows_from_the_numbers(figure):
    stored = figure.result, figure.digit, figure.difference, figure.allowed
    if not figure.measured:
        assert stored == ("not measured", "", "", "")
        return
    found = compare(figure)
    sizes = ("", "") if found.unit is None else (f"{found.difference:.2g}", f"{found.unit:g}")
    assert stored == ("agrees" if found.agrees else "differs", str(found.digit or ""), *sizes)
