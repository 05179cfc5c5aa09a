"""The page in a real, headless chromium: `pytest --browser`, with Debian's packages chromium and chromium-driver."""

import base64
import io
import json
import os
import shutil
import time
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

import pandas as pd
import pytest

from conservative import registry
from conservative.benchmarks.measures import measurement
from conservative.reports import report
from conservative.reports.document import html
from conservative.reports.run.measure import Measurements
from conservative.reports.run.plan import Plan, plan_report
from conservative.reports.run.provenance import provenance
from conservative.reports.sections.report import build

from ..environments import PATIENCE
from .made_up import at_step, named, over_steps

pytestmark = pytest.mark.browser

ARGUMENTS = (
    "--headless=new",
    "--disable-gpu",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--window-size=1280,1000",
)
METHODS = ["reduced", "reduced:order=4", "gauss:stages=2", "mujoco:RK4", "heyoka:tol=1e-9"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A real report of both scenes."""
    out = tmp_path_factory.mktemp("browser") / "report"
    report.write(plan_report([], METHODS, quick=True), out, lambda share, what: None)
    return out


@contextmanager
def open_drawn(file, profile):
    """Have a browser that has opened and drawn a page, for the length of a block."""
    browser = start(profile)
    try:
        browser.get(file.as_uri())
        wait(browser, "return document.documentElement.dataset.drawn")
        yield browser
    finally:
        browser.quit()


def start(profile, *arguments):
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service

    browser, driver = shutil.which("chromium") or shutil.which("google-chrome"), shutil.which("chromedriver")
    assert browser, "neither chromium nor google-chrome is there: apt-get install chromium, or leave out --browser"
    assert driver, "chromedriver is not there: apt-get install chromium-driver, or leave out --browser"
    options = webdriver.ChromeOptions()
    options.binary_location = browser
    root = ["--no-sandbox"] if os.geteuid() == 0 else []  # chromium's sandbox refuses root, as CI's container has it
    for argument in (*ARGUMENTS, *root, f"--user-data-dir={profile}", *arguments):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    return webdriver.Chrome(options=options, service=Service(driver))


@pytest.fixture(scope="module")
def opened(folder, tmp_path_factory):
    """The page, opened and drawn, and everything that the browser asked for on the way."""
    with open_drawn(folder / "index.html", tmp_path_factory.mktemp("profile")) as browser:
        yield browser


@pytest.fixture(scope="module")
def unfolded(opened):
    """The same page with every folded part open and drawn."""
    unfold(opened)
    return opened


def unfold(browser):
    browser.execute_script("document.querySelectorAll('main details').forEach(d => { d.open = true })")
    wait(browser, "return [...document.querySelectorAll('.chart')].every(e => e.querySelector('svg'))")


def wait(browser, script):
    end = time.monotonic() + PATIENCE
    while not browser.execute_script(script):
        assert time.monotonic() < end, script
        time.sleep(0.05)


def requests(browser):
    """Return every address that the page asked for; the browser's own pages are not the page's."""
    events = (json.loads(entry["message"])["message"] for entry in browser.get_log("performance"))
    asked = [event["params"]["request"]["url"] for event in events if event["method"] == "Network.requestWillBeSent"]
    return [url for url in asked if not url.startswith(("chrome:", "chrome-untrusted:", "about:", "data:", "blob:"))]


def test_nothing_is_asked_for_but_the_file_and_nothing_goes_wrong(opened, folder):
    assert set(requests(opened)) == {(folder / "index.html").as_uri()}
    assert [entry for entry in opened.get_log("browser") if entry["source"] != "rendering"] == []  # a slow renderer says so


def test_the_first_look_is_short(opened, folder):
    words = opened.execute_script("return document.body.innerText")
    assert 50 < len(words.split()) <= 350  # measured 312
    end = opened.execute_script("return document.querySelector('main > details').getBoundingClientRect().bottom")
    assert end + opened.execute_script("return scrollY") < 1000  # px, 1,280 wide; measured 923
    entries = opened.execute_script(
        "return [...document.querySelectorAll('.legend')].map(l => [...l.querySelectorAll('.entry')]"
        ".filter(e => e.checkVisibility()).length).filter(n => n)"
    )
    assert entries
    assert max(entries) <= 8
    assert (folder / "index.html").stat().st_size < 2e6  # measured 1.2e6
    assert opened.execute_script("return document.querySelectorAll('#motion .motion figure').length") >= 3


def test_a_link_of_the_header_opens_the_part_behind_the_click(folder, tmp_path):
    with open_drawn(folder / "index.html", tmp_path) as browser:
        shown = "return document.querySelector('#drift h3').checkVisibility()"
        assert not browser.execute_script(shown)
        browser.find_element("css selector", "nav a[href='#drift']").click()
        wait(browser, shown)
        wait(browser, "return document.querySelectorAll('#drift .chart svg').length")


def test_a_table_has_its_rows_as_csv(opened):
    link = opened.find_element("css selector", "#results .csv a")
    opened.execute_script("arguments[0].click()", link)
    wait(opened, "return document.querySelector('#results .csv a').download")
    text = opened.execute_async_script("fetch(arguments[0].href).then(r => r.text()).then(arguments[1])", link)
    found = pd.read_csv(io.StringIO(text))
    measured = pd.read_csv(Path(opened.current_url.removeprefix("file://")).parent / "measurements.csv")
    study = measured["study"].isin(["motion", "convergence", "speed"])
    expected = measured[study & (measured["scene"] == "brick_flip")].reset_index(drop=True)
    assert expected["study"].nunique() == 3
    pd.testing.assert_frame_equal(found, expected, check_dtype=False)


def test_every_table_has_a_link_and_every_long_one_a_filter(opened):
    script = """
    return [...document.querySelectorAll('main table')].map((table) => {
        const frame = table.closest('.scroll, .grid'), rows = table.tBodies[0].rows.length;
        const [before, after] = [frame.previousElementSibling, frame.nextElementSibling];
        return [rows, Boolean(after?.matches('.csv')), Boolean(before?.matches('.filter'))];
    })"""
    found = opened.execute_script(script)
    assert len(found) > 10  # measured 17
    assert all(linked for _, linked, _ in found)
    assert all(filtered for rows, _, filtered in found if rows > 10)


def test_a_chart_in_a_folded_part_is_drawn_when_it_is_opened(opened):
    inside = "document.querySelectorAll('#brick_flip .chart svg').length"
    assert opened.execute_script(f"return {inside}") == 0
    opened.execute_script("document.getElementById('brick_flip').open = true")
    wait(opened, f"return {inside}")


def test_every_chart_has_marks(unfolded):
    opened = unfolded
    marks = "svg .mark-symbol path, svg .mark-line path"
    script = "return [...document.querySelectorAll('.chart')].map(e => e.querySelectorAll(arguments[0]).length)"
    counts = opened.execute_script(script, marks)
    assert len(counts) > 10  # measured 12 in a default report
    assert min(counts) >= 2


def drawn_symbols(browser, colour):
    script = 'return document.querySelectorAll(`#time_against_error .chart svg path[fill="${arguments[0]}"]`).length'
    return browser.execute_script(script, colour)


def test_a_button_of_the_legend_hides_its_line_and_brings_it_back(opened):
    from selenium.webdriver.common.keys import Keys

    button = opened.find_element("css selector", "#time_against_error .entry[data-series^=mujoco]")
    colour = button.find_element("css selector", "path").get_attribute("fill")
    before = drawn_symbols(opened, colour)
    assert before > 1
    button.send_keys(Keys.ENTER)  # as a keyboard does it
    wait(
        opened,
        f"return !document.querySelectorAll('#time_against_error .chart path[fill=\"{colour}\"]').length",
    )
    assert button.get_attribute("aria-pressed") == "false"
    assert opened.execute_script("return document.querySelectorAll('#time_against_error .chart .mark-symbol path').length")
    button.send_keys(Keys.SPACE)
    wait(
        opened,
        f"return document.querySelectorAll('#time_against_error .chart path[fill=\"{colour}\"]').length == {before}",
    )
    assert button.get_attribute("aria-pressed") == "true"


def test_hovering_shows_exact_values(opened):
    from selenium.webdriver import ActionChains

    mark = opened.find_element("css selector", "#time_against_error .chart .mark-symbol path")
    opened.execute_script("arguments[0].scrollIntoView({block: 'center', behavior: 'instant'})", mark)
    ActionChains(opened).move_to_element(mark).perform()
    wait(opened, "return document.querySelector('#vg-tooltip-element.visible')")
    text = opened.find_element("id", "vg-tooltip-element").text
    assert "attitude error, rad" in text
    assert "µs per simulated second" in text


def column(browser, table, number):
    return browser.execute_script(
        "return [...arguments[0].tBodies[0].rows].map(r => r.cells[arguments[1]].textContent)", table, number
    )


def test_a_table_sorts_by_number_both_ways(unfolded):
    opened = unfolded
    region = "[aria-label^='brick_flip: wall time']"
    table = opened.find_element("css selector", f"{region} table.sortable")
    head = table.find_elements("css selector", "thead th")[2]
    for wanted, backwards in (("ascending", False), ("descending", True)):
        head.click()
        wait(opened, f"return document.querySelectorAll(`{region} thead th`)[2].ariaSort === '{wanted}'")
        found = [float(text.replace(",", "")) for text in column(opened, table, 2) if text != "–"]
        assert found == sorted(found, reverse=backwards)
        assert len(found) > 3


def load_axe(opened):
    opened.set_script_timeout(PATIENCE)  # on a busy machine axe needs more than the usual 30 s
    axe = Path(find_spec("axe_core_python").submodule_search_locations[0]) / "axe.min.js"
    opened.execute_script(axe.read_text(encoding="utf-8"))


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_no_serious_violation(opened, scheme):
    opened.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": scheme}]})
    wait(opened, f"return document.documentElement.dataset.drawn === '{scheme}'")
    load_axe(opened)
    opened.execute_script("document.querySelectorAll('details').forEach(d => { d.open = true })")
    # What is inside a chart is a picture (role="img") with a name; its thousands of marks would take a minute.
    found = opened.execute_async_script("axe.run({exclude: [['.chart svg']]}).then(arguments[0])")
    serious = [
        f"{v['id']}: {v['nodes'][0]['html'][:200]}" for v in found["violations"] if v["impact"] in ("serious", "critical")
    ]
    assert serious == []
    assert len(found["passes"]) > 10  # measured 28


def test_a_control_that_is_bad_is_found_by_axe(opened):
    """The check before this one can fail: a button without a name is a critical violation."""
    load_axe(opened)
    opened.execute_script("document.body.insertAdjacentHTML('beforeend', '<button id=nameless></button>')")
    found = opened.execute_async_script("axe.run('#nameless').then(arguments[0])")
    opened.execute_script("document.getElementById('nameless').remove()")
    assert "button-name" in {violation["id"] for violation in found["violations"]}


AT_390 = """
    const left = [...document.querySelectorAll('#motion figure')].map((e) => e.getBoundingClientRect().left);
    const tables = [...document.querySelectorAll('.scroll')].filter((e) => e.checkVisibility());
    const hints = (e) => [e.classList.contains('more'), getComputedStyle(e).maskImage !== 'none'];
    const wide = tables.filter((e) => e.scrollWidth > e.clientWidth + 8), before = wide.map(hints);
    wide.forEach((e) => { e.scrollLeft = e.scrollWidth; });
    const empty = [...document.querySelectorAll('.scroll tbody tr')].filter((e) => e.checkVisibility()).map((row) => {
      const heights = [...row.cells].map((cell) => {
        const range = document.createRange();
        range.selectNodeContents(cell);
        return range.getBoundingClientRect().height;
      });
      return [row.offsetHeight - Math.max(...heights.slice(0, 2)), row.textContent];
    });
    requestAnimationFrame(() => requestAnimationFrame(() => arguments[0]({
      columns: new Set(left).size, tables: wide.length, before, after: wide.map(hints),
      empty: empty.sort(([a], [b]) => b - a)[0],
    })));
"""


def test_phone_has_two_panels_in_a_row_low_rows_and_a_sign_at_tables_that_scroll(opened):
    size = {"width": 390, "height": 844, "deviceScaleFactor": 1, "mobile": True}
    opened.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    try:
        wait(opened, "return innerWidth <= 390 && document.querySelector('.scroll.more')")
        found = opened.execute_async_script(AT_390)
        assert (found["columns"], found["tables"] >= 2) == (2, True)
        assert found["before"] == [[True, True]] * found["tables"]
        assert found["after"] == [[False, False]] * found["tables"]
        assert found["empty"][0] < 40  # px beside the first two cells: a line and the padding; measured 33, before 89
    finally:
        opened.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def test_phone_has_no_sideways_scrolling_of_the_page(opened):
    size = {"width": 390, "height": 844, "deviceScaleFactor": 1, "mobile": True}
    opened.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    try:
        wait(opened, "return innerWidth <= 390 && document.documentElement.scrollWidth <= innerWidth")
        widths = opened.execute_script(
            "return [...document.querySelectorAll('.chart svg')].map(e => e.getBoundingClientRect().width)"
        )
        assert max(widths) <= 390
    finally:
        opened.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def test_page_prints(opened):
    done = opened.execute_cdp_cmd("Page.printToPDF", {"printBackground": True})
    pdf = base64.b64decode(done["data"])
    assert pdf.startswith(b"%PDF")
    assert len(pdf) > 5e4  # measured 7e5


ENGINE_ROWS = "[...document.querySelectorAll('#engines .compact')[1].querySelectorAll('tbody tr:has(th)')]"
VISIBLE_ENGINES = f"return {ENGINE_ROWS}.filter((row) => row.offsetHeight).length"


@pytest.fixture(scope="module")
def engines_page(tmp_path_factory):
    """A page with three settings of two engines."""
    rows = [
        *at_step("a==1", "RK4", 1e-6),
        *over_steps("a==1", "RK4", (1e-1, 1e-2, 1e-3, 1e-4), 4.0),
        *at_step("a==1", "Euler", 3.0, as_installed=True),
        *at_step("b==2", "Euler", 0.2),
    ]
    plan = Plan((registry.scene("brick_flip"),), (registry.method("reduced"),), (), engines=named(rows))
    document = build(plan, Measurements(measurement.frame(rows), measurement.samples_frame([])), provenance([]))
    file = tmp_path_factory.mktemp("page") / "index.html"
    file.write_text(html.render(document), encoding="utf-8")
    with open_drawn(file, tmp_path_factory.mktemp("profile")) as browser:
        unfold(browser)
        yield browser


@pytest.mark.parametrize(("words", "count"), [("", 3), ("euler", 2), ("EULER  b==2", 1), ("as installed", 1), ("nothing", 0)])
def test_rows_with_all_words_stay(engines_page, words, count):
    field = engines_page.find_elements("css selector", "#engines .filter input")[1]
    field.clear()
    field.send_keys(words or " ")
    wait(engines_page, f"{VISIBLE_ENGINES} === {count}")
    shown = engines_page.find_elements("css selector", "#engines .filter output")[1].text
    assert shown == (f"{count} of 3" if words else "")
