"""README against the evidence: its tables to the character, its sentences by what `claims.toml` says that they are made of."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from itertools import zip_longest
from pathlib import Path
from typing import Any

from conservative import files
from conservative.errors import BadInput

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
    sentences = [*(_claim(entry, evidence) for entry in entries["claim"]), *allowed]
    wrong, covered = _compare_tables(page, evidence)
    return [*wrong, *judge(page, sentences, covered), *_stale(page, sentences)]


def write_tables(readme: Path = README, evidence: Evidence | None = None) -> None:
    """Write README's tables anew, as the evidence gives them."""
    text = readme.read_text(encoding="utf-8")
    for given in (evidence or Evidence()).tables:
        text = text.replace(_find_table(text, given), "\n".join(given))
    files.write_text(readme, text, "readme")


def _find_table(text: str, given: Sequence[str]) -> str:
    """Return the table of a page whose header begins as that of a table that is given; raise `BadInput` without one."""
    _, bar, rest = text.partition("\n" + given[0].split(" | ")[0] + " | ")
    if not bar:
        raise BadInput("README.md", f"no table whose header begins with {given[0]}", "one for each generated table")
    return (bar + rest.partition("\n\n")[0]).strip("\n")


def _compare_tables(page: Page, evidence: Evidence) -> tuple[list[str], set[Number]]:
    """Return what the generated tables on the page say otherwise than the evidence, and all numbers in them."""
    wrong: list[str] = []
    covered: set[Number] = set()
    for given in evidence.tables:
        there = _find_table(page.text, given)
        first = page.text.index(there)
        pairs = enumerate(zip_longest(there.splitlines(), given, fillvalue="(no row)"), page.text.count("\n", 0, first) + 1)
        wrong += [f"{page.name}:{at}: {one}: the evidence gives {other}" for at, (one, other) in pairs if one != other]
        covered |= {number for number in page.numbers if first <= number.start < first + len(there)}
    return wrong, covered


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
