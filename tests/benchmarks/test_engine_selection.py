"""Engines by name: those beside us, in environments, and those that are not installed."""

import pytest

from conservative import BadInput, MissingEngine
from conservative.benchmarks.studies import engine_selection
from conservative.benchmarks.studies.case import Case, attempt
from conservative.benchmarks.studies.engine_selection import is_as_installed, list_installed, select_engines
from conservative.benchmarks.studies.selection import Missing
from conservative.method import grid_for
from conservative.outcome import OutcomeKind
from conservative.references.environments.environment import Environment
from conservative.references.environments.failures import MissingEnvironment

from .generic_study import SCENE


@pytest.fixture(autouse=True)
def nothing_in_environments(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))


def test_an_engine_beside_us_stands_for_all_its_settings():
    found = select_engines(["pinocchio"])
    assert [method.name for method in found] == ["pinocchio:scheme=Euler", "pinocchio"]


def test_an_engine_that_is_named_twice_is_there_once():
    assert select_engines(["pinocchio", "pinocchio"]) == select_engines(["pinocchio"])


def test_all_are_those_beside_us_where_no_environment_is_there():
    families = {method.family for method in select_engines(["all"])}
    assert {"mujoco", "pinocchio", "heyoka", "scipy"} <= families
    assert not families & {"reduced", "exact", "exudyn"}


def test_all_take_the_newest_environment_and_none_of_what_is_beside_us(monkeypatch, tmp_path):
    here = select_engines(["mujoco"])[0].label.partition("/")[0].partition("==")[2]
    made = [("exudyn", "1.9"), ("exudyn", "1.10"), ("mujoco", here), ("unregistered", "1.0")]
    environments = tuple(Environment(*each, tmp_path, "3.11", ()) for each in made)
    monkeypatch.setattr(engine_selection, "list_environments", lambda: environments)
    found = list_installed()
    assert found[-1] == "exudyn==1.10"
    assert sum(name.startswith("mujoco") for name in found) == 1
    monkeypatch.setattr(engine_selection, "list_environments", lambda: (Environment("mujoco", "0.1", tmp_path, "3.11", ()),))
    assert list_installed()[-1] == "mujoco==0.1"


@pytest.mark.parametrize("name", ["exudyn", "exudyn==1.2.3", "mujoco==3.6.0"])
def test_an_engine_without_an_environment_is_an_error_with_the_line_that_installs_it(name):
    with pytest.raises(MissingEngine, match=f"conservative engines install {name}$"):
        select_engines([name])


def test_a_missing_engine_is_a_row_where_it_is_asked_for():
    (found,) = select_engines(["exudyn==1.2.3"], skip_missing=True)
    assert isinstance(found, Missing)
    assert found.label == "exudyn==1.2.3"
    case = Case("engines_at_one_step", SCENE, found, grid_for(SCENE, 0.02))
    outcome = attempt(case, skip_missing=True).outcome
    assert outcome.kind is OutcomeKind.MISSING
    assert outcome.reason.endswith("conservative engines install exudyn==1.2.3")
    with pytest.raises(MissingEnvironment):
        attempt(case)


@pytest.mark.parametrize("name", ["exudin", "reduced", "exact", "pinocchio==4.0", "exudyn:RK44", "exudyn==", "", "a;b"])
def test_a_name_that_is_no_engine_is_bad_input(name):
    with pytest.raises(BadInput):
        select_engines([name])


def test_no_setting_is_as_installed_where_the_engine_does_not_say_so():
    assert not any(is_as_installed(method) for method in select_engines(["scipy"]))
    assert not is_as_installed(Missing("mujoco", "MuJoCo", "mujoco"))
