"""Columns of times, by the words of their names."""

from __future__ import annotations

import re
from collections.abc import Sequence

from .names import SECONDS, parse, vocabulary
from .quantities import other

DATES = dict.fromkeys(("utcg", "utc", "txt", "text", "date", "iso", "iso8601", "tai", "gps", "tdb", "local", "local time"), 1.0)
"""Names of times that are dates or in s, in the place of a unit."""
DAYS = frozenset(("julian", "jd", "mjd"))
"""Words of times in days."""
FRACTIONS = {"nsec": 1e-9, "ns": 1e-9, "usec": 1e-6, "us": 1e-6, "msec": 1e-3, "ms": 1e-3}
"""Last words of columns with the fractions of seconds in another column, and their units, s."""
_WHOLE = frozenset(("sec", "secs", "second", "seconds", "s"))
_TIMES = vocabulary(
    "time stamp elapsed epoch unix utc date datetime clock heure datum uhrzeit julian jd mjd "
    "second seconds sec secs msec usec nsec"
)
_SPANS = vocabulary(
    "dt delay latency step interval exposure remaining duration period solve compute constant scale sync zone week lag diff "
    "age per rate frequency cost iteration fine"
)
"""Words of spans of time, which are not the time of a row."""
_MEASURED = vocabulary("header sample measurement measured sensor capture acquisition")
_ARRIVED = vocabulary(
    "arrival arrived receive received recv rx log logging logged publish published host wall system record recorded write "
    "receipt pc cpu accelerometer location gps gnss mag magnetometer altimeter battery video audio camera"
)
_COUNTERS = vocabulary("frame frames index idx row sample number n i k counter count step tick ticks packet seq")


def find_times(names: Sequence[str]) -> list[list[str]]:
    """Return the columns that may be the time of a row: one each, or two of seconds and their fractions."""
    singles = [name for name in names if _is_time(name)]
    by_words = {parse(name).all: name for name in reversed(singles)}
    pairs = [
        [by_words[whole], name]
        for name in singles
        if (words := parse(name).all) and words[-1] in FRACTIONS
        for word in _WHOLE
        if (whole := (*words[:-1], word)) in by_words
    ]
    taken = {name for pair in pairs for name in pair}
    return [*pairs, *([name] for name in singles if name not in taken)]


def _is_time(name: str) -> bool:
    """Return whether a column is the time of a row by the words of its name."""
    parsed = parse(name)
    words = parsed.words
    if (
        not words
        or (parsed.unit is not None and parsed.unit not in SECONDS | DATES)
        or other(name)
        or _SPANS.intersection(words)
    ):
        return False
    alone = words[parsed.part :] == ("t",) or (
        "t" in words and len(words) < 4 and not any(len(word) < 2 and word != "t" for word in words)
    )
    return bool(_TIMES.intersection(words)) or alone or words in (("tv",),)


def is_counter(name: str) -> bool:
    """Return whether a column counts rows by its name, or has no name."""
    words = parse(name).words
    return not words or bool(_COUNTERS.intersection(words))


def rank(names: Sequence[str], motion: Sequence[str]) -> int:
    """Return how likely columns are the time of the measurement: 0 for the time of the same sensor, 4 for a temperature."""
    words = frozenset(word for name in names for word in parse(name).words)
    if "t" in words and re.search("(?<![A-Za-z])T(?![A-Za-z])", names[0]):
        return 4
    if words & motion_words(motion) - _TIMES:
        return 0
    return 1 if words & _MEASURED else 3 if words & _ARRIVED else 2


def motion_words(motion: Sequence[str]) -> frozenset[str]:
    """Return the words of the columns of a motion that may name their sensor."""
    return frozenset(word for name in motion for word in parse(name).words if len(word) > 2)
