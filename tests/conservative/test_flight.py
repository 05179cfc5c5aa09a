"""Free flight: the truth against Newton-Euler equations at the frame's origin, invariants, transforms, bad input, files."""

from dataclasses import replace

import heyoka as hy
import numpy as np
import pytest

import conservative as cv
from conservative import registry
from conservative.attitude import angle_between, rotation_about, to_quaternion
from conservative.benchmarks.measures.errors import measure_errors
from conservative.benchmarks.measures.measure import Measure
from conservative.grid import Grid
from conservative.invariants import sizes
from conservative.scene_files.scene_file import load
from conservative.scenes.transforms import in_body_frame, slow_motion
from conservative.shapes import MassDistribution


def random_flight(random, t_end=2.0):
    axes = rotation_about(random.normal(size=3), random.uniform(0, 3))
    x, y, z = random.uniform(0.05, 1, 3)  # second moments, of any body
    inertia = axes @ np.diag((y + z, z + x, x + y)) @ axes.T
    body = MassDistribution(random.uniform(0.3, 5), random.normal(size=3) / 3, inertia)
    start = {"p_WB0": random.normal(size=3), "v_WB0": 2 * random.normal(size=3)}
    attitude = rotation_about(random.normal(size=3), random.uniform(0, 3))
    gravity = body.gravity(random.uniform(0, 10)) if random.uniform() < 0.7 else None
    return body, cv.Scene("random", body, attitude, 2 * random.normal(size=3), t_end, gravity, **start)


def spatial_equations():
    """Return an integrator of Newton-Euler equations at the frame's origin: q, w, p, v_B; parameters mass, com, J_origin, g.

    Neither the centre of mass nor the inertia about it occurs: the spatial inertia is inverted as a 6 x 6 system, by symbolic
    elimination with the translational block.
    """
    q, w, p, v = (hy.make_vars(*(f"{name}{i}" for i in range(n))) for name, n in (("q", 4), ("w", 3), ("p", 3), ("v", 3)))
    m, c = hy.par[0], [hy.par[1 + i] for i in range(3)]
    J = [[hy.par[4 + 3 * i + j] for j in range(3)] for i in range(3)]  # about the origin
    cross = lambda a, b: [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]  # noqa: E731
    add = lambda *terms: [sum(each) for each in zip(*terms, strict=True)]  # noqa: E731
    scale = lambda a, b: [a * each for each in b]  # noqa: E731
    apply = lambda A, b: [sum(A[i][j] * b[j] for j in range(3)) for i in range(3)]  # noqa: E731
    q0, q1, q2, q3 = q
    down = scale(-hy.par[13], [2 * (q1 * q3 - q0 * q2), 2 * (q2 * q3 + q0 * q1), 1 - 2 * (q1 * q1 + q2 * q2)])
    # m (a + dw x c + w x (w x c) + w x v) = m g        J dw + m c x (a + w x v) + w x J w = m c x g
    pull = add(down, scale(-1, cross(w, v)))
    force = add(pull, scale(-1, cross(w, cross(w, c))))  # a = force - dw x c
    moment = add(scale(m, cross(c, pull)), scale(-1, cross(w, apply(J, w))), scale(-m, cross(c, force)))
    cc = sum(each * each for each in c)
    A = [[J[i][j] - m * ((cc if i == j else 0.0) - c[i] * c[j]) for j in range(3)] for i in range(3)]
    minors = [cross(A[1], A[2]), cross(A[2], A[0]), cross(A[0], A[1])]
    determinant = sum(A[0][i] * minors[0][i] for i in range(3))
    dw = [sum(minors[j][i] * moment[j] for j in range(3)) / determinant for i in range(3)]
    dv = add(force, scale(-1, cross(dw, c)))
    spin = [-(q1 * w[0] + q2 * w[1] + q3 * w[2]), *add(scale(q0, w), cross(q[1:], w))]
    twice = scale(2, cross(q[1:], v))
    dp = add(v, scale(q0, twice), cross(q[1:], twice))
    slopes = [*scale(0.5, spin), *dw, *dp, *dv]
    return hy.taylor_adaptive(
        list(zip([*q, *w, *p, *v], slopes, strict=True)), [1.0, *[0.0] * 12], tol=1e-18, compact_mode=True
    )


