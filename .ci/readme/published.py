"""The tables of benchmarks/published.md, from tests/data/published_figures.csv, and the rule by which a figure agrees."""

from __future__ import annotations

import csv
from collections.abc import Callable
from decimal import Decimal
from functools import partial
from typing import NamedTuple

from code_map import ROOT
from marks import table

FIGURES = ROOT / "tests" / "data" / "published_figures.csv"
MANY = 10
"""Programs that print all digits of a double also print their round-off: figures that differ only from here on are counted."""


class Comparison(NamedTuple):
    """Whether a figure agrees, the largest difference with the unit of its number, and the first digit that differs.

    If numbers differ, the largest is that of these. Difference and unit are None for bounds, the digit also if all agree.
    """

    agrees: bool
    difference: Decimal | None = None
    unit: Decimal | None = None
    digit: int | None = None


def read_figures() -> list[dict[str, str]]:
    """Return the rows of published_figures.csv."""
    with FIGURES.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def compare(relation: str, printed: str, measured: str) -> Comparison:
    """Compare measured numbers with printed ones, both decimals with spaces between them.

    A bound has to hold. Any other number may differ from the printed one by a unit of the last printed digit, because programs
    round digits or cut them off. That is the only tolerance.
    """
    pairs = [tuple(map(Decimal, pair)) for pair in zip(printed.split(), measured.split(), strict=True)]
    if relation != "=":
        return Comparison(all(each < bound if relation == "<" else each > bound for bound, each in pairs))
    units = [Decimal(1).scaleb(int(number.as_tuple().exponent)) for number, _ in pairs]
    differences = [abs(each - number) for number, each in pairs]
    _, difference, unit = max((d > u, d, u) for d, u in zip(differences, units, strict=True))
    digits = [n.adjusted() - d.adjusted() + 1 for (n, _), d, u in zip(pairs, differences, units, strict=True) if d > u]
    return Comparison(not digits, difference, unit, max(1, min(digits)) if digits else None)


def render_counts() -> str:
    """Return a sentence with the numbers of figures that agree, differ and cannot be measured."""
    figures = read_figures()
    found = [compare(row["relation"], row["printed"], row["measured"]) for row in figures if row["measured"]]
    agree = sum(each.agrees for each in found)
    late = sum(each.digit is not None and each.digit >= MANY for each in found)
    return (
        f"Of {len(figures)} published figures {agree} agree with our measurements and {len(found) - agree} differ, "
        f"{late} of them in the tenth digit or later.\n{len(figures) - len(found)} cannot be measured with our adapters.\n"
    )


def render_source(source: str) -> str:
    """Return the table of a source."""
    lines = []
    for row in read_figures():
        if row["source"] == source:
            note = f". {row['note']}" if row["note"] else ""
            shown = row["printed"] if row["relation"] == "=" else f"{row['relation']} {row['printed']}"
            cells = [row["name"].replace("|", "\\|"), shown, row["measured"] or "–"]
            if row["measured"]:
                each = compare(row["relation"], row["printed"], row["measured"])
                size = "–" if each.unit is None else f"{each.difference:.2g} ({each.unit:g})"
                cells += [size, row["method"], f"{result(each)}{note}"]
            else:
                cells += ["–", "–", f"not measured{note}"]
            lines.append(cells)
    return table(["figure", "printed", "measured", "difference (allowed)", "with", "result"], lines)


def result(each: Comparison) -> str:
    """Return the result as text: in bold if a reader should look."""
    if each.agrees:
        return "agrees"
    if each.digit is None:
        return "**differs**"
    return f"differs from digit {each.digit} on" if each.digit >= MANY else f"**differs** from digit {each.digit} on"


TABLES: dict[str, Callable[[], str]] = {
    "published figures": render_counts,
    **{
        f"figures of {source.replace('-', ' ')}": partial(render_source, source)
        for source in dict.fromkeys(row["source"] for row in read_figures())
    },
}
"""Parts of pages by the name of their mark, which has no hyphens."""
