"""Each way in which a run can be worse than its baseline, planted, and the failure that must name it."""

import json
import os
import subprocess
import sys
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest
from click.testing import CliRunner

import conservative as cv
from conservative.attitude import rotation_about
from conservative.benchmarks.gate import baseline, compare, dashboards, results, yardstick
from conservative.benchmarks.gate.results import Results, Row, Status
from conservative.benchmarks.suite import points
from conservative.benchmarks.verification.gate_false_alarms import Slower
from conservative.registry import method, scene
from conservative.reports.cli.main import main

BRICK = scene("brick_flip:t_end=1")
MACHINE = "this one"
METHODS = ("reduced", "reduced:order=4", "mujoco:Euler")
SECOND, FOURTH, ENGINE = METHODS


@dataclass(frozen=True)
class NoGyroscopicTerm(cv.Method):
    """A negative control: the body keeps its rates."""

    family: ClassVar[str] = "control"
    role: ClassVar[cv.Role] = cv.Role.OURS

    @property
    def order(self):
        return 2

    def prepare(self, scene, grid):
        w = np.array(scene.w_WB_B0)
        turns = np.array([rotation_about(w, np.linalg.norm(w) * t) for t in grid.t])
        return lambda: cv.Trajectory(scene, grid.t, scene.R_WB0 @ turns, np.tile(w, (len(turns), 1)), self.label)


COMPILE_REFERENCE = yardstick.compile_reference
STEP, TURN = 1e-7, 2e-8
"""Time, s, of a step of any method and of a turn of the yardstick on a clock that only counts them."""


@pytest.fixture(scope="module", autouse=True)
def clock():
    """Time as the gate sees it, without the machine: each step takes as long as all others."""

    def wall_time(run, calls=1):
        done = run()
        return calls * (done * TURN if isinstance(done, int) else done.counters.steps * STEP)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(yardstick, "wall_time", wall_time)
        patch.setattr(yardstick, "compile_reference", lambda: lambda n_steps, h: n_steps)
        yield


def measured(name, instead=None):
    """The row of a method; with `instead`, measured with another one that goes by its name."""
    point = points.Point(BRICK, method(name))
    labels = point.labels
    found = points.measure(replace(point, method=instead or point.method))
    values, spreads = ({key: getattr(each, kind) for key, each in found.items()} for kind in ("value", "spread"))
    ratio = yardstick.time_ratio(instead or point.method, BRICK, BRICK.dt) if name == SECOND and not instead else None
    return Row(point.id, BRICK.name, name, Status.PASSED, labels["engine"], labels["definition"], values, spreads, ratio)


@pytest.fixture(scope="module")
def untouched():
    rows = [measured(name) for name in METHODS]
    return Results(MACHINE, {row.id: row for row in rows}, "abc")


@pytest.fixture(scope="module")
def kept(untouched):
    return baseline.update_baseline(None, [untouched], "the first one")


def with_row(untouched, name, **changes):
    """The results with one row changed; a change of `values` is merged into those it has."""
    (id,) = (id for id, row in untouched.rows.items() if row.method == name)
    row = untouched.rows[id]
    changes["values"] = {**row.values, **changes.get("values", {})}
    return replace(untouched, rows={**untouched.rows, id: replace(row, **changes)})


def failures(kept, found, times="required"):
    """The violations as (measure, method), and their text."""
    verdict = compare.judge(kept, found, times)
    assert verdict.passed == (not verdict.violations)
    return {(each.measure, each.method) for each in verdict.violations}, str(verdict)


def test_an_untouched_run_passes(kept, untouched):
    again = [measured(name) for name in METHODS]
    assert again[0].time_ratio == pytest.approx(STEP / TURN, rel=1e-12)
    assert failures(kept, Results(MACHINE, {row.id: row for row in again}))[0] == set()


@pytest.mark.parametrize(("factor", "caught"), [(1.05, False), (1.3, True)])
def test_a_slower_kernel(kept, untouched, factor, caught):
    slow = yardstick.time_ratio(Slower(method(SECOND), factor), BRICK, BRICK.dt)
    assert slow == pytest.approx(factor * STEP / TURN, rel=1e-3)  # measured 1e-4 off: steps are whole
    found, text = failures(kept, with_row(untouched, SECOND, time_ratio=slow))
    assert found == ({("time ratio", SECOND)} if caught else set())  # 1.10 is allowed
    assert ("time ratio, brick_flip, reduced: was " in text) == caught


