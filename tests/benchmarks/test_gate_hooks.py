"""The hooks of a gated run, one by one, on reports that are made up."""

import hashlib
import inspect
from pathlib import Path
from types import SimpleNamespace

import pytest

from conservative.benchmarks.gate import baseline, compare, dashboards, pytest_gate, results, yardstick
from conservative.benchmarks.gate.results import Results, Row, Status
from conservative.benchmarks.gate.stash import REPEAT

HERE, COMMIT = "here", "abc"
INFO = {"scene": "brick", "method": "reduced", "error": "1e-9", "spreads": {"error": 1e-12, "gone": 0}, "time ratio": 2}


@pytest.fixture(autouse=True)
def origin(monkeypatch):
    monkeypatch.setattr(pytest_gate, "machine", lambda: SimpleNamespace(times_key=HERE))
    monkeypatch.setattr(pytest_gate, "commit", lambda folder: COMMIT)
    monkeypatch.delenv("GITHUB_STEP_SUMMARY", raising=False)


@pytest.fixture
def gate(tmp_path):
    options = {"conservative_gate_baseline": "kept.json", "conservative_gate_times": "required"}
    return pytest_gate.Gate(SimpleNamespace(rootpath=tmp_path, getoption=options.get))


def benchmark(info=INFO, **changes):
    """A test that is a benchmark."""
    stats = SimpleNamespace(stats=SimpleNamespace(min=1e-6, max=2.0))
    held = SimpleNamespace(extra_info=dict(info), stats=stats)
    names = {"path": Path("/a/file.py"), "nodeid": "b/file.py::test_x[1]", "name": "test_x[1]"}
    return SimpleNamespace(**{**names, "fixturenames": ["benchmark"], "funcargs": {"benchmark": held}, "stash": {}, **changes})


def report(when="call", outcome="passed", **more):
    return SimpleNamespace(when=when, outcome=outcome, passed=outcome == "passed", **more)


def hand_in(gate, item, *reports):
    """Give reports to the hook as pytest does."""
    for each in reports:
        hook = gate.pytest_runtest_makereport(item)
        next(hook)
        with pytest.raises(StopIteration) as ended:
            hook.send(each)
        assert ended.value.value is each


def test_a_row_is_what_the_benchmark_left():
    found = pytest_gate.row(benchmark(), report())
    assert found.id == "file.py::test_x[1]"
    assert (found.scene, found.method, found.status, found.engine) == ("brick", "reduced", Status.PASSED, "")
    assert found.values["error"] == 1e-9
    assert found.values["gone"] != found.values["gone"]
    assert found.spreads == {"error": 1e-12, "gone": 0.0}
    assert (found.time_ratio, found.seconds) == (2.0, 1e-6)
    assert found.definition == hashlib.sha256(b"test_x[1]").hexdigest()[:16]
    named = pytest_gate.row(benchmark({"definition": "mine", "engine": "e==1"}), report(outcome="failed"))
    assert (named.definition, named.engine, named.time_ratio, named.status) == ("mine", "e==1", None, Status.FAILED)
    assert pytest_gate.row(benchmark(), report(outcome="skipped", wasxfail="why")).status is Status.XFAILED


def test_a_row_of_what_never_ran():
    found = pytest_gate.row(benchmark(funcargs={}), report("setup", "skipped"))
    assert (found.scene, found.values, found.seconds, found.status) == ("", {}, None, Status.SKIPPED)


def test_a_test_without_a_definition_is_defined_by_its_source(request):
    text = inspect.getsource(request.function) + request.node.name
    assert pytest_gate._source_hash(request.node) == hashlib.sha256(text.encode()).hexdigest()[:16]


def test_which_reports_leave_a_row(gate):
    again = [].clear
    item = benchmark(stash={REPEAT: again})
    hand_in(gate, item, report("setup"))
    assert not gate.rows
    hand_in(gate, item, report(), report("teardown"))
    assert gate.rows["file.py::test_x[1]"].status is Status.PASSED
    assert gate.repeats == {"file.py::test_x[1]": again}
    hand_in(gate, item, report("teardown", "failed"))
    assert gate.rows["file.py::test_x[1]"].status is Status.ERROR
    hand_in(gate, benchmark(fixturenames=[], path=Path("other.py")), report())
    hand_in(gate, SimpleNamespace(), report())
    assert len(gate.rows) == 1
    hand_in(gate, benchmark(path=Path("other.py")), report("setup", "failed"))
    assert gate.rows["other.py::test_x[1]"].status is Status.FAILED
    assert len(gate.repeats) == 1


