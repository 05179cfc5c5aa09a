"""Tests of references/motions that need no other file: few motions that catch every mistake, embedded as text."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

import conservative

from .programs import ANGLES, QUANTITIES

Description = Mapping[str, Any]
"""The keys and values of the JSON file of a motion, see `files.describe`."""

LANGUAGES = {
    "c": "rotation_test.c",
    "csharp": "RotationTest.cs",
    "javascript": "rotation.test.mjs",
    "python": "test_rotation.py",
    "rust": "rotation_test.rs",
}
"""The test of each language in references/motions. The test in C is one in C++, too."""
CLEAR = 10.0
"""Smallest error of a mistake that a motion of the small set catches, over the tolerance of order 2 at the smallest step."""
BANDS = ("usual", "small", "fast", "slow", "very slow")
"""Sizes of bodies, and rates of bodies that are not small: below 0.03 rad/s, to 0.3, to 30, and above."""
APART, DISTANCE = 30.0, 2.0
"""The same for pairs that a motion tells apart, and the sum of the squares of the logarithms of their errors' ratios, 2.5 times
the largest distance at which the tests name a mistake."""
DIGITS = 12
"""Digits of attitudes and rates. The smallest tolerance is 1e-10."""
NAMED = QUANTITIES[:2]
"""Errors that mistakes are named by: with all four, as in the files, no more planted mistakes are named (33 of 34)."""
BODY = ("rotor_momentum_B", "torque_B", "torque_W", "damping", "weight", "com_B", "orbit")
_REGION = re.compile(r"(^[^\n]*BEGIN MOTIONS[^\n]*\n).*?(^[^\n]*END MOTIONS)", re.DOTALL | re.MULTILINE)
_AROUND = {
    "c": ("static const char *const embedded[] = {", '"{}",', "NULL};"),
    "csharp": ('  const string Motions = @"', "{}", '";'),
    "javascript": ("const MOTIONS = `", "{}", "`;"),
    "python": ('MOTIONS = """', "{}", '"""'),
    "rust": ('const MOTIONS: &str = "', "{}", '";'),
}
"""The beginning of the embedded text, a line of it, and its end, by language."""


def small_set(descriptions: Sequence[Description], number: int = 12) -> list[Description]:
    """Return motions that catch every mistake that all motions catch, in the same order.

    First come motions that catch all mistakes clearly, as few and as short as possible. Motions of free bodies of usual size
    and rate are tried first, so that a mistake is caught in an engine that supports nothing else, where that is possible.
    A free body of each other band is next, because only such bodies show limits, sleep and dead bands of engines.
    Further motions of free bodies, those that tell apart most pairs of mistakes in their band, fill up the number.
    """
    caught = [_caught(each, CLEAR) for each in descriptions]
    mistakes, pairs = [{*each} for each in caught], [_pairs(each) for each in descriptions]
    bands = [_band(each) for each in descriptions]
    free = [i for i, each in enumerate(descriptions) if not each["features"]]
    usual = [i for i, band in enumerate(bands) if band == "usual"]
    chosen: list[int] = []

    def add(candidates: Sequence[int], gains: Sequence[set[Any]]) -> None:
        """Add the motion that gains most for its length as text; a motion has some hundred characters of mistakes."""
        known: set[Any] = set().union(*(gains[i] for i in chosen))
        remaining = [i for i in candidates if i not in chosen]
        chosen.append(max(remaining, key=lambda i: len(gains[i] - known) / (1000 + sum(map(len, _lines(descriptions[i]))))))

    for candidates in ([i for i in free if i in usual], free, usual, [*range(len(descriptions))]):
        while set().union(*(mistakes[i] for i in candidates)) - set().union(*(mistakes[i] for i in chosen)):
            add(candidates, mistakes)
    for band in BANDS:
        inside = [i for i in free if bands[i] == band]
        if inside and not {*inside} & {*chosen}:
            chosen.append(max(inside, key=lambda i: len(pairs[i])))
    while len(chosen) < number and {*free} - {*chosen}:
        add(free, pairs)
    return [descriptions[i] for i in sorted(chosen)]


def _caught(description: Description, factor: float) -> dict[str, Any]:
    """Return the logarithms of errors over tolerances (4,) by mistake, of those that are larger than a factor."""
    (allowed,) = (row for row in description["tolerance"] if (row["order"], row["angle"]) == (2, ANGLES[-1]))
    ratios = {each["mistake"]: np.array([each[name] / allowed[name] for name in QUANTITIES]) for each in description["catches"]}
    return {name: np.log(np.maximum(ratio, 1.0)) for name, ratio in ratios.items() if ratio.max() >= factor}


def _pairs(description: Description) -> set[tuple[str, str, str]]:
    """Return the pairs of mistakes that a motion tells apart, with the band of the motion."""
    band, caught = _band(description), _caught(description, APART)
    return {
        (band, one, other)
        for one, other in combinations(sorted(caught), 2)
        if np.sum((caught[one] - caught[other]) ** 2) >= DISTANCE
    }


def _band(description: Description) -> str:
    """Return the band of `BANDS` of a motion."""
    rates = description["scale"]["rates"]
    if np.linalg.eigvalsh(description["inertia_B"])[2] < 1e-4:
        return "small"
    return "usual" if 0.3 < rates < 30 else "fast" if rates >= 30 else "slow" if rates >= 0.03 else "very slow"


def embedded(descriptions: Sequence[Description]) -> list[str]:
    """Return lines of text with motions: lines as in their CSV files, with fewer digits, and a line for each mistake.

    The tolerances are those at the smallest step. A line `sample` has a time, an attitude and the rates in body axes. A line
    `mistake` has a field for each motion, with errors of attitude and rates, or nothing.
    """
    made: dict[str, list[str]] = {}
    for i, description in enumerate(descriptions):
        for each in description["catches"]:
            errors = made.setdefault(each["mistake"], [""] * len(descriptions))
            errors[i] = " ".join(_short(each[name], 2) for name in NAMED)
    rare_first = sorted(
        made.items(), key=lambda item: sum(map(bool, item[1]))
    )  # of two that explain the same, the first is named
    table = [",".join(["mistake", mistake, *errors]) for mistake, errors in rare_first]
    return [*(line for each in descriptions for line in _lines(each)), *table]


def _lines(description: Description) -> Iterator[str]:
    """Yield the lines of a motion, without its mistakes."""
    rates = description["scale"]["rates"]
    yield f"name,{description['name']}"
    if description["features"]:
        yield ",".join(["features", *description["features"]])
    yield _line("inertia_B", description["inertia_B"])
    yield f"quaternion_wxyz0,{_rounded(description['quaternion_wxyz0'], 1.0)}"
    yield f"w_WB_B0,{_rounded(description['w_WB_B0'], rates)}"
    yield from (_line(key, description[key]) for key in BODY if key in description)
    for t, q, w in zip(description["t"], description["quaternion_wxyz"], description["w_WB_B"], strict=True):
        yield f"sample,{_short(t, 15)},{_rounded(q, 1.0)},{_rounded(w, rates)}"
    yield _line("scale", list(description["scale"].values()))
    for row in description["tolerance"]:
        if row["angle"] == ANGLES[-1]:
            yield _line("tolerance", list(row.values()))
    yield _line("single", description["single"])


def _line(key: str, values: Any) -> str:
    return ",".join([key, *(_short(float(x), 17) for x in np.ravel(values))])


def _rounded(values: Sequence[float], size: float) -> str:
    """Return numbers rounded to digits of a size."""
    decimals = DIGITS - math.floor(math.log10(size))
    return ",".join(_short(round(x, decimals), 17) for x in values)


def _short(x: float, digits: int) -> str:
    """Return the shortest text of a number, rounded to digits."""
    number = float(f"{x:.{digits}g}")
    plain, scientific = np.format_float_positional(number, trim="-"), np.format_float_scientific(number, trim="-", exp_digits=1)
    plain = re.sub(r"^(-?)0\.", r"\1.", plain)
    return min(plain, scientific.replace("e+", "e"), key=len)


def one_file(language: str, descriptions: Sequence[Description]) -> str:
    """Return the test of a language (a key of `LANGUAGES`) with these motions embedded instead of its own."""
    folder = Path(conservative.__file__).parent / "references" / "motions"
    return fill(language, (folder / LANGUAGES[language]).read_text(encoding="utf-8"), descriptions)


def fill(language: str, text: str, descriptions: Sequence[Description]) -> str:
    """Return the text of a test with motions instead of those between the marks BEGIN MOTIONS and END MOTIONS."""
    before, line, after = _AROUND[language]
    lines = "\n".join([before, *(line.format(each) for each in embedded(descriptions)), after, ""])
    return _REGION.sub(lambda match: match[1] + lines + match[2], text)
