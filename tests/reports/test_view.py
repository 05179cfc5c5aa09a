"""The view holds every number that a report shows: rendering it integrates nothing and starts no process."""

import dataclasses
import json
import subprocess

import numpy as np
import pytest

from conservative import Gauss, Method, Reduced, registry
from conservative.benchmarks.measures import measurement
from conservative.benchmarks.measures.measurement import Samples
from conservative.benchmarks.studies import studies
from conservative.benchmarks.studies.study import Study
from conservative.method import Role
from conservative.reports import document, view
from conservative.reports.run.measure import Measurements
from conservative.reports.run.plan import plan_report
from conservative.reports.run.provenance import Lock, provenance
from conservative.reports.tables import lines, work_precision

from .made_up import at_step, convergence, curves, measurements, over_steps
from .rows import frame, parts, point, row


def classes(base):
    return {base, *(found for kind in base.__subclasses__() for found in classes(kind))}


@pytest.fixture
def nothing_is_measured(monkeypatch):
    """Make every method that is about to run, and every process that is about to start, an error."""

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
    """Plan, measurements and origin of a report of both scenes: the paper's figures, curves and imports are measured."""
    plan = plan_report([], ["reduced"], quick=True)
    found = [finding for scene in plan.scenes for finding in curves(scene, Reduced())]
    found += studies.findings(Study("paper_figures", plan.scenes, plan.methods))
    lines = [finding for finding in found if isinstance(finding, Samples)]
    return plan, Measurements(measurements().table, measurement.samples_frame(lines)), provenance(["report"])


def test_what_renders_the_view_integrates_nothing_and_starts_nothing(report, nothing_is_measured, tmp_path):
    document.render(view.build(*report), tmp_path, png=False)
    names = {path.name for path in tmp_path.iterdir()}
    assert {"report.md", "index.html", "measurements.json", "paper_figure_1.svg", "paper_figure_2.svg"} < names
    assert "sphere_lagrange_top" in (tmp_path / "index.html").read_text()


def test_engines_and_locks_are_rendered_from_the_view_alone(report, nothing_is_measured, tmp_path):
    plan, measured, source = report
    rows = [*at_step("exudyn==1.0", "RK44", 1e-6), *over_steps("exudyn==1.0", "RK44", (1e-1, 1e-2, 1e-3, 1e-4), 4.0)]
    named = dataclasses.replace(plan, engines=(registry.method("pinocchio"),))
    locked = dataclasses.replace(source, environments=(Lock("exudyn==1.0", "3.11.7", ("exudyn==1.0", "numpy==2.0")),))
    document.render(view.build(named, Measurements(measurement.frame(rows), measured.samples), locked), tmp_path, False)
    text, page = ((tmp_path / name).read_text() for name in ("report.md", "index.html"))
    for part in ("exudyn==1.0/RK44", "4.00 ± 0.01 (4)", "exudyn==1.0, numpy==2.0"):
        assert part in text
        assert part in page
    assert (tmp_path / "engines_brick_flip.svg").exists()


def test_a_report_without_engines_has_no_section_of_them_but_locks_of_its_methods(report, nothing_is_measured, tmp_path):
    plan, measured, source = report
    document.render(view.build(plan, measured, source), tmp_path, False)
    without = (tmp_path / "report.md").read_text(), (tmp_path / "index.html").read_text()
    assert not any("## Engines" in text or 'id="engines"' in text or "Environments of engines" in text for text in without)
    locked = dataclasses.replace(source, environments=(Lock("exudyn==1.0", "3.11.7", ("numpy==2.0",)),))
    document.render(view.build(plan, measured, locked), tmp_path, False)
    for name in ("report.md", "index.html"):
        text = (tmp_path / name).read_text()
        assert "Environments of engines" in text
        assert "numpy==2.0" in text.partition("How this was made")[2]
    assert json.loads((tmp_path / "measurements.json").read_text())["environments"][0]["packages"] == ["numpy==2.0"]


