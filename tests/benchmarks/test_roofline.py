"""The roofline: what is counted, and what the page says of made-up measurements."""

from pathlib import Path

import pytest

import conservative
from conservative.benchmarks.verification import operations, roofline
from conservative.benchmarks.verification.operations import Counted, count_value, counts
from conservative.benchmarks.verification.roofline import Measured, Work, count_series, write_page

PEAKS = {"an FMA": 1e-10, "a division": 1e-9, "a square root": 2e-9}
CASE = ("taylor:order=8", "heavy_tops", 0.05)


def test_numbers_count_what_is_done_with_them():
    counts.clear()
    a, (b, _) = Counted(2.0), count_value((3.0, "text"))
    assert -(a * b + 1.0 - 4.0 / b) / 2 == -(6.0 + 1.0 - 4.0 / 3.0) / 2
    assert dict(counts) == {"multiplications": 1, "additions": 2, "divisions": 2}
    assert 2.0 * a == 4.0
    assert counts["multiplications"] == 2
    assert type(a * b) is Counted


@pytest.mark.parametrize("order", [1, 2, 9])
def test_products_of_a_series_are_those_of_all_pairs(order):
    pairs = [(i, k - i) for k in range(order) for i in range(k + 1)]
    assert count_series(order).multiplications == 15 * len(pairs) + 18 * order


def test_a_bound_is_the_time_of_what_cannot_be_left_out():
    assert Work(30, 20, 1, 2).bound(PEAKS) == pytest.approx(30e-10 + 1e-9 + 4e-9)
    assert Work(20, 30, 0, 0).bound(PEAKS) == pytest.approx(30e-10)


def test_the_page_shows_what_was_measured_and_how():
    page = write_page(Measured({CASE: Work(40, 10, 0, 0)}, PEAKS, 9.6e9, {CASE: 8e-9}, {CASE: 2e-8}))
    assert "| `taylor:order=8` | heavy tops | 0.05 | 40 | 10 | 0 | 0 | 4.00 | 8.00 | 50% |" in page
    assert "at least 10.0 ns" in page
    assert f"| a sample |  |  | {96 / 3.35:.1f} | {96 / 1.008:.1f} |" in page
    assert f"| {40 / 17e12 * 1e12:.2f} |" in page
    assert roofline.DEVICES[0].source in page


def test_the_page_of_this_repository_has_the_form_and_says_where_it_was_made():
    page = (Path(conservative.__file__).resolve().parent.parent / "benchmarks" / "roofline.md").read_text(encoding="utf-8")
    assert "python -m conservative.benchmarks.verification.roofline --out benchmarks/roofline.md" in page
    assert all(f"| `{name}` |" in page for name, *_ in operations.CASES)
    headings = [line for line in write_page(Measured({}, PEAKS, 1e10, {}, {})).splitlines() if line.startswith("#")]
    assert [line for line in page.splitlines() if line.startswith("#")] == headings
