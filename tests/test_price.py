"""The table of prices: processes that run both sides, the error of their results, and its rows."""

import os
import sys

import pytest

from conservative.scenes.random_body import FIELDS, random_body

from .pages import ROOT

sys.path.insert(0, str(ROOT / ".ci" / "readme"))  # `price` imports the program beside it
import price
import price_program

sys.path.pop(0)


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    cache = os.environ.get("NUMBA_CACHE_DIR") or str(tmp_path_factory.mktemp("kernels"))
    pair = price.pairs()[0]
    return {side: [price.measure_side(side, *pair, cache)] for side in (price.OURS, price.HEYOKA)}


@pytest.mark.slow
def test_both_sides_reach_the_error(found):
    assert found[price.HEYOKA][0]["error"] < price_program.ERROR / 10  # measured 1.1e-10
    assert found[price.OURS][0]["error"] < price_program.ERROR  # measured 1.2e-8


def test_the_rows_are_medians_and_the_largest_error():
    bodies = [{"once": t, "thousand": 2 * t, "other": 3 * t, "error": t} for t in (1.0, 5.0, 2.0)]
    rows = list(price.price_rows({price.OURS: bodies, price.HEYOKA: bodies[:1]}))
    assert [(row["name"], row["quantity"], row["value"]) for row in rows[:4]] == [
        ("conservative", "one run", 2.0),
        ("conservative", "1,000 runs", 4.0),
        ("conservative", "first run of another body", 6.0),
        ("conservative", "largest error", 5.0),
    ]
    assert [row["value"] for row in rows[4:]] == [1.0, 2.0, 3.0, 1.0]


def test_the_bodies_are_two_of_each_field():
    pairs = price.pairs()
    fields = [type(random_body(field, 0, 0).potential) for field in FIELDS]
    assert [[type(scene.potential) for scene in pair] for pair in pairs] == [[field, field] for field in fields]
    assert len({scene.key for pair in pairs for scene in pair}) == 2 * len(FIELDS)
