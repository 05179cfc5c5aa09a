"""The count of false alarms and of slow-downs that are caught, on records with chosen ratios."""

from conservative.benchmarks.verification.comparison_alarms import FACTORS, Slowed, as_record, summarize

from .made_up import timed

SAME, SLOW = timed((1.0, 0.98, 1.02)), timed((1.1, 1.08, 1.12), (1.1, 1.08, 1.12))


def record(*rows):
    return as_record({f"brick_flip / reduced x{factor}": row for factor, row in zip(FACTORS, rows, strict=True)})


def test_alarms_are_counted_by_what_was_planted():
    found = summarize([record(SAME, SLOW, SLOW), record(SLOW, SAME, SLOW), record(SAME, SAME, SLOW)])
    assert (found["comparisons"], found["with a false alarm"]) == (3, 1)
    assert found["rows with a false alarm"] == ["brick_flip / reduced x1.0"]
    assert found["alarms by factor"] == {"1.0": "1 of 3", "1.1": "1 of 3", "1.2": "3 of 3"}


def test_one_side_takes_more_steps_than_it_says(monkeypatch):
    taken = []
    monkeypatch.setattr("conservative.benchmarks.comparison.side.Side.timed", lambda self, *asked: taken.append(asked))
    for plant in (False, True):
        side = object.__new__(Slowed)
        side._plant = plant
        side.timed("brick_flip", "reduced:order=4 x1.1", 0.01, 1000)
    assert taken == [("brick_flip", "reduced:order=4", 0.01, 1000), ("brick_flip", "reduced:order=4", 0.01, 1100)]
