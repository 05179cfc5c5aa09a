"""`pytest --benchmark --gate`: collects a row from every benchmark, and ends the run with a test that compares them all.

A test, so that reports in JUnit's format and everything else that reads pytest's outcomes know about the gate.
"""

from __future__ import annotations

import hashlib
import inspect
import os
from collections.abc import Callable, Generator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from conservative.errors import NotWritten
from conservative.files import write_text

from ..measures.origin import commit, machine
from . import baseline, compare, dashboards, results, yardstick
from .results import TIME_RATIO, Results, Row, Status
from .stash import REPEAT


class GateFailed(Exception):
    """The gate is not passed."""


class GateItem(pytest.Item):
    """The last test of a run: are the rows of this run what the baseline says?"""

    collector: Gate

    def runtest(self) -> None:
        """Compare, and fail with one line for each violation."""
        verdict = self.collector.finish()
        if not verdict.passed:
            raise GateFailed(str(verdict))

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: Any = None) -> Any:
        """Return the lines alone: a traceback would say nothing more."""
        return (
            str(excinfo.value) if isinstance(excinfo.value, GateFailed | ValueError) else super().repr_failure(excinfo, style)
        )

    def reportinfo(self) -> tuple[Path, None, str]:
        """Return what a report calls it."""
        return self.path, None, "gate"


class Gate:
    """The hooks of a gated run."""

    def __init__(self, config: pytest.Config) -> None:
        self.root = config.rootpath
        self.baseline = self.root / config.getoption("conservative_gate_baseline")
        self.times: compare.Times = config.getoption("conservative_gate_times")
        self.folder = self.root / results.FOLDER
        self.rows: dict[str, Row] = {}
        self.repeats: dict[str, Callable[[], float]] = {}
        self.verdict: compare.Verdict | None = None
        self.without_baseline = False

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, session: pytest.Session, items: list[pytest.Item]) -> None:
        """Put the gate behind the benchmarks, whichever were chosen."""
        item = GateItem.from_parent(session, name="gate")
        item.collector = self
        items.append(item)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(self, item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
        """Keep a row of every benchmark; of what came after its timing, only that it failed."""
        report = yield
        if "benchmark" in getattr(item, "fixturenames", ()):
            id = row_id(item)
            if report.when == "call" or (report.when == "setup" and not report.passed):
                self.rows[id] = row(item, report)
                if REPEAT in item.stash:
                    self.repeats[id] = item.stash[REPEAT]
            elif report.when == "teardown" and not report.passed:
                self.rows[id] = replace(self.rows[id], status=Status.ERROR)
        return report

    def finish(self) -> compare.Verdict:
        """Leave results and exports in the folder, and return the verdict.

        Raises
        ------
        NoBaseline
            There is nothing to compare with.
        """
        found = Results(machine().times_key, self.rows, commit(self.root))
        results.write(found, self.folder / results.FILE)
        dashboards.write(found, self.folder)
        try:
            before = baseline.read(self.baseline)
            found = self._confirm(before, found)
            self.verdict = compare.judge(before, found, self.times)
        except baseline.NoBaseline:
            self.without_baseline = True
            raise
        text = dashboards.markdown(self.verdict)
        write_text(self.folder / dashboards.SUMMARY, text, "results")
        if summary := os.environ.get("GITHUB_STEP_SUMMARY"):
            _append(Path(summary), text)
        return self.verdict

    def _confirm(self, before: baseline.Baseline, found: Results) -> Results:
        """Measure again what is too slow for the baseline, and keep the results that this leads to."""
        for id, again in self.repeats.items():
            limits = before.rows[id].time_ratios.get(found.machine) if id in before.rows else None
            ratio = self.rows[id].time_ratio
            if limits and ratio is not None:
                self.rows[id] = replace(self.rows[id], time_ratio=yardstick.confirm(ratio, limits.limit, again))
        found = replace(found, rows=self.rows)
        results.write(found, self.folder / results.FILE)
        return found

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """Say how it ended, and where the results are."""
        terminalreporter.section("gate")
        ended = self.verdict or "no verdict: " + ("no baseline" if self.without_baseline else "the run ended before the gate")
        terminalreporter.write_line(str(ended))
        terminalreporter.write_line(f"results and exports: {self.folder}")

    @pytest.hookimpl(trylast=True)
    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        """Exit with 2 where there is no baseline, and never with 0 without a verdict."""
        if self.without_baseline or (self.verdict is None and session.exitstatus == 0):
            session.exitstatus = 2


def _append(path: Path, text: str) -> None:
    """Add to a file that others add to as well. Raise `NotWritten` where that cannot be."""
    try:
        with path.open("a", encoding="utf-8") as file:
            file.write(text)
    except OSError as error:
        raise NotWritten("GITHUB_STEP_SUMMARY", path, error) from None


def row_id(item: pytest.Item) -> str:
    """Return the file's name and the test's, without folders, which depend on where pytest was started."""
    return f"{item.path.name}::{item.nodeid.partition('::')[2]}"


def row(item: pytest.Item, report: pytest.TestReport) -> Row:
    """Return what a benchmark left in `extra_info`: see benchmarks/README.md, Benchmarks of your own, for the keys."""
    benchmark = getattr(item, "funcargs", {}).get("benchmark")
    info: dict[str, Any] = benchmark.extra_info if benchmark else {}
    spreads = {str(name): float(spread) for name, spread in info.get("spreads", {}).items()}
    stats = getattr(benchmark, "stats", None)
    return Row(
        id=row_id(item),
        scene=str(info.get("scene", "")),
        method=str(info.get("method", "")),
        status=Status.XFAILED if hasattr(report, "wasxfail") else Status(report.outcome),
        engine=str(info.get("engine", "")),
        definition=str(info.get("definition") or _source_hash(item)),
        values={name: float(info.get(name, "nan")) for name in spreads},
        spreads=spreads,
        time_ratio=float(info[TIME_RATIO]) if TIME_RATIO in info else None,
        seconds=float(stats.stats.min) if stats else None,
    )


def _source_hash(item: pytest.Item) -> str:
    """Return the hash of a test's source and parameters: its definition, where it names none."""
    text = inspect.getsource(item.function) + item.name if isinstance(item, pytest.Function) else item.name
    return hashlib.sha256(text.encode()).hexdigest()[:16]
