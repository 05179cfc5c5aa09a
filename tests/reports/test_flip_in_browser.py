"""The live figure of the page "Why does it flip?" in a real, headless chromium: `pytest --browser`."""

import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import conservative as cv
from conservative.references.exact.method import Exact
from conservative.reports.documentation import flip
from conservative.reports.documentation.site import HERE
from conservative.reports.numbers import angle

from .test_animation_in_browser import WEBGL, at
from .test_page_in_browser import load_axe, requests, start, wait

SETTINGS = {  # length along the spin axis, rate (rad/s), disturbance
    "the brick": (2.0, 10.0, 0.005),
    "largest moment": (0.5, 20.0, 0.3),
    "smallest moment": (4.5, 3.0, 0.1),
    "nearly the separatrix": (2.4, 15.0, 1e-4),
    "two equal moments": (1.0, 10.0, 0.2),
}


def test_the_page_has_at_most_400_words():
    text = re.sub(r"```.*?```", "", (HERE / "why_does_it_flip.md").read_text(encoding="utf-8"), flags=re.DOTALL)
    assert 300 < len(text.split()) <= 400


def test_the_file_beside_the_page_is_current_and_needs_no_network():
    text = flip.FILE.read_text(encoding="utf-8")
    assert text == flip.page(), "run: python -m conservative.reports.documentation.flip"
    assert not re.findall(r"""(?:src|href)=["']?(?:https?:)?//""", text)


@pytest.fixture(scope="module")
def file():
    return flip.FILE


@pytest.fixture(scope="module")
def browser(file, tmp_path_factory):
    browser = start(tmp_path_factory.mktemp("profile"), *WEBGL, "--force-prefers-reduced-motion")
    browser.get(file.as_uri())
    wait(browser, "return document.querySelector('.motion[data-drawn]')")
    yield browser
    browser.quit()


def moved(browser, length, rate, disturbance):
    """Move the sliders, and return the moments, attitudes and momenta (relative, body axes) of both motions."""
    script = """
        for (const [k, slider] of [...document.querySelectorAll('.settings input')].entries()) slider.value = arguments[k];
        document.querySelector('.settings input').dispatchEvent(new Event('input'));
        const [body, exact, losing_body, losing] = document.querySelector('.motion').content.panels;
        return [exact.moments, body.q, exact.L, losing_body.q, losing.L];
    """
    moments, *values = browser.execute_script(script, length, rate, np.log10(disturbance))
    return np.array(moments), *(np.reshape(each, (-1, size)) for each, size in zip(values, (4, 3, 4, 3), strict=True))


@pytest.mark.browser
@pytest.mark.parametrize("name", SETTINGS)
def test_the_exact_motion_is_that_of_the_exact_solution(browser, name):
    length, rate, disturbance = SETTINGS[name]
    moments, q, L, *_ = moved(browser, length, rate, disturbance)
    assert moments == pytest.approx([9 + length**2, 1 + length**2, 10])
    w0 = np.array([0, rate * disturbance, rate])
    scene = cv.Scene("flip", cv.RigidBody(moments), np.eye(3), w0, flip.DURATION)
    exact = Exact().solve(scene, cv.Grid(1 / 60, len(q) - 1))
    assert len(q) == 721
    errors = (Rotation.from_matrix(exact.R_WB).inv() * Rotation.from_quat(q)).magnitude()
    assert errors.max() < 1e-6  # measured 3e-7, near the separatrix, where all errors grow
    assert np.abs(L * np.linalg.norm(moments * w0) / moments - exact.w_WB_B).max() < 1e-6 * rate  # measured 3e-7


