"""The pytest plugin and its gate: runs of pytest in another project, and the rows of its results."""

import json
import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from click.testing import CliRunner

from conservative.benchmarks import suite
from conservative.benchmarks.gate import baseline, compare, pytest_gate, pytest_plugin, results
from conservative.benchmarks.gate.results import Results
from conservative.errors import NotWritten
from conservative.outcome import OK, Outcome, OutcomeKind
from conservative.reports.cli.main import main

from ...environments import PATIENCE
from ...sampling import sampled

SUITE = Path(suite.__file__).parent
FEW_PLUGINS = " ".join(f"-p no:{name}" for name in ("zarr", "hypothesispytest", "anyio"))
"""Plugins of other packages, whose imports take two seconds in each pytest that a test starts."""
INI = f"[pytest]\naddopts = {FEW_PLUGINS} -p no:cacheprovider --benchmark-max-time=0.001\n"
OTHER = """
def test_plain():
    pass

def test_timed(benchmark):
    benchmark.extra_info.update(label="mine", error=1.25e-9)
    benchmark(sum, range(100))
"""


@pytest.fixture
def other(tmp_path):
    """Another project, with a benchmark of its own and no settings."""
    (tmp_path / "checks").mkdir()
    (tmp_path / "checks" / "test_other.py").write_text(OTHER)
    (tmp_path / "pytest.ini").write_text(f"{INI}testpaths = checks\n")
    return tmp_path


def run(folder, *options):
    command = [sys.executable, "-m", "pytest", *map(str, options)]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=PATIENCE, check=False)
    return done.returncode, done.stdout + done.stderr


LOADED = """
import sys
import pytest
before = set(sys.modules)
import conservative.benchmarks.gate.pytest_plugin
roots = {"conservative", "numpy", "numba", "pandas"}
print(*(name for name in set(sys.modules) - before if name.partition(".")[0] in roots))
"""


def test_the_plugin_imports_no_other_module_of_the_package():
    done = subprocess.run([sys.executable, "-c", LOADED], capture_output=True, text=True, timeout=PATIENCE, check=True)
    plugin = "conservative.benchmarks.gate.pytest_plugin"
    above = {".".join(plugin.split(".")[:length]) for length in range(1, 5)}
    assert set(done.stdout.split()) == above | {"conservative.version"}


@pytest.mark.slow
def test_without_the_option_other_projects_are_unaffected(other):
    code, text = run(other)
    assert code == 0
    assert "2 passed" in text
    assert "accuracy and time" not in text


def test_accuracy_is_printed_next_to_the_times(other):
    _, text = run(other, "--benchmark", "checks")
    after = text.split("accuracy and time")[1].splitlines()
    assert after[1].split() == ["benchmark", "min,", "s", "median,", "s", "error"]
    name, *numbers = after[2].split()
    assert name == "test_timed"
    assert float(numbers[2]) == 1.25e-9


@pytest.mark.slow
def test_the_suite_is_skipped_without_the_option(other):
    assert "1 skipped" in run(other, SUITE, "-k", "brick_flip-scipy")[1]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "reason"),
    [
        (("--gate",), "together with --benchmark"),
        (("--gate", "--benchmark", "-n1"), "-n0"),
        (("--benchmark", "-p", "no:benchmark"), "pytest-benchmark is not loaded"),
    ],
    ids=["alone", "workers", "no timer"],
)
def test_missing_requirements_are_usage_errors(other, options, reason):
    code, text = run(other, "--override-ini=addopts=", *options)
    assert (code, reason in text) == (pytest.ExitCode.USAGE_ERROR, True), text


@pytest.mark.parametrize(("options", "expected"), [((), (0.1, 2)), (("--benchmark-max-time=3",), (1.0, 5))])
def test_the_suite_runs_briefly_without_a_path(options, expected):
    config = SimpleNamespace(
        args=["tests"],
        args_source=pytest.Config.ArgsSource.TESTPATHS,
        getoption={"conservative_benchmark": True}.get,
        invocation_params=SimpleNamespace(args=options, dir=Path.cwd()),
        option=SimpleNamespace(benchmark_max_time=1.0, benchmark_min_rounds=5),
        pluginmanager=SimpleNamespace(hasplugin=lambda name: True),
    )
    pytest_plugin.pytest_configure(config)
    assert config.args == [str(SUITE)]
    assert (config.option.benchmark_max_time, config.option.benchmark_min_rounds) == expected
    assert pytest_plugin.pytest_xdist_auto_num_workers(config) == 0


