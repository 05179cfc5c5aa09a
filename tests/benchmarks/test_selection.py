"""Scenes, methods and engines by name, and engines that are not installed."""

import re
from dataclasses import dataclass
from types import ModuleType
from typing import ClassVar

import pytest

from conservative import BadInput, Convected, MissingEngine, Reduced, Taylor, registry
from conservative.benchmarks.studies import engine_selection, selection
from conservative.benchmarks.studies.case import Case, attempt, names_of
from conservative.benchmarks.studies.engine_selection import list_installed, select_engines
from conservative.benchmarks.studies.line import list_settings
from conservative.benchmarks.studies.selection import Missing, at_tolerance, methods, series, tolerance_setting
from conservative.benchmarks.suite.points import Point
from conservative.grid import Grid, grid_for
from conservative.method import Method, Role
from conservative.method_info import Maker
from conservative.outcome import OutcomeKind
from conservative.references.environments.adapter import LocalEngine, method_class
from conservative.references.environments.environment import Environment, MissingEnvironment

from .generic_study import SCENE

BRICK = registry.scene("brick_flip")


def test_scenes_by_name_with_parameters():
    selected = selection.scenes(("lagrange_top", "brick_flip:disturbance=0.001"))
    assert [scene.name for scene in selected] == ["lagrange_top", "brick_flip_0.001"]
    assert [scene.name for scene in selection.scenes()] == ["brick_flip", "lagrange_top"]


def test_a_family_stands_for_its_variants_and_a_name_with_settings_for_one():
    assert set(methods(["mujoco"])) == set(registry.method("mujoco").settings_for("variants"))
    assert methods(["mujoco:Euler"]) == (registry.method("mujoco:Euler"),)


def test_ours_come_first_and_duplicates_are_removed():
    selected = methods(["mujoco", "reduced:order=2", "mujoco:Euler", "convected"])
    engines = len(methods(["mujoco"]))
    assert [method.role for method in selected] == ["ours", "ours", *["engine"] * engines]
    assert len(set(selected)) == len(selected)


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
    assert missing == Missing("mujoco", error=MissingEngine("MuJoCo", "mujoco"))
    assert (missing.name, missing.label, missing.role, missing.order) == ("mujoco", "mujoco", "engine", None)
    with pytest.raises(MissingEngine, match="pip install mujoco"):
        missing.prepare(BRICK, Grid(0.01, 1))


def test_tolerances_belong_to_adaptive_methods_only():
    scipy = registry.method("scipy:rtol=1e-9")
    assert tolerance_setting(scipy) == "rtol"
    assert tolerance_setting(Reduced()) is None
    assert at_tolerance(scipy, "rtol", 1e-5) == registry.method("scipy:rtol=1e-5")


def test_tolerances_of_a_method_are_one_line():
    assert series(registry.method("scipy:rtol=1e-9")) == series(registry.method("scipy:rtol=1e-5")) == "scipy"
    assert series(registry.method("scipy:RK45,rtol=1e-5")) == "scipy:integrator=RK45"
    assert series(Convected(tol=1e-9)) == "convected:tol=1e-09"
    assert {series(Taylor(tolerance=10.0**-k)) for k in (3, 9)} == {"taylor:tolerance"} != {series(Taylor())}


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
    assert Point(BRICK, registry.method(name)).id == expected


def test_ids_are_different_and_have_no_odd_characters():
    selected = [Point(scene, method).id for scene in selection.scenes() for method in methods()]
    assert len(set(selected)) == len(selected)
    assert all(re.fullmatch(r"[\w.+-]+", text) for text in selected)


@pytest.fixture(autouse=True)
def nothing_in_environments(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))


def test_an_engine_in_this_environment_has_all_its_settings():
    selected = select_engines(["pinocchio"])
    assert [method.name for method in selected] == ["pinocchio:scheme=Euler", "pinocchio"]


def test_all_engines_without_other_environments_are_those_in_this_one():
    families = {method.family for method in select_engines(["all"])}
    assert {"mujoco", "pinocchio", "heyoka", "scipy"} <= families
    assert not families & {"reduced", "exact", "exudyn"}


def test_all_engines_include_the_newest_environment_of_each(monkeypatch, tmp_path):
    here = select_engines(["mujoco"])[0].label.partition("/")[0].partition("==")[2]
    made = [("exudyn", "1.9"), ("exudyn", "1.10"), ("mujoco", here), ("unregistered", "1.0")]
    environments = tuple(Environment(*each, tmp_path, "3.11", ()) for each in made)
    monkeypatch.setattr(engine_selection, "list_environments", lambda: environments)
    selected = list_installed()
    assert selected[-1] == "exudyn@1.10"
    assert sum(name.startswith("mujoco") for name in selected) == 1
    monkeypatch.setattr(engine_selection, "list_environments", lambda: (Environment("mujoco", "0.1", tmp_path, "3.11", ()),))
    assert list_installed()[-1] == "mujoco@0.1"


