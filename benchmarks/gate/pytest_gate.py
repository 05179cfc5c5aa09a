"""`pytest --benchmark --gate`: collects a row from every benchmark, and ends the run with a test that compares them all.

It is a test so that JUnit files, and everything else that reads outcomes of pytest, contain the gate.
"""

from __future__ import annotations

import hashlib
import inspect
import os
from collections.abc import Generator
from dataclasses import replace
from fnmatch import fnmatch
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from conservative.errors import NotWritten
from conservative.outcome import Outcome, OutcomeKind

from ..measures.origin import commit, machine_title
from . import baseline, compare, results
from .results import Results, Row

Made = pytest.Item | pytest.Collector | list[pytest.Item | pytest.Collector] | None
"""Kinds of items that pytest collects from a name in a module."""


class GateFailed(Exception):
    """The gate is not passed."""


class GateItem(pytest.Item):
    """The last test of a run: compares the rows of this run with the baseline."""

    collector: Gate

    def runtest(self) -> None:
        """Compare, and fail with one line for each violation."""
        verdict = self.collector.finish()
        if not verdict.passed:
            raise GateFailed(str(verdict))

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: Any = None) -> Any:
        """Return the lines without a traceback."""
        return (
            str(excinfo.value) if isinstance(excinfo.value, GateFailed | ValueError) else super().repr_failure(excinfo, style)
        )

    def reportinfo(self) -> tuple[Path, None, str]:
        """Return the name in reports."""
        return self.path, None, "gate"


