"""Parts of pages that are generated: what is between `<!-- generated NAME: python .ci/readme -->` and `<!-- end -->`."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PART = re.compile(r"(<!-- generated ([\w ]+): python \.ci/readme -->\n)((?:(?!<!-- ).)*)(<!-- end -->\n)", re.DOTALL)


def names(page: str) -> list[str]:
    """Return the names of the parts of a page."""
    return [match[2] for match in PART.finditer(page)]


def fill(page: str, parts: Mapping[str, Callable[[], str]]) -> str:
    """Return a page with each of its parts as it should be."""
    return PART.sub(lambda match: f"{match[1]}{parts[match[2]]()}{match[4]}", page)


def table(header: list[str], rows: Iterable[list[str]]) -> str:
    """Return lines of cells as a table."""
    lines = [header, ["---"] * len(header), *rows]
    return "".join(re.sub(r"\|  (?=\|)", "| ", f"| {' | '.join(line)} |\n") for line in lines)


def read_csv(path: Path) -> list[dict[str, str]]:
    """Return the rows of a CSV file."""
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def summary(text: str | None) -> str:
    """Return the sentences that end in the first line of a docstring, or its first sentence if that is longer."""
    first = (text or "").partition("\n\n")[0]
    whole = re.match(r".*\.(?=\s|$)", first) or re.match(r".*?\.(?=\s|$)", first, re.DOTALL)
    return " ".join((whole[0] if whole else first).split())
