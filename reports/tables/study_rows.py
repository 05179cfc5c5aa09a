"""The findings of one study: tables for a terminal and for Markdown, CSV and JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import pandas as pd

from conservative.benchmarks.studies.studies import RANDOM, THROUGHPUT
from conservative.outcome import OutcomeKind

from ..labels import with_names
from . import random_bodies, throughput
from .cells import DASH, Cell, Table, markdown, number
from .rows import prefix_quantity

Captioned = tuple[str, Table]
"""What a table is called, and the table."""


@dataclass(frozen=True, eq=False)
class StudyRows:
    """What a study found.

    Attributes
    ----------
    name
        Of the study.
    table, samples
        Its rows (see `Measurement`), and lines of pictures (see `Samples`).
    made
        How, where and when it was measured, by name.
    """

    name: str
    table: pd.DataFrame
    samples: pd.DataFrame
    made: Mapping[str, str]

    @cached_property
    def _many(self) -> throughput.ThroughputView | None:
        return throughput.view(with_names(self.table)) if self.name == THROUGHPUT else None

    @property
    def tables(self) -> list[Captioned]:
        """The tables: ratios of random bodies, costs of many; of any other study its rows."""
        if self._many:
            captions = ("Many bodies: an engine's time over ours", "Many bodies: what one of them costs", "What did not run")
            return list(zip(captions, (self._many.ratios, self._many.costs, self._many.absent), strict=True))
        if self.name != RANDOM:
            return [(f"{self.name}: {len(self.table)} rows", rows_table(self.table))]
        contests = random_bodies.ratios(with_names(self.table))
        return [
            ("Random bodies: the cheapest engine's time over ours", random_bodies.as_table(contests)),
            ("Random bodies: each engine's time over ours, mean (worst to best)", random_bodies.by_engine(contests)),
        ]

    @property
    def statements(self) -> tuple[str, ...]:
        """What it comes to, in words; only of random bodies, and of many."""
        if self._many:
            return self._many.statements
        return random_bodies.statements(random_bodies.ratios(with_names(self.table))) if self.name == RANDOM else ()

    def csv_text(self) -> str:
        """Return the rows as CSV, in the columns of a report's measurements.csv."""
        return self.table.to_csv(index=False, lineterminator="\n")

    def json_text(self) -> str:
        """Return everything as JSON; null stands for a number that could not be measured."""
        contests = random_bodies.ratios(with_names(self.table)) if self.name == RANDOM else ()
        ratios = {"ratios": random_bodies.records(contests)} if contests else {}
        parts = {**ratios, "rows": _records(self.table), "samples": _records(self.samples)}
        return json.dumps({"study": self.name, **self.made, **parts}, indent=1, ensure_ascii=False)

    def markdown_text(self) -> str:
        """Return tables and statements as Markdown, and how they were made."""
        tables = [f"## {caption}\n\n{markdown(table)}" for caption, table in self.tables]
        said = ["\n".join(f"- {text}" for text in self.statements)] if self.statements else []
        terms = {RANDOM: [random_bodies.TERMS], THROUGHPUT: [throughput.TERMS]}.get(self.name, [])
        made = "\n".join(["| | |", "| --- | --- |", *(f"| {name} | {value} |" for name, value in self.made.items())])
        return "\n\n".join([f"# Study: {self.name}", *terms, *said, *tables, f"## How this was made\n\n{made}"]) + "\n"


def _records(table: pd.DataFrame) -> list[dict[Any, Any]]:
    return [dict(row) for row in table.astype(object).where(table.notna(), None).to_dict("records")]


def rows_table(table: pd.DataFrame) -> Table:
    """Return the rows of any study as a table: what was measured of whom, or why it was not."""
    header = ["scene", "method", "step, s", "measure", "value", "unit", "outcome"]
    return header, [_row(row) for row in prefix_quantity(with_names(table)).to_dict("records")]


def _row(row: Mapping[Any, Any]) -> list[str | Cell]:
    step = DASH if math.isnan(row["dt"]) else f"{row['dt']:.4g}"
    ok = row["outcome"] == OutcomeKind.OK
    end = "" if ok else f"{row['outcome']}{': ' * bool(row['reason'])}{row['reason']}"
    return [row["scene"], row["name"], step, row["measure"], number(row["value"], 3), row["unit"], end]