@pytest.mark.parametrize(
    "measure",
    [
        lambda: curves(registry.scene("brick_flip"), Reduced()),
        lambda: list(studies.findings(Study("paper_figures", (registry.scene("brick_flip"),), (Reduced(),)))),
    ],
    ids=["curves", "figures of the paper"],
)
def test_what_rendering_once_measured_would_be_noticed(measure, nothing_is_measured):
    with pytest.raises(pytest.fail.Exception, match=r"runs on|a process starts"):
        measure()


def test_orders_of_attitude_and_rates_are_fitted_to_their_own_errors(report):
    plan, measured, source = report
    errors = [
        row("convergence", "reduced", measure, dt**order, dt, scene="brick_flip")
        for measure, order in (("attitude error max", 2), ("rate error max", 3))
        for dt in (0.1, 0.05, 0.025, 0.0125)
    ]
    built = view.build(plan, Measurements(measurement.frame(errors), measured.samples), source)
    (line,) = next(scene.order[1] for scene in built.scenes if scene.name == "brick_flip")
    assert line[:3] == ["reduced", "2.00 ± 0.00", "3.00 ± 0.00"]


SCENES = ("brick_flip", "lagrange_top")


def line(study, scene, quantity, method="reduced"):
    t = np.linspace(0.5, 60, 120)
    who = {"method": method, "label": method, "series": method, **parts(method)}
    return Samples(study=study, scene=scene, role=Role.OURS, dt=0.1, quantity=quantity, t=t, value=1e-15 * t, **who)


@pytest.fixture(scope="module")
def built():
    plan = dataclasses.replace(
        plan_report([], ["reduced"], quick=True), scenes=tuple(map(registry.scene, SCENES)), methods=(Reduced(), Gauss(2))
    )
    found = [row("long_runs", "reduced", "energy drift max", 2e-15, scene=scene) for scene in SCENES]
    for scene, order in zip(SCENES, (2, 4), strict=True):
        found += convergence("reduced", order, scene)
        found += point("reduced", "ours", 1e-2, 1e-6, scene=scene) + point("scipy:DOP853", "engine", 1e-3, 1e-4, scene=scene)
    found += convergence("gauss:stages=2", 4, "lagrange_top")
    drifts = [line("long_runs", scene, "energy") for scene in SCENES]
    table = frame(found).drop(columns=["name", "line"])
    return view.build(plan, Measurements(table, measurement.samples_frame(drifts)), provenance(["report"])), plan, table


def test_scenes_are_those_of_the_plan_in_its_order(built):
    found, plan, table = built
    assert [scene.name for scene in found.scenes] == list(SCENES)
    assert found.table.equals(table)
    assert found.quick is plan.quick is True
    for scene, value in zip(found.scenes, plan.scenes, strict=True):
        assert (scene.source, scene.free) == (value.source, value.free)
        assert (scene.t_end, scene.dt) == (f"{value.t_end:g}", f"{value.dt:g}")
    assert [scene.free for scene in found.scenes] == [True, False]


def test_each_scene_has_its_rows_and_no_others(built):
    for scene, order in zip(built[0].scenes, (2, 4), strict=True):
        for rows in (scene.points, scene.drifts, scene.errors):
            assert set(rows["scene"]) == {scene.name}
            assert list(rows.index) == list(range(len(rows)))
            assert "index" not in rows
        assert scene.line_count == 2
        assert len(scene.contests[1]) == len(built[0].scenes[0].contests[1])  # as many points, all of them its own
        assert scene.front.equals(work_precision.front(scene.points))
        assert scene.thin_drifts.equals(lines.thin(scene.drifts))
        header, body = scene.order
        slope = next(cells for cells in body if cells[0].startswith("reduced"))
        assert any(str(cell).startswith(f"{order}.0") for cell in slope[1:]), (header, slope)


def test_curves_that_are_missing_are_named(built):
    """Both methods should have one, and none has."""
    assert all("reduced" in scene.without_curve for scene in built[0].scenes)
    drawn = dataclasses.replace(built[1], scenes=built[1].scenes[:1])
    curve = measurement.samples_frame([line("sphere_curves", "brick_flip", quantity) for quantity in ("x", "y", "z")])
    table = built[2]
    found = view.build(drawn, Measurements(table, curve), provenance(["report"]))
    assert "reduced" not in found.scenes[0].without_curve