@pytest.mark.slow
def test_options_of_pytest_benchmark_keep_their_meaning(other):
    assert "1 passed, 1 skipped" in run(other, "--benchmark-only")[1]
    assert "1 passed, 1 skipped" in run(other, "--benchmark-skip")[1]
    code, text = run(other, "--benchmark", "--benchmark-only", "--benchmark-json=written.json", "checks")
    assert code == 0
    assert "1 passed, 1 skipped" in text
    (written,) = json.loads((other / "written.json").read_text())["benchmarks"]
    assert written["extra_info"] == {"label": "mine", "error": 1.25e-9}


GATED = """
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


@pytest.mark.slow
def test_from_end_to_end(tmp_path, monkeypatch):
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(tmp_path / "summary.md"))
    (tmp_path / "pytest.ini").write_text(INI)
    suite = tmp_path / "test_other.py"
    suite.write_text(GATED)
    code, text = run(tmp_path, "--benchmark", "--gate", "test_other.py")
    assert (code, "no baseline" in text) == (2, True)
    kept = ["--baseline", str(tmp_path / "benchmarks" / "baseline.json")]
    written = str(tmp_path / results.FOLDER / results.FILE)
    assert CliRunner().invoke(main, ["gate", *kept, "--update", "the first one", written]).exit_code == 0
    code, text = run(tmp_path, "--benchmark", "--gate", "test_other.py")
    assert code == 0, text
    assert "gate: passed, 5 rows" in text
    assert "## Gate: passed" in (tmp_path / "summary.md").read_text()
    assert not results.read(Path(written)).left_out
    for old, new in PLANTED:
        assert old in suite.read_text()
        suite.write_text(suite.read_text().replace(old, new))
    code, text = run(tmp_path, "--benchmark", "--gate", "test_other.py", "--junitxml=junit.xml")
    assert code == 1
    report = (tmp_path / "junit.xml").read_text()
    for line in (
        "row, mine, removed: was ok, is missing",
        "is skipped",
        "is failed",
        "is failed (in its teardown)",
        "definition, mine, kept",
    ):
        assert line in text
        assert line in report
    assert "| row | mine | removed |" in (tmp_path / "summary.md").read_text()


PARTS = {
    "checks/test_one.py": """
import pytest

@pytest.mark.parametrize("method", ["kept", "removed", "a::b"])
def test_mine(benchmark, method):
    benchmark(sum, range(9))

class TestFirst:
    def test_in(self, benchmark):
        benchmark(sum, range(9))

class TestOther:
    @pytest.mark.late
    def test_in(self, benchmark):
        benchmark(sum, range(9))

def test_plain():
    pass
""",
    "more/test_two.py": "def test_two(benchmark):\n    benchmark(sum, range(9))\n",
    "more/test_three.py": "def test_three(benchmark):\n    benchmark(sum, range(9))\n",
}
ALL = {"test_mine[kept]", "test_mine[removed]", "test_mine[a::b]", "TestFirst::test_in", "TestOther::test_in"}
ALL = {f"test_one.py::{name}" for name in ALL} | {"test_two.py::test_two", "test_three.py::test_three"}
ONE = {name for name in ALL if name.startswith("test_one.py")}
MINE = {name for name in ONE if "test_mine" in name}
KEPT = "test_one.py::test_mine[kept]"
SELECTIONS = {  # and the benchmarks that are run
    "checks more": ALL,
    "checks": ONE,
    "more/test_two.py": {"test_two.py::test_two"},
    "checks/test_one.py::TestFirst": {"test_one.py::TestFirst::test_in"},
    "checks/test_one.py::test_mine": MINE,
    "checks/test_one.py::test_mine[kept]": {KEPT},
    "checks more -k kept": {KEPT},
    "checks -k mine": MINE,
    "checks more -m late": {"test_one.py::TestOther::test_in"},
    "checks more --deselect checks/test_one.py::test_mine": ALL - MINE,
    "checks more --ignore more/test_three.py": ALL - {"test_three.py::test_three"},
    "checks more --lf": {KEPT},
    "checks more -k plain": set(),
    "checks more -k nothing": set(),
}
GONE = {"test_one.py::test_mine[removed]", "test_one.py::TestOther::test_in", "test_three.py::test_three"}
RUNS = """
import json, sys
from pathlib import Path

