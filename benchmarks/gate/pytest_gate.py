"""`pytest --benchmark --gate`: collects a row from every benchmark, and ends the run with a test that compares them all.

It is a test so that JUnit files, and everything else that reads outcomes of pytest, contain the gate.
"""

from __future__ import annotations

import hashlib
import inspect
import os
from collections.abc import Generator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from conservative.errors import NotWritten

from ..measures.origin import commit, machine_title
from . import baseline, compare, results
from .results import Results, Row, Status


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

    def __init__(self, config: pytest.Config) -> None:
        self.root = config.rootpath
        self.baseline = self.root / config.getoption("conservative_gate_baseline")
        self.folder = self.root / results.FOLDER
        self.rows: dict[str, Row] = {}
        self.verdict: compare.Verdict | None = None
        self.without_baseline = False
        self.chosen = False

    def pytest_deselected(self, items: Sequence[pytest.Item]) -> None:
        """Note that `-k` or `-m` left benchmarks out."""
        self.chosen = self.chosen or any("benchmark" in getattr(item, "fixturenames", ()) for item in items)

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, session: pytest.Session, items: list[pytest.Item]) -> None:
        """Put the gate behind the benchmarks, whichever were chosen."""
        item = GateItem.from_parent(session, name="gate")
        item.collector = self
        items.append(item)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(self, item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
        """Record a row for every benchmark; a failure after its timing only changes the status."""
        report = yield
        if "benchmark" in getattr(item, "fixturenames", ()):
            id = row_id(item)
            if report.when == "call" or (report.when == "setup" and not report.passed):
                self.rows[id] = row(item, report)
            elif report.when == "teardown" and not report.passed:
                self.rows[id] = replace(self.rows[id], status=Status.ERROR)
        return report

    def finish(self) -> compare.Verdict:
        """Write the results to the folder, and return the verdict.

        Raises
        ------
        NoBaseline
            There is nothing to compare with.
        """
        run = Results(machine_title(), self.rows, commit(self.root), self.chosen)
        results.write(run, self.folder / results.FILE)
        try:
            self.verdict = compare.judge(baseline.read(self.baseline), run)
        except baseline.NoBaseline:
            self.without_baseline = True
            raise
        if summary := os.environ.get("GITHUB_STEP_SUMMARY"):
            try:
                with Path(summary).open("a", encoding="utf-8") as file:
                    file.write(self.verdict.markdown_text())
            except OSError as error:
                raise NotWritten("GITHUB_STEP_SUMMARY", Path(summary), error) from None
        return self.verdict

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """Print the verdict and the path of the results."""
        terminalreporter.section("gate")
        ended = self.verdict or "no verdict: " + ("no baseline" if self.without_baseline else "the run ended before the gate")
        terminalreporter.write_line(str(ended))
        terminalreporter.write_line(f"results: {self.folder / results.FILE}, for Bencher: {self.folder / results.HISTORY}")

    @pytest.hookimpl(trylast=True)
    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        """Exit with 2 where there is no baseline, and never with 0 without a verdict."""
        if self.without_baseline or (self.verdict is None and session.exitstatus == 0):
            session.exitstatus = 2


def row_id(item: pytest.Item) -> str:
    """Return the file's name and the test's, without folders, which depend on where pytest was started."""
    return f"{item.path.name}::{item.nodeid.partition('::')[2]}"


def row(item: pytest.Item, report: pytest.TestReport) -> Row:
    """Return the row of a benchmark, from its `extra_info`: see benchmarks/README.md, Benchmarks of your own, for the keys."""
    benchmark = getattr(item, "funcargs", {}).get("benchmark")
    timed = getattr(benchmark, "stats", None)  # None with --benchmark-disable
    info: dict[str, Any] = benchmark.extra_info if benchmark else {}
    spreads = {str(name): float(spread) for name, spread in info.get("spreads", {}).items()}
    return Row(
        id=row_id(item),
        scene=str(info.get("scene", "")),
        method=str(info.get("method", "")),
        status=Status.XFAILED if hasattr(report, "wasxfail") else Status(report.outcome),
        engine=str(info.get("engine", "")),
        definition=str(info.get("definition") or source_hash(item)),
        values={name: float(info.get(name, "nan")) for name in spreads},
        spreads=spreads,
        seconds=float(timed.stats.min) if timed else 0.0,
    )


def source_hash(item: pytest.Item) -> str:
    """Return the hash of the source and parameters of a test: its definition unless `extra_info` has one."""
    text = inspect.getsource(item.function) + item.name if isinstance(item, pytest.Function) else item.name
    return hashlib.sha256(text.encode()).hexdigest()[:16]
