"""An animation in a real, headless chromium: `pytest --browser`."""

import pytest

import conservative as cv
from conservative import registry
from conservative.references.exact.method import Exact

from .test_page_in_browser import start, wait

pytestmark = pytest.mark.browser
WEBGL = ("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    scene = cv.scenes.brick_flip()
    engine = cv.integrate(scene, 0.002, registry.method("mujoco:Euler"))
    file = tmp_path_factory.mktemp("animation") / "brick.html"
    engine.animate(labels=["engine", "exact"], truth=cv.integrate(scene, 0.002, Exact())).save(file)
    return file.as_uri()


def opened(page, folder, *arguments):
    browser = start(folder, *arguments)
    browser.get(page)
    wait(browser, "return document.querySelector('.motion[data-drawn]')")
    return browser


@pytest.fixture(scope="module")
def browser(page, tmp_path_factory):
    browser = opened(page, tmp_path_factory.mktemp("profile"), *WEBGL, "--force-prefers-reduced-motion")
    yield browser
    browser.quit()


def at(browser, time):
    """Move the slider to a time, s, and return the colours of each panel: the numbers of pixels by colour."""
    script = """
        const slider = document.querySelector('.time');
        slider.value = arguments[0];
        slider.dispatchEvent(new Event('input'));
        return [...document.querySelectorAll('canvas')].map((canvas) => {
          const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height), counts = {};
          for (let k = 0; k < data.length; k += 4) {
            if (data[k + 3] < 255) continue;
            const [r, g, b] = data.subarray(k, k + 3);
            const green = g > 1.5 * r && g > b, purple = r > 1.3 * g && b > 1.3 * g;
            const name = green ? 'green' : purple ? 'purple' : r > 1.5 * b ? 'warm' : b > 1.2 * r ? 'blue' : 'other';
            counts[name] = (counts[name] ?? 0) + 1;
          }
          return counts;
        });
    """
    return browser.execute_script(script, time)


def values(browser):
    return browser.execute_script("return [...document.querySelectorAll('dd')].map((e) => [e.textContent, e.className])")


def test_it_draws_body_momentum_and_trace_and_nothing_goes_wrong(browser):
    begin, end = at(browser, 0), at(browser, 6)
    for counts in (*begin, *end):
        assert min(counts["green"], counts["warm"] + counts["blue"]) > 100  # measured 234 and 4,300
    assert end[0]["purple"] > 3 * begin[0]["purple"]  # the trace
    assert abs(begin[0]["warm"] - begin[1]["warm"]) < 0.1 * begin[1]["warm"]  # 0.047: the same start, below an outline
    assert abs(end[0]["warm"] - end[1]["warm"]) > 0.2 * end[1]["warm"]  # 0.6 rad later
    assert [entry for entry in browser.get_log("browser") if entry["source"] != "rendering"] == []  # a slow renderer says so


def test_numbers_are_the_largest_so_far_with_their_colours(browser):
    at(browser, 6)
    assert values(browser) == [
        ["✗ 0.04", "bad"], ["✗ 0.02", "bad"], ["✗ 0.6", "bad"], ["✓ < 1e-15", "good"], ["✓ < 1e-15", "good"],
    ]  # fmt: skip
    at(browser, 0)
    assert {name for _, name in values(browser)} == {"good"}


def test_reduced_motion_waits_for_play_and_a_keyboard_plays_and_moves(browser):
    from selenium.webdriver.common.keys import Keys

    at(browser, 1.2)
    time = "return Number(document.querySelector('.time').value)"
    play, slider = (browser.find_element("css selector", name) for name in (".play", ".time"))
    assert play.text == "Play"
    assert browser.execute_script(time) == pytest.approx(1.2)
    play.send_keys(Keys.ENTER)
    wait(browser, f"{time} > 1.4")
    assert play.text == "Pause"
    slider.send_keys(Keys.SPACE)
    assert play.text == "Play"
    slider.send_keys(Keys.HOME)
    assert browser.execute_script(time) == 0
    slider.send_keys(Keys.ARROW_RIGHT)
    assert browser.execute_script(time) == pytest.approx(0.006)


def test_it_plays_by_itself_otherwise(page, tmp_path):
    browser = opened(page, tmp_path, *WEBGL)
    try:
        wait(browser, "return Number(document.querySelector('.time').value) > 0.1")
    finally:
        browser.quit()


def test_without_webgl_a_sentence_says_so_and_the_numbers_remain(page, tmp_path):
    browser = opened(page, tmp_path, "--disable-3d-apis")
    try:
        assert "WebGL" in browser.find_element("css selector", ".missing").text
        assert not browser.find_element("css selector", "canvas").is_displayed()
        browser.execute_script("const s = document.querySelector('.time'); s.value = 6; s.dispatchEvent(new Event('input'))")
        assert values(browser)[2] == ["✗ 0.6", "bad"]
    finally:
        browser.quit()
