"""A rotor of constant momentum: the methods that take it against an independent truth, what they conserve, and refusals."""

from __future__ import annotations

from functools import cache
from itertools import product
from pathlib import Path

import numpy as np
import pytest

import conservative as cv
from conservative import registry
from conservative.attitude import angle_between, rotation_about
from conservative.grid import Grid
from conservative.invariants import kinetic_energy
from conservative.references.collocation import collocate
from conservative.references.precise import Precise
from conservative.references.truth import confirm
from conservative.scene_files.scene_file import load
from conservative.scenes.random_body import FIELDS
from conservative.scenes.transforms import in_body_frame, slow_motion

from ..sampling import sampled
from .gyrostats import gyrostat
from .volterra import momenta_of_volterra

KINDS = ("free", *FIELDS)


@cache
def truth(kind: str, index: int) -> np.ndarray:
    """Return the attitudes at tenths of the run. More samples take as much longer."""
    scene = gyrostat(kind, index)
    return Precise(96).solve(scene, Grid(scene.t_end / 10, 10)).R_WB


def errors(method: str, kind: str, index: int, n: int) -> tuple[float, float]:
    """Return the largest attitude error, rad, and the largest drift of an invariant that the method conserves, in n steps."""
    scene, chosen = gyrostat(kind, index), registry.method(method)
    found = chosen.solve(scene, Grid(scene.t_end / n, n))
    assert found.ok, found.outcome
    kept = [invariant for invariant in scene.invariants if invariant.name in chosen.conserves]
    drift = max((float(np.linalg.norm(np.atleast_2d(found.drift(each)), axis=0).max()) for each in kept), default=0.0)
    return float(angle_between(found.R_WB[:: n // 10], truth(kind, index)).max()), drift


def test_momentum_has_the_rotor_and_kinetic_energy_has_not() -> None:
    body = cv.RigidBody([[2.0, 0.3, 0], [0.3, 1.5, 0.1], [0, 0.1, 3.0]], rotor_momentum=(1.0, -2.0, 0.5))
    w = np.array([0.3, -0.7, 1.1])
    assert np.array_equal(body.momentum(w), w @ body.inertia + [1.0, -2.0, 0.5])
    assert kinetic_energy(body, w) == kinetic_energy(cv.RigidBody(body.inertia), w)
    assert cv.RigidBody((1, 2, 3), (0, 0, 0)).rotor_momentum is None  # no rotor: no code for one


@pytest.mark.parametrize("rotor", [(1, 2), (1, 2, np.nan), "3", (1e40, 0, 0)])
def test_bad_rotor(rotor: object) -> None:
    with pytest.raises(cv.BadInput) as caught:
        cv.RigidBody((1, 2, 3), rotor_momentum=rotor)  # type: ignore[arg-type]
    assert caught.value.argument == "rotor_momentum"


# Of 204 bodies, the largest difference is 8.2e-14 rad and the median 1e-16 rad.
@pytest.mark.parametrize(
    ("indices", "kind"), sampled(product((range(1), range(1, 34)), KINDS), 2, [(range(1), "free"), (range(1), "gradient")])
)
def test_two_truths_agree(indices: range, kind: str) -> None:
    for index in indices:
        scene = gyrostat(kind, index)
        assert confirm(scene, Grid(scene.t_end / 4, 4)).agreement_rad < 1e-12


def test_the_truth_is_not_that_of_another_rotor() -> None:
    scene = gyrostat("free", 0)
    grid, right = Grid(scene.t_end / 4, 4), scene.body.rotor_momentum
    for wrong in (-right, right * (1 + 1e-6), None):
        other = scene.rename("wrong", body=cv.RigidBody(scene.body.inertia, wrong))
        difference = angle_between(Precise(96).solve(scene, grid).R_WB, collocate(other, grid, 16).R_WB).max()
        assert difference > 1e-6  # measured 3e-6 and more


LARGEST = {
    "reduced": 2e-2,
    "reduced:order=6": 1e-7,
    "projected": 1e-9,
    "taylor": 1e-10,
    "taylor:tolerance=1e-12": 1e-8,
    "gauss": 1e-10,
    "splitting": 1e-7,
    "splitting:order=2": 2e-2,
    "no_squish:order=4": 1e-4,
}
"""Largest errors in 1000 steps, rad."""


def supported(kind: str, method: str) -> bool:
    return registry.method(method).unsupported(gyrostat(kind, 1)) is None


DIAGONAL = [
    *(("gravity", "taylor"), ("spring", "reduced:order=6"), ("attraction", "splitting")),
    *(("gradient", "taylor:tolerance=1e-12"), ("fixed_gradient", "projected")),
]
"""Each field with one method: compiling a kernel takes 2 s. The crossing has a rotor without a field, with all methods."""


@pytest.mark.parametrize("method", LARGEST)
def test_a_method_supports_the_fields_that_it_declares(method: str) -> None:
    for kind in KINDS:
        declared = gyrostat(kind, 1).features <= registry.method(method).supports and (kind, method) != ("free", "projected")
        assert supported(kind, method) is declared


@pytest.mark.parametrize(
    ("kind", "method"), sampled([pair for pair in product(KINDS, LARGEST) if supported(*pair)], 3, DIAGONAL[::2])
)
def test_a_method_is_accurate_and_conserves(kind: str, method: str) -> None:
    found, drift = errors(method, kind, 1, 1000)
    assert found < LARGEST[method]
    assert drift < 1e-12


ENGINES = ("heyoka", "heyoka:frame=base_vectors", "heyoka:frame=lean", "scipy")


@pytest.mark.parametrize(("kind", "method"), sampled(product(("free", "gravity", "gradient"), ENGINES), 4, [("free", "scipy")]))
def test_an_engine_agrees(kind: str, method: str) -> None:
    assert errors(method, kind, 2, 200)[0] < 1e-9


@pytest.mark.engine("bsk")
def test_a_reaction_wheel_of_basilisk_is_the_same_motion() -> None:
    scene = gyrostat("free", 2)
    grid = Grid(round(scene.t_end / 500 * 1e9) * 1e-9, 500)  # whole nanoseconds
    found, exact = registry.method("bsk:RKF78").solve(scene, grid), cv.Taylor().solve(scene, grid)
    assert found.ok
    assert angle_between(found.R_WB, exact.R_WB).max() < 1e-12  # measured 1.3e-14


@pytest.mark.parametrize(
    "method", ["moser_veselov", "lame", "convected", "rattle", "lie_variational", "textbook", "exact", "mujoco", "pinocchio"]
)
def test_others_refuse(method: str) -> None:
    for kind in ("free", "gravity"):
        reason = registry.method(method).unsupported(gyrostat(kind, 0))
        assert reason is not None
    assert "a rotor" in (registry.method("moser_veselov").unsupported(gyrostat("free", 0)) or "")
    assert "reduced" in (registry.method("moser_veselov").unsupported(gyrostat("free", 0)) or "")


def test_other_frame_and_units_are_the_same_motion() -> None:
    scene, R = gyrostat("free", 3), rotation_about((1.0, -2.0, 0.5), 0.9)
    turned, slow = in_body_frame(scene, R, "turned"), slow_motion(scene, 4)
    small = scene.rename("small", body=cv.RigidBody(scene.body.inertia * 1e-12, scene.body.rotor_momentum * 1e-12))
    one = cv.integrate(scene, scene.t_end / 200, "reduced").R_WB
    assert angle_between(cv.integrate(turned, scene.t_end / 200, "reduced").R_WB @ R, one).max() < 1e-12
    assert angle_between(cv.integrate(slow, slow.t_end / 200, "reduced").R_WB, one).max() < 1e-12
    assert angle_between(cv.integrate(small, scene.t_end / 200, "reduced").R_WB, one).max() < 1e-12


def test_samples_between_steps_and_many_bodies() -> None:
    scene = gyrostat("free", 4)
    t = np.array([0.0, 0.31, 0.77]) * scene.t_end
    between = cv.integrate(scene, scene.t_end / 1000, "reduced:order=6", t_eval=t)
    exact = Precise(96).solve(scene, Grid(scene.t_end / 100, 100))
    assert angle_between(between.R_WB[1:], exact.R_WB[[31, 77]]).max() < 1e-7
    starts = cv.spread(scene, 5, rate="10%", inertia="1%", seed=3)
    ensemble = cv.integrate_many(scene, **starts, dt=scene.t_end / 200, method="reduced")
    assert not ensemble.failures
    assert max(values.max() for values in ensemble.drifts.values()) < 1e-13
    alone = cv.integrate(ensemble[3].scene, scene.t_end / 200, "reduced")
    assert np.array_equal(alone.R_WB, ensemble[3].R_WB)


def momentum_range(name: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the smallest and largest components (3,) of J w + h, relative to its length, in a scene."""
    scene = registry.scene(name)
    L = scene.body.momentum(cv.integrate(scene, scene.dt, "taylor").w_WB_B)
    return L.min(axis=0) / np.linalg.norm(L[0]), L.max(axis=0) / np.linalg.norm(L[0])


def test_a_rotor_decides_about_which_axis_the_momentum_circulates() -> None:
    for name, axis, without in (("dual_spin_turn", 2, 0), ("flat_spin_recovery", 0, 2)):
        low, high = momentum_range(name)
        assert low[axis] > 0.6  # measured 0.62 and 0.83
        assert low[without] < -0.5 < 0.5 < high[without]
        low, high = momentum_range(f"{name}:rotor=0")
        assert low[without] > 0.9
    # The brick does not flip above a rotor of 30 kg m^2/s: (J3 w + h - J1 w) (J3 w + h - J2 w) > 0.
    assert momentum_range("stabilised_brick:rotor=20")[0][2] < 0.5  # measured 0.44
    assert momentum_range("stabilised_brick:rotor=60")[0][2] > 0.999


def test_scene_file(tmp_path: Path) -> None:
    path = tmp_path / "gyrostat.toml"
    text = "t_end = 1.0\n[body]\ninertia = [1, 2, 2.5]\n[rotor]\nmomentum = [0.1, 0, 2]\n[start]\nw_WB_B = [0, 0, 1]\n"
    path.write_text(text)
    assert load(path).body.rotor_momentum.tolist() == [0.1, 0, 2]
    for bad, line in (("momentum = [1, 2]", 5), ("speed = 3", 5), ("", 4)):
        path.write_text(text.replace("momentum = [0.1, 0, 2]", bad))
        with pytest.raises(cv.BadInput) as caught:
            load(path)
        assert getattr(caught.value, "line", None) == line


@pytest.mark.parametrize("index", [None, 5, 6, 7])
def test_the_momentum_is_that_of_volterras_closed_form(index: int | None) -> None:
    scene = cv.scenes.volterra_gyrostat(10.0) if index is None else gyrostat("free", index)
    grid = Grid(scene.t_end / 10, 10)
    exact = momenta_of_volterra(scene.body, scene.w_WB_B0, grid.t)
    size, found = np.linalg.norm(exact[0]), scene.body.momentum(Precise(128).solve(scene, grid).w_WB_B)
    assert np.abs(found - exact).max() < 1e-14 * size  # measured 1.6e-15
    wrong = momenta_of_volterra(cv.RigidBody(scene.body.inertia, 1.001 * scene.body.rotor_momentum), scene.w_WB_B0, grid.t)
    assert np.abs(wrong - exact).max() > 1e-4 * size


def test_reduced_has_no_linear_drift_in_a_million_steps() -> None:
    # With rounded constants times products of two rates, both drift linearly, to 2e-13.
    scene = gyrostat("free", 3)
    dt = 0.05 / float(np.linalg.norm(scene.w_WB_B0))
    found = cv.integrate(scene, dt, "reduced", t_end=1e6 * dt, sample_every=10_000)
    assert np.abs(found.drift("energy")).max() < 5e-14  # measured 2e-15
    assert np.linalg.norm(found.drift("momentum"), axis=1).max() < 5e-14  # measured 5e-15


@pytest.mark.parametrize("size", [9e2, 1.1e3, 1e6])
def test_a_rotor_momentum_that_jumps_is_refused_at_any_size(size):
    """A jump above 1,000 kg m^2/s was taken for a corner."""
    body = cv.RigidBody((1.0, 2.0, 2.5), rotor_momentum=lambda t: (0.0, 0.0, size * (t >= 0.3)))
    with pytest.raises(cv.BadInput, match=r"a function that jumps at t = 0\.3 s"):
        cv.integrate(cv.Scene("jump", body, np.eye(3), (0.1, 0.2, 0.3), 1.0), 0.01, "projected")
