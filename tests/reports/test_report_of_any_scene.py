"""Reports and animations of every scene that `run` runs; and what remains of a report where a part of it cannot be made."""

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

import conservative as cv
from conservative import registry
from conservative.benchmarks.studies import studies
from conservative.benchmarks.studies.motion import MOST_FRAMES, TURN
from conservative.features import Feature
from conservative.integration.one import read_method
from conservative.references.truth import Disagreement
from conservative.reports import report
from conservative.reports.charts import style
from conservative.reports.cli.main import main
from conservative.reports.document import latex
from conservative.reports.document.attempt import failed_parts
from conservative.reports.document.model import Document, Motion, Paragraph, Table, walk
from conservative.reports.run import measure
from conservative.reports.run import plan as run_plan
from conservative.reports.run.measure import Measurements
from conservative.reports.run.plan import plan_report
from conservative.reports.run.provenance import provenance
from conservative.reports.sections import advice, scenes, tumbling
from conservative.reports.sections.report import build

from ..crossing import ROWS, write_file
from ..sampling import sampled
from ..shared_reader import reading_worker, shared_reader  # noqa: F401
from . import made_up

PARTS = [feature for feature, row in ROWS.items() if row.in_file]
URDF = """<robot name="r"><link name="palm"><inertial><origin xyz="0.01 -0.02 0.03" rpy="0.3 -0.2 0.5"/><mass value="730"/>
<inertia ixx="2.5" ixy="0.2" ixz="-0.1" iyy="1.7" iyz="0.15" izz="1.0"/></inertial></link></robot>"""


def random_file(folder, seed):
    """Write a scene file without a step, whose duration no step divides: a part of a scene in turn, every third from a URDF."""
    random = np.random.default_rng((37, seed))
    case = ROWS[PARTS[seed % len(PARTS)]].case
    case = replace(case, t_end=float(random.uniform(0.3, 1.9)), w0=case.w0 * random.uniform(0.5, 3))
    path = write_file(folder / f"random_{seed}.toml", case)
    if seed % 3 == 2 and case.flight is None and case.field is None:
        (folder / "hand.urdf").write_text(URDF)
        lines = [line for line in path.read_text().splitlines() if not line.startswith("inertia")]
        lines.insert(lines.index("[body]") + 1, 'urdf = "hand.urdf"\nname = "palm"')
        path.write_text("\n".join(lines) + "\n")
    return path


def methods(scene):
    """MuJoCo, Pinocchio and the method of ours that `run` takes for a scene: that of the paper where it can."""
    return [read_method(None, registry.scene(scene)).name, "mujoco:RK4", "pinocchio:RK4"]


def made(name, named, folder, names=("motion",)):
    """The document of some studies of a scene, drawn into a folder; pictures in files are left out, because they are slow."""
    plan = plan_report([name], named, quick=True, time_limit=0.01)
    plan = replace(plan, studies=tuple(each for each in plan.studies if each.name in names))
    found = Measurements.of(finding for study in plan.studies for finding in studies.findings(study))
    document = build(plan, found, provenance([]))
    return report.render(document, folder, png=False), plan.scenes[0]


@pytest.fixture
def without_files(monkeypatch):
    monkeypatch.setattr(style, "picture_file", lambda picture, kind: b"")


def check(document, scene, folder):
    assert failed_parts(document.blocks) == []
    drawings = [block for block in walk(document.blocks) if isinstance(block, Motion)]
    assert len(drawings) == 1
    assert all(trajectory.t[-1] >= scene.t_end * (1 - 1e-9) for trajectory in drawings[0].trajectories)
    assert (folder / "index.html").stat().st_size > 1e5


@pytest.mark.usefixtures("shared_reader")
@pytest.mark.parametrize("seed", sampled([0, 7, 8], 1, [8]))  # gravity, a torque, damping on a body from a URDF file
def test_a_page_of_a_file_without_a_step(seed, tmp_path, without_files):
    path = random_file(tmp_path, seed)
    names = methods(str(path))
    document, scene = made(str(path), names, tmp_path)
    check(document, scene, tmp_path)
    done = CliRunner().invoke(main, ["watch", str(path), "-m", ",".join(names), "--out", str(tmp_path / "watch.html")])
    assert done.exit_code == 0, done.output


