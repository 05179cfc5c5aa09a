"""Many bodies at once: the numbers of one at a time, whatever the blocks, the threads and what is given."""

import threading

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import conservative as cv
from conservative.integration import blocks, shared_choice
from conservative.integration.inputs import read_bodies
from conservative.methods.between import Samples
from conservative.methods.many import Bodies

from .many_bodies import BODY, fields, scene, starts, tensors

N = 11
WAYS = {
    "alone": cv.Gauss(2),
    "on lanes": cv.Reduced(),
}
SAMPLES = {"dt": 0.05, "t_end": 0.5, "sample_every": 3}


def rename(given):
    """The scene of a body as users write it, with nothing that `take` has left unchecked."""
    return cv.Scene("one", cv.RigidBody(given.body.inertia), given.R_WB0, given.w_WB_B0, given.t_end, given.potential)


def require_same(found, method):
    """Compare all bodies of an ensemble with `integrate`."""
    for i, of_many in enumerate(found):
        alone = cv.integrate(rename(found.bodies.take(i)), 0.05, method, 0.5, 3)
        np.testing.assert_array_equal(of_many.t, alone.t)
        np.testing.assert_allclose(of_many.R_WB, alone.R_WB, rtol=0, atol=1e-14)  # 3e-15
        np.testing.assert_allclose(of_many.w_WB_B, alone.w_WB_B, rtol=0, atol=1e-14)
        assert of_many.ok
    assert found.label.startswith(method.label)  # of one body, it says more


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("field", ["free", "gravity"])
def test_numbers_are_those_of_one_at_a_time(way, field):
    potential, parameters = fields(N)[field]
    given = {"inertia": tensors(N), "parameters": parameters, "method": WAYS[way], **SAMPLES}
    found = cv.integrate_many(scene(potential), *starts(N), **given)
    require_same(found, WAYS[way])
    assert len(found) == N
    assert found.R_WB.shape == (N, 5, 3, 3)
    assert max(values.max() for values in found.drifts.values()) < 1e-14  # 2e-15
    assert set(found.drifts) == {"orthonormality", *(each.name for each in scene(potential).invariants)}


def test_what_is_not_given_is_that_of_the_scene():
    R, w = starts(2)
    own = scene(cv.UniformGravity(3.0, (0.1, 0.2, 0.3)))
    for given in (
        {"w_WB_B0": w},
        {"R_WB0": R},
        {"R_WB0": Rotation.from_matrix(R)},
        {"inertia": [[1.0, 1.4, 2.0], [2.0, 1.4, 1.0]]},
        {"parameters": {"weight": [1.0, 2.0]}},
        {},
    ):
        require_same(cv.integrate_many(own, **given, method=cv.Gauss(2), **SAMPLES), cv.Gauss(2))


def test_one_body_costs_no_other_bits():
    given, dt = scene(), {"dt": 0.05, "method": "reduced"}
    alone, found = cv.integrate(given, **dt), cv.integrate_many(given, **dt)
    np.testing.assert_array_equal(found.R_WB[0], alone.R_WB)
    np.testing.assert_array_equal(found[0].w_WB_B, alone.w_WB_B)
    assert found.bodies.first is given  # with all that it has been converted to
    assert dict(found.drifts).keys() == {"orthonormality", "energy", "momentum"}
    assert len(found.drifts) == 3
    assert found.drifts["energy"].shape == (1,)


def test_numbers_depend_neither_on_blocks_nor_on_threads(monkeypatch):
    runs, before = [{"threads": 1}, {"threads": 1}, {"threads": 2}, {}], threading.active_count()
    found = []
    for most, run in zip((1024, 4, 4, 3), runs, strict=True):
        monkeypatch.setattr(blocks, "MOST_BODIES", most)
        found.append(cv.integrate_many(scene(), *starts(N), inertia=tensors(N), **run, **SAMPLES))
    for other in found[1:]:
        np.testing.assert_array_equal(other.R_WB, found[0].R_WB)
        np.testing.assert_array_equal(other.w_WB_B, found[0].w_WB_B)
        assert all((values == found[0].drifts[name]).all() for name, values in other.drifts.items())
    assert threading.active_count() <= before


def test_blocks_are_as_large_as_their_samples_allow():
    assert blocks.list_blocks(2500, cv.Grid(0.1, 10)) == range(0, 2500, 1024)
    assert blocks.count_bodies(cv.Grid(0.1, 10**4)) == 17  # 16.3 MB
    assert blocks.count_bodies(cv.Grid(0.1, 10**6)) == 1