@pytest.fixture(scope="module")
def second_truth():
    integrator = spatial_equations()

    def solve(body, scene, t):
        flight = scene.flight
        integrator.pars[:] = [body.mass, *body.com_B, *body.inertia.ravel(), flight.g]
        start = to_quaternion(scene.R_WB0), scene.w_WB_B0, flight.p_WB0, scene.R_WB0.T @ flight.v_WB0
        integrator.time, integrator.state[:] = 0.0, np.concatenate(start)
        return integrator.propagate_grid(t)[-1]

    return solve


@pytest.mark.parametrize("count", [20, pytest.param(200, marks=pytest.mark.slow)])
def test_random_flights_agree_with_newton_euler_at_the_origin(second_truth, count):
    worst, random = 0.0, np.random.default_rng(26)
    for _ in range(count):
        body, scene = random_flight(random)
        found = registry.method("exact").solve(scene, Grid(0.5, 4))
        states = second_truth(body, scene, found.t)
        R = np.array([cv.attitude.from_quaternion(state / np.linalg.norm(state)) for state in states[:, :4]])
        v_WB = np.einsum("nij,nj->ni", R, states[:, 10:])
        for values, other in ((found.p_WB, states[:, 7:10]), (found.v_WB, v_WB), (found.w_WB_B, states[:, 4:7])):
            worst = max(worst, np.abs(values - other).max() / np.abs(other).max())
        worst = max(worst, angle_between(R, found.R_WB).max())
    assert worst < 1e-12  # 1.0e-13 measured


ENGINES = [
    pytest.param(name, marks=pytest.mark.engine(name.partition(":")[0]))
    for name in ("drake:runge_kutta5", "pybullet", "pybullet:maximal")
]


@pytest.mark.parametrize("method", ["reduced", "gauss", "taylor", "mujoco:RK4", "pinocchio", "precise", *ENGINES])
def test_methods_converge_to_the_truth(method):
    _, scene = random_flight(np.random.default_rng(3), t_end=1.0)
    if (reason := registry.method(method).unsupported(scene)) is not None:
        pytest.skip(reason)
    exact = registry.method("exact").solve(scene, Grid(0.1, 10))
    off = []
    for dt in (0.01, 0.005):
        found = cv.integrate(scene, dt, method, sample_every=round(0.1 / dt))
        off.append(np.linalg.norm(found.p_WB - exact.p_WB, axis=1).max())
    order = registry.method(method).order
    # The measured ratios are 4.0 (reduced), 16 (mujoco, pinocchio), 34 (drake), 2 (pybullet); the others have no error left.
    assert off[1] < 1e-12 or (order and off[0] / off[1] > 0.9 * 2**order), off


@pytest.mark.parametrize("method", ["mujoco:Euler", "mujoco:RK4"])
def test_engines_drift_where_our_methods_do_not(method):
    scene = cv.scenes.offset_brick()
    ours, engine = (cv.integrate(scene, method=each) for each in ("reduced", method))
    for name in ("linear momentum", "momentum about the origin", "total energy"):
        assert sizes(ours.drift(name)).max() < 1e-14  # 2e-15
        assert sizes(engine.drift(name)).max() > 1e-8, name  # 3e-8 (RK4) to 0.2
    errors = [{each.measure: each.value for each in measure_errors(each, ours)} for each in (ours, engine)]
    assert errors[0][Measure.POSITION_MAX] < 1e-14
    assert errors[1][Measure.POSITION_MAX] > 1e-6  # 5e-6 m (RK4), 1.5 m (Euler)


