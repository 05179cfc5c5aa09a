"""What a method is called, taken from the method itself."""

from dataclasses import dataclass
from typing import ClassVar

import pytest

from conservative import registry
from conservative.benchmarks.studies.method_names import drop_tolerance, names_of
from conservative.benchmarks.studies.selection import Missing
from conservative.method import Method, Role


@dataclass(frozen=True)
class Adaptive(Method):
    """A method of another package, without a label of its own."""

    stol: int = 3
    tol: float = 1e-6

    family: ClassVar[str] = "adaptive"
    role: ClassVar[Role] = Role.ENGINE

    @property
    def label(self):
        return f"theirs==1.0/{self.name}"

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
        ("heyoka:1e-6", ("heyoka", "VERSION", "tol=1e-06,body"), "body"),
        ("scipy:rtol=1e-9", ("scipy", "VERSION", "DOP853,rtol=1e-09"), "DOP853"),
        ("pinocchio:RK4", ("pinocchio", "VERSION", "aba+RK4"), "aba+RK4"),
    ],
)
def test_the_parts_of_a_name(method, parts, of_series):
    value = registry.method(method)
    found = names_of(value)
    version = value.label.partition("==")[2].partition("/")[0]
    assert (found.family, found.version, found.setting) == tuple(version if part == "VERSION" else part for part in parts)
    assert found.series_setting == of_series
    assert (found.method, found.label) == (value.name, value.label)


def test_a_method_of_another_package_has_its_version_and_its_name_once():
    found = names_of(Adaptive(stol=4, tol=1e-9))
    assert (found.family, found.version, found.setting) == ("adaptive", "1.0", "stol=4,tol=1e-09")
    assert (found.series, found.series_setting) == ("adaptive:stol=4", "stol=4")


def test_only_the_tolerance_is_dropped():
    assert drop_tolerance(Adaptive(), "stol=3,tol=1e-06,x") == "stol=3,x"


def test_a_method_whose_engine_is_missing_is_called_as_it_was_asked_for():
    found = names_of(Missing("mujoco:RK4", "MuJoCo", "mujoco"))
    assert (found.family, found.version, found.setting) == ("mujoco", "", "RK4")
    assert found.label == "mujoco:RK4"
