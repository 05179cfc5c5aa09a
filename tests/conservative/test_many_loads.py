"""Many bodies with loads and rotors: states, balances and stores are those of each body alone, bit for bit."""

from __future__ import annotations

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import angle_between, rotation_about
from conservative.integration import blocks
from conservative.integration.blocks import run_block
from conservative.integration.inputs import read_bodies
from conservative.integration.shared_choice import pick_hardest
from conservative.invariants import sizes
from conservative.pickling import dump, load

from ..sampling import sampled

BODY = cv.RigidBody([[13, 0.5, 0.2], [0.5, 5, 0.3], [0.2, 0.3, 10]], rotor_momentum=(3.0, -4.0, 2.0))
GRAVITY = cv.UniformGravity(3.0, (0.1, 0.2, 0.3))
ORBIT = cv.Orbit(0.3, (0, 1, 0)).gravity_gradient(BODY.inertia, (1, 0, 0))
MATRIX = [[0.5, 0.1, 0], [-0.1, 0.3, 0], [0, 0, 0.7]]
TABLE = cv.Torque(([0.0, 1.3, 2.0], [[0, 0, 1], [1, 0, 1], [1, 2, 3]]))
STEPPED = cv.Damping(MATRIX, ([0.0, 0.7, 2.0], [0, 2, 1]))


def wave(t):
    return 3 * np.sin(t), -1.0, 2.0


def magnetic(t, R_WB):
    """Return a torque m x B of a body whose dipole m and whose field B are fixed, but for its growth."""
    return np.cross((3.0, 0.0, 1.0), R_WB.T @ (0.0, 2.0 + t, 1.0))


def eddy(t, R_WB):
    field_B = R_WB.T @ (0.0, 2.0 + t, 1.0)
    return 0.1 * (field_B @ field_B * np.eye(3) - np.outer(field_B, field_B))


def scene(potential, torque=None, damping=None, body=BODY):
    start = rotation_about((1, -2, 0.5), 0.9), (0.1, 1.5, 2.0)
    return cv.Scene("loaded", body, *start, 1.5, potential, torque=torque, damping=damping)


RUNS = {
    "constant": (scene(None, cv.Torque((3.0, -1.0, 2.0))), "reduced"),
    "damping": (scene(GRAVITY, damping=cv.Damping(MATRIX)), "reduced:order=4"),
    "tables": (scene(GRAVITY, TABLE, STEPPED), "projected"),
    "functions, turning": (scene(ORBIT, cv.Torque(wave, "world"), cv.Damping(MATRIX, lambda t: 1 + t * t)), "projected"),
    "jump": (scene(None, cv.Torque(([0, 0.32, 0.32, 0.41, 0.41, 2], np.outer([0, 0, 1, 1, 0, 0], (90, 0, 20))))), "reduced"),
    "pulse": (scene(None, cv.Torque(lambda t: (90.0 * (0.32 <= t < 0.41), 0, 0))), "reduced:order=6"),
    "attitude": (scene(GRAVITY, cv.Torque(magnetic), cv.Damping(eddy)), "projected"),
    "motor": (
        scene(None, TABLE, body=cv.RigidBody(BODY.inertia, ([0, 0.5, 2], [[0, 0, 0], [0, 0, 0], [9, 0, 30]]))),
        "reduced",
    ),
    "motor, turning": (scene(ORBIT, body=cv.RigidBody(BODY.inertia, lambda t: (3 * t, 0, 9 * np.cos(t)))), "projected"),
    "motor, gravity": (scene(GRAVITY, body=cv.RigidBody(BODY.inertia, lambda t: (3 * t, 0, 9 * np.cos(t)))), "projected"),
    "scipy": (scene(GRAVITY, TABLE, STEPPED), "scipy"),
}
SAMPLE = sampled(RUNS, 3, ["functions, turning", "jump", "scipy"])
"""The crossing of parts and commands has all parts; they are kept here for balances and bits, and with --all."""
N = 5
STEPS = {"dt": 0.05, "sample_every": 4}


def starts():
    rng = np.random.default_rng(5)
    R = np.array([rotation_about(*each) for each in zip(rng.normal(size=(N, 3)), rng.uniform(0.1, 3, N), strict=True)])
    return R, rng.normal(size=(N, 3))