@pytest.mark.browser
@pytest.mark.parametrize("name", SETTINGS)
def test_the_motion_that_loses_energy_is_that_of_implicit_euler(browser, name):
    length, rate, disturbance = SETTINGS[name]
    moments, _, _, q, L = moved(browser, length, rate, disturbance)
    w, turn, J, h = np.array([0, rate * disturbance, rate]), Rotation.identity(), np.diag(moments), 1 / 60
    size = np.linalg.norm(J @ w)
    turns, momenta = [], []
    for _ in q:
        turns.append(turn)
        momenta.append(J @ w / size)
        skew, skew_L = (np.cross(each, np.eye(3)).T for each in (w, J @ w))
        w = w - np.linalg.solve(J + h * (skew @ J - skew_L), h * np.cross(w, J @ w))
        turn = turn * Rotation.from_rotvec(h * w)
    assert (
        Rotation.concatenate(turns).inv() * Rotation.from_quat(q)
    ).magnitude().max() < 1e-6  # measured 7e-8, near the separatrix
    assert np.abs(L - momenta).max() < 1e-6  # measured 5e-8
    assert np.linalg.norm(L[-1]) < 0.995  # measured 0.991: it loses


@pytest.mark.browser
@pytest.mark.parametrize("name", SETTINGS)
def test_the_error_has_the_text_of_tables_and_is_the_largest_so_far(browser, name):
    _, q, _, losing, _ = moved(browser, *SETTINGS[name])
    largest = np.maximum.accumulate((Rotation.from_quat(q).inv() * Rotation.from_quat(losing)).magnitude())
    (sizes,) = browser.execute_script("return document.querySelector('.motion').content.panels[2].sizes")
    sizes = {frame: text for frame, text, _ in sizes}
    assert len(sizes) > 30  # measured 83 to 139
    shown = [sizes[max(frame for frame in sizes if frame <= n)] for n in range(len(q))]
    others = [(text, value) for text, value in zip(shown, largest, strict=True) if text != angle(value)]
    assert [pair for pair in others if pair[0] not in (angle(pair[1] - 1e-9), angle(pair[1] + 1e-9))] == []
    assert len(others) <= 2  # whose last digit is round-off, as that of 0


@pytest.mark.browser
def test_sentences_follow_the_sliders(browser):
    said = {
        name: (moved(browser, *values), browser.find_element("css selector", ".said").text)[1]
        for name, values in SETTINGS.items()
    }
    assert ("4 times" in said["the brick"], "44 %" in said["the brick"], "25 %" in said["the brick"]) == (True,) * 3
    assert [name for name in said if "unstable" in said[name]] == ["the brick", "nearly the separatrix"]
    assert [name for name in said if " 0 times" in said[name]] == ["largest moment", "smallest moment"]


@pytest.mark.browser
@pytest.mark.parametrize("width", [390, 1280])
def test_it_works_from_disk_on_a_phone_and_a_screen_and_by_keyboard(browser, file, width):
    from selenium.webdriver.common.keys import Keys

    size = {"width": width, "height": 844, "deviceScaleFactor": 1, "mobile": width == 390}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    moved(browser, *SETTINGS["the brick"])
    wait(browser, "return document.documentElement.scrollWidth <= innerWidth")
    rows = browser.execute_script(
        "return [...document.querySelectorAll('.flip canvas')].map((e) => e.getBoundingClientRect().top)"
    )
    assert rows[0] == rows[1] < rows[2] == rows[3]
    begin, end = at(browser, 0), at(browser, 6)
    assert min(counts["purple"] for counts in end) > 200  # traces and polhodes; measured 408
    assert max(counts.get("purple", 0) for counts in begin[1::2]) < 20  # measured 0
    outputs = "return [...document.querySelectorAll('.settings output')].map((e) => e.textContent)"
    before = browser.execute_script(outputs)
    for slider in browser.find_elements("css selector", ".settings input"):
        slider.send_keys(Keys.ARROW_RIGHT)
        assert slider.get_attribute("aria-valuetext")
    assert all(new != old for new, old in zip(browser.execute_script(outputs), before, strict=True))
    picture = "return document.querySelectorAll('.flip canvas')[1].toDataURL()"
    seen = browser.execute_script(picture)
    browser.find_elements("css selector", ".flip canvas")[1].send_keys(Keys.ARROW_LEFT)
    assert browser.execute_script(picture) != seen
    assert set(requests(browser)) <= {file.as_uri()}
    assert [entry for entry in browser.get_log("browser") if entry["source"] != "rendering"] == []
    load_axe(browser)
    found = browser.execute_async_script("axe.run('.flip').then(arguments[0])")["violations"]
    assert [each["id"] for each in found if each["impact"] in ("serious", "critical")] == []
