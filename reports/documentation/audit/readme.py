"""README against the evidence: its tables to the character, its sentences by what `claims.toml` says that they are made of."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from .. import readme_table
from ..evidence.store import Evidence
from .measured import FUNCTIONS
from .sentences import Sentence, judge
from .text import Number, Page

CLAIMS = Path(__file__).with_name("claims.toml")
README = Path(__file__).resolve().parents[3] / "README.md"
"""In a checkout; what is installed has none."""


def audit_here() -> list[str]:
    """Return what README of this checkout says without support."""
    return audit(README.read_text(encoding="utf-8"), Evidence(), CLAIMS.read_text(encoding="utf-8"))


def audit(text: str, evidence: Evidence, claims: str) -> list[str]:
    """Return what README says without support, a line each; `claims` is the text of claims.toml."""
    page, entries = Page("README.md", text), tomllib.loads(claims)
    allowed = [_literal(entry["text"]) for entry in entries["allowed"]]
    sentences = [_claim(entry, evidence) for entry in entries["claim"]]
    tables = {name: "\n".join(readme_table.markdown(lines)) for name, lines in _tables(evidence).items()}
    covered = {number for number in page.numbers if any(_within(number, page, table) for table in tables.values())}
    return [
        *(
            f"README.md: the table of {name} is not what the evidence gives"
            for name, table in tables.items()
            if table not in text
        ),
        *judge(page, [*sentences, *allowed], covered),
        *_stale(page, [*sentences, *allowed]),
    ]


def _tables(evidence: Evidence) -> Mapping[str, Iterable[Any]]:
    return {"costs": readme_table.rows(evidence.rows), "random bodies": readme_table.random_bodies(evidence.contests)}


def _within(number: Number, page: Page, part: str) -> bool:
    start = page.text.find(part)
    return start >= 0 and start <= number.start < start + len(part)


def _claim(entry: Mapping[str, Any], evidence: Evidence) -> Sentence:
    given = {name: value for name, value in entry.items() if name not in ("text", "from")}
    return Sentence(entry["text"], partial(FUNCTIONS[entry["from"]], evidence, **given), tuple(_numbers(given.values())))


def _numbers(values: Iterable[Any]) -> Iterator[float]:
    """Yield the numbers in the arguments of a claim, those in their words included."""
    for value in values:
        if isinstance(value, list):
            yield from _numbers(value)
        elif isinstance(value, int | float):
            yield float(value)
        else:
            yield from (sum(number.bounds) / 2 for number in Page("", value).numbers)


def _literal(text: str) -> Sentence:
    """Return a sentence all of whose numbers are allowed as they stand there."""
    return Sentence(text, dict, tuple(number.text for number in Page("", text).numbers))


def _stale(page: Page, sentences: Iterable[Sentence]) -> Iterator[str]:
    for sentence in sentences:
        count = len(sentence.pattern.findall(page.text))
        if count != 1:
            yield f'claims.toml: "{sentence.text}" stands {count} times in README.md, and has to stand there once'