def test_the_yardstick_is_compiled_from_the_loop_that_is_hashed():
    assert COMPILE_REFERENCE()(3, 0.1) == pytest.approx(yardstick.step_reference_body(3, 0.1), rel=1e-14)  # measured 0
    assert "def turn" in yardstick.definition()


@pytest.mark.parametrize(
    ("repeats", "taken", "least"), [([9.0, 9.0, 9.0], 3, 9.0), ([0.9, 9.0, 9.0], 1, 0.9), ([1.5, 1.2, 1.1], 3, 1.1)]
)
def test_what_looks_too_slow_is_measured_again(repeats, taken, least, monkeypatch):
    monkeypatch.setattr(yardstick, "sleep", lambda pause: None)
    rest = iter(repeats)
    assert yardstick.confirm(9.5, 1.0, lambda: next(rest)) == least
    assert len(list(rest)) == len(repeats) - taken
    assert yardstick.confirm(0.5, 1.0, lambda: pytest.fail("within its limit")) == 0.5


def test_one_more_newton_iteration(kept, untouched):
    row = measured(SECOND, method("reduced:tol=1e-40"))
    found, text = failures(kept, with_row(untouched, SECOND, values=row.values))
    assert ("iterations", SECOND) in found  # measured 299 instead of 204 in 100 steps
    (single,) = (each.values["iterations"] + 1 for each in untouched.rows.values() if each.method == SECOND)
    assert failures(kept, with_row(untouched, SECOND, values={"iterations": single}))[0] == {("iterations", SECOND)}
    assert "--update" in text


def test_order_3_8_instead_of_4(kept, untouched):
    found, text = failures(kept, with_row(untouched, FOURTH, values={"observed order": 3.8}))
    assert found == {("observed order", FOURTH)}
    assert "is 3.8, allowed at least 3.9" in text


def test_energy_drift_10_times_larger(kept, untouched):
    for name in METHODS:
        (drift,) = (row.values["energy drift max"] for row in untouched.rows.values() if row.method == name)
        found, _ = failures(kept, with_row(untouched, name, values={"energy drift max": 10 * drift}))
        assert found == {("energy drift max", name)}


def test_a_negative_control_in_place_of_the_method(kept, untouched):
    row = measured(SECOND, NoGyroscopicTerm())
    found, _ = failures(kept, with_row(untouched, SECOND, values=row.values))
    assert {("attitude error max", SECOND), ("rate error max", SECOND), ("momentum drift max", SECOND)} <= found


@pytest.mark.parametrize("measure", ["attitude error max", "energy drift max", "iterations", "observed order"])
def test_nan(kept, untouched, measure):
    assert failures(kept, with_row(untouched, SECOND, values={measure: float("nan")}))[0] == {(measure, SECOND)}


def test_a_time_that_is_nan_or_missing(kept, untouched):
    for ratio in (float("nan"), None):
        assert failures(kept, with_row(untouched, SECOND, time_ratio=ratio))[0] == {("time ratio", SECOND)}


def test_a_measure_that_is_gone(kept, untouched):
    (row,) = (row for row in untouched.rows.values() if row.method == SECOND)
    values = {name: value for name, value in row.values.items() if name != "energy drift max"}
    found = replace(untouched, rows={**untouched.rows, row.id: replace(row, values=values)})
    assert failures(kept, found)[0] == {("energy drift max", SECOND)}


def test_a_row_removed_or_renamed(kept, untouched):
    (id,) = (id for id, row in untouched.rows.items() if row.method == FOURTH)
    rows = {other: row for other, row in untouched.rows.items() if other != id}
    found, text = failures(kept, replace(untouched, rows=rows))
    assert found == {("row", FOURTH)}
    assert "was passed, is missing" in text
    renamed = replace(untouched, rows={**rows, "other": replace(untouched.rows[id], id="other")})
    found, text = failures(kept, renamed)
    assert found == {("row", FOURTH)}
    assert "is renamed other" in text
    assert "note: unbaselined: other" in text


