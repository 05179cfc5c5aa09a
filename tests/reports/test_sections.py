"""The document of a report: its sections contain every number, and building and rendering it measures nothing."""

import dataclasses
import json
import subprocess

import numpy as np
import pytest

from conservative import Gauss, Method, Reduced, Scene, registry, scenes
from conservative.benchmarks.measures import measurement
from conservative.benchmarks.measures.measurement import Samples
from conservative.benchmarks.studies import studies
from conservative.benchmarks.studies.study import Study
from conservative.method import Role
from conservative.reports.charts import style
from conservative.reports.document import html
from conservative.reports.document import json as json_renderer
from conservative.reports.document.model import Figure, Section, Table, walk
from conservative.reports.report import render
from conservative.reports.run.measure import Measurements
from conservative.reports.run.plan import Plan, plan_report
from conservative.reports.run.provenance import LockedEngine, provenance
from conservative.reports.sections.report import build

from .made_up import at_step, convergence, curves, curves_of, measurements, over_steps
from .made_up import named as engines_of
from .rows import frame, parts, point, row
from .rows import texts as texts_of


def classes(base):
    return {base, *(found for kind in base.__subclasses__() for found in classes(kind))}


@pytest.fixture
def nothing_is_measured(monkeypatch):
    """Make every method that is about to run, and every process that is about to start, an error. Pictures are empty files."""
    monkeypatch.setattr(style, "picture_file", lambda picture, kind: b"")

    def integrate(self, scene, grid):
        pytest.fail(f"{self.name} runs on {scene.name}")

    def start(self, arguments, *rest, **options):
        pytest.fail(f"a process starts: {arguments}")

    for name in registry.list_methods():
        registry.method(name)  # so that its class is there
    for kind in classes(Method):
        if "prepare" in vars(kind):
            monkeypatch.setattr(kind, "prepare", integrate)
    monkeypatch.setattr(subprocess.Popen, "__init__", start)


@pytest.fixture(scope="module")
def report():
    """Plan, measurements and origin of a report of both scenes: curves are measured."""
    plan = plan_report([], ["reduced"], quick=True)
    samples = [curve for scene in plan.scenes for curve in curves_of(scene.name)]
    return plan, Measurements(measurements().table, measurement.samples_frame(samples)), provenance(["report"])


def texts(document, folder):
    """The Markdown and the page of a document."""
    render(document, folder, png=False)
    return [(folder / name).read_text(encoding="utf-8") for name in ("report.md", "index.html")]


def test_building_and_rendering_integrates_nothing_and_starts_nothing(report, nothing_is_measured, tmp_path):
    """The report has no section of engines but the locks of its methods."""
    plan, measured, source = report
    locked = dataclasses.replace(source, environments=(LockedEngine("exudyn==1.0", "Python 3.11.7", ("numpy==2.0",)),))
    document = build(plan, measured, locked)
    text, page = texts(document, tmp_path)
    assert 'data-figure="sphere_lagrange_top"' in page
    assert "The motion itself" not in text  # its figures are on the page alone
    for each in (text, page):
        assert not any(part in each for part in ("## Engines", 'id="engines"'))
        assert "Environments of engines" in each
        assert "numpy==2.0" in each.rpartition("How this was made")[2]
    assert json.loads(json_renderer.render(document.data))["environments"][0]["packages"] == ["numpy==2.0"]


def test_engines_and_locks_are_in_the_document(report, nothing_is_measured, tmp_path):
    plan, measured, source = report
    rows = [*at_step("exudyn==1.0", "RK44", 1e-6), *over_steps("exudyn==1.0", "RK44", (1e-1, 1e-2, 1e-3, 1e-4), 4.0)]
    (brick, _) = plan.scenes
    named = dataclasses.replace(plan, scenes=(brick,), engines=(registry.method("pinocchio"), *engines_of(rows)))
    locked = dataclasses.replace(source, environments=(LockedEngine("exudyn==1.0", "Python 3", ("exudyn==1.0", "numpy==2.0")),))
    document = build(named, Measurements(measurement.frame(rows), measured.samples), locked)
    for text in texts(document, tmp_path):
        assert all(part in text for part in ("exudyn==1.0/RK44", "4.00 ± 0.01 (4)", "exudyn==1.0, numpy==2.0"))
    assert (tmp_path / "engines_brick_flip.svg").exists()


@pytest.mark.parametrize(
    "measure",
    [
        lambda: curves(registry.scene("brick_flip"), Reduced()),
        lambda: list(studies.findings(Study("paper", (registry.scene("brick_flip"),), (Reduced(),)))),
    ],
    ids=["curves", "a study"],
)
def test_measuring_would_be_noticed(measure, nothing_is_measured):
    with pytest.raises(pytest.fail.Exception, match=r"runs on|a process starts"):
        measure()


def section(document, title):
    return next(block for block in walk(document.blocks) if isinstance(block, Section) and block.title == title)


