"""The hooks of a gated run, one by one, on reports with chosen outcomes."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from conservative.benchmarks.gate import baseline, compare, pytest_gate, results
from conservative.benchmarks.gate.results import Results, Status
from conservative.errors import NotWritten

INFO = {"scene": "brick", "method": "reduced", "error": "1e-9", "spreads": {"error": 1e-12}}
ID = "file.py::test_x[1]"


@pytest.fixture
def gate(tmp_path, monkeypatch):
    monkeypatch.delenv("GITHUB_STEP_SUMMARY", raising=False)
    return pytest_gate.Gate(SimpleNamespace(rootpath=tmp_path, getoption={"conservative_gate_baseline": "kept.json"}.get))


def benchmark(info=INFO, **changes):
    """A test that is a benchmark."""
    names = {"path": Path("/a/file.py"), "nodeid": "b/file.py::test_x[1]", "name": "test_x[1]"}
    held = SimpleNamespace(extra_info=dict(info))
    return SimpleNamespace(**{**names, "fixturenames": ["benchmark"], "funcargs": {"benchmark": held}, **changes})


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


def test_a_row_has_the_values_of_extra_info():
    found = pytest_gate.row(benchmark({**INFO, "spreads": {"error": 1e-12, "gone": 0}}), report())
    assert (found.id, found.scene, found.method, found.status, found.engine) == (ID, "brick", "reduced", Status.PASSED, "")
    assert found.values["error"] == 1e-9
    assert found.values["gone"] != found.values["gone"]
    assert found.spreads == {"error": 1e-12, "gone": 0.0}
    named = pytest_gate.row(benchmark({"definition": "mine", "engine": "e==1"}), report(outcome="failed"))
    assert (named.definition, named.engine, named.status) == ("mine", "e==1", Status.FAILED)
    assert pytest_gate.row(benchmark(), report(outcome="skipped", wasxfail="why")).status is Status.XFAILED
    never_ran = pytest_gate.row(benchmark(funcargs={}), report("setup", "skipped"))
    assert (never_ran.scene, never_ran.values, never_ran.status) == ("", {}, Status.SKIPPED)


def test_a_test_without_a_definition_is_defined_by_its_source(request):
    one, other = (request.node, request.session.items[0])
    hashes = {pytest_gate.source_hash(each) for each in {one, other}}
    assert all(len(each) == 16 for each in hashes)
    assert pytest_gate.row(benchmark(), report()).definition == pytest_gate.source_hash(benchmark())


def test_which_reports_leave_a_row(gate):
    item = benchmark()
    hand_in(gate, item, report("setup"))
    assert not gate.rows
    hand_in(gate, item, report(), report("teardown"))
    assert gate.rows[ID].status is Status.PASSED
    hand_in(gate, item, report("teardown", "failed"))
    assert gate.rows[ID].status is Status.ERROR
    hand_in(gate, benchmark(fixturenames=[], path=Path("other.py")), report())
    hand_in(gate, SimpleNamespace(), report())
    assert len(gate.rows) == 1
    hand_in(gate, benchmark(path=Path("other.py")), report("setup", "failed"))
    assert gate.rows["other.py::test_x[1]"].status is Status.FAILED


def test_the_verdict_and_the_results_are_kept(gate, tmp_path, monkeypatch):
    hand_in(gate, benchmark(), report())
    baseline.write(baseline.update_baseline(None, [Results("here", gate.rows)], "first"), gate.root / "kept.json")
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(tmp_path / "step.md"))
    (tmp_path / "step.md").write_text("before\n")
    assert gate.finish() is gate.verdict
    assert gate.verdict == compare.Verdict((), (), 1)
    assert results.read(tmp_path / results.FOLDER / results.FILE).rows == gate.rows
    assert (tmp_path / "step.md").read_text() == "before\n" + gate.verdict.markdown_text()
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(tmp_path))
    with pytest.raises(NotWritten, match=r"GITHUB_STEP_SUMMARY: got .*Is a directory"):
        gate.finish()


def test_without_a_verdict_the_exit_status_is_2(gate):
    session = SimpleNamespace(exitstatus=0)
    gate.pytest_sessionfinish(session)
    assert session.exitstatus == 2
    hand_in(gate, benchmark(), report())
    with pytest.raises(baseline.NoBaseline):
        gate.finish()
    session.exitstatus = 1
    gate.pytest_sessionfinish(session)
    assert session.exitstatus == 2


@pytest.mark.parametrize(("verdict", "status"), [(compare.Verdict((), (), 1), 0), (compare.Verdict((), (), 1), 1), (None, 3)])
def test_other_exit_statuses_stay(gate, verdict, status):
    session, gate.verdict = SimpleNamespace(exitstatus=status), verdict
    gate.pytest_sessionfinish(session)
    assert session.exitstatus == status


def test_the_gate_is_the_last_item_and_fails_with_its_lines(gate, request):
    items = [request.node]
    gate.pytest_collection_modifyitems(request.session, items)
    item = items[-1]
    assert (len(items), item.name, item.collector) == (2, "gate", gate)
    failed = compare.Verdict((compare.Violation(*"abcdef"),), (), 1)
    gate.finish = lambda: failed
    with pytest.raises(pytest_gate.GateFailed) as raised:
        item.runtest()
    assert item.repr_failure(raised) == str(failed)
