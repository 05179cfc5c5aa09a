"""Figures that others have printed, measured again; sources and results: benchmarks/published.md.

A row of tests/data/published_figures.csv has the body and its start (`motion`, one of `MOTIONS`), what is run (`method`, or
`truth` for a figure of the motion itself), its step `dt` in seconds, what is measured (`quantity`, a function of this file) and
the printed numbers. A measured number agrees with a printed one if they differ by at most a unit of the last printed digit,
because programs round digits or cut them off, or by at most `tolerance`. A known difference is expected; `note` has its reason.
"""

import csv
import re
from collections import Counter
from decimal import Decimal
from functools import lru_cache
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import conservative as cv
from conservative import registry
from conservative.attitude import angle_between, from_quaternion, rotation_about, to_quaternion
from conservative.grid import Grid, grid_for
from conservative.references.truth import reference
from conservative.shapes import MassDistribution

from ..environments import ROOT

with (ROOT / "tests" / "data" / "published_figures.csv").open(encoding="utf-8", newline="") as stream:
    FIGURES = [SimpleNamespace(**row) for row in csv.DictReader(stream)]
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
        cv.RigidBody((0.5, 2, 3)),
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
    total = next(each for each in trajectory.scene.invariants if each.name == "total energy")
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


def euler_angles_in_north_east_down(figure):  # yaw, pitch, roll; the axes turn about the first one with the Earth
    R = rotation_about((1, 0, 0), -EARTH * end(figure).t[-1]) @ end(figure).R_WB[-1]
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


def agrees(figure, measured):
    printed = np.array([float(text) for text in figure.printed.split()])
    if figure.relation == "<":
        return (measured < printed).all()
    if figure.relation == ">":
        return (measured > printed).all()
    digit = max(10.0 ** Decimal(text).as_tuple().exponent for text in figure.printed.split())
    return np.abs(measured - printed).max() <= float(figure.tolerance or digit)


def cases():
    """Return a parameter for each figure that can be measured. Figures of engines in environments are marked."""
    inside = registry.list_engines()
    for figure in FIGURES:
        family, _, version = figure.method.partition(":")[0].partition("@")
        engine = f"{family}@{version}" if version else family
        marks = [pytest.mark.engine(engine)] if version or family in inside else []
        if figure.expected != "not measured":
            yield pytest.param(figure, id=f"{figure.source}-{figure.name}", marks=marks)


@pytest.mark.slow
@pytest.mark.parametrize("figure", list(cases()))
def test_a_published_figure(figure):
    measured = np.atleast_1d(globals()[figure.quantity](figure))
    assert agrees(figure, measured) == (figure.expected == "agrees"), measured


@pytest.mark.parametrize(
    ("relation", "printed", "tolerance", "expected"),
    [
        ("=", "0.6", "", True),  # a unit of the last digit
        ("=", "0.60", "", False),
        ("=", "0.60", "0.2", True),
        ("=", "0.50 0.52", "", False),
        ("=", "5e-1", "", True),
        ("<", "0.5", "", False),
        ("<", "0.51", "", True),
        (">", "0.51", "", False),
    ],
)
def test_the_comparison_of_a_half_with_printed_numbers(relation, printed, tolerance, expected):
    figure = SimpleNamespace(relation=relation, printed=printed, tolerance=tolerance)
    assert agrees(figure, np.array([0.5])) == expected


def test_every_figure_is_on_the_page():
    lines = (ROOT / "benchmarks" / "published.md").read_text(encoding="utf-8").replace("\\", "").splitlines()
    found = Counter(figure.expected for figure in FIGURES)
    counts = [len(FIGURES), found["agrees"], found["differs"], found["not measured"]]
    assert [int(number) for number in re.findall(r"\d+", " ".join(lines[2:4]))] == counts
    for figure in FIGURES:
        parts = figure.name, figure.printed.split()[0], figure.expected
        assert any(all(part in line for part in parts) for line in lines), figure.name
        assert figure.expected == "agrees" or figure.note, figure.name