class Gate:
    """The hooks of a gated run."""

    def __init__(self, config: pytest.Config, suite: Path) -> None:
        self.root = config.rootpath
        self.baseline = self.root / config.getoption("conservative_gate_baseline")
        self.folder = self.root / results.FOLDER
        self.rows: dict[str, Row] = {}
        self.verdict: compare.Decision | None = None
        self.nothing = ""
        self.config, self.suite = config, suite
        self.read: set[str] = set()
        self.classes: set[str] = set()
        self.benchmarks: set[str] = set()

    def pytest_collectstart(self, collector: pytest.Collector) -> None:
        """Note the files and classes that are read; with `--lf` a file can be left out after this."""
        if isinstance(collector, pytest.File | pytest.Class) and not self.config.getoption("lf", False):
            self.read.add(row_id(collector))

    @pytest.hookimpl(wrapper=True)
    def pytest_pycollect_makeitem(self, collector: pytest.Collector) -> Generator[None, Made, Made]:
        """Note the benchmarks and classes of a file or class that is read, before any is deselected."""
        made = yield
        nodes = made if isinstance(made, list) else [made] if made else []
        self.read.add(row_id(collector))
        self.classes |= {row_id(node) for node in nodes if isinstance(node, pytest.Class)}
        self.benchmarks |= {row_id(node) for node in nodes if is_benchmark(node)}
        return made

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_collection_modifyitems(self, session: pytest.Session, items: list[pytest.Item]) -> Generator[None]:
        """Put the gate behind the benchmarks, whichever were chosen; after `--lf`, which would leave it out."""
        yield
        item = GateItem.from_parent(session, name="gate")
        item.collector = self
        items.append(item)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(self, item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
        """Record a row for every benchmark; a failure after its timing only changes the outcome."""
        report = yield
        if is_benchmark(item):
            id = row_id(item)
            if report.when == "call" or (report.when == "setup" and not report.passed):
                self.rows[id] = row(item, report)
            elif report.when == "teardown" and not report.passed:
                self.rows[id] = replace(self.rows[id], outcome=Outcome(OutcomeKind.FAILED, "in its teardown"))
        return report

    def finish(self) -> compare.Decision:
        """Write the results to the folder, and return the verdict. Raise `NothingToCompare`."""
        before: baseline.Baseline | baseline.NoBaseline
        try:
            before = baseline.read(self.baseline)
        except baseline.NoBaseline as error:
            before = error
        ids = self.benchmarks | (set() if isinstance(before, Exception) else before.rows.keys())
        run = Results(machine_title(), self.rows, commit(self.root), tuple(sorted(filter(self.is_left_out, ids))))
        results.write(run, self.folder / results.FILE)
        if isinstance(before, Exception):
            self.nothing = "no baseline"
            raise before
        try:
            self.verdict = compare.decide(before, run)
        except baseline.NothingToCompare as error:
            self.nothing = str(error)
            raise
        if summary := os.environ.get("GITHUB_STEP_SUMMARY"):
            try:
                with Path(summary).open("a", encoding="utf-8") as file:
                    file.write(self.verdict.markdown_text())
            except OSError as error:
                raise NotWritten("GITHUB_STEP_SUMMARY", Path(summary), error) from None
        return self.verdict

    def is_left_out(self, id: str) -> bool:
        """Return whether a benchmark exists, as far as this run has looked, and was not run, because it was not selected.

        One that was not seen can exist in a file or a class that was not read, because paths or options select others.
        """
        if id in self.rows:
            return False
        if id in self.benchmarks or any(id.startswith(f"{name}::") for name in self.classes - self.read):
            return True
        file, some = id.partition("::")[0], self.config.args_source is pytest.Config.ArgsSource.ARGS
        some = some or any(self.config.getoption(name, None) for name in ("lf", "ignore", "ignore_glob"))
        return file not in self.read and some and self.has_file(file)

    def has_file(self, name: str) -> bool:
        """Return whether the suite or the project has a file of a name, outside of folders that pytest does not search."""
        if (self.suite / name).is_file():
            return True
        hidden = self.config.getini("norecursedirs")
        for _, folders, files in os.walk(self.root):
            if name in files:
                return True
            folders[:] = [folder for folder in folders if not any(map(partial(fnmatch, folder), hidden))]
        return False

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """Print the verdict and the path of the results."""
        terminalreporter.section("gate")
        ended = self.verdict or f"no verdict: {self.nothing or 'the run ended before the gate'}"
        terminalreporter.write_line(str(ended))
        terminalreporter.write_line(f"results: {self.folder / results.FILE}, for Bencher: {self.folder / results.HISTORY}")

    @pytest.hookimpl(trylast=True)
    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        """Exit with 2 if there is nothing to compare, and never with 0 without a verdict."""
        if self.nothing or (self.verdict is None and session.exitstatus == 0):
            session.exitstatus = 2


def row_id(node: pytest.Item | pytest.Collector) -> str:
    """Return the names of the file and of the test in it, without folders, which depend on where pytest was started."""
    return node.path.name + "".join(node.nodeid.partition("::")[1:])


def is_benchmark(item: object) -> bool:
    """Return whether a test has the fixture of pytest-benchmark."""
    return "benchmark" in getattr(item, "fixturenames", ())


def row(item: pytest.Item, report: pytest.TestReport) -> Row:
    """Return the row of a benchmark, from its `extra_info`: see benchmarks/README.md, Benchmarks, for the keys."""
    benchmark = getattr(item, "funcargs", {}).get("benchmark")
    timed = getattr(benchmark, "stats", None)  # None with --benchmark-disable
    info: dict[str, Any] = benchmark.extra_info if benchmark else {}
    spreads = {str(name): float(spread) for name, spread in info.get("spreads", {}).items()}
    return Row(
        id=row_id(item),
        scene=str(info.get("scene", "")),
        method=str(info.get("method", "")),
        outcome=outcome_of(report),
        engine=str(info.get("engine", "")),
        definition=str(info.get("definition") or source_hash(item)),
        values={name: float(info.get(name, "nan")) for name in spreads},
        spreads=spreads,
        seconds=float(timed.stats.min) if timed else 0.0,
    )


def outcome_of(report: pytest.TestReport) -> Outcome:
    """Return the outcome of a test; one that is expected to fail counts as skipped."""
    if hasattr(report, "wasxfail"):
        return Outcome(OutcomeKind.SKIPPED, "expected to fail")
    kinds = {"passed": OutcomeKind.OK, "failed": OutcomeKind.FAILED, "skipped": OutcomeKind.SKIPPED}
    return Outcome(kinds[report.outcome])


def source_hash(item: pytest.Item) -> str:
    """Return the hash of the source and parameters of a test: its definition unless `extra_info` has one."""
    text = inspect.getsource(item.function) + item.name if isinstance(item, pytest.Function) else item.name
    return hashlib.sha256(text.encode()).hexdigest()[:16]
