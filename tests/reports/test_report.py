import json
import math
import re
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

from conservative import BadInput, MissingEngine, NotConverged, Reduced, registry
from conservative.benchmarks.measures.measurement import COLUMNS
from conservative.benchmarks.studies import selection, studies
from conservative.benchmarks.studies.throughput import QUICK_BODIES
from conservative.methods.gauss import Gauss
from conservative.outcome import Outcome, OutcomeKind
from conservative.reports import report
from conservative.reports.charts import style
from conservative.reports.cli.main import main
from conservative.reports.cli.options import split_list, split_names
from conservative.reports.document.model import Document
from conservative.reports.run.measure import SCHEMA
from conservative.reports.run.plan import plan_report
from conservative.reports.run.provenance import provenance
from conservative.reports.sections import failures

from ..declared import FULL, MAIN
from .made_up import measurements
from .rows import frame, row


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A real report of one scene and three methods: its folder and the result of the command."""
    folder = tmp_path_factory.mktemp("made") / "report"
    methods = "reduced,mujoco:RK4,heyoka:tol=1e-9,frame=non_spinning"
    options = [
        "--quick",
        "--time-limit",
        "0.03",
        "--scenes",
        "brick_flip",
        "--methods",
        methods,
        "--latex",
        "--out",
        str(folder),
    ]
    done = CliRunner().invoke(main, ["report", *options], env={"COLUMNS": "80"})
    assert done.exit_code == 0, done.output
    return folder, done


def test_report_has_its_files_and_lists_them(made):
    folder, done = made
    names = {path.name for path in folder.iterdir()}
    pictures = {f"{kind}_brick_flip.svg" for kind in ("work_precision", "drift", "convergence")}
    others = {"report.md", "report.tex", "index.html", "measurements.csv", "measurements.json"}
    assert names == pictures | others
    assert set(json.loads((folder / "measurements.json").read_text())["files"]) == names
    assert set(re.findall(r"\]\((\w+\.svg)\)", (folder / "report.md").read_text())) == pictures
    assert done.stdout.strip().endswith("index.html")


def test_a_line_per_study_tells_the_progress_where_there_is_no_terminal(made):
    lines = re.findall(r"^study \d of \d, (.*)", made[1].stderr, re.M)  # without those of every ten seconds, and of compilation
    assert lines == [name.replace("_", " ") for name in MAIN]


def test_the_command_ends_with_a_table_per_scene_the_verdict_and_the_path(made):
    folder, done = made
    lines = done.stdout.strip().splitlines()
    table = pd.read_csv(folder / "measurements.csv")
    assert max(map(len, lines[:-1])) <= 80
    assert lines[-1] == str(folder / "index.html")
    cells = [re.split(r"\s{2,}", line.strip()) for line in lines]
    ours, engine = (next(row for row in cells if row[0] == name) for name in ("reduced", "mujoco RK4"))
    paper = table[(table["study"] == "paper") & (table["method"] == "reduced")]
    drift = paper[paper["quantity"] == "energy"]["value"].iloc[0]
    assert float(ours[1]) == pytest.approx(drift, rel=0.06)  # two digits are shown
    assert float(ours[4]) == pytest.approx(2, abs=0.05)
    assert float(engine[4]) == pytest.approx(4, abs=0.5)
    verdict = " ".join(" ".join(lines[-5:-1]).split())
    assert "the attitude of mujoco 4" in verdict
    assert "is wrong by" in verdict
    assert len(lines) < 40  # measured 20


def test_the_table_for_a_paper_has_error_drift_order_and_time_of_each_scheme(made):
    folder, _ = made
    table, text = pd.read_csv(folder / "measurements.csv"), (folder / "report.tex").read_text()
    rows = [[cell.strip(" \\") for cell in line.split("&")] for line in text.splitlines() if line.endswith("\\")]
    assert rows[0][0] == "scheme"
    names = [row[0] for row in rows[1:]]
    assert names == sorted(names)  # without regard to authors
    value = lambda cell: float(cell.strip("$").replace(r"\times10^{", "e").replace("10^{", "1e").strip("}"))  # noqa: E731
    reduced, mujoco = ({row[0]: row for row in rows}[name] for name in ("reduced", "mujoco RK4"))
    own = table[(table["study"] == "paper") & (table["method"] == "reduced") & (table["dt"] == 0.01)]
    error, drift = own[own["measure"] == "attitude error max"], own[own["measure"] == "drift max"]
    assert [value(cell) for cell in reduced[2:4]] == pytest.approx([error["value"].max(), drift["value"].max()], rel=0.06)
    assert (float(reduced[4]), float(mujoco[4])) == (pytest.approx(2, abs=0.05), pytest.approx(4, abs=0.5))
    time = table[
        (table["study"] == "speed") & (table["method"] == "reduced") & (table["measure"] == "time per simulated second")
    ]
    assert float(reduced[5]) == pytest.approx(time["value"].max() * 1e6, rel=0.06)


def test_the_default_report_measures_a_selection_of_methods_and_a_full_one_everything():
    default, full = plan_report(), plan_report(full=True)
    assert default.names == ("random", *MAIN)
    assert set(full.names) == set(studies.STUDIES)
    assert set(default.methods) < set(full.methods)
    left_out = {name for name, family in registry.list_families().items() if family.method_info.report == ()}
    assert {"exact", "textbook"} <= left_out
    assert {method.family for method in default.methods} == set(registry.list_methods()) - left_out
    assert "textbook" in {method.family for method in full.methods}
    assert plan_report(bodies=2).names == ("random", *MAIN)
    assert plan_report(quick=True).names == plan_report(bodies=0).names == MAIN
    assert plan_report(engines=["scipy"]).names == ("random", *MAIN)
    assert plan_report(engines=["scipy"]).verified
    assert set(plan_report(["lagrange_top"], full=True).names) == set(FULL)


def test_settings_of_the_studies_of_each_kind_of_report():
    """quick, processes, longest run (s), scenes and bodies: as they were when each stood in `plan_report`."""
    main, full = (False, 1, 0.15, 2, None), (False, 1, 0.6, 2, None)
    several = (False, 5, 0.6, 2, None)
    expected = {
        (): {"random": (True, 1, 0.15, 3, None)} | dict.fromkeys(MAIN, main),
        ("quick",): dict.fromkeys(MAIN, (True, 1, 0.15, 2, None)),
        ("full",): {"random": (False, 5, 0.6, 15, None)}
        | dict.fromkeys(FULL, full)
        | dict.fromkeys(("work_precision", "each_step"), several)
        | {"stability": (False, 1, 0.6, 11, None), "hard_cases": (False, 1, 0.6, len(registry.list_scenes()), None)}
        | {"throughput": (True, 5, 0.15, 3, QUICK_BODIES)},
        ("full", "quick"): {"random": (True, 1, 0.15, 5, None)} | dict.fromkeys(FULL, (True, 1, 0.15, 2, None)),
    }
    for options, studies_of in expected.items():
        planned = plan_report(**dict.fromkeys(options, True)).studies
        found = {
            each.name: (each.quick, each.processes, each.longest_run, len(each.scenes), getattr(each, "bodies", None))
            for each in planned
        }
        assert found == studies_of, options


def test_methods_of_other_packages_are_part_of_the_default_report(monkeypatch):
    monkeypatch.setattr(Gauss, "method_info", replace(Gauss.method_info, report=None))
    assert [method.name for method in selection.main_methods() if method.family == "gauss"] == [
        method.name for method in registry.method("gauss").settings_for("variants")
    ]


@pytest.mark.slow
def test_a_quick_report_with_random_bodies_ends_well(tmp_path):
    options = ["--quick", "--scenes", "brick_flip", "--methods", "taylor:order=12,scipy", "--bodies", "1"]
    done = CliRunner().invoke(main, ["report", *options, "--out", str(tmp_path / "report")])
    assert done.exit_code == 0, done.output


def test_a_report_names_the_commit_that_it_began_at(monkeypatch, tmp_path):
    commits = iter(["before", "after"])
    monkeypatch.setattr(report, "provenance", lambda: replace(provenance([]), commit=next(commits)))
    monkeypatch.setattr(report, "measure", lambda plan, step, progress: measurements())
    monkeypatch.setattr(report, "render", lambda document, folder, png: document)
    written = report.write(plan_report(["brick_flip"], ["reduced"], quick=True), tmp_path / "report", lambda *_: None)
    assert written.data["commit"] == "before"


def test_table_and_json_hold_the_same_rows_with_their_origin(made):
    folder, _ = made
    table = pd.read_csv(folder / "measurements.csv")
    stored = json.loads((folder / "measurements.json").read_text())
    assert tuple(table.columns) == COLUMNS
    assert len(stored["rows"]) == len(table) > 100
    assert set(MAIN) == set(table["study"])
    assert stored["schema"] == SCHEMA
    assert stored["packages"]["mujoco"]
    assert stored["machine"]["cores"]
    for key in ("command", "python", "commit", "date"):
        assert stored[key]
    energy = table[
        (table["study"] == "paper")
        & (table["measure"] == "drift max")
        & (table["quantity"] == "energy")
        & (table["method"] == "reduced")
    ]
    assert energy["value"].max() < 1e-13  # measured 5e-16
    values = [math.nan if row["value"] is None else row["value"] for row in stored["rows"]]
    assert np.array_equal(
        values, table["value"], equal_nan=True
    )  # pandas' own JSON has 15 decimals, and 1.33e-15 is one of them


def test_pictures_are_drawings_with_lines(made):
    pictures = list(made[0].glob("*.svg"))
    assert pictures
    for path in pictures:
        root = ET.parse(path).getroot()
        assert root.tag.endswith("svg")
        assert len(root.findall(".//{http://www.w3.org/2000/svg}path")) > 20, path.name


def test_report_that_is_stopped_leaves_nothing(tmp_path):
    def stop(share, what):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        report.write(plan_report(["brick_flip"], ["reduced"]), tmp_path / "report", stop)
    assert list(tmp_path.iterdir()) == []


def test_folder_is_checked_before_any_work(tmp_path):
    (tmp_path / "mine.txt").write_text("mine")

    def fail(share, what):
        pytest.fail("work was begun")

    with pytest.raises(BadInput, match=r"out: got .*mine.txt"):
        report.write(plan_report(["brick_flip"], ["reduced"]), tmp_path, fail)


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (["--scenes", "brik_flip"], "'brick_flip' (nearest)"),
        (["--methods", "reduced,mujocco"], "'mujoco' (nearest)"),
        (["--methods", "mujoco:RK5"], "RK5"),
        (["--out", "file.txt"], "out: got"),
    ],
)
def test_mistakes_end_before_any_work(arguments, part, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file.txt").write_text("mine")
    done = CliRunner().invoke(main, ["report", *arguments])
    assert done.exit_code == 2
    assert part in done.stderr
    assert done.stderr.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["file.txt"]


def test_missing_engine_stops_the_plan_unless_it_is_skipped(monkeypatch):
    def missing(self):
        raise MissingEngine("mujoco", "mujoco")

    monkeypatch.setattr(type(registry.method("mujoco")), "label", property(missing))
    with pytest.raises(MissingEngine, match="pip install mujoco"):
        plan_report(["brick_flip"], ["mujoco"])
    assert len(plan_report(["brick_flip"], ["mujoco"], skip_missing=True).methods) == 5


def test_a_missing_engine_is_skipped_among_all_methods(monkeypatch):
    def method(text, found=registry.method):
        if text == "pinocchio":
            raise MissingEngine("Pinocchio", "pin")
        return found(text)

    monkeypatch.setattr(registry, "method", method)
    with pytest.raises(MissingEngine, match="pip install pin"):
        plan_report(["brick_flip"], [])
    assert "pinocchio" in [method.name for method in plan_report(["brick_flip"], [], skip_missing=True).methods]


def test_a_failure_of_our_methods_fails_the_command(monkeypatch):
    outcome = NotConverged(3, 0.02, 1.0).outcome
    found = [
        row("paper", "reduced", "energy drift max", float("nan"), 0.01, scene="brick_flip", outcome=each)
        for each in (outcome, "unsupported")
    ]
    failed = failures.failures_of_ours(frame(found))
    assert failed == [f"reduced on brick_flip, dt = 0.01 s: {outcome}"]
    monkeypatch.setattr(report, "write", lambda plan, out, step, resume: Document("", "", (), failures=failed))
    done = CliRunner().invoke(main, ["report", "--methods", "reduced"])
    assert done.exit_code == 1
    assert "not converged in step 3" in done.stderr


def test_names_with_settings_are_kept_together():
    assert split_names("methods", ("a,b:x=1,y=2,c", "d")) == ["a", "b:x=1,y=2", "c", "d"]
    assert split_names("methods", ("a,b=1,c:x=1,d==2,e=3",)) == ["a", "b=1", "c:x=1", "d==2", "e=3"]
    assert split_names("engines", ("a==1,b==2,c",)) == ["a==1", "b==2", "c"]
    assert split_names("methods", ()) == []
    assert split_list("engines", ("all, exudyn,mujoco==3.6.0",)) == ["all", "exudyn", "mujoco==3.6.0"]


@pytest.mark.parametrize("option", ["--scenes", "--methods"])
@pytest.mark.parametrize("value", ["", ",", " , "])
def test_an_option_that_names_nothing_does_not_mean_everything(option, value, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(main, ["report", option, value])
    assert done.exit_code == 2
    assert f"Invalid value for {option}: it names nothing" in done.stderr
    assert list(tmp_path.iterdir()) == []


MUJOCO = dict.fromkeys(("mujoco 4.0.0 RK4", "mujoco 4.0.0 Euler"), "mujoco")


def test_the_colour_of_a_family_does_not_depend_on_others():
    some = style.colours({"reduced": "reduced", **MUJOCO})
    more = style.colours({"heyoka 7.13.2 body": "heyoka", **MUJOCO, "reduced": "reduced", "their_own x": "their_own"})
    assert some["reduced"] == more["reduced"]
    assert some["mujoco 4.0.0 RK4"] == more["mujoco 4.0.0 Euler"]
    assert len(set(more.values())) == 4
    assert list(style.number_in_family({**MUJOCO, "reduced": "reduced"}).values()) == [0, 1, 0]


def test_provenance_has_command_version_and_commit():
    found = provenance(["report", "--out", "a b"])
    assert found.command == "conservative report --out 'a b'"
    assert Reduced().label.partition("/")[0] == f"conservative=={found.compared['conservative-rotation']}"
    assert re.fullmatch(r"([0-9a-f]{40}(\+changes)?)|unknown", found.commit)


def test_a_run_that_was_skipped_has_its_reason():
    outcome = Outcome(OutcomeKind.SKIPPED, "no reference solution: they differ")
    rows = [row(study, "reduced", "energy drift max", float("nan"), outcome=outcome) for study in ("paper", "motion")]
    (shown,) = failures.failures(frame(rows)).rows
    assert [str(each) for each in shown] == ["made_up", "reduced", "skipped", outcome.reason, "paper, motion", "0.1"]