SOME = ("lagrange_top", "gazebo_box", 4, 5)
"""A top, free flight, and files with a turning field and with a rotor: all others take half an hour and run with `--attack`."""


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(each, marks=pytest.mark.slow if each in SOME else pytest.mark.attack)
        for each in (*registry.list_scenes(), *range(10))
    ],
)
def test_report_and_watch_end_with_a_page(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    scene = str(name) if isinstance(name, str) else str(random_file(tmp_path, name))
    names = ",".join(methods(scene))
    for words in (
        ["report", "--quick", "--scenes", scene, "--methods", names, "--time-limit", "0.001"],
        ["watch", scene, "-m", names, "--out", "watch.html"],
    ):
        done = CliRunner().invoke(main, words)
        assert done.exit_code == 0, done.output[-2000:]
    assert (tmp_path / "report" / "index.html").exists()
    assert (tmp_path / "watch.html").exists()


def test_a_scene_whose_reference_solutions_disagree_has_drifts(tmp_path, without_files, monkeypatch):
    def find(scene, grid):
        raise Disagreement(scene.name, ("one", "other"), 0.5, 1e-8)

    monkeypatch.setattr(run_plan, "remember_truths", lambda: find)
    document, _ = made("brick_flip", ["gauss:stages=4", "mujoco:RK4"], tmp_path, ("motion", "paper"))
    text = (tmp_path / "report.md").read_text()
    assert "The attitude errors on brick_flip are not known: no reference solution is confirmed by another one." in text
    tables = [block for block in walk(document.blocks) if isinstance(block, Table) and "drift of energy" in block.header]
    (first, *_) = tables
    rows = {str(row[0]): [str(cell) for cell in row] for row in first.rows}
    for name, grade in (("gauss", "✓"), ("mujoco", "≈")):  # measured 7e-16 and 1.5e-9 in momentum
        (row,) = [row for full, row in rows.items() if full.startswith(name)]
        assert row[3].startswith(grade)
        assert row[4] == "–"
    assert "differ by 0.5 rad" in text  # among the runs that failed or were skipped
    assert failed_parts(document.blocks) == []


@pytest.mark.slow  # `watch` shows the beginning of the same motions, in `test_animation`
def test_a_motion_that_turns_too_often_shows_its_beginning(tmp_path, without_files):
    path = write_file(tmp_path / "long.toml", replace(ROWS[Feature.ROTOR].without, t_end=1000.0))
    path.write_text("dt = 0.5\n" + path.read_text())
    document, scene = made(str(path), ["moser_veselov", "reduced"], tmp_path)
    assert failed_parts(document.blocks) == []
    (drawing,) = [block for block in walk(document.blocks) if isinstance(block, Motion)]
    exact = drawing.trajectories[drawing.truth]
    turned = np.linalg.norm(exact.w_WB_B, axis=1).mean() * exact.t[-1]
    assert 0.8 * MOST_FRAMES * TURN < turned <= MOST_FRAMES * TURN < 1.5 * scene.t_end  # measured 0.95
    assert np.linalg.norm(exact.w_WB_B, axis=1).max() * np.diff(exact.t).max() <= TURN * (1 + 1e-9)
    assert f"Only the first {exact.t[-1]:.3g} s" in (tmp_path / "report.md").read_text()


@pytest.mark.slow
def test_samples_of_an_animation_are_close_enough_to_be_joined(tmp_path, without_files):
    path = write_file(tmp_path / "fast.toml", replace(ROWS[Feature.ROTOR].without, t_end=170.0))  # 300 rad
    path.write_text("dt = 0.1\n" + path.read_text())
    document, scene = made(str(path), ["moser_veselov"], tmp_path)
    (drawing,) = [block for block in walk(document.blocks) if isinstance(block, Motion)]
    exact = drawing.trajectories[drawing.truth]
    assert exact.t[-1] == pytest.approx(scene.t_end)
    assert np.linalg.norm(exact.w_WB_B, axis=1).max() * np.diff(exact.t).max() <= TURN * (1 + 1e-9)


def test_a_centre_of_mass_in_the_fixed_point_is_drawn(tmp_path):
    scene = cv.Scene(
        "balanced", cv.RigidBody((1, 2, 2.5)), np.eye(3), (0.1, 1, 0.2), 1.0, potential=cv.UniformGravity(9.81, (0, 0, 0))
    )
    cv.integrate(scene, 0.01, cv.Reduced()).animate().save(tmp_path / "balanced.html")


@pytest.fixture
def rows_of_a_report(monkeypatch, tmp_path):
    """`report` with made-up rows, which are counted as they are measured."""
    monkeypatch.chdir(tmp_path)
    found, count = [*made_up.convergence("reduced", 2), *made_up.curves_of("brick_flip")], []

    def findings(study, tell):
        count.append(study.name)
        return (each for each in found if each.study == study.name)

    monkeypatch.setattr(measure.studies, "findings", findings)
    monkeypatch.setattr(measure, "compile_kernels", lambda *_: None)
    return count


def fault(*_, **__):
    raise ZeroDivisionError("planted")


class Cell:
    """A cell of a table that cannot be shown."""

    def __str__(self):
        raise ZeroDivisionError("planted")


PLANTED = {  # what fails, how, and a word of its sentence
    "section": (advice, "section", fault, "'advice'"),
    "chart": (scenes, "convergence_figure", fault, "chart of convergence of brick_flip"),
    "animation": (tumbling, "animation", fault, "animation of brick_flip"),
    "results": (tumbling, "results", fault, "'motion'"),
    "picture": (style, "picture_file", fault, "'brick_flip: attitude error against step'"),
    "block": (scenes, "accuracy", lambda *_: Table(["method"], [[Cell()]], "accuracy"), ""),
    "table in LaTeX": (latex, "table", fault, "'report.tex'"),
}
TOGETHER = ("section", "animation", "block", "table in LaTeX")


@pytest.mark.parametrize(
    "parts", [TOGETHER, *(pytest.param((part,), marks=pytest.mark.slow) for part in PLANTED)], ids="+".join
)
def test_a_part_that_fails_is_a_sentence_and_nothing_measured_is_lost(parts, rows_of_a_report, tmp_path, monkeypatch):
    if "picture" not in parts:
        monkeypatch.setattr(style, "picture_file", lambda picture, kind: b"")
    command = ["report", "--quick", "--scenes", "brick_flip", "--methods", "reduced", "--latex"]
    with monkeypatch.context() as patch:
        for part in parts:
            place, name, broken, _ = PLANTED[part]
            patch.setattr(place, name, broken)
        done = CliRunner().invoke(main, command)
    assert done.exit_code == 1, (done.output, done.exception)
    folder = tmp_path / "report"
    assert folder.exists(), (done.output, done.exc_info)
    table, content = pd.read_csv(folder / "measurements.csv"), json.loads((folder / "measurements.json").read_text())
    assert len(table) == len(content["rows"]) == len(made_up.convergence("reduced", 2))
    assert set(content["files"]) == {path.name for path in folder.iterdir()}
    page, pages = (folder / "index.html").read_text(), [folder / "index.html", folder / "report.md"]
    for text in (done.stderr, *([] if parts == ("table in LaTeX",) else [path.read_text() for path in pages])):
        assert "ZeroDivisionError: planted" in text
        assert "--resume" in text
    for part in parts:
        assert PLANTED[part][-1] in done.stderr
    if "table in LaTeX" in parts:
        assert "'report.tex' could not be made (ZeroDivisionError: planted)" in done.stderr
    if "block" in parts:
        assert page.count("ZeroDivisionError: planted") == len(parts) - ("table in LaTeX" in parts)
    assert "Where drift comes from" in page or parts == ("results",)
    assert "observed order" in page  # the table next to the accuracy
    measured = len(rows_of_a_report)
    done = CliRunner().invoke(main, [*command, "--resume"])
    assert done.exit_code == 0, done.output
    assert len(rows_of_a_report) == measured
    assert "planted" not in (folder / "index.html").read_text()
    assert pd.read_csv(folder / "measurements.csv").equals(table)
    assert [path.name for path in tmp_path.iterdir()] == ["report"]


def test_an_animation_that_cannot_be_drawn_is_a_sentence(tmp_path):
    document = report.render(Document("c", "t", [Motion([], []), Paragraph("after it")]), tmp_path, png=False)
    (sentence,) = failed_parts(document.blocks)
    assert "trajectories: got []" in sentence
    page = (tmp_path / "index.html").read_text()
    assert page.index("trajectories: got []") < page.index("after it")


def test_measurements_are_written_if_no_page_can_be(rows_of_a_report, tmp_path, monkeypatch):
    monkeypatch.setattr(report, "render", fault)
    done = CliRunner().invoke(main, ["report", "--quick", "--scenes", "brick_flip", "--methods", "reduced"])
    assert done.exit_code == 1
    assert len(pd.read_csv(tmp_path / "report" / "measurements.csv")) == len(made_up.convergence("reduced", 2))
    assert (tmp_path / "report.partial.json").exists()
