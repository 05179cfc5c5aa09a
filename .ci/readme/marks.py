"""Parts of pages that are generated: what is between `<!-- generated NAME: python .ci/readme -->` and `<!-- end -->`."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping

PART = re.compile(r"(<!-- generated ([\w ]+): python \.ci/readme -->\n)((?:(?!<!-- ).)*)(<!-- end -->\n)", re.DOTALL)


def names(page: str) -> list[str]:
    """Return the names of the parts of a page."""
    return [match[2] for match in PART.finditer(page)]


def fill(page: str, parts: Mapping[str, Callable[[], str]]) -> str:
    """Return a page with each of its parts as it should be."""
    return PART.sub(lambda match: f"{match[1]}{parts[match[2]]()}{match[4]}", page)


def table(header: list[str], rows: list[list[str]]) -> str:
    """Return lines of cells as a table."""
    lines = [header, ["---"] * len(header), *rows]
    return "".join(re.sub(r"\|  (?=\|)", "| ", f"| {' | '.join(line)} |\n") for line in lines)