@pytest.mark.parametrize("status", ["skipped", "failed", "error", "xfailed"])
def test_a_row_that_did_not_pass(kept, untouched, status):
    found, text = failures(kept, with_row(untouched, SECOND, status=Status(status)))
    assert found == {("row", SECOND)}
    assert f"was passed, is {status}" in text


def test_an_engine_of_another_version(kept, untouched):
    found, text = failures(kept, with_row(untouched, ENGINE, engine="mujoco==3.9.9/Euler"))
    assert found == {("engine version", ENGINE)}
    assert "is mujoco==3.9.9/Euler" in text


def test_another_definition(kept, untouched):
    longer = points.Point(scene("brick_flip:t_end=2"), method(SECOND)).definition
    assert failures(kept, with_row(untouched, SECOND, definition=longer))[0] == {("definition", SECOND)}


def test_a_baseline_of_a_foreign_machine(kept, untouched):
    elsewhere = replace(untouched, machine="another")
    found, text = failures(kept, elsewhere)
    assert found == {("foreign machine", "all")}
    assert "was this one, is another" in text
    found, text = failures(kept, elsewhere, "known")
    assert found == set()
    assert "note: unbaselined machine" in text
    worse = replace(with_row(untouched, SECOND, values={"rate error max": 1.0}), machine="another")
    assert failures(kept, worse, "known")[0] == {("rate error max", SECOND)}  # all but time is gated everywhere
    both = baseline.update_baseline(kept, [elsewhere], "a second machine")
    assert failures(both, elsewhere)[0] == failures(both, untouched)[0] == set()


def test_a_baseline_without_rows(untouched):
    assert failures(baseline.Baseline({}, []), untouched)[0] == {("rows", "all")}


