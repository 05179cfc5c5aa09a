"""What a stranger sees, measured in a real, headless chromium: `pytest --browser`; see `test_page_in_browser`."""

import base64
import dataclasses

import pandas as pd
import pytest

from conservative.benchmarks.measures import measurement
from conservative.reports.charts.contrast import DARK_PAPER, LEAST, LIGHT_PAPER, contrast
from conservative.reports.page import page, random_bodies, scene_charts
from conservative.reports.run.measure import Measurements
from conservative.reports.run.plan import plan_report
from conservative.reports.run.provenance import provenance
from conservative.reports.view import build

from .made_up import measurements, row
from .rows import point
from .test_page_in_browser import open_drawn, wait
from .test_random_ratios import SLOWER, TWICE
from .test_throughput import ROWS as MANY_BODIES

pytestmark = pytest.mark.browser

FAMILIES = {
    **dict.fromkeys(("reduced", "gauss", "taylor", "projected", "convected", "substepped", "moser_veselov"), "ours"),
    **dict.fromkeys(("heyoka", "scipy", "mujoco:integrator=implicitfast", "pinocchio:scheme=Euler", "made_up"), "engine"),
}
CASES = [f"a_case_with_a_long_name_{k}" for k in range(28)]
PAPER_WIDTH = 1032  # px of an A4 page across, 297 mm, less margins of 12 mm
WIDER = "return [...document.querySelectorAll(arguments[0])].map((e) => e.getBoundingClientRect().right)"


def rows():
    """Rows of a dozen families of every class, as many as there are colours to see."""
    for k, (name, role) in enumerate(FAMILIES.items()):
        for i in range(4):
            yield from point(name, role, 10.0 ** (-2 * i - 2), (1 + k) * 1e-6 * 3**i, 0.1 / 2**i, scene="brick_flip")
        yield row("long_runs", name, "energy drift max", 10.0 ** (k - 15), role=role)
        yield row("speed", name, "prepare time", (1.5, 2345.0, 0.4)[k % 3], role=role)
        yield from (row("stability", name, "largest |w| dt that works", 1.0, scene=case, role=role) for case in CASES[:14])
        for case in CASES:
            yield row("hard_cases", name, "attitude error max", 10.0 ** (-k), scene=case, role=role)


@pytest.fixture(scope="module")
def opened(tmp_path_factory):
    """A page of made-up rows with everything that a page can have."""
    made = measurements()
    random = measurement.frame([each for lines in (*TWICE, *SLOWER) for each in lines])
    others = made.table[~made.table["study"].isin(("long_runs", "work_precision", "speed"))]
    table = pd.concat([others, measurement.frame(rows()), random, MANY_BODIES])
    plan = dataclasses.replace(plan_report(["brick_flip"], ["reduced", "heyoka:tol=1e-9"], bodies=2), hard=True)
    view = build(plan, Measurements(table, made.samples), provenance(["report"]))
    charts = {scene.name: scene_charts.build(scene) for scene in view.scenes}
    file = tmp_path_factory.mktemp("page") / "index.html"
    file.write_text(page.render(view, charts, {}, random_bodies.chart(view.random)), encoding="utf-8")
    with open_drawn(file, tmp_path_factory.mktemp("profile")) as browser:
        yield browser


@pytest.fixture
def sized(opened):
    """Sets the size of the screen, and opens the page anew on it, since charts are drawn for the screen that they find."""

    def resize(width, height, mobile=False):
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": mobile}
        opened.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        opened.refresh()
        wait(opened, "return document.documentElement.dataset.drawn")

    yield resize
    opened.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
    opened.refresh()
    wait(opened, "return document.documentElement.dataset.drawn")


def bottom(browser, selector):
    return browser.execute_script("return document.querySelector(arguments[0]).getBoundingClientRect().bottom", selector)


def test_sentence_picture_and_table_are_on_the_first_screen(opened, sized):
    sized(1440, 900)
    assert bottom(opened, ".lead") < bottom(opened, "#first svg") < bottom(opened, "#verdict table.classes") <= 900
    assert "as fast as" in opened.find_element("css selector", ".lead").text


def test_sentence_and_picture_and_where_the_table_begins_are_on_the_first_screen_of_a_phone(opened, sized):
    sized(390, 844, mobile=True)
    row = bottom(opened, "#verdict .classes tbody tr")
    assert bottom(opened, ".lead") < bottom(opened, "#first .chart svg") < row <= 844  # measured 792
    assert opened.execute_script("return document.documentElement.scrollWidth") <= 390
    assert max(opened.execute_script(WIDER, ".lead, .classes *, .grid, .grid td, .grid thead th, figure, .chart svg")) <= 390