def test_invariants_are_those_of_the_textbook():
    _, scene = random_flight(np.random.default_rng(5))
    flight, mass = scene.flight, scene.flight.mass
    found = cv.integrate(scene, method="exact", dt=0.1)
    rng, values = np.random.default_rng(7), {invariant.name: invariant for invariant in scene.invariants}
    # Off the motion, so that no term can be missing: any state, at any time.
    R, w, t = rotation_about(rng.normal(size=3), 1.0), rng.normal(size=3), 0.7
    p, v = rng.normal(size=(2, 3))
    c, u = p + R @ flight.com_B, v + np.cross(R @ w, R @ flight.com_B)
    L_c, down = R @ scene.body.inertia @ w, np.array([0, 0, -flight.g])
    (c0,), (u0,) = flight.fall(scene, np.zeros(1))
    moment = np.cross(c0 * t + u0 * t**2 / 2, mass * down)
    wanted = {
        "linear momentum": mass * (u - down * t),
        "momentum about the origin": L_c + np.cross(c, mass * u) - moment,
        "total energy": w @ scene.body.inertia @ w / 2 + mass * u @ u / 2 + mass * flight.g * c[2],
    }
    for name, value in wanted.items():
        np.testing.assert_allclose(
            values[name].evaluate(R[None], w[None], p[None], v[None], np.array([t]))[0], value, rtol=1e-13
        )
        assert sizes(found.drift(name)).max() < 1e-14
    shifted = replace(found, frame=(found.p_WB + 1e-3, found.v_WB + 1e-3))
    assert sizes(shifted.drift("linear momentum")).max() > 1e-5  # an error of the velocity is seen


def test_scenes_without_flight_carry_nothing():
    found = cv.integrate(cv.scenes.brick_flip(), t_end=0.1)
    assert found.p_WB is found.v_WB is found.frame is None
    assert not [name for name in found.to_pandas() if name.startswith(("p_", "v_"))]
    assert [name for name in cv.integrate(cv.scenes.thrown_box(), t_end=0.1).to_pandas() if name.startswith(("p_", "v_"))]


@pytest.mark.parametrize("name", ["mujoco:RK4", "pinocchio", "reduced"])
def test_same_flight_in_other_axes_slower_and_in_other_units(name):
    _, scene = random_flight(np.random.default_rng(11), t_end=1.0)
    found = cv.integrate(scene, 0.01, name)
    F = rotation_about((1, 2, 3), 0.7)
    turned = cv.integrate(in_body_frame(scene, F, "turned"), 0.01, name)
    np.testing.assert_allclose(turned.p_WB, found.p_WB, atol=1e-11)
    slow = cv.integrate(slow_motion(scene, 4.0), 0.04, name)
    np.testing.assert_allclose(slow.p_WB, found.p_WB, atol=1e-11)
    np.testing.assert_allclose(4 * slow.v_WB, found.v_WB, atol=1e-11)
    light = replace(
        scene, body=cv.RigidBody(scene.body.inertia * 2.0**-40), flight=replace(scene.flight, mass=scene.flight.mass * 2.0**-40)
    )
    np.testing.assert_allclose(cv.integrate(light, 0.01, name).p_WB, found.p_WB, atol=1e-11)
    fast = slow_motion(scene, 2.0**-20)
    np.testing.assert_allclose(cv.integrate(fast, 0.01 * 2.0**-20, name).p_WB, found.p_WB, atol=1e-11)


@pytest.mark.parametrize("name", ["mujoco:RK4", "reduced"])
def test_samples_between_steps(name):
    _, scene = random_flight(np.random.default_rng(13), t_end=1.0)
    t = np.array([0.0, 0.123, 0.4567, 1.0])
    found, exact = (cv.integrate(scene, 0.002, each, t_eval=t) for each in (name, "exact"))
    assert found.p_WB.shape == (4, 3)
    # 6e-9 and 3e-5 measured, errors of the steps before the samples.
    np.testing.assert_allclose(found.p_WB, exact.p_WB, atol=1e-4 if name == "reduced" else 1e-7)
    np.testing.assert_allclose(found.v_WB, exact.v_WB, atol=1e-4 if name == "reduced" else 1e-7)


def test_other_engines_refuse_and_many_bodies_fly():
    scene = cv.scenes.thrown_box()
    with pytest.raises(cv.Unsupported, match="free flight"):
        cv.integrate(scene, method="heyoka")
    ensemble = cv.integrate_many(scene, w_WB_B0=np.array([scene.w_WB_B0, 2 * scene.w_WB_B0]), dt=0.01)
    alone = cv.integrate(scene, 0.01, "reduced")
    for name in ("R_WB", "p_WB", "v_WB"):
        np.testing.assert_allclose(
            getattr(ensemble[0], name), getattr(alone, name), rtol=0, atol=1e-14
        )  # lanes round otherwise
    assert set(ensemble.drifts) == {"orthonormality", "energy", "momentum"}
    assert max(values.max() for values in ensemble.drifts.values()) < 1e-14  # measured 2e-15