def test_progress_is_told_after_each_block(monkeypatch):
    monkeypatch.setattr(blocks, "MOST_BODIES", 4)
    told = []
    cv.integrate_many(scene(), *starts(N), progress=told.append, threads=1, **SAMPLES)
    assert [each.done for each in told] == [4, 8, 11]
    assert {each.total for each in told} == {11}
    assert told[-1].left == 0
    cv.integrate_many(scene(), progress=told.append, **SAMPLES)
    assert (told[-1].done, told[-1].total) == (1, 1)


@pytest.fixture(scope="module")
def ensemble():
    return cv.integrate_many(scene(), *starts(N), **SAMPLES)


def test_parts_of_an_ensemble(ensemble):
    part = ensemble[3:9:2]
    assert len(part) == 3
    np.testing.assert_array_equal(part[1].R_WB, ensemble[5].R_WB)
    np.testing.assert_array_equal(part[-1].R_WB, ensemble[7].R_WB)
    np.testing.assert_array_equal(part.drifts["energy"], ensemble.drifts["energy"][3:9:2])
    assert isinstance(part.bodies, Bodies)
    assert ensemble.outcome(-1).ok
    assert ensemble.ok.all()
    with pytest.raises(IndexError):
        ensemble[N]


def test_tables_of_samples_and_of_bodies(ensemble):
    assert "11 bodies, 5 samples to 0.5 s, 11 ok" in repr(ensemble)
    samples, bodies = ensemble.to_pandas(), ensemble.to_pandas("bodies")
    assert list(samples.columns)[:3] == ["body", "t", "R_WB_11"]
    assert len(samples) == N * 5
    own = samples[samples["body"] == 4].drop(columns="body").reset_index(drop=True)
    assert own.equals(ensemble[4].to_pandas())
    assert list(bodies["outcome"]) == ["ok"] * N
    assert bodies.loc[4, "drift of energy"] == ensemble.drifts["energy"][4]


def test_one_step_for_all_comes_from_an_error():
    wanted = {"t_end": 2.0, "error": 1e-6, "dt": 1.0, "parameters": {"weight": np.linspace(1, 9, N)}}
    own, (R, w) = scene(cv.UniformGravity(3.0, (0.1, 0.2, 0.3))), starts(N)
    w = np.concatenate([w[:-1], 9 * w[-1:]])
    found = cv.integrate_many(own, R, w, **wanted)
    assert found.choice.bodies == N  # of more, 16
    assert found.choice.reached
    assert found.choice.grid.n_steps == found.grid.n_steps
    np.testing.assert_allclose(found.t, [0, 1, 2], rtol=1e-15)
    finer = cv.integrate_many(
        own, R, w, parameters=wanted["parameters"], method=cv.Taylor(), dt=0.01, t_end=2.0, sample_every=100
    )
    assert np.abs(found.R_WB - finer.R_WB).max() < 1e-6  # 2e-9
    with pytest.raises(cv.BadInput, match=r"^method: .* None together with error"):
        cv.integrate_many(own, R, w, **wanted, method="reduced")


def test_a_body_that_fails_verification_shortens_the_step_of_all(monkeypatch):
    n, goal = 100, shared_choice.Goal(1e-6, 2.0, Samples(None, 1))
    bodies = read_bodies(scene(cv.UniformGravity(3.0, (0.1, 0.2, 0.3))), *starts(n), None, None)
    numbers = shared_choice.pick(bodies)
    sensitive, steps = numbers[-1], []  # one of those that are only verified
    assert len(numbers) == 16

    def find_worst(bodies, numbers, method, grid):
        steps.append(grid.dt)
        truncation = goal.error / 2 * (grid.dt / steps[0]) ** method.order
        return max((truncation * (1e6 if i == sensitive else 1), i) for i in numbers)

    monkeypatch.setattr(shared_choice, "find_worst", find_worst)
    choice = shared_choice.choose_for_all(bodies, goal)
    assert choice.reached
    assert choice.grid.dt < steps[0] * 5e5 ** (-1 / choice.method.order)


def test_an_error_below_round_off_is_a_warning():
    with pytest.warns(cv.AccuracyNotReached):
        found = cv.integrate_many(scene(body=BODY), *starts(3), error=1e-18, t_end=1.0)
    assert not found.choice.reached