import pytest

from conservative.benchmarks.gate import baseline, compare, results

cache, ended = Path(".pytest_cache/v/cache/lastfailed"), {}
for words in json.loads(sys.argv[1]):
    cache.parent.mkdir(parents=True, exist_ok=True)
    cache.write_text('{"checks/test_one.py::test_mine[kept]": true}')
    code = pytest.main(["-q", "-n0", "--import-mode=importlib", "--benchmark", "--gate", *words.split()])
    run = results.read(results.FOLDER / results.FILE)
    if not baseline.PATH.exists():
        baseline.write(baseline.update_baseline(None, [run], "first"), baseline.PATH)
    try:
        violations = compare.decide(baseline.read(baseline.PATH), run).violations
        missing = [change.row.scene for change in violations if change.now == "missing"]
    except baseline.NothingToCompare:
        missing = []
    ended[words] = code, sorted(run.rows), sorted(missing)
Path("ended.json").write_text(json.dumps(ended))
"""


def select(folder, *selections):
    """Return the exit code, the rows and the missing rows of a run for each selection, in one process."""
    code = [sys.executable, "-c", RUNS, json.dumps(selections)]
    variables = {name: value for name, value in os.environ.items() if name != "PYTEST_ADDOPTS"}  # a cache of its own, for --lf
    subprocess.run(code, cwd=folder, capture_output=True, check=True, env=variables)
    return json.loads((folder / "ended.json").read_text())


FEW = ("checks/test_one.py::TestFirst", "checks more -k kept", "checks more -m late", "checks more --ignore more/test_three.py")


@pytest.mark.parametrize("selections", sampled([(FEW,), (tuple(SELECTIONS),)], 1), ids=["few", "all"])
def test_rows_that_are_not_selected_are_not_missing(selections, tmp_path):
    (tmp_path / "pytest.ini").write_text(f"[pytest]\naddopts = {FEW_PLUGINS} --benchmark-max-time=0.001\nmarkers = late\n")
    for name, text in PARTS.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    found = select(tmp_path, "more checks", *selections)
    assert found.pop("more checks") == [2, sorted(ALL), []]  # no baseline
    assert found == {words: [0 if rows else 2, sorted(rows), []] for words, rows in SELECTIONS.items() if words in selections}
    plain = "    def test_in(self):\n        pass\n"
    changed = PARTS["checks/test_one.py"].replace(', "removed"', "").partition("    @pytest.mark.late")[0] + plain
    (tmp_path / "checks/test_one.py").write_text(changed)
    (tmp_path / "more/test_three.py").unlink()
    some = ("checks more", "more/test_two.py", "checks/test_one.py::TestFirst", "checks more -k kept", "checks more --lf")
    for words, (code, rows, missing) in select(tmp_path, *(some if selections != FEW else some[::2])).items():
        read = "test_one" if words.startswith("checks") else "nothing"
        read = "test_mine" if "TestFirst" in words else read  # its node id leaves out the other class
        assert missing == sorted({"test_three.py::test_three"} | {name for name in GONE if read in name}), words
        assert (code, set(rows)) == (1, SELECTIONS[words] - GONE), words


@pytest.mark.parametrize("option", ["ignore", "ignore_glob", "lf"])
def test_a_file_that_an_option_leaves_out_is_not_missing_without_a_path(option, tmp_path):
    options = {"conservative_gate_baseline": "kept.json", option: ["a"]}
    config = SimpleNamespace(
        rootpath=tmp_path,
        getoption=lambda name, default=None: options.get(name, default),
        args_source="default",
        getini=lambda _: [],
    )
    (tmp_path / "test_a.py").touch()
    gate = pytest_gate.Gate(config, SUITE)
    assert gate.is_left_out("test_a.py::test_x")
    assert not gate.is_left_out("test_b.py::test_x")  # there is no such file
    del options[option]
    assert not gate.is_left_out("test_a.py::test_x")


INFO = {"scene": "brick", "method": "reduced", "error": "1e-9", "spreads": {"error": 1e-12}}
ID = "file.py::test_x[1]"


@pytest.fixture
def gate(tmp_path, monkeypatch):
    monkeypatch.delenv("GITHUB_STEP_SUMMARY", raising=False)
    return pytest_gate.Gate(
        SimpleNamespace(rootpath=tmp_path, getoption={"conservative_gate_baseline": "kept.json"}.get), SUITE
    )


def benchmark(info=INFO, **changes):
    """A test that is a benchmark."""
    names = {"path": Path("/a/file.py"), "nodeid": "b/file.py::test_x[1]", "name": "test_x[1]"}
    held = SimpleNamespace(extra_info=dict(info))
    return SimpleNamespace(**{**names, "fixturenames": ["benchmark"], "funcargs": {"benchmark": held}, **changes})


def report(when="call", outcome="passed", **more):
    return SimpleNamespace(when=when, outcome=outcome, passed=outcome == "passed", **more)


def hand_in(gate, item, *reports):
    """Pass reports to the hook as pytest does."""
    for each in reports:
        hook = gate.pytest_runtest_makereport(item)
        next(hook)
        with pytest.raises(StopIteration) as ended:
            hook.send(each)
        assert ended.value.value is each


def test_a_row_has_the_values_of_extra_info():
    written = pytest_gate.row(benchmark({**INFO, "spreads": {"error": 1e-12, "gone": 0}}), report())
    assert (written.id, written.scene, written.method, written.outcome, written.engine) == (
        ID,
        "brick",
        "reduced",
        OK,
        "",
    )
    assert written.values["error"] == 1e-9
    assert written.values["gone"] != written.values["gone"]
    assert written.spreads == {"error": 1e-12, "gone": 0.0}
    named = pytest_gate.row(benchmark({"definition": "mine", "engine": "e==1"}), report(outcome="failed"))
    assert (named.definition, named.engine, named.outcome.kind) == ("mine", "e==1", OutcomeKind.FAILED)
    assert pytest_gate.row(benchmark(), report(outcome="skipped", wasxfail="why")).outcome.kind is OutcomeKind.SKIPPED
    never_ran = pytest_gate.row(benchmark(funcargs={}), report("setup", "skipped"))
    assert (never_ran.scene, never_ran.values, never_ran.outcome) == ("", {}, Outcome(OutcomeKind.SKIPPED))


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
    assert gate.rows[ID].outcome == OK
    hand_in(gate, item, report("teardown", "failed"))
    assert gate.rows[ID].outcome.kind is OutcomeKind.FAILED
    hand_in(gate, benchmark(fixturenames=[], path=Path("other.py")), report())
    hand_in(gate, SimpleNamespace(), report())
    assert len(gate.rows) == 1
    hand_in(gate, benchmark(path=Path("other.py")), report("setup", "failed"))
    assert gate.rows["other.py::test_x[1]"].outcome.kind is OutcomeKind.FAILED


def test_the_verdict_and_the_results_are_written(gate, tmp_path, monkeypatch):
    hand_in(gate, benchmark(), report())
    baseline.write(baseline.update_baseline(None, [Results("here", gate.rows)], "first"), gate.root / "kept.json")
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(tmp_path / "step.md"))
    (tmp_path / "step.md").write_text("before\n")
    assert gate.finish() is gate.verdict
    assert gate.verdict == compare.Decision((), (), 1)
    assert results.read(tmp_path / results.FOLDER / results.FILE).rows == gate.rows
    assert (tmp_path / "step.md").read_text() == "before\n" + gate.verdict.markdown_text()
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(tmp_path))
    with pytest.raises(NotWritten, match=r"GITHUB_STEP_SUMMARY: got .*Is a directory"):
        gate.finish()


@pytest.mark.parametrize(("verdict", "status"), [(compare.Decision((), (), 1), 0), (compare.Decision((), (), 1), 1), (None, 3)])
def test_other_exit_statuses_stay(gate, verdict, status):
    session, gate.verdict = SimpleNamespace(exitstatus=status), verdict
    gate.pytest_sessionfinish(session)
    assert session.exitstatus == status
