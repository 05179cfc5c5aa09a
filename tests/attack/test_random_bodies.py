"""Runs of random bodies in all fields, with steps of any length and in any units.

The ratio of moments is up to 1e16 in diagonal tensors and up to 1e13 in others; some moments are equal or nearly so. A step
turns the body by 1e-4 to 100 rad. A run with the outcome ok is within its bounds. A run of a `TAME` body with `SHORT` steps
does not fail with `NotConserved`. Short runs of free bodies and tops agree with the closed form. Units that are powers of two
change only exponents, so attitudes are the same.
"""

import math
from dataclasses import replace
from random import Random

import numpy as np
import pytest
from hypothesis import assume, given, reject
from hypothesis import strategies as st

import conservative as cv
from conservative.attitude import angle_between, from_quaternion, orthonormality
from conservative.check import LARGEST
from conservative.errors import NotConserved
from conservative.grid import Grid
from conservative.invariants import kept_sizes, sizes
from conservative.methods.units import bound_rate
from conservative.references.environments.catalogue import MuJoCo, Pinocchio
from conservative.references.exact.method import Exact
from conservative.references.precise import Precise
from conservative.references.solvers.heyoka import Heyoka
from conservative.references.solvers.scipy import SciPy
from conservative.trajectory import LOOSEST, drift_limit

from ..bodies import impossible_body
from .effort import tries

pytestmark = pytest.mark.attack
OURS = [cv.Reduced(), cv.Reduced(4), cv.Gauss(2), cv.MoserVeselov(), cv.Lame(), cv.Projected(), cv.Convected(), cv.Substepped()]
SETTINGS = [
    *(cv.Reduced(8), cv.Reduced(4, frame="auto"), cv.Reduced(frame="auto"), cv.Gauss(1), cv.Gauss(6), cv.Gauss(4, "body")),
    *(cv.MoserVeselov(2), cv.MoserVeselov(6), cv.Convected(tol=1e-4), cv.Substepped("gauss:6")),
]
REFERENCES = [MuJoCo(), Pinocchio(), Heyoka(1e-9), SciPy(rtol=1e-8), Exact(), Precise(64)]
TAME, SHORT = 1e6, 3.0  # ratio of moments, and turn in a step, rad
SLACK, FLOOR = 10.0, 1e-9  # attitude error allowed: so many times turn^order (measured: below 2), and so many rad anyway
DECADES = math.log10(LARGEST) - 1

seeds = st.integers(0, 2**60)
methods = st.sampled_from(OURS + SETTINGS)


def run(method, scene, grid):
    try:
        return method.solve(scene, grid)
    except cv.BadInput:  # such as a step that is too long for the method
        reject()


def draw_scene(draw, decades, fields):
    """Return a random scene whose moments are up to so many decades apart."""
    body = draw_body(draw, decades)
    w = np.zeros(3) if draw.random() < 0.1 else 10 ** draw.uniform(-3, 3) * draw.normal(size=3)
    if draw.random() < 0.3:
        w = body.inverse @ w * float(body.moments.max())
    energy = (float(w @ body.inertia @ w) or float(body.moments.max())) * 10 ** draw.uniform(-3, 3)
    field = fields[draw.integers(len(fields))]
    return cv.Scene("drawn", body, draw_rotation(draw), w, 1.0, field and field(draw, body, energy))


def draw_body(draw, decades):
    """Return a body, diagonal or in other axes, of three different moments, two, nearly two, or one."""
    plain = draw.random() < 0.6
    moments = 10 ** -draw.uniform(0, min(decades, 16.0 if plain else 12.9) * draw.random(), size=3)
    kind = draw.random()
    if kind < 0.4:
        moments[1] = moments[0] * (1 + (10 ** draw.uniform(-16, -5) if kind < 0.15 else 0.0))
    elif kind < 0.5:
        moments[:] = moments[0]
    moments *= 10 ** draw.uniform(-5, 5) / moments.max()
    R = np.eye(3) if plain else draw_rotation(draw)
    tensor = R @ np.diag(moments) @ R.T
    return impossible_body(moments if plain else (tensor + tensor.T) / 2)


def draw_rotation(draw):
    q = draw.normal(size=4)
    return np.eye(3) if draw.random() < 0.2 else from_quaternion(q / np.linalg.norm(q))


def gravity(draw, body, energy):
    axis = body.symmetry_axis()
    lever = draw.normal(size=3) if axis is None or draw.random() < 0.3 else body.R_BP[:, axis]
    return cv.UniformGravity(energy * draw.choice((-1, 1)), lever)


def draw_points(draw):
    """Return a point of the body and one of the world that never meet."""
    b, a = draw.normal(size=3), draw.normal(size=3)
    ratio = 10 ** draw.uniform(0.1, 2) if draw.random() < 0.7 else 10 ** draw.uniform(-2, -0.1)
    return b, a * ratio * np.linalg.norm(b) / np.linalg.norm(a)


def spring(draw, body, energy):
    b, a = draw_points(draw)
    farthest = float(np.linalg.norm(a) + np.linalg.norm(b))
    rest = 0.0 if draw.random() < 0.4 else farthest * 10 ** draw.uniform(-2, 2)
    return cv.LinearSpring(energy / farthest**2, b, a, rest)


def attraction(draw, body, energy):
    b, a = draw_points(draw)
    return cv.PointAttraction(energy * draw.choice((-1, 1)) * math.hypot(*a, *b), b, a)


def gradient(draw, body, energy):
    return cv.GravityGradient(math.sqrt(energy / body.moments.max() / 3), body.inertia, draw.normal(size=3))


