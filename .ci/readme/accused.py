"""Tables of wrong results of engines, from references/accusations: a line for each sentence with a script that ran."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import partial
from pathlib import Path

from pages import ROOT, table

from conservative.references.accusations.rows import Accusation, Result, read_accusations, read_results

FOLDER = ROOT / "references" / "accusations"
PAGES = {
    "bodies": ROOT / "references" / "model_files" / "measured.md",
    "motions": ROOT / "benchmarks" / "verification" / "pairs" / "measured.md",
    "engines": ROOT / "references" / "README.md",
}
"""The page of each group of sentences."""


def accusations(group: str) -> str:
    """Return a row for each sentence of a group that was wrong in a version."""
    results = read_results()
    lines = [
        _line(accusation, found, PAGES[group].parent)
        for accusation in read_accusations()
        if accusation.page == group and (found := _results_of(accusation, results))
    ]
    return table(["engine", "what is wrong", "what the script printed"], lines)


def _results_of(accusation: Accusation, results: list[Result]) -> list[Result]:
    """Return the results of a script if one version was wrong."""
    found = [result for result in results if result.script == accusation.script]
    return found if any(result.verdict == "wrong" for result in found) else []


def _line(accusation: Accusation, found: list[Result], folder: Path) -> list[str]:
    link = partial(_link, folder)
    links = [link("script", accusation.path), *([link("file", accusation.file_path)] if accusation.file_path else [])]
    verdicts = ", ".join(f"{result.version}: {result.verdict}" for result in found)
    last = [result for result in found if result.verdict == "wrong"][-1]
    return [accusation.engine, f"{accusation.sentence} ({', '.join(links)})", f"{last.printed} ({verdicts})"]


def _link(folder: Path, text: str, path: Path) -> str:
    return f"[{text}]({Path(os.path.relpath(os.path.realpath(path), folder)).as_posix()})"


def counted() -> str:
    """Return a sentence on how many sentences about engines there are, and how many versions were run."""
    rows, results = read_accusations(), read_results()
    run = {(row.engine, result.version) for row in rows for result in results if result.script == row.script}
    engines = len({engine for engine, _ in run})
    link = _link(PAGES["bodies"].parent, "accusations.csv", FOLDER / "accusations.csv")
    return (
        f"{link} has {len(rows)} sentences about engines, each with its script.\n"
        f"The scripts were run in {len(run)} versions of {engines} engines.\n"
    )


TABLES: dict[str, Callable[[], str]] = {
    **{f"what is wrong in {group}": partial(accusations, group) for group in PAGES},
    "counted accusations": counted,
}
"""Tables by the name of their mark."""
