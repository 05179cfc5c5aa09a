"""Sentences about engines, and what their scripts printed.

`accusations.csv` has a row for each sentence: the page that shows it, the engine, the script in `scripts/`, and the file that
the script gets, relative to `references`. The sentence is the first line of the script. `measured.csv` has a row for each
script and version of the engine.
"""

from __future__ import annotations

import ast
import csv
from dataclasses import asdict, dataclass, fields
from pathlib import Path

HERE = Path(__file__).resolve().parent
SENTENCES, MEASURED = HERE / "accusations.csv", HERE / "measured.csv"
VERDICTS = ("right", "wrong", "undecided")
"""Last words of a script; "undecided" if it ends with neither of the first two."""


@dataclass(frozen=True)
class Accusation:
    """A sentence about an engine.

    Attributes
    ----------
    page
        Name of the generated part of a page that shows it.
    engine
        Name of the engine, or of a package that is no engine.
    script
        Name of the script.
    file
        Path of the file that the script gets, relative to the folder `references`; "" if it gets none.
    """

    page: str
    engine: str
    script: str
    file: str

    @property
    def path(self) -> Path:
        """The script."""
        return HERE / "scripts" / self.script

    @property
    def file_path(self) -> Path | None:
        """The file that the script gets; None if it gets none."""
        return HERE.parent / self.file if self.file else None

    @property
    def sentence(self) -> str:
        """The sentence, which is the first line of the script."""
        return first_line(self.path)


@dataclass(frozen=True)
class Result:
    """What a script printed.

    Attributes
    ----------
    script, version
        Name of the script and version of the engine.
    verdict
        One of `VERDICTS`.
    printed
        The last line of its output without the verdict, or the reason why there is none.
    date
        Date of the measurement, as 2026-11-29.
    """

    script: str
    version: str
    verdict: str
    printed: str
    date: str


def first_line(script: Path) -> str:
    """Return the sentence in the first line of a script: a docstring in Python, a comment in JavaScript."""
    text = script.read_text(encoding="utf-8")
    if script.suffix == ".py":
        return (ast.get_docstring(ast.parse(text)) or "").partition("\n")[0]
    return text.partition("\n")[0].removeprefix("//").strip()


def read_accusations() -> list[Accusation]:
    """Return all sentences, in the order of the table."""
    with SENTENCES.open(encoding="utf-8", newline="") as file:
        return [Accusation(**row) for row in csv.DictReader(file)]


def read_results() -> list[Result]:
    """Return all results, older versions first."""
    with MEASURED.open(encoding="utf-8", newline="") as file:
        return [Result(**row) for row in csv.DictReader(file)]


def write_results(results: list[Result]) -> None:
    """Write the results, which have to be in their order."""
    with MEASURED.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, [field.name for field in fields(Result)], lineterminator="\n")
        writer.writeheader()
        writer.writerows(asdict(result) for result in results)