def run(name, **more):
    given, method = RUNS[name]
    return cv.integrate_many(given, *starts(), method=method, **STEPS | more)


def require_same(one, other):
    for name in ("R_WB", "w_WB_B", "supplied"):
        assert np.array_equal(getattr(one, name), getattr(other, name))


@pytest.mark.parametrize("name", SAMPLE)
def test_each_body_is_that_of_integrate_bit_for_bit_with_its_balances(name, monkeypatch):
    monkeypatch.setattr(blocks, "MOST_BODIES", 2)
    found = run(name, threads=2)
    given, method = RUNS[name]
    for i, (R, w) in enumerate(zip(*starts(), strict=True)):
        alone = cv.integrate(given.rename("alone", R_WB0=R, w_WB_B0=w), 0.05, method, sample_every=4)
        require_same(found[i], alone)
        require_same(found[1:][i - 1] if i else found[0], alone)
        assert (found[i].supplied is None) == (method == "scipy")
        for balance in () if method == "scipy" else alone.scene.invariants:
            drift = sizes(alone.drift(balance)).max()
            assert found.drifts[balance.name][i] == pytest.approx(drift, abs=1e-15)  # measured 4e-16
            assert drift < 2e-14  # measured 3e-15
    assert found.drifts["orthonormality"].max() < 1e-9  # SciPy, measured 1.4e-11


@pytest.mark.parametrize("name", SAMPLE)
def test_a_batch_of_one_is_integrate(name):
    given, method = RUNS[name]
    found, alone = cv.integrate_many(given, method=method, **STEPS), cv.integrate(given, 0.05, method, sample_every=4)
    require_same(found[0], alone)
    for balance in given.invariants:
        drift = sizes(alone.drift(balance)).max()
        assert found.drifts[balance.name][0] == pytest.approx(drift, abs=1e-15, nan_ok=True)


def test_a_work_and_an_impulse_that_are_wrong_by_a_millionth_show_in_the_drifts(monkeypatch):
    solve = cv.Reduced.solve

    def wrong(method, given, grid):
        found = solve(method, given, grid)
        found.supplied[-1] *= 1 + 1e-6
        return found

    monkeypatch.setattr(cv.Reduced, "solve", wrong)
    found = run("constant")
    for name in ("energy balance", "momentum balance"):
        assert found.drifts[name].min() > 1e-8  # measured 6e-8


STORED = ("tables", "functions, turning", "jump", "attitude", "motor", "motor, gravity", "scipy")


@pytest.mark.parametrize("name", sampled(STORED, 1, ["functions, turning"]))
def test_a_store_has_what_was_supplied_and_is_resumed_to_the_same(name, tmp_path, monkeypatch):
    pytest.importorskip("zarr")
    monkeypatch.setattr(blocks, "MOST_BODIES", 2)
    memory, place = run(name), tmp_path / "a.zarr"
    run(name, path=place)
    for part in place.glob("supplied/c/1/*/*"):
        part.unlink()  # a lost block
    with pytest.raises(cv.BadInput, match="missing, damaged or edited"):
        cv.open_ensemble(place)
    run(name, path=place, resume=True)
    functions = any(callable(load.value) for load in RUNS[name][0].loads)
    stored = cv.open_ensemble(place, RUNS[name][0] if functions else None)
    for one, other in zip(stored, memory, strict=True):
        require_same(one, other)
        require_same(cv.integrate(one.scene, 0.05, RUNS[name][1], sample_every=4), other)  # loads are restored
    memory.to_zarr(tmp_path / "b.zarr")
    for file in (path.relative_to(place) for path in place.rglob("*") if path.is_file()):
        assert (place / file).read_bytes() == (tmp_path / "b.zarr" / file).read_bytes()