def test_a_picture_of_rows_of_panels_has_a_chart_for_each_of_them(opened):
    script = "return [...document.querySelectorAll('#many_bodies .chart')].map((e) => e.querySelectorAll(arguments[0]).length)"
    counts = opened.execute_script(script, ".mark-symbol path")
    assert len(counts) == 6  # kinds of bodies times errors
    assert min(counts) >= 2
    assert len(opened.find_elements("css selector", "#many_bodies .entry")) == 5
    assert opened.get_log("browser") == []


def test_long_tables_keep_their_first_column_and_their_header(opened, sized):
    sized(390, 844, mobile=True)
    script = """
        const box = [...document.querySelectorAll(".scroll")].find((e) => e.scrollWidth > e.clientWidth + 20);
        box.scrollLeft = box.scrollWidth;
        const at = (e) => e.getBoundingClientRect();
        return [at(box.querySelector("tbody th")).left - at(box).left, at(box.querySelector("tbody td")).left - at(box).left];
    """
    first, second = opened.execute_script(script)
    assert abs(first) < 2
    assert second < 0  # what is not the first column is scrolled away
    assert opened.execute_script("return getComputedStyle(document.querySelector('.scroll thead th')).position") == "sticky"


@pytest.mark.parametrize(("scheme", "paper"), [("light", LIGHT_PAPER), ("dark", DARK_PAPER)])
def test_every_line_has_contrast(opened, scheme, paper):
    opened.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": scheme}]})
    wait(opened, f"return document.documentElement.dataset.drawn === '{scheme}'")
    found = opened.execute_script(
        """return [...document.querySelectorAll(".mark-line path, .mark-symbol path, .entry path")].flatMap((e) =>
        [e.getAttribute("stroke"), e.getAttribute("fill")]).filter((colour) => colour?.startsWith("#"))"""
    )
    opened.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})
    assert len(set(found)) > 10
    assert min(contrast(colour.upper(), paper) for colour in set(found)) >= LEAST


def test_at_most_eight_lines_are_drawn_at_first_and_single_settings_on_demand(opened):
    pressed = opened.find_elements("css selector", "#work_precision_brick_flip .entry[aria-pressed=true]")
    assert len(pressed) == 8
    assert len(opened.find_elements("css selector", "#work_precision_brick_flip .entry")) == 12
    lines = "return document.querySelectorAll('#work_precision_brick_flip .mark-line path').length"
    before = opened.execute_script(lines)
    assert before == 8
    box = opened.find_element("css selector", "#work_precision_brick_flip input[type=checkbox]")
    opened.execute_script("arguments[0].click()", box)
    wait(opened, f"{lines} > {before}")


def test_numbers_of_a_hard_case_are_told_at_a_tap(opened):
    cell = opened.find_element("css selector", ".grid td[data-about*=reduced]")
    opened.execute_script("arguments[0].scrollIntoView({block: 'center'}); arguments[0].click()", cell)
    assert opened.find_element("css selector", ".grid output").text == cell.get_attribute("data-about")
    assert " rad, invariants " in cell.get_attribute("data-about")


def table_rows(browser):
    script = "return [...document.querySelector('#paid-once tbody').rows].map((e) => [e.innerText, e.offsetHeight])"
    return [text for text, height in browser.execute_script(script) if height]


def test_a_long_table_is_filtered_by_text_and_sorted_by_number(opened):
    from selenium.webdriver.common.keys import Keys

    field = opened.find_element("css selector", "#paid-once .filter input")
    field.send_keys("e")
    wait(opened, "return document.querySelector('#paid-once .filter output').textContent")
    assert all("e" in text for text in table_rows(opened))
    assert len(table_rows(opened)) < len(FAMILIES)
    field.clear()
    field.send_keys(" ")
    head = opened.find_elements("css selector", "#paid-once thead th")[1]
    head.find_element("css selector", "[role=button]").send_keys(Keys.ENTER)  # as a keyboard does it
    cells = [text.split("\t")[1].replace(",", "") for text in table_rows(opened)]
    found = [float(text) for text in cells if text != "–"]
    assert found == sorted(found)
    assert len(set(found)) == 3
    assert head.get_attribute("aria-sort") == "ascending"


def test_print_loses_no_column_and_repeats_headers(opened, sized):
    sized(PAPER_WIDTH, 700)
    opened.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    opened.execute_script("dispatchEvent(new Event('beforeprint'))")
    rights = opened.execute_script(WIDER, "table, table th, table td")
    heads = opened.execute_script("return [...document.querySelectorAll('thead')].map((e) => getComputedStyle(e).display)")
    done = opened.execute_cdp_cmd("Page.printToPDF", {"printBackground": True, "preferCSSPageSize": True})
    opened.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": ""})
    assert len(rights) > 500
    assert max(rights) <= PAPER_WIDTH + 1
    assert set(heads) == {"table-header-group"}
    assert base64.b64decode(done["data"]).startswith(b"%PDF")
