import re

import pytest

from conservative import BadInput, MissingEngine, Reduced, registry
from conservative.benchmarks.studies import selection
from conservative.benchmarks.studies.selection import Missing, at_tolerance, identifier, methods, series, tolerance_setting
from conservative.method import Grid

BRICK = registry.scene("brick_flip")


def test_scenes_by_name_with_parameters():
    found = selection.scenes(("lagrange_top", "brick_flip:disturbance=0.001"))
    assert [scene.name for scene in found] == ["lagrange_top", "brick_flip_0.001"]
    assert [scene.name for scene in selection.scenes()] == ["brick_flip", "lagrange_top"]


def test_a_family_stands_for_its_variants_and_a_name_with_settings_for_one():
    assert set(methods(["mujoco"])) == set(registry.method("mujoco").variants())
    assert methods(["mujoco:Euler"]) == (registry.method("mujoco:Euler"),)


def test_ours_come_first_and_nothing_comes_twice():
    found = methods(["scipy", "reduced:order=2", "scipy:rtol=1e-9", "convected"])
    assert [method.role for method in found] == ["ours", "ours", "engine", "engine"]
    assert len(set(found)) == len(found)


def test_unknown_names_are_refused():
    with pytest.raises(BadInput, match="reduced"):
        methods(["reducd"])


@pytest.fixture
def without_mujoco(monkeypatch):
    real = registry.method

    def method(name):
        if name.startswith("mujoco"):
            raise MissingEngine("MuJoCo", "mujoco")
        return real(name)

    monkeypatch.setattr(registry, "method", method)


@pytest.mark.usefixtures("without_mujoco")
def test_a_missing_engine_is_an_error_unless_skipped():
    with pytest.raises(MissingEngine, match="pip install mujoco"):
        methods(["reduced", "mujoco"])
    ours, missing = methods(["reduced:order=2", "mujoco"], skip_missing=True)
    assert ours == Reduced()
    assert missing == Missing("mujoco", "MuJoCo", "mujoco")
    assert (missing.name, missing.label, missing.role, missing.order) == ("mujoco", "mujoco", "engine", None)
    with pytest.raises(MissingEngine, match="pip install mujoco"):
        missing.prepare(BRICK, Grid(0.01, 1))


def test_tolerances_belong_to_adaptive_methods_only():
    scipy = registry.method("scipy:rtol=1e-9")
    assert tolerance_setting(scipy) == "rtol"
    assert tolerance_setting(Reduced()) is None
    assert at_tolerance(scipy, "rtol", 1e-5) == registry.method("scipy:rtol=1e-5")


def test_a_line_of_a_picture_is_a_method_whatever_its_tolerance():
    assert series(registry.method("scipy:rtol=1e-9")) == series(registry.method("scipy:rtol=1e-5")) == "scipy"
    assert series(registry.method("scipy:RK45,rtol=1e-5")) == "scipy:integrator=RK45"
    assert series(Reduced(tol=1e-9)) == "reduced:tol=1e-09"


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("reduced", "brick_flip-reduced-dt0.01"),
        ("mujoco:RK4", "brick_flip-mujoco_rk4-dt0.01"),
        ("mujoco:Euler", "brick_flip-mujoco_euler-dt0.01"),
        ("scipy:rtol=1e-9", "brick_flip-scipy_dop853_rtol1e-09-dt0.01"),
        ("gauss:stages=4", "brick_flip-gauss_s4-dt0.01"),
    ],
)
def test_ids_of_benchmarks(name, expected):
    assert identifier(BRICK, registry.method(name), 0.01) == expected


def test_ids_are_different_and_have_no_odd_characters():
    found = [identifier(scene, method, 0.01) for scene in selection.scenes() for method in methods()]
    assert len(set(found)) == len(found)
    assert all(re.fullmatch(r"[\w.+-]+", text) for text in found)
