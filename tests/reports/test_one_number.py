"""One number for one quantity: what each picture, headline, table and command says about the error and drifts of one run.

The expected values are those of `independent` at the run's own steps.
"""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

import conservative as cv
from conservative import registry
from conservative.attitude import angle_between
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies import studies
from conservative.references.truth import solve
from conservative.reports import animation
from conservative.reports.animation.frames import ERROR, make_panels
from conservative.reports.cli.main import main
from conservative.reports.document.model import Motion, Paragraph, Table, walk
from conservative.reports.run.measure import Measurements
from conservative.reports.run.plan import plan_report
from conservative.reports.run.provenance import provenance
from conservative.reports.run.single_run import run_methods
from conservative.reports.sections import closing, scenes, tumbling
from conservative.reports.sections.measured import Measured

from ..crossing import COM, FREE, HEAVY, PIVOTED, TIMES, VALUES, write_file
from ..independent import motion

DT = 0.002
CASES = {  # no step divides the durations
    "gravity": (replace(PIVOTED, t_end=1.2345), "mujoco:RK4"),
    "free": (replace(FREE, w0=9 * FREE.w0, t_end=1.2345), "mujoco:RK4"),  # 16 rad
    "flight": (replace(FREE, flight=(2.0, COM, 9.81, (0, 0, 0), (1, -2, 3)), t_end=0.5678), "mujoco:RK4"),
    "torque": (replace(FREE, torque=(TIMES, VALUES), frame="world", t_end=1.2345), "scipy:RK45,rtol=1e-6"),
    "balance": (replace(FREE, torque=(TIMES, VALUES), frame="world", t_end=1.2345), "reduced"),  # it sums work and impulse
    "turning": (replace(FREE, field=HEAVY, turning=(1.5, (0.48, -0.6, 0.64)), t_end=1.2345), "scipy:RK45,rtol=1e-6"),
}


USUAL = ("free",)  # each of the others takes seconds


@pytest.fixture(scope="module", params=[pytest.param(name, marks=[pytest.mark.slow] * (name not in USUAL)) for name in CASES])
def said(request, tmp_path_factory):
    """The file of a scene, the method, the right error, rad, the measurements of two studies, and their document's parts."""
    case, method = CASES[request.param]
    path = write_file(tmp_path_factory.mktemp("scene") / f"{request.param}.toml", case)
    path.write_text(f"dt = {DT}\n" + path.read_text())
    scene, chosen = registry.scene(str(path)), registry.method(method)
    run = chosen.run(scene, DT)
    assert run.t[-1] > scene.t_end
    off = angle_between(motion(replace(case, t_end=float(run.t[-1])), run.t)[0], run.R_WB)
    plan = plan_report([str(path)], [method], quick=True)
    planned = tuple(each for each in plan.studies if each.name in ("motion", "paper"))
    found = Measurements.of(finding for study in planned for finding in studies.findings(study))
    return path, scene, run, float(off.max()), Measured(replace(plan, studies=planned), found, provenance([]))


def close(value, error):
    """Whether an error is the right one; both truths are known to 1e-12 rad."""
    return value == pytest.approx(error, rel=1e-5, abs=2e-12)


def shown(text, error):
    """Whether a text has the right number, with as many digits as it shows."""
    value = float(re.search(r"[\d.]+(e-?\d+)?$", text)[0])
    return value == pytest.approx(error, rel=0.55 if len(text.strip("✓≈✗ ").partition("e")[0]) == 1 else 0.06)


def test_the_first_screen(said):
    _, scene, run, error, measured = said
    (found,) = [result for result in tumbling.results(measured) if result.dt == DT and result.method == run_name(measured, run)]
    assert close(found.error, error)
    section, moving = tumbling.section(measured, [found]), tumbling.motion_section(measured, [found])
    (drawing,) = [block for block in walk(moving.blocks) if isinstance(block, Motion)]
    _, panels = make_panels(drawing.trajectories, drawing.labels, drawing.truth, drawing.values)
    assert panels[1].sizes[ERROR][-1] == found.error  # the page shows one digit
    drifts = {name: float(values[-1]) for name, values in panels[1].sizes.items() if name != ERROR}
    expected = {f"{invariant.name} drift": np.abs(run.drift(invariant)) for invariant in scene.invariants}
    for name, drift in drifts.items():
        size = np.linalg.norm(run.drift(name.removesuffix(" drift")), axis=-1) if expected[name].ndim > 1 else expected[name]
        assert drift == pytest.approx(size.max(), rel=1e-6, abs=1e-15)
        assert found.drifts[name.removesuffix(" drift")] == drift
    (table,) = [block for block in section.blocks if isinstance(block, Table)]
    cell = table.rows[0][table.header.index(next(name for name in table.header if "attitude" in name))]
    assert shown(cell.text, error)
    assert cell.value == found.error
    lead = next(block.text for block in section.blocks if isinstance(block, Paragraph))
    assert shown(re.search(r"([\d.]+(e-\d+)?) rad", lead)[1], error)


def run_name(measured, run):
    return next(method.name for method in measured.plan.methods if method.label == run.label)


def test_tables_of_the_scene_and_of_the_terminal(said):
    _, scene, run, error, measured = said
    name = run_name(measured, run)
    rows = measured.rows[(measured.rows["measure"] == Measure.ATTITUDE_MAX.text) & (measured.rows["method"] == name)]
    values = rows[rows["dt"] == DT].groupby("study")["value"].first()
    assert set(values.index) == {"motion", "paper"}
    assert all(close(value, error) for value in values)
    terminal = closing.scene_table(measured.rows, measured.points, scene)
    errors = [row[1 + len(scene.invariants)] for row in terminal.rows]
    assert any(shown(text, error) for text in errors if re.search(r"\d", text))
    accuracy = scenes.accuracy(measured.rows, scene.name)
    assert any(close(row[1].value, error) for row in accuracy.rows)


def test_run_watch_and_notebook(said, tmp_path, monkeypatch):
    path, scene, run, error, measured = said
    name = run_name(measured, run)
    (summary,), _ = run_methods(str(path), [name], DT, None, True, lambda *_: None)
    assert close(summary["error"]["attitude"], error)
    for name_of_drift, drift in summary["drift"].items():
        (here,) = [result.drifts for result in tumbling.results(measured) if result.dt == DT and result.method == name]
        assert np.isnan(drift) or drift == pytest.approx(here[name_of_drift], rel=1e-6, abs=1e-15)
    drawn = []
    monkeypatch.setattr(animation.Animation, "render", lambda self, *_: drawn.append(self) or b"page")
    watched = CliRunner().invoke(
        main, ["watch", str(path), "-m", name, "--dt", str(DT), "--out", str(tmp_path / "w.gif"), "--json"]
    )
    assert watched.exit_code == 0, watched.output
    (known,) = json.loads(watched.stdout)["runs"]
    assert close(known["error"]["attitude"], error)
    (values,) = drawn[0].values
    assert values[ERROR][-1] == known["error"]["attitude"]
    truth = solve(scene, cv.Grid(scene.t_end / 77, 77))  # at other times, and it ends before the run
    _, panels = make_panels([run, truth], ["a", "b"], 1)
    assert close(panels[0].sizes[ERROR][-1], error)
