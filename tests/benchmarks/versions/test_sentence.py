"""The sentence for a pull request: errors, order and the first bad motion of free bodies, if they changed."""

from dataclasses import replace

import pytest

from conservative.benchmarks.versions.comparison import Comparison, Line
from conservative.benchmarks.versions.project import decide
from conservative.benchmarks.versions.sentence import sentences
from conservative.outcome import Outcome, OutcomeKind

from .made_up import BASE, HEAD, comparison, row

SENTENCE = "free rotation at your step"


def sentence(*pairs, scene="brick_flip"):
    """Return the sentences on pairs of rows, each of another scene: `scene`, then a separatrix."""
    places = (scene, "near_separatrix")
    rows = [
        tuple(each and replace(each, scene=place, id=f"{place} / {each.method}") for each in pair)
        for place, pair in zip(places, pairs, strict=False)
    ]
    lines = [Line(place, pair[0].method, pair) for place, pair in zip(places, rows, strict=False)]
    compared = Comparison((BASE, HEAD), tuple(lines))
    return list(sentences(compared, decide(compared)))


def wrong(mistake="", **values):
    return replace(row(**values), mistake=mistake, cause=mistake)


CASES = {
    "nothing": ([(row(), row())], ""),
    "round-off": ([(row(), row(attitude_error_max=1e-3 * (1 + 1e-9)))], ""),
    "all three": (
        [(row(attitude_error_max=0.19), wrong("no gyroscopic term", attitude_error_max=0.23, observed_order=1.0))],
        "attitude error 0.19 to 0.23 rad, order 2.0 to 1.0; first bad motion: brick_flip (no gyroscopic term)",
    ),
    "better": ([(row(), row(attitude_error_max=1e-5))], "attitude error 0.001 to 1e-05 rad"),
    "two digits are equal": (
        [(row(), row(attitude_error_max=1.0001e-3))],
        "first bad motion: brick_flip (no known mistake)",
    ),
    "order": ([(row(observed_order=1.0), row(observed_order=2.0))], "order 1.0 to 2.0"),
    "order by less than 0.2": ([(row(observed_order=1.0), row(observed_order=1.19))], ""),
    "a drift": ([(row(), row(energy_drift_max=0.1))], "first bad motion: brick_flip (no known mistake)"),
    "a smaller error beside a new failure": (
        [(row(), row(attitude_error_max=1e-5, energy_drift_max=0.1))],
        "first bad motion: brick_flip (no known mistake)",
    ),
    "work is no motion": ([(row(), row(steps=601.0))], ""),
    "a mistake of both versions": ([(wrong("damping"), wrong("damping"))], ""),
    "another mistake": ([(wrong("damping"), wrong("late"))], "first bad motion: brick_flip (late)"),
    "an unknown mistake": ([(row(), wrong("unknown"))], "first bad motion: brick_flip (no known mistake)"),
    "a run that fails": (
        [(row(), row(Outcome(OutcomeKind.DIVERGED, time=1.0)))],
        "first bad motion: brick_flip (diverged)",
    ),
    "the scene that changed, not the one with the larger error": (
        [(row(), row(attitude_error_max=2e-3)), (row(attitude_error_max=0.2), row(attitude_error_max=0.2))],
        "attitude error 0.001 to 0.002 rad; first bad motion: brick_flip (no known mistake)",
    ),
    "half a turn in both versions": ([(row(attitude_error_max=3.1), row(attitude_error_max=3.14))], ""),
}


@pytest.mark.parametrize("name", CASES)
def test_a_sentence(name):
    pairs, expected = CASES[name]
    assert sentence(*pairs) == ([f"{SENTENCE}: {expected}"] if expected else [])


def test_a_change_within_the_spread_is_not_said():
    spread = {"attitude error max": 0.1}
    was, now = (replace(row(attitude_error_max=error), spreads=spread) for error in (0.19, 0.23))
    assert sentence((was, now)) == []


def test_bodies_with_loads_are_not_free():
    assert sentence((row(), row(attitude_error_max=0.5)), scene="lagrange_top") == []


def test_each_of_several_methods_has_its_name():
    worse = row(attitude_error_max=2e-3)
    compared = comparison((row(), worse, None), (row(method="gauss"), row(method="gauss"), None))
    (text,) = sentences(compared, decide(compared))
    assert text.startswith(f"{SENTENCE} (reduced): attitude error 0.001 to 0.002 rad")
