"""A method is one file and an entry point; every part of the package that uses methods then uses it."""

import importlib
import sys

import pytest

import conservative as cv
from conservative import deferred_imports, registry
from conservative.benchmarks.studies import hard_cases, motion, selection
from conservative.benchmarks.suite import points
from conservative.errors import NotLoadable
from conservative.methods import search
from conservative.reports.charts import style

SOURCE = '''
from dataclasses import dataclass
from typing import ClassVar

from conservative.method_info import MethodInfo, Cost
from conservative.method import Method, Role
from conservative.methods.reduced import Reduced


@dataclass(frozen=True)
class Borrowed(Method):
    """The map of `Reduced` with almost no declared cost."""

    parts: int = 1

    family: ClassVar[str] = "borrowed"
    role: ClassVar[Role] = Role.OURS
    method_info: ClassVar[MethodInfo] = MethodInfo(
        variants=("parts=1", "parts=2", "parts=3"),
        suite=("parts=2",),
        pictures=("parts=3",),
        rank=-1,
        group="implicit",
        cost=lambda method: Cost(step=1e-9),
        colour="#123456",
    )

    @property
    def order(self):
        return 2

    @property
    def conserves(self):
        return frozenset({"energy"})

    def prepare(self, scene, grid):
        return Reduced().prepare(scene, grid)
'''
SILENT = (
    SOURCE.partition("    method_info:")[0]
    + """
    order = None

    def prepare(self, scene, grid):
        raise NotImplementedError
"""
)
"""The same method with only the members that have no default."""


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """Install a package of one file as pip would."""

    def install(source, entry="borrowed = borrowed_method:Borrowed"):
        (tmp_path / "borrowed_method.py").write_text(source)
        info = tmp_path / "borrowed_method-1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text("Metadata-Version: 2.1\nName: borrowed_method\nVersion: 1.0\n")
        (info / "entry_points.txt").write_text(f"[{deferred_imports.METHODS}]\n{entry}\n")
        monkeypatch.syspath_prepend(tmp_path)
        importlib.invalidate_caches()
        deferred_imports.list_entries.cache_clear()

    yield install
    sys.modules.pop("borrowed_method", None)
    monkeypatch.undo()
    deferred_imports.list_entries.cache_clear()


def test_the_automatic_choice_considers_it(installed):
    top = cv.scenes.asymmetric_top(t_end=0.5)
    before = [method.family for method in search.candidates(top)]
    assert "borrowed" not in before
    installed(SOURCE)
    found = [method.family for method in search.candidates(top)]
    assert found == ["borrowed"] * 3 + ["taylor"] * 3  # the first of its group, and the methods without a group
    assert search.candidates(cv.scenes.brick_flip()) == (cv.MoserVeselov(),)  # an exact family stays alone
    assert cv.integrate(top, error=1e-3).choice.method.family == "borrowed"


def test_the_suite_times_its_settings(installed):
    installed(SOURCE)
    found = [point for point in points.points() if point.method.family == "borrowed"]
    assert [point.scene.name for point in found] == list(points.SCENES)
    assert {point.method.name for point in found} == {"borrowed:parts=2"}


def test_pictures_use_its_colour_and_its_setting(installed):
    lines = {"heyoka 7.13.2 body": "heyoka", "borrowed parts=2": "borrowed", "reduced": "reduced"}
    assert style.colours(lines)["borrowed parts=2"] != "#123456"
    installed(SOURCE)
    assert style.colours(lines)["borrowed parts=2"] == "#123456"
    assert list(style.order_lines(lines)) == ["reduced", "borrowed parts=2", "heyoka 7.13.2 body"]  # ours before engines
    methods = selection.methods(["borrowed", "reduced:order=4"])
    assert [method.name for method in motion.select_methods(methods)] == ["borrowed:parts=3", "reduced:order=4"]


def test_a_method_needs_no_card(installed):
    installed(SILENT)
    method = registry.method("borrowed")
    assert method in [point.method for point in points.points()]
    assert method in hard_cases.settings(selection.methods())
    assert method in motion.select_methods(selection.methods())
    assert style.colours({"borrowed": "borrowed"})["borrowed"] not in style.PALETTE.values()
    assert "borrowed" not in {candidate.family for candidate in search.candidates(cv.scenes.asymmetric_top())}


NEEDY = SOURCE.replace(
    "    @property\n    def order",
    "    def __post_init__(self):\n        raise MissingEngine('Engine', 'engine')\n\n    @property\n    def order",
).replace("from conservative.method ", "from conservative.errors import MissingEngine\nfrom conservative.method ")
"""The same method, which needs an engine that is not installed."""


def test_a_method_without_its_engine_breaks_nothing(installed):
    top = cv.scenes.asymmetric_top()
    before = search.candidates(top)
    installed(NEEDY)
    assert "borrowed" in registry.list_families()
    assert search.candidates(top) == before
    missing = [point.method for point in points.points() if point.method.name == "borrowed"]
    assert {type(method) for method in missing} == {selection.Missing}


BROKEN = {
    "nothing there": ("", "borrowed = borrowed_nowhere:Borrowed", NotLoadable, "'borrowed', registered as 'borrowed_nowhere:B"),
    "fails on import": ("raise OSError('no licence')", "borrowed = borrowed_method:Borrowed", NotLoadable, "cannot be loaded"),
    "no class": (SOURCE, "borrowed = borrowed_method:Phantom", NotLoadable, "cannot be loaded"),
    "not a method": (SOURCE, "borrowed = borrowed_method:Role", cv.BadInput, "class Role has family = None"),
    "another name": (SOURCE, "lent = borrowed_method:Borrowed", cv.BadInput, "family = 'borrowed'; expected family = 'lent'"),
}


@pytest.mark.parametrize("what", BROKEN)
def test_a_broken_entry_point_is_reported_and_breaks_nothing(installed, what):
    source, entry, error, message = BROKEN[what]
    top = cv.scenes.asymmetric_top()
    families, chosen = registry.list_families(), search.candidates(top)
    installed(source, entry)
    with pytest.raises(error, match=message):
        registry.method(entry.partition(" ")[0])
    assert registry.list_families() == families
    assert search.candidates(top) == chosen
    assert list(style.order_lines({"mujoco 4.0.0 RK4": "mujoco", "reduced": "reduced"})) == ["reduced", "mujoco 4.0.0 RK4"]
