"""Cost of a run in a new process: the error of both sides, and the rows of measured.csv."""

import sys

import pytest

from .pages import ROOT

sys.path.insert(0, str(ROOT / ".ci" / "readme"))
import price

sys.path.pop(0)


@pytest.mark.slow
@pytest.mark.parametrize(("side", "limit"), [("heyoka", price.ERROR / 10), ("conservative", price.ERROR)])
def test_a_side_reaches_the_error(side, limit):
    found = price.measure(side, "gravity", 0)
    assert found["error"] < limit  # measured 4.2e-12 and 1.5e-14
    assert 0 < found["other"] < found["once"]  # the first run imports and compiles: measured 2e-5 and 0.2 s, or 0.01 and 0.6 s


def test_the_rows_are_medians_and_the_largest_error(monkeypatch):
    found = {0: 1.0, 1: 5.0, 2: 2.0}
    monkeypatch.setattr(price, "measure", lambda side, field, index: dict.fromkeys(price.QUANTITIES, found[index]))
    rows = [(row["name"], row["quantity"], row["value"]) for row in price.price_rows((0, 1, 2), ("gravity",))]
    medians = ("one run", "first run of another body", "next run of the same body")
    values = [*((quantity, 2.0) for quantity in medians), ("largest error", 5.0)]
    assert rows == [(side, *value) for side in ("conservative", "heyoka") for value in values]
