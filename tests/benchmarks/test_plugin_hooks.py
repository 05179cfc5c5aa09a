"""The hooks of the plugin, one by one, on configurations that are made up."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from conservative.benchmarks.gate import pytest_gate, pytest_plugin


class Options(SimpleNamespace):
    """A configuration of pytest with these options."""

    def getoption(self, name):
        return getattr(self, name)


def configuration(*arguments, source=pytest.Config.ArgsSource.ARGS, timer=True, **options):
    given = SimpleNamespace(args=arguments, dir=Path.cwd())
    plugins = SimpleNamespace(
        hasplugin=lambda name: timer and name == "benchmark", register=lambda *plugin: known.append(plugin)
    )
    known = []
    wanted = {"conservative_benchmark": True, "conservative_gate": False, "args": list(arguments), "args_source": source}
    wanted |= {"conservative_gate_baseline": "b", "rootpath": Path("root")}
    held = SimpleNamespace(benchmark_max_time=1.0, benchmark_min_rounds=5, dist=options.pop("dist", "no"))
    return Options(invocation_params=given, pluginmanager=plugins, option=held, known=known, stash={}, **{**wanted, **options})


def test_the_suite_is_what_runs_without_a_path():
    config = configuration(source=pytest.Config.ArgsSource.TESTPATHS)
    pytest_plugin.pytest_configure(config)
    assert config.args == [str(pytest_plugin.SUITE)]
    assert (config.option.benchmark_max_time, config.option.benchmark_min_rounds) == (0.1, 2)
    assert not config.known
    timed = configuration("--benchmark-max-time=3", source=pytest.Config.ArgsSource.TESTPATHS)
    pytest_plugin.pytest_configure(timed)
    assert (timed.option.benchmark_max_time, timed.option.benchmark_min_rounds) == (1.0, 5)
    own = configuration("tests/mine.py::test_x")
    pytest_plugin.pytest_configure(own)
    assert own.args == ["tests/mine.py::test_x"]
    assert own.option.benchmark_max_time == 1.0


def test_the_gate_needs_benchmarks_the_timer_and_no_workers():
    for config, words in (
        (configuration(conservative_benchmark=False, conservative_gate=True), "together with --benchmark"),
        (configuration(timer=False), "pytest-benchmark is not loaded"),
        (configuration(conservative_gate=True, dist="load"), "-n0"),
        (configuration(conservative_gate=True, workerinput={}), "-n0"),
    ):
        with pytest.raises(pytest.UsageError, match=words):
            pytest_plugin.pytest_configure(config)
    pytest_plugin.pytest_configure(configuration(conservative_benchmark=False, timer=False))
    gated = configuration(conservative_gate=True)
    pytest_plugin.pytest_configure(gated)
    ((plugin, name),) = gated.known
    assert (type(plugin), name) == (pytest_gate.Gate, "conservative_gate")
    assert pytest_plugin.pytest_xdist_auto_num_workers(gated) == 0
    assert pytest_plugin.pytest_xdist_auto_num_workers(configuration(conservative_benchmark=False)) is None


def test_the_suite_is_skipped_unless_it_is_asked_for():
    marks = []
    inside = SimpleNamespace(path=pytest_plugin.SUITE.resolve() / "test_speed.py", add_marker=marks.append)
    outside = SimpleNamespace(path=Path(__file__), add_marker=lambda mark: pytest.fail("not of the suite"))
    pytest_plugin.pytest_collection_modifyitems(configuration(), [inside])
    assert not marks
    pytest_plugin.pytest_collection_modifyitems(configuration(conservative_benchmark=False), [outside, inside])
    assert [mark.name for mark in marks] == ["skip"]


def test_a_path_of_the_suite_is_taken_by_the_name_it_is_imported_under():
    real, room = pytest_plugin.REAL, pytest_plugin.ROOM
    folder = real.parent
    assert pytest_plugin._linked("benchmarks/suite/test_speed.py::test_x[a::b]", folder) == (
        f"{room / 'suite' / 'test_speed.py'}::test_x[a::b]"
    )
    assert pytest_plugin._linked("tests", folder) == "tests"
    assert pytest_plugin.pytest_ignore_collect(real) is True
    assert pytest_plugin.pytest_ignore_collect(room) is None
    assert pytest_plugin.pytest_ignore_collect(folder / "tests") is None
    assert pytest_plugin.pytest_ignore_collect(folder / "elsewhere" / real.name) is None


def test_accuracy_is_shown_group_by_group():
    said, config = [], configuration()
    terminal = SimpleNamespace(config=config, section=said.append, write_line=said.append)
    pytest_plugin.pytest_terminal_summary(terminal)
    assert not said
    rows = [
        {"name": name, "param": None, "group": group, "min": 1.0, "median": 2.0, "extra_info": {"error": 3.0}}
        for name, group in (("a", "one"), ("b", "two"), ("c", "one"))
    ]
    assert pytest_plugin.pytest_benchmark_group_stats(config, rows) is None
    assert config.stash[pytest_plugin.MEASURED] == rows
    pytest_plugin.pytest_terminal_summary(terminal)
    assert [line.split("  ")[0] for line in said] == ["accuracy beside time", "benchmark", "a", "c", "", "benchmark", "b", ""]


def test_numbers_become_aligned_columns_and_texts_do_not():
    def flat(name, fastest, **extra):
        return {"name": name, "param": None, "group": None, "min": fastest, "median": 2 * fastest, "extra_info": extra}

    header, first, second = pytest_plugin.table_lines([flat("slow", 1e-3, label="x", drift=2e-16), flat("fast", 1e-6, order=2)])
    assert header.split()[-2:] == ["drift", "order"]
    assert first.split() == ["fast", "1e-06", "2e-06", "2"]
    assert second.split() == ["slow", "0.001", "0.002", "2e-16"]
    assert len(header) == len(first)
