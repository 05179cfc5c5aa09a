"""The filter of the tables of engines, in a real, headless chromium: `pytest --browser`."""

import pytest

from conservative import registry
from conservative.benchmarks.measures import measurement, samples
from conservative.reports.page import figures, page
from conservative.reports.run.measure import Measurements
from conservative.reports.run.plan import Plan
from conservative.reports.run.provenance import provenance
from conservative.reports.view import build

from .made_up_engines import at_step, over_steps
from .test_page_in_browser import open_drawn, wait

pytestmark = pytest.mark.browser
ROWS = "[...document.querySelectorAll('#engines .compact')[1].querySelectorAll('tbody tr:has(th)')]"
VISIBLE = f"return {ROWS}.filter((row) => row.offsetHeight).length"


@pytest.fixture(scope="module")
def opened(tmp_path_factory):
    """A page with three settings of two engines."""
    rows = [
        *at_step("a==1", "RK4", 1e-6),
        *over_steps("a==1", "RK4", (1e-1, 1e-2, 1e-3, 1e-4), 4.0),
        *at_step("a==1", "Euler", 3.0, as_installed=True),
        *at_step("b==2", "Euler", 0.2),
    ]
    plan = Plan((registry.scene("brick_flip"),), (registry.method("reduced"),), (), engines=(registry.method("pinocchio"),))
    view = build(plan, Measurements(measurement.frame(rows), samples.frame([])), provenance([]))
    file = tmp_path_factory.mktemp("page") / "index.html"
    file.write_text(page.render(view, figures.charts(view)), encoding="utf-8")
    with open_drawn(file, tmp_path_factory.mktemp("profile")) as browser:
        yield browser


@pytest.mark.parametrize(("words", "count"), [("", 3), ("euler", 2), ("EULER  b==2", 1), ("as installed", 1), ("nothing", 0)])
def test_rows_with_all_words_stay(opened, words, count):
    field = opened.find_elements("css selector", "#engines .filter input")[1]
    field.clear()
    field.send_keys(words or " ")
    wait(opened, f"{VISIBLE} === {count}")
    shown = opened.find_elements("css selector", "#engines .filter output")[1].text
    assert shown == (f"{count} of 3" if words else "")
