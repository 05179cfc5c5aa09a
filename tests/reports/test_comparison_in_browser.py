"""The page of a comparison in a real, headless chromium: `pytest --browser`."""

from dataclasses import replace

import pytest

from conservative.benchmarks.comparison.compare import judge
from conservative.reports.page.versions import render_comparison
from conservative.reports.tables.comparison import Answer

from ..benchmarks.comparison.made_up import BASE, HEAD, found, timed
from .test_page_in_browser import start

pytestmark = pytest.mark.browser
TIMES = {
    "reduced": timed((1.1, 1.08, 1.12), (1.11, 1.09, 1.13)),
    "gauss": timed((0.8, 0.79, 0.81)),
    "lame": timed((1.01, 0.99, 1.02)),
}
VISIBLE = (
    "return [...document.querySelectorAll('tbody tr')].filter((row) => row.offsetHeight).map((row) => row.cells[1].textContent)"
)


@pytest.fixture(scope="module")
def opened(tmp_path_factory):
    """A page with three rows: one slower, one faster, one as it was."""
    rows = {name: replace(found(), row=replace(found().row, id=name, method=name)) for name in TIMES}
    file = tmp_path_factory.mktemp("page") / "gate.html"
    file.write_text(render_comparison(Answer(judge(BASE, HEAD, rows, rows, TIMES))), encoding="utf-8")
    browser = start(tmp_path_factory.mktemp("profile"))
    try:
        browser.get(file.as_uri())
        yield browser
    finally:
        browser.quit()


@pytest.fixture
def visible(opened):
    """Return the methods of the rows that are shown, of a page that was opened anew."""
    opened.refresh()
    return lambda: opened.execute_script(VISIBLE)


def click(browser, selector):
    browser.execute_script(f"document.querySelector({selector!r}).click()")


def test_rows_that_failed_come_first_and_every_row_is_shown(opened, visible):
    assert visible() == ["reduced", "gauss", "lame"]
    assert opened.execute_script("return document.getElementById('count').textContent") == "3 of 3 rows"


def test_rows_are_filtered_by_text_and_by_standing(opened, visible):
    opened.find_element("id", "text").send_keys("Brick LA")
    assert visible() == ["lame"]
    opened.refresh()
    click(opened, "[value=same]")
    assert visible() == ["reduced", "gauss"]
    click(opened, "[value=slower]")
    assert visible() == ["gauss"]


def test_rows_are_sorted_by_their_ratio_both_ways(opened, visible):
    click(opened, "thead th:nth-child(4) button")
    assert visible() == ["gauss", "lame", "reduced"]
    click(opened, "thead th:nth-child(4) button")
    assert visible() == ["reduced", "lame", "gauss"]
    assert opened.execute_script("return document.querySelector('[aria-sort]').textContent") == "ratio"