def tables(document, title):
    """The tables of a section by caption."""
    return {block.caption: block for block in walk(section(document, title).blocks) if isinstance(block, Table)}


def figure(document, name):
    return next(each for each in document.figures if each.name == name)


def test_orders_of_attitude_and_rates_are_fitted_to_their_own_errors(report):
    plan, measured, source = report
    errors = [
        row("convergence", "reduced", measure, dt**order, dt, scene="brick_flip")
        for measure, order in (("attitude error max", 2), ("rate error max", 3))
        for dt in (0.1, 0.05, 0.025, 0.0125)
    ]
    (brick, _) = plan.scenes
    document = build(
        dataclasses.replace(plan, scenes=(brick,)), Measurements(measurement.frame(errors), measured.samples), source
    )
    (line,) = texts_of(tables(document, "All tables of brick_flip")["brick_flip: observed order"])
    assert line[:3] == ["reduced", "2.00 ± 0.00", "3.00 ± 0.00"]


SCENES = ("brick_flip", "lagrange_top")


def line(study, scene, quantity, method="reduced"):
    t = np.linspace(0.5, 60, 120)
    who = {"method": method, "label": method, "series": method, **parts(method)}
    return Samples(study=study, scene=scene, role=Role.OURS, dt=0.1, quantity=quantity, t=t, value=1e-15 * t, **who)


@pytest.fixture(scope="module")
def planned():
    plan = plan_report([], ["reduced"], quick=True)
    return dataclasses.replace(plan, scenes=tuple(map(registry.scene, SCENES)), methods=(Reduced(), Gauss(2)))


@pytest.fixture(scope="module")
def table():
    found = [row("long_runs", "reduced", "energy drift max", 2e-15, scene=scene) for scene in SCENES]
    for scene, order in zip(SCENES, (2, 4), strict=True):
        found += convergence("reduced", order, scene)
        found += point("reduced", "ours", 1e-2, 1e-6, scene=scene) + point("scipy:DOP853", "engine", 1e-3, 1e-4, scene=scene)
    return frame(found + convergence("gauss:stages=2", 4, "lagrange_top")).drop(columns=["name", "line"])


@pytest.fixture(scope="module")
def built(planned, table):
    drifts = [line("motion", scene, "drift of energy") for scene in SCENES]
    return build(planned, Measurements(table, measurement.samples_frame(drifts)), provenance(["report"]))


def test_scenes_are_those_of_the_plan_in_its_order(built, planned, table):
    titles = [
        block.title for block in walk(built.blocks) if isinstance(block, Section) and block.title.startswith("All tables")
    ]
    assert titles == [f"All tables of {name}" for name in SCENES]
    assert len(built.data["rows"]) == len(table)
    for scene in planned.scenes:
        facts = section(built, f"All tables of {scene.name}").blocks[1].text
        assert facts == f"{scene.source}. {scene.t_end:g} s; the scene's own step is {scene.dt:g} s."


def test_each_method_of_the_package_is_described_once(built):
    (facts,) = section(built, "Methods of this package").blocks
    assert facts.facts[0] == ("reduced", Reduced.__doc__.splitlines()[0])
    assert [name for name, _ in facts.facts] == ["reduced", "gauss"]


def test_each_scene_has_its_rows_and_no_others(built):
    for scene, order in zip(SCENES, (2, 4), strict=True):
        orders = texts_of(tables(built, f"All tables of {scene}")[f"{scene}: observed order"])
        (slope,) = [cells for cells in orders if cells[0].startswith("reduced")]
        assert slope[1].startswith(f"{order}.0")
        panels = [panel["usermeta"]["name"] for panel in figure(built, "time_against_error").panels]
        assert panels == ["brick_flip (free body)", "lagrange_top (top)"]
        (panel,) = figure(built, f"drift_{scene}").panels
        assert panel["datasets"].popitem()[1].count("\n") == 120 + 1


def test_curves_that_are_missing_are_named(planned, table):
    curve = measurement.samples_frame([line("motion", "brick_flip", quantity) for quantity in ("x", "y", "z")])
    document = build(planned, Measurements(table, curve), provenance(["report"]))
    assert (
        "Not drawn, as they fail or do not support the scene: gauss:stages=2." in figure(document, "sphere_brick_flip").summary
    )
    assert not any(isinstance(each, Figure) and each.name == "sphere_lagrange_top" for each in document.figures)


def test_names_of_scenes_cannot_become_markup_and_empty_figures_are_stated():
    scene = Scene("<b>", scenes.brick_flip().body, np.eye(3), (0.1, 0.2, 3.0), 1.0, dt=0.1, source="<i>")
    page = html.render(build(Plan((scene,), (Reduced(),), (), quick=True), measurements(), provenance([])))
    assert "<i>" not in page
    assert "&lt;i&gt;" in page
    assert "Nothing was measured that could be drawn" in page
