"""Sentences with numbers: which ones stand on a page, and whether their numbers are those that follow from rows.

A sentence is a text with places for what is measured: `{low}` for a number, `{low>}` for one that no value is below, `{high<}`
for one that none is above; `{error:given}` for a number, and `{engine:words}` for words, that the values depend on;
`{commit:text}` for words that are what the values say.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from .text import NUMBER, Number, Page, Value

PLACE = re.compile(r"\{(\w+)([<>]?)(?::(given|words|text))?\}")
WORDS = r"[^\n]+?"
Values = Mapping[str, Value | Sequence[Value]]
"""What each place of a sentence has to say; several values, if all of them have to be written so."""
NOTHING = "no row of the evidence supports it"


class NoSupportError(Exception):
    """The rows do not have what a sentence is about; the text says what is missing."""


@dataclass(frozen=True)
class Sentence:
    """A sentence, and what its numbers have to be.

    Attributes
    ----------
    text
        The sentence, or a part of it, with its places.
    values
        Returns the values; takes what is `given` and `words` by name, and raises `NoSupportError`.
    parameters
        What the values depend on and what stands in the text as it is.
    words
        Regular expression of what `{engine:words}` stands for.
    """

    text: str
    values: Callable[..., Values]
    parameters: Collection[Value] = ()
    words: str = WORDS

    @cached_property
    def pattern(self) -> re.Pattern[str]:
        """What the sentence looks like on a page, wherever its lines end."""
        parts = PLACE.split(self.text)
        found = [_literal(parts[0])]
        for name, _, kind, literal in zip(parts[1::4], parts[2::4], parts[3::4], parts[4::4], strict=True):
            place = {"words": self.words, "text": WORDS}.get(kind, NUMBER.pattern)
            found.append(f"(?P<{name}>{place}){_literal(literal)}")
        return re.compile("".join(found))

    @cached_property
    def places(self) -> dict[str, tuple[str, str]]:
        """Relation and kind of each place."""
        return {name: (relation, kind or "") for name, relation, kind in PLACE.findall(self.text)}

    def check(self, page: Page, found: re.Match[str]) -> Iterator[tuple[Number, str]]:
        """Yield each number of the sentence where it was found, and what is wrong with it, "" if nothing is."""
        given = {name: _read(found, name, kind) for name, (_, kind) in self.places.items() if kind in ("given", "words")}
        try:
            values, missing = self.values(**given), ""
        except NoSupportError as error:
            values, missing = {}, str(error)
        for number in page.numbers:
            if found.start() <= number.start and number.end <= found.end():
                yield number, missing or self._judge(number, found, values)

    def _judge(self, number: Number, found: re.Match[str], values: Values) -> str:
        name = next((name for name in self.places if found.start(name) <= number.start and number.end <= found.end(name)), None)
        if name is None:
            return "" if any(number.agrees(value) for value in self.parameters) else NOTHING
        relation, kind = self.places[name]
        return "" if kind in ("given", "words") else _compare(found[name] if kind == "text" else number, relation, values[name])


def _literal(text: str) -> str:
    return r"\s+".join(re.escape(word) for word in re.split(r"\s+", text))


def _read(found: re.Match[str], name: str, kind: str) -> Any:
    number = Number(*found.span(name), found[name])
    return sum(number.bounds) / 2 if kind == "given" else found[name]


def _compare(written: Number | str, relation: str, value: Value | Sequence[Value]) -> str:
    """Return what the values are where they are not what is written."""
    several: Sequence[Value] = [value] if isinstance(value, int | float | str) else value
    if isinstance(written, str):
        holds = bool(several) and all(written == each for each in several)
    else:
        agrees = {"": written.agrees, "<": written.lies_above, ">": written.lies_below}[relation]
        holds = bool(several) and all(agrees(each) for each in several)
    return "" if holds else f"the rows give {', '.join(_text(each) for each in several) or 'nothing'}"


def _text(value: Value) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def judge(page: Page, sentences: Sequence[Sentence], covered: Collection[Number]) -> Iterator[str]:
    """Yield what is wrong with each number of a page that is not covered already, in the order of the page."""
    verdicts: dict[Number, list[str]] = {number: [] for number in page.numbers if number not in covered}
    for sentence in sentences:
        for found in sentence.pattern.finditer(page.text):
            for number, wrong in sentence.check(page, found):
                verdicts.setdefault(number, []).append(wrong)
    for number, found_wrong in sorted(verdicts.items(), key=lambda item: item[0].start):
        if number not in covered and "" not in found_wrong:
            yield f"{page.describe(number)}: {(found_wrong or [NOTHING])[0]}"