@pytest.mark.parametrize(
    ("damage", "name"),
    [
        (lambda text: text[: len(text) // 2], "truncated"),
        (lambda text: text.replace('"limit": ', '"limit": 1', 1), "edited by hand"),
        (lambda text: "{}", "another format"),
        (None, "no baseline"),
    ],
)
def test_a_damaged_baseline_is_none(kept, untouched, tmp_path, damage, name):
    path, found = tmp_path / "baseline.json", tmp_path / "results.json"
    results.write(untouched, found)
    baseline.write(kept, path)
    arguments = ["gate", "--baseline", str(path), str(found)]
    assert CliRunner().invoke(main, arguments).exit_code == 0
    if damage:
        path.write_text(damage(path.read_text()))
    else:
        path.unlink()
    ended = CliRunner().invoke(main, arguments)
    assert ended.exit_code == 2
    assert name in ended.output


def test_the_command_compares_and_accepts(kept, untouched, tmp_path):
    path, found = tmp_path / "baseline.json", tmp_path / "results.json"
    baseline.write(kept, path)
    results.write(with_row(untouched, SECOND, values={"rate error max": 0.5}), found)
    arguments = ["gate", "--baseline", str(path), str(found)]
    ended = CliRunner().invoke(main, arguments)
    assert ended.exit_code == 1
    assert "rate error max, brick_flip, reduced: was 0.00" in ended.output
    assert CliRunner().invoke(main, [*arguments, "--update", " "]).exit_code == 2
    assert CliRunner().invoke(main, [*arguments, "--update", "wanted so"]).exit_code == 0
    assert CliRunner().invoke(main, arguments).exit_code == 0
    assert [entry["reason"] for entry in baseline.read(path).history] == ["the first one", "wanted so"]
    assert len(baseline.read(path).history[-1]["changed"]) == 1


@pytest.mark.parametrize(
    "changes",
    [{"status": Status.FAILED}, {"values": {"rate error max": float("nan")}}, {"values": {"iterations": float("inf")}}],
)
def test_what_failed_cannot_be_accepted(kept, untouched, changes):
    with pytest.raises(cv.BadInput):
        baseline.update_baseline(kept, [with_row(untouched, SECOND, **changes)], "no")


def test_the_limit_of_a_time_follows_from_repeats():
    calm = baseline.time_limit([1.0, 1.001, 0.999, 1.0, 1.002, 0.998], 10)
    assert calm.limit == pytest.approx(1.05, rel=1e-3)
    noisy = baseline.time_limit([1.0, 1.01, 0.98, 1.02, 0.99, 1.0], 10)
    assert 1.05 < noisy.limit / noisy.value <= 1.10
    assert baseline.time_limit([1.0, 1.0], 10).limit == pytest.approx(1.10)
    spell = baseline.time_limit([1.0, 1.001, 0.999, 1.0, 1.002, 1.4], 10)
    assert spell.limit == pytest.approx(1.05, rel=1e-2)  # one repeat in a slow spell of the machine widens nothing


def test_exports(untouched):
    entries = dashboards.smaller_is_better(untouched)
    assert {"name", "unit", "value", "extra"} == set(entries[0])
    assert not any("order" in entry["name"].rpartition("/")[2] for entry in entries)
    metrics = dashboards.bmf(untouched)["brick_flip / reduced"]
    assert metrics["attitude-error-max"]["lower_value"] <= metrics["attitude-error-max"]["value"]
    json.dumps([entries, metrics], allow_nan=False)


OTHER = """
import pytest

@pytest.mark.parametrize("method", ["kept", "removed"])
def test_mine(benchmark, method):
    benchmark(sum, range(9))
    benchmark.extra_info.update(scene="mine", method=method, error=1e-9, engine="theirs==1", spreads={"error": 0.0})

def test_skipped(benchmark):
    benchmark(sum, range(9))

def test_fails_after_timing(benchmark):
    benchmark(sum, range(9))

@pytest.fixture
def fragile():
    yield

def test_fails_in_teardown(benchmark, fragile):
    benchmark(sum, range(9))
"""
PLANTED = (
    ('["kept", "removed"]', '["kept"]'),
    ("theirs==1", "theirs==2"),
    ("test_skipped(benchmark):\n", "test_skipped(benchmark):\n    pytest.skip('today')\n"),
    ("    yield\n", "    yield\n    assert False\n"),
    (
        "timing(benchmark):\n    benchmark(sum, range(9))\n",
        "timing(benchmark):\n    benchmark(sum, range(9))\n    assert False\n",
    ),
)


def test_from_end_to_end(tmp_path):
    (tmp_path / "pytest.ini").write_text("[pytest]\naddopts = -p no:cacheprovider\n")
    suite = tmp_path / "test_other.py"
    suite.write_text(OTHER)
    code, text = run(tmp_path, "--gate")
    assert (code, "no baseline" in text) == (2, True)
    kept = ["--baseline", str(tmp_path / "benchmarks" / "baseline.json")]
    found = str(tmp_path / results.FOLDER / results.FILE)
    assert CliRunner().invoke(main, ["gate", *kept, "--update", "the first one", found]).exit_code == 0
    code, text = run(tmp_path, "--gate")
    assert code == 0, text
    assert "gate: passed, 5 rows" in text
    assert "## Gate: passed" in (tmp_path / "summary.md").read_text()
    for old, new in PLANTED:
        assert old in suite.read_text()
        suite.write_text(suite.read_text().replace(old, new))
    code, text = run(tmp_path, "--gate", "--junitxml=junit.xml")
    assert code == 1
    report = (tmp_path / "junit.xml").read_text()
    for line in (
        "row, mine, removed: was passed, is missing",
        "is skipped",
        "is failed",
        "is error",
        "definition, mine, kept",
    ):
        assert line in text
        assert line in report
    assert "| row | mine | removed |" in (tmp_path / "summary.md").read_text()


def run(folder, *options):
    command = [sys.executable, "-m", "pytest", "--benchmark", "--benchmark-max-time=0.001", "test_other.py", *options]
    environment = {**os.environ, "GITHUB_STEP_SUMMARY": str(folder / "summary.md")}
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=120, check=False)
    return done.returncode, done.stdout + done.stderr


@pytest.mark.parametrize(
    ("options", "reason"), [(("--benchmark", "-n1"), "-n0"), ((), "together with --benchmark")], ids=["workers", "alone"]
)
def test_the_gate_does_not_judge_what_it_cannot(tmp_path, options, reason):
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "--gate", *options],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == pytest.ExitCode.USAGE_ERROR
    assert reason in done.stderr