@pytest.mark.parametrize("name", ["exudyn", "exudyn@1.2.3", "mujoco@3.6.0"])
def test_an_engine_without_an_environment_is_an_error_with_the_line_that_installs_it(name):
    with pytest.raises(MissingEngine, match=f"conservative engines install {name}$"):
        select_engines([name])


def test_a_missing_engine_is_a_row_if_requested():
    (selected,) = select_engines(["exudyn==1.2.3"], skip_missing=True)
    assert isinstance(selected, Missing)
    assert selected.label == "exudyn@1.2.3"
    case = Case("paper", SCENE, selected, grid_for(SCENE, 0.02))
    outcome = attempt(case, skip_missing=True)
    assert outcome.kind is OutcomeKind.MISSING
    assert outcome.reason.endswith("conservative engines install exudyn@1.2.3")
    with pytest.raises(MissingEnvironment):
        attempt(case)


@pytest.mark.parametrize("name", ["exudin", "reduced", "exact", "pinocchio==4.0", "exudyn:RK44", "exudyn@", "", "a;b"])
def test_a_name_that_is_no_engine_is_bad_input(name):
    with pytest.raises(BadInput):
        select_engines([name])


def test_an_engine_without_the_declaration_has_no_setting_as_installed():
    assert not any(method in method.settings_for("as_installed") for method in select_engines(["scipy"]))


@dataclass(frozen=True)
class Adaptive(Method):
    """A method of another package, without a label of its own."""

    stol: int = 3
    tol: float = 1e-6

    family: ClassVar[str] = "adaptive"
    role: ClassVar[Role] = Role.ENGINE

    maker = Maker("theirs", "1.0")

    @property
    def order(self):
        return None

    def prepare(self, scene, grid):
        raise NotImplementedError


@pytest.mark.parametrize(
    ("method", "parts", "of_series"),
    [
        ("reduced", ("reduced", "", ""), ""),
        ("reduced:order=4", ("reduced", "", "order=4"), "order=4"),
        ("convected:tol=1e-12", ("convected", "", "tol=1e-12"), "tol=1e-12"),  # the tolerance of its iteration
        ("exact", ("exact", "", ""), ""),
        ("mujoco:Euler", ("mujoco", "VERSION", "Euler"), "Euler"),
        ("taylor:tolerance=1e-9", ("taylor", "", "tolerance=1e-09"), "tolerance"),
        ("heyoka:1e-6", ("heyoka", "VERSION", "tol=1e-06,body"), "body"),
        ("scipy:rtol=1e-9", ("scipy", "VERSION", "DOP853,rtol=1e-09"), "DOP853"),
        ("pinocchio:RK4", ("pinocchio", "VERSION", "aba+RK4"), "aba+RK4"),
    ],
)
def test_the_columns_of_a_method(method, parts, of_series):
    value = registry.method(method)
    selected = names_of(value)
    expected = tuple(value.maker.version if part == "VERSION" else part for part in parts)
    assert (selected["family"], selected["version"], selected["setting"]) == expected
    assert selected["engine"] == ("" if value.role != Role.ENGINE else selected["family"])
    assert selected["series_setting"] == of_series
    assert (selected["method"], selected["label"]) == (value.name, value.label)


def test_a_method_of_another_package_has_its_version_and_its_name_once():
    selected = names_of(Adaptive(stol=4, tol=1e-9))
    assert (selected["family"], selected["version"], selected["setting"]) == ("adaptive", "1.0", "stol=4,tol=1e-09")
    assert (selected["series"], selected["series_setting"]) == ("adaptive:stol=4", "stol=4")


def test_steps_and_accuracies_of_an_engine_are_two_lines():
    """Drake's, OpenSim's and Diffrax's tolerances are lines, apart from the same integrator's fixed steps."""
    settings = {"integrator": "RK5", "accuracy": 0.0}
    module = ModuleType("engines.stepped")
    module.ENGINE = {"package": "numpy", "module": "numpy", "settings": settings, "orders": {"RK5": 5}, "tolerance": "accuracy"}
    engine = method_class(module, LocalEngine)
    fixed, loose, tight = engine(), engine("RK5", 1e-6), engine("RK5", 1e-12)
    assert tolerance_setting(fixed) is None
    assert tolerance_setting(loose) == "accuracy"
    assert series(fixed) != series(loose) == series(tight) == "stepped:RK5,accuracy"
    found = list_settings(Case("study", BRICK, loose, Grid(0.5, 12)), [], (2, 0.5, 1e-12))
    assert [case.method for case in found] == [engine("RK5", 0.5), tight]  # 2 is out of range


def test_a_method_with_a_missing_engine_has_the_name_that_was_given():
    selected = names_of(Missing("mujoco:RK4", error=MissingEngine("MuJoCo", "mujoco")))
    assert (selected["family"], selected["version"], selected["setting"]) == ("mujoco", "", "RK4")
    assert selected["label"] == "mujoco:RK4"


def test_both_ways_to_write_a_version_are_one_engine():
    found = select_engines(["mujoco@0.0.1", "mujoco==0.0.1"], skip_missing=True)
    assert [each.name for each in found] == ["mujoco@0.0.1"]