def check_conservation(found, method, grid, turn):
    """Compare a run with its bounds by the definitions instead of the compiled check."""
    scene, bounds = found.scene, method.bounds(found.scene, grid)
    if not found.ok:
        loose = getattr(method, "tol", 0.0) * grid.n_steps > LOOSEST / 10  # allows more than is ever called ok
        tame = turn <= SHORT and scene.body.condition <= TAME and not loose
        assert not (tame and isinstance(found.failure, NotConserved)), f"false alarm: {found.failure}"
        return
    assert orthonormality(found.R_WB).max() <= min(LOOSEST, bounds.orthonormality)
    limit = min(LOOSEST, drift_limit(scene, bounds))
    for invariant, size in kept_sizes(scene, method.conserves).items():
        assert (sizes(found.drift(invariant)) * (invariant.scale / size)).max() <= limit, invariant.name


@tries(1500)
@given(seeds, methods)
def test_a_run_with_the_outcome_ok_is_within_its_bounds(seed, method):
    draw = np.random.default_rng(seed)
    scene, turn = draw_scene(draw, 16.0, (None, gravity, gravity, spring, attraction, gradient)), 10 ** draw.uniform(-4, 2)
    assume(method.unsupported(scene) is None)
    # The rate at the start, or the rate that the field gives the axis of largest moment, rad/s.
    made = 0.0 if scene.potential is None else math.sqrt(scene.potential.scale() / float(scene.body.moments.max()))
    grid = Grid(turn / (max(float(np.linalg.norm(scene.w_WB_B0)), made) or 1.0), int(10 ** draw.uniform(0, 2.3)))
    check_conservation(run(method, scene, grid), method, grid, turn)


def check_attitudes(found, true, allowed):
    if found.ok and true.ok:
        assert angle_between(true.R_WB, found.R_WB).max() <= allowed


@tries(300)
@given(seeds, methods)
def test_a_short_run_is_the_motion(seed, method):
    draw = np.random.default_rng(seed)
    scene, turn = draw_scene(draw, 1.0, (None, gravity)), 10 ** draw.uniform(-2.5, -0.7)
    assume(method.unsupported(scene) is None and Exact().unsupported(scene) is None)
    grid = Grid(turn / bound_rate(scene), int(draw.integers(1, 40)))
    power = 0.0 if method.order is None else turn**method.order
    check_attitudes(run(method, scene, grid), Exact().solve(scene, grid), SLACK * power + FLOOR)


def scene_in_units(seed, time, inertia):
    """Return a random scene in units of time, s, and of inertia, kg m^2."""
    rng = Random(seed)
    moments = np.array([rng.uniform(0.7, 1.3) for _ in range(3)])
    if rng.random() < 0.4:
        moments[1] = moments[0]
    rates, moment = np.array([rng.gauss(0, 1) for _ in range(3)]), rng.uniform(0.1, 3)
    field = cv.UniformGravity(moment * inertia / time**2, (0, 0, 1.0)) if rng.random() < 0.5 else None
    return cv.Scene("drawn", cv.RigidBody(moments * inertia), np.eye(3), rates / time, 0.5 * time, field)


@tries(300)
@given(seeds, st.sampled_from(OURS + REFERENCES), st.integers(-24, 24), st.integers(-45, 45))
def test_units_change_nothing(seed, method, time, inertia):
    scenes = scene_in_units(seed, 1.0, 1.0), scene_in_units(seed, 2.0**time, 2.0**inertia)
    assume(method.unsupported(scenes[0]) is None)
    plain, scaled = (run(method, scene, Grid(scene.t_end / 10, 10)) for scene in scenes)
    check_attitudes(scaled, plain, 1e-5)


sizes_of_numbers = st.floats(-DECADES, DECADES).map(lambda decades: 10.0**decades)


@pytest.mark.filterwarnings("ignore::conservative.RotationNotResolved")
@tries(500)
@given(st.lists(sizes_of_numbers, min_size=8, max_size=8), st.sampled_from(OURS), st.booleans(), st.booleans())
def test_extreme_numbers_are_refused_or_integrated(numbers, method, round_body, heavy):
    moments, rates, (t_end, weight) = [numbers[0]] * 3 if round_body else numbers[:3], numbers[3:6], numbers[6:]
    field = cv.UniformGravity(weight, (0, 0, 1)) if heavy else None
    try:
        scene = cv.Scene("extreme", impossible_body(moments), np.eye(3), rates, t_end, field)
        found = cv.integrate(scene, t_end / 10, method, on_failure="return")
    except cv.BadInput:
        return
    if found.ok:
        assert orthonormality(found.R_WB).max() <= 1e-6
        assert np.isfinite(found.w_WB_B).all()


BRICK = cv.integrate(cv.scenes.brick_flip(), 0.01, t_end=0.1)
TURNED = replace(BRICK, R_WB=np.roll(BRICK.R_WB, 1, axis=0))


@pytest.mark.parametrize(
    "found",
    [
        replace(BRICK, w_WB_B=(1 + 1e-12) * BRICK.w_WB_B),
        replace(BRICK, R_WB=(1 + 1e-12) * BRICK.R_WB),
        replace(BRICK, failure=NotConserved(0.1, "energy", 1.0, 0.1)),
    ],
    ids=["energy", "orthonormality", "false alarm"],
)
def test_a_fault_is_found(found):
    with pytest.raises(AssertionError):
        check_conservation(found, cv.Reduced(), Grid(0.01, 10), 0.1)


def test_another_motion_is_found():
    check_attitudes(BRICK, BRICK, 1e-9)
    with pytest.raises(AssertionError):
        check_attitudes(TURNED, BRICK, 1e-3)
    check_conservation(replace(BRICK, failure=NotConserved(0.1, "energy", 1.0, 0.1)), cv.Reduced(), Grid(0.01, 10), turn=30.0)
