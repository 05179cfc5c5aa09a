"""The table of prices: processes that run both sides, the error of their results, and its rows."""

import os
import sys

import pytest

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


def test_both_sides_reach_the_error(found):
    assert found[price.HEYOKA][0]["error"] < price_program.ERROR / 10  # measured 1.1e-10
    assert found[price.OURS][0]["error"] < price_program.ERROR  # measured 1.2e-8


def test_a_thousand_runs_contain_the_first(found):
    for (each,) in found.values():
        assert each["other"] > 0
        assert 0 < each["once"] < each["thousand"]


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


def test_the_bodies_are_two_of_each_field_and_all_different():
    pairs = price.pairs()
    assert len({type(scene.potential) for scene, _ in pairs}) == len(pairs) == len(price.FIELDS)
    assert all(type(a.potential) is type(b.potential) for a, b in pairs)
    bodies = [scene for pair in pairs for scene in pair]
    assert len({scene.key for scene in bodies}) == len({tuple(scene.body.moments) for scene in bodies}) == len(bodies)