@pytest.mark.parametrize("n", [1, 3])
def test_many_bodies_fly_and_are_stored_with_their_flight(n, tmp_path):
    pytest.importorskip("zarr")
    scene, rates = cv.scenes.thrown_box(), np.random.default_rng(3).normal(size=(n, 3))
    run = {"w_WB_B0": rates, "dt": 0.01, "method": "reduced:order=10", "t_end": 0.5}
    memory, stored = cv.integrate_many(scene, **run), cv.integrate_many(scene, **run, path=tmp_path / "a.zarr")
    for found in (memory, stored, cv.open_ensemble(tmp_path / "a.zarr"), cv.open_ensemble(tmp_path / "a.zarr", scene)):
        for i in range(n):
            exact = cv.integrate(scene.rename("own", w_WB_B0=rates[i]), 0.01, "exact", t_end=0.5)
            np.testing.assert_allclose(found[i].p_WB, exact.p_WB, atol=1e-14)  # measured 2e-16
            assert sizes(found[i].drift("linear momentum")).max() < 1e-14  # measured 2e-17
    other = scene.rename(scene.name, flight=replace(scene.flight, v_WB0=scene.flight.v_WB0 * (1 + 1e-15)))
    with pytest.raises(cv.BadInput, match="another scene"):
        cv.integrate_many(other, **run, path=tmp_path / "a.zarr", resume=True)
    with pytest.raises(cv.BadInput, match="the scene of the run"):
        cv.open_ensemble(tmp_path / "a.zarr", scene.rename(scene.name, flight=None))


BOX = cv.shapes.box((0.1, 0.2, 0.3), mass=2).about((0.1, 0, 0))


@pytest.mark.parametrize(
    ("argument", "values"),
    [
        ("body", {"body": cv.RigidBody((1, 2, 2.5)), "p_WB0": (0, 0, 1)}),
        ("body", {}),
        ("potential", {"p_WB0": (0, 0, 1), "potential": cv.UniformGravity(1, (0, 0, 1))}),
        ("potential", {"p_WB0": (0, 0, 1), "potential": cv.LinearSpring(1, (0, 0, 1), (0, 0, 1))}),
        ("p_WB0", {"p_WB0": (0, 0, np.nan)}),
        ("v_WB0", {"v_WB0": (0, 0)}),
        ("torque", {"v_WB0": (0, 0, 0), "torque": cv.Torque((0, 0, 1))}),
        ("flight", {"body": cv.RigidBody((1, 2, 2.5)), "flight": "high"}),
    ],
)
def test_bad_input_names_the_argument(argument, values):
    given = {"name": "bad", "body": BOX, "R_WB0": np.eye(3), "w_WB_B0": (1, 2, 3), "t_end": 1.0} | values
    with pytest.raises(cv.BadInput) as caught:
        cv.Scene(**given)
    assert caught.value.argument == argument


BODY = "inertia_com = [[3, 0.1, 0], [0.1, 4, 0.2], [0, 0.2, 5]]\nmass = 2.0\ncom_B = [0.1, 0.2, -0.3]\n"
START = "[start]\nw_WB_B = [1, 2, 3]\np_WB = [0, 0, 1]\nv_WB = [3, 0, 4]\n"


def test_scene_file(tmp_path):
    path = tmp_path / "thrown.toml"
    path.write_text(f't_end = 1.0\n[body]\n{BODY}[potential]\nkind = "uniform_gravity"\ng = 9.81\n{START}')
    scene = load(path)
    np.testing.assert_array_equal(scene.flight.v_WB0, (3, 0, 4))
    np.testing.assert_array_equal(scene.flight.com_B, (0.1, 0.2, -0.3))
    assert (scene.flight.mass, scene.flight.g, scene.body.inertia[0, 1]) == (2, 9.81, 0.1)
    path.write_text(f"t_end = 1.0\n[body]\ninertia = [1, 2, 2.5]\n{START}")
    with pytest.raises(cv.BadInput, match="body"):
        load(path)
    path.write_text(f"t_end = 1.0\n[body]\n{BODY}{START.replace('4]', '[4]]')}")
    with pytest.raises(cv.BadInput, match=r"start\.v_WB"):
        load(path)
