"""An attitude is lost above 1 rad, wherever it is said: by the gate, `track`, and `recommend`.

0.12 rad was called lost in both versions, and 0.2 rad by `recommend`. 0.46 rad that became 1.26 rad by a planted mistake next
to a separatrix was called the same, because five times a spread of 0.16 rad allows it.
"""

from dataclasses import replace

import pytest

from conservative.benchmarks.gate import compare
from conservative.benchmarks.gate.baseline import update_baseline
from conservative.benchmarks.gate.results import Results
from conservative.benchmarks.measures.errors import LOST, is_lost
from conservative.benchmarks.recommendation.growth import fit_law
from conservative.benchmarks.recommendation.probe import Probe
from conservative.benchmarks.versions.changes import Aspect, find_changes
from conservative.benchmarks.versions.project import Standing, decide, faster, standing_of
from conservative.outcome import OK
from conservative.registry import method
from conservative.reports.sections.recommendation import expected_text

from ..benchmarks.versions.made_up import comparison, row, timed
from ..benchmarks.versions.made_up_engine import GOOD, near

SPREAD = 0.165
"""Change of the attitude error by round-off, rad, next to a separatrix."""


def at(error, spread=SPREAD):
    """Return a row with this attitude error and this change of it by round-off, rad."""
    made = row(attitude_error_max=error)
    return replace(made, spreads={**made.spreads, "attitude error max": spread})


CASES = {
    (0.12, 0.12): Standing.SAME,
    (0.12, 0.46): Standing.SAME,  # within five spreads
    (0.46, 0.99): Standing.SAME,
    (0.46, 1.01): Standing.WORSE,
    (0.46, 1.26): Standing.WORSE,
    (0.83, 1.01): Standing.WORSE,  # no change by round-off loses it
    (0.84, 1.26): Standing.SAME,  # round-off may lose it
    (1.26, 1.7): Standing.SAME,
    (1.26, 2.2): Standing.WORSE,
    (1.26, 0.1): Standing.BETTER,
    (0.05, 1.26): Standing.MOTION,
    (3.05, 3.14): Standing.SAME,
}


@pytest.mark.parametrize("errors", CASES)
def test_two_versions_of_a_project(errors):
    compared = comparison((at(errors[0]), at(errors[1]), timed((1.0, 0.98, 1.02))))
    decided = decide(compared)
    assert standing_of(compared.lines[0], decided.violations) == CASES[errors]
    said = any("lost in both versions" in note for note in decided.notes)
    assert said == (min(errors) > LOST)


@pytest.mark.parametrize("errors", [(was, now) for was, now in CASES if was < 3])
def test_the_gate_with_a_baseline(errors):
    """It decides alike, except that it knows no other motions and no half turns."""
    was, now = map(at, errors)
    decided = compare.decide(update_baseline(None, [Results("", {was.id: was})], "first"), Results("", {now.id: now}))
    assert decided.passed == (CASES[errors] not in (Standing.WORSE, Standing.MOTION))


def test_a_motion_that_is_not_lost_can_be_faster():
    quick = timed((0.5, 0.49, 0.51))
    assert [faster(comparison((at(error), at(error), quick)).lines[0]) for error in (0.12, 0.99, 1.01)] == [True, True, False]


@pytest.mark.parametrize(
    ("was", "now", "lost"),
    [
        (0.12, 0.12, None),
        (0.46, 0.99, None),
        (0.46, 1.26, True),
        (0.995, 1.26, None),  # with one or two more steps it was lost before
        (1.26, 2.9, None),
        (1.26, 0.46, False),
        (0.12, 0.46, False),  # an error that is larger is a change, and no loss
    ],
)
def test_versions_of_an_engine(was, now, lost):
    found = find_changes(replace(GOOD, error=near(was)), replace(GOOD, error=near(now)), (), ())
    assert [(change.row.measure, change.lost) for change in found] == ([] if lost is None else [(Aspect.ERROR, lost)])


@pytest.mark.parametrize(
    ("error", "duration", "text"),
    [
        (0.12, 10.0, "0.12"),
        (0.12, 200.0, "lost"),  # 2.4 rad are expected
        (0.46, 10.0, "above 0.46"),
        (0.46, 200.0, "above 0.46"),
        (1.26, 10.0, "lost"),
    ],
)
def test_the_error_to_expect(error, duration, text):
    import numpy as np

    t = np.linspace(0.0, 10.0, 101)
    law = fit_law(t, error * t / 10, 0.0, 1.0)
    words = law.describe(duration), law.extrapolate(duration)
    probe = Probe(method("reduced"), 0.1, 10.0, error, words[1], words[0], 1.0, law, (), 1.0, OK)
    assert expected_text(probe) == text
    if duration > 10:
        assert ("the attitude is lost" in words[0]) == is_lost(error)
