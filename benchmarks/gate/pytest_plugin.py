"""The pytest plugin of `pytest --benchmark`; without the option it only skips the suite.

It is an entry point that every pytest run of the environment imports, so it imports nothing of the package at the top.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest

ROOM = Path(__file__).parents[1]
"""The package `conservative.benchmarks`; in a checkout a link to `REAL`, the folder `benchmarks` at its top."""
REAL = ROOM.resolve()
SUITE = ROOM / "suite"
MAX_TIME, SHORT, FEW = "--benchmark-max-time", 0.1, 2
"""The suite has many points, so each is timed for 0.1 s or two calls unless the option of pytest-benchmark is given."""
MEASURED = pytest.StashKey[list[dict[str, Any]]]()
"""On the configuration: the rows that pytest-benchmark shows."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Register the options. Options that begin with the same letters, all of pytest-benchmark's, keep their meaning."""
    group = parser.getgroup("conservative", "benchmarks of rotation integrators")
    group.addoption(
        "--benchmark",
        action="store_true",
        dest="conservative_benchmark",
        help="Run benchmarks: those under the paths given, by default the suite that comes with conservative.",
    )
    group.addoption(
        "--gate",
        action="store_true",
        dest="conservative_gate",
        help="With --benchmark: compare with the baseline at the end. Exit code 1: a violation; 2: no baseline.",
    )
    group.addoption(
        "--gate-baseline",
        default="benchmarks/baseline.json",
        metavar="FILE",
        dest="conservative_gate_baseline",
        help="The baseline, relative to the root of the project (default: %(default)s).",
    )


def pytest_configure(config: pytest.Config) -> None:
    """With the option and no path, run the suite; take paths of the suite by the name that it is imported under.

    Raises
    ------
    pytest.UsageError
        pytest-benchmark, which times, is not installed or switched off; or the gate is asked for where it cannot decide.
    """
    config.args = [_linked(text, config.invocation_params.dir) for text in config.args]
    if not config.getoption("conservative_benchmark"):
        if config.getoption("conservative_gate"):
            raise pytest.UsageError("--gate can only be used together with --benchmark")
        return
    if not config.pluginmanager.hasplugin("benchmark"):  # pytest-benchmark
        advice = "Run: pip install 'conservative-rotation[gate]', and do not use -p no:benchmark"
        raise pytest.UsageError(f"--benchmark: pytest-benchmark is not loaded. {advice}")
    if config.args_source is not pytest.Config.ArgsSource.ARGS:
        config.args = [str(SUITE)]
        if not any(text.startswith(MAX_TIME) for text in config.invocation_params.args):
            config.option.benchmark_max_time, config.option.benchmark_min_rounds = SHORT, FEW
    if config.getoption("conservative_gate"):
        if getattr(config.option, "dist", "no") != "no" or hasattr(config, "workerinput"):
            raise pytest.UsageError("--gate: got -n, under which workers disturb each other's times; allowed with -n0")
        from .pytest_gate import Gate

        config.pluginmanager.register(Gate(config, SUITE), "conservative_gate")


@pytest.hookimpl(optionalhook=True, tryfirst=True)
def pytest_xdist_auto_num_workers(config: pytest.Config) -> int | None:
    """Run benchmarks without workers, which disturb each other's times, unless the command line has a number of them."""
    return 0 if config.getoption("conservative_benchmark") else None


def _linked(text: str, folder: Path) -> str:
    """Return an argument below `REAL` as one below `ROOM`: pytest names a module by its path, and a module has one name."""
    place, *rest = text.partition("::")
    path = (folder / place).resolve()
    if not (ROOM.is_symlink() and path.is_relative_to(REAL)):
        return text
    return "".join([str(ROOM / path.relative_to(REAL)), *rest])


def pytest_ignore_collect(collection_path: Path) -> bool | None:
    """Leave out `REAL`, which is collected below `ROOM`."""
    if collection_path.name != REAL.name or collection_path.is_symlink() or not ROOM.is_symlink():
        return None
    return True if collection_path.resolve() == REAL else None


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Skip the suite unless benchmarks were asked for."""
    if config.getoption("conservative_benchmark"):
        return
    suite = SUITE.resolve()
    paths = {path for path in {item.path for item in items} if suite in path.resolve().parents}
    for item in items:
        if item.path in paths:
            item.add_marker(pytest.mark.skip(reason="a benchmark, which runs with --benchmark"))


@pytest.hookimpl(optionalhook=True, tryfirst=True)
def pytest_benchmark_group_stats(config: pytest.Config, benchmarks: list[dict[str, Any]]) -> None:
    """Store the rows that pytest-benchmark is about to show. The result None leaves the grouping to pytest-benchmark."""
    config.stash[MEASURED] = list(benchmarks)


@pytest.hookimpl(trylast=True)
def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Show accuracy next to the times, after the table of pytest-benchmark, or the reason why nothing was timed."""
    config = terminalreporter.config
    if not config.getoption("conservative_benchmark"):
        return
    if getattr(config.option, "dist", "no") != "no":
        terminalreporter.write_line("--benchmark: timing is off under -n, since workers disturb each other; use -n0 for times")
    measured = config.stash.get(MEASURED, [])
    if measured:
        terminalreporter.section("accuracy and time")
        for group in dict.fromkeys(row["group"] for row in measured):
            for line in (*table_lines([row for row in measured if row["group"] == group]), ""):
                terminalreporter.write_line(line)


def table_lines(benchmarks: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return a text table of pytest-benchmark's flat rows: name, times in s, and every number in `extra_info`."""
    names: dict[str, None] = {}
    for row in benchmarks:
        names.update({key: None for key, value in row["extra_info"].items() if isinstance(value, int | float)})
    table = [["benchmark", "min, s", "median, s", *names]]
    for row in sorted(benchmarks, key=lambda row: (row["group"] or "", row["min"])):
        values = [row["min"], row["median"], *(row["extra_info"].get(name) for name in names)]
        table.append([row["param"] or row["name"], *("" if value is None else f"{value:.3g}" for value in values)])
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    lines = []
    for first, *rest in table:
        numbers = (cell.rjust(width) for cell, width in zip(rest, widths[1:], strict=True))
        lines.append("  ".join([first.ljust(widths[0]), *numbers]).rstrip())
    return lines