CHANGED = {
    "torque": {"torque": cv.Torque(([0.0, 1.3, 2.0], [[0, 0, 1], [1, 0, 1], [1, 2, 3 + 1e-15]]))},
    "frame": {"torque": cv.Torque(TABLE.value, "world")},
    "factor": {"damping": cv.Damping(MATRIX, ([0.0, 0.7 + 1e-15, 2.0], [0, 2, 1]))},
    "matrix": {"damping": cv.Damping(np.nextafter(MATRIX, 2), STEPPED.factor.value)},
    "without": {"torque": None},
    "function": {"torque": cv.Torque(wave)},
    "rotor": {"body": cv.RigidBody(BODY.inertia, np.nextafter(BODY.rotor_momentum, 9))},
}


@pytest.mark.parametrize("change", CHANGED)
def test_a_run_with_other_loads_is_not_resumed(change, tmp_path):
    pytest.importorskip("zarr")
    run("tables", path=tmp_path / "a.zarr")
    given, method = RUNS["tables"]
    other = given.rename(given.name, **CHANGED[change])
    with pytest.raises(cv.BadInput, match="another scene"):
        cv.integrate_many(other, *starts(), method=method, **STEPS, path=tmp_path / "a.zarr", resume=True)


@pytest.mark.parametrize("name", SAMPLE)
def test_a_block_is_sent_to_another_process(name):
    given, method = RUNS[name]
    bodies, grid = read_bodies(given, *starts(), None, None), cv.Grid(0.05, 30)
    method = cv.registry.method(method)
    here = run_block(method, bodies, grid)  # functions have been called from compiled code in this process
    do, *parts = load(dump((run_block, method, bodies, grid)))
    there = do(*parts)
    for name in ("R_WB", "w_WB_B", "drifts", "supplied"):
        np.testing.assert_array_equal(getattr(there, name), getattr(here, name))


@pytest.mark.parametrize("name", sampled(["constant", "tables", "attitude"], 1, ["tables"]))
def test_an_error_is_reached_with_the_loads_of_each_body(name):
    given, inertia = RUNS[name][0], BODY.inertia * np.linspace(0.3, 1, N)[:, None, None]
    found = cv.integrate_many(given, *starts(), inertia=inertia, error=1e-7)
    assert found.choice.reached
    for i in range(N):
        truth = cv.integrate(found.bodies.take(i), found.grid.dt / 2, "projected", sample_every=2 * found.grid.every)
        assert angle_between(found[i].R_WB, truth.R_WB).max() < 1e-7  # measured 4e-12


def test_the_hardest_bodies_are_chosen_by_their_own_energy():
    # The rotor turns against the bodies, so w.(J w + h) is negative. A torque turns bodies that start at rest.
    rates, sizes_of = np.linspace(0.2, 1, 9)[:, None] * (1.0, 1.0, 1.0), np.linspace(1, 3, 9)
    against = cv.Scene("against", cv.RigidBody((1.0, 1.5, 2.0), (-50, -50, -50)), np.eye(3), (1, 1, 1), 1.0)
    assert pick_hardest(read_bodies(against, None, rates, None, None)) == [8, 7, 6]
    pushed = cv.Scene("pushed", cv.RigidBody((1.0, 1.5, 2.0)), np.eye(3), (0, 0, 0), 1.0, torque=cv.Torque((1, 0, 0)))
    assert pick_hardest(read_bodies(pushed, None, None, sizes_of[:, None] * (1.0, 1.5, 2.0), None)) == [0, 1, 2]


def test_the_energy_of_a_body_with_a_large_rotor_has_all_digits():
    heavy = cv.Scene("heavy", cv.RigidBody((1.0, 1.5, 2.0), (0, 0, 1e7)), np.eye(3), (0.3, 0.1, 0.2), 1e-6)
    found = cv.integrate_many(heavy, w_WB_B0=np.array([[0.3, 0.1, 0.2], [0.1, 0.7, 0.3]]), dt=1e-8, method="reduced")
    assert found.drifts["energy"].max() < 1e-14  # measured 4e-16; 4e-10 from (J w + h) - h


def test_workers_of_a_cluster_return_the_same(monkeypatch):
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr(blocks, "MOST_BODIES", 2)
    options = {"n_workers": 1, "processes": False, "dashboard_address": None}
    with distributed.LocalCluster(**options) as cluster, distributed.Client(cluster) as client:
        for name in ("tables", "functions, turning"):
            for one, other in zip(run(name, client=client), run(name), strict=True):
                require_same(one, other)