def kept(gate, **changes):
    """Write a baseline that accepts the rows of this run, as they are after these changes."""
    rows = {id: Row(**{**vars(row), **changes}) for id, row in gate.rows.items()}
    baseline.write(baseline.update_baseline(None, [Results(HERE, rows, COMMIT)], "first"), gate.root / "kept.json")


def measured(gate, ratio=2.0, again=None):
    info = {**INFO, "spreads": {"error": 1e-12}, "time ratio": ratio}
    hand_in(gate, benchmark(info, stash={REPEAT: again} if again else {}), report())


def test_the_verdict_is_kept_with_what_it_is_about(gate, tmp_path, monkeypatch):
    measured(gate)
    kept(gate)
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(tmp_path / "step.md"))
    (tmp_path / "step.md").write_text("before\n")
    verdict = gate.finish()
    assert verdict is gate.verdict
    assert verdict == compare.Verdict((), (), 1)
    folder = tmp_path / ".benchmarks" / "gate"
    names = {results.FILE, dashboards.SUMMARY, dashboards.BMF, dashboards.SMALLER_IS_BETTER}
    assert {path.name for path in folder.iterdir()} == names
    assert results.read(folder / results.FILE) == Results(HERE, gate.rows, COMMIT)
    assert (folder / "summary.md").read_text() == dashboards.markdown(verdict)
    assert (tmp_path / "step.md").read_text() == "before\n" + dashboards.markdown(verdict)


def test_what_is_too_slow_is_measured_again_and_kept(gate, monkeypatch):
    monkeypatch.setattr(yardstick, "sleep", lambda pause: None)
    measured(gate, 9.0, lambda: 2.1)
    kept(gate, time_ratio=2.0)
    assert gate.finish().passed
    assert results.read(gate.folder / results.FILE).rows["file.py::test_x[1]"].time_ratio == 2.1
    measured(gate, 9.0, lambda: 8.0)
    assert [each.now for each in gate.finish().violations] == ["8"]


def test_what_is_not_in_the_baseline_is_not_measured_again(gate):
    measured(gate)
    kept(gate)
    gate.repeats = {"file.py::test_x[1]": lambda: pytest.fail("within its limit"), "new": lambda: pytest.fail("no limit")}
    gate.rows["new"] = gate.rows["file.py::test_x[1]"]
    assert gate.finish().passed


def test_no_baseline_is_no_verdict(gate):
    said = []
    terminal = SimpleNamespace(section=said.append, write_line=said.append)
    session = SimpleNamespace(exitstatus=0)
    gate.pytest_terminal_summary(terminal)
    gate.pytest_sessionfinish(session)
    assert (said[0], said[1], session.exitstatus) == ("gate", "no verdict: the run ended before the gate", 2)
    measured(gate)
    with pytest.raises(baseline.NoBaseline):
        gate.finish()
    gate.pytest_terminal_summary(terminal)
    assert (said[4], said[5]) == ("no verdict: no baseline", f"results and exports: {gate.folder}")
    session.exitstatus = 1
    gate.pytest_sessionfinish(session)
    assert session.exitstatus == 2


def test_a_verdict_leaves_the_exit_status(gate):
    gate.verdict = compare.Verdict((), (), 1)
    for status in (0, 1):
        session = SimpleNamespace(exitstatus=status)
        gate.pytest_sessionfinish(session)
        assert session.exitstatus == status
    interrupted, gate.verdict = SimpleNamespace(exitstatus=3), None
    gate.pytest_sessionfinish(interrupted)
    assert interrupted.exitstatus == 3


def test_the_gate_is_the_last_item_and_fails_in_its_own_words(gate, request):
    items = [request.node]
    gate.pytest_collection_modifyitems(request.session, items)
    item = items[-1]
    assert (len(items), item.name, item.collector) == (2, "gate", gate)
    assert item.reportinfo() == (item.path, None, "gate")
    gate.finish = lambda: compare.Verdict((), (), 1)
    item.runtest()
    failed = compare.Verdict((compare.Violation(*"abcdef"),), (), 1)
    gate.finish = lambda: failed
    with pytest.raises(pytest_gate.GateFailed) as raised:
        item.runtest()
    assert item.repr_failure(raised) == str(failed)
    with pytest.raises(KeyError) as other:
        {}["key"]
    assert "{}" in str(item.repr_failure(other))


def test_the_gate_comes_after_all_other_plugins():
    for hook in (pytest_gate.Gate.pytest_collection_modifyitems, pytest_gate.Gate.pytest_sessionfinish):
        assert hook.pytest_impl["trylast"]
    assert pytest_gate.Gate.pytest_runtest_makereport.pytest_impl["wrapper"]
