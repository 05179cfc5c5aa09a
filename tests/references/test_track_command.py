"""`conservative track` on versions of the test engine that behave differently, and on MuJoCo."""

import json
import re
from xml.etree import ElementTree

import pytest
from click.testing import CliRunner

from conservative.references.environments.environment import list_environments
from conservative.reports.cli.main import main

from .local_wheels import write_numpy, write_wheel

BEHAVIOUR = {
    "1.0": ("integrate", 2),
    "1.1": ("integrate", 4),
    "1.2": ("refuse", 4),
}
"""The behaviour of each version, and the stages of its integrator: the midpoint rule, the classical Runge-Kutta method."""


@pytest.fixture(scope="module")
def index(tmp_path_factory):
    """A folder of wheels of NumPy and of versions of the engine that behave differently."""
    folder = tmp_path_factory.mktemp("index")
    write_numpy(folder)
    for version, (do, stages) in BEHAVIOUR.items():
        write_wheel(folder, version, code=code(do, stages))
    return folder


def code(do, stages):
    at = "prepare" if do == "refuse" else "run"
    return f"DO, AT, STAGES = {do!r}, {at!r}, {stages}\n"


@pytest.fixture
def track(index, no_environments):
    """Return exit code, stdout and stderr of the command."""

    def run(*arguments):
        options = ("--find-links", str(index), "--settings", "as_packaged", "--scenes", "brick_flip:t_end=0.5")
        done = CliRunner().invoke(main, ["track", "trial", *map(str, arguments), *options])
        return done.exit_code, done.stdout, done.stderr

    return run


@pytest.mark.slow
def test_changes_between_versions_are_reported_and_written(track, tmp_path):
    files = ("--out", tmp_path / "page", "--junit", tmp_path / "junit.xml", "--markdown", tmp_path / "track.md")
    code, text, words = track("1.0", "1.1", "1.2", *files)
    assert code == 0
    assert words.splitlines() == [f"installing trial@{version}" for version in BEHAVIOUR]
    rose, gone = text.partition("Changes\n")[2].splitlines()[:2]
    assert "as_packaged on brick_flip:t_end=0.5, 1.0 → 1.1: order of the attitude 2 → 4; order of the rates 2 → 4" in rose
    assert "attitude error 2.1e-3 → 2.6e-7 rad" in rose
    assert "1.1 → 1.2: outcome ok → " in gone
    assert (tmp_path / "track.md").read_text() == (tmp_path / "page" / "track.md").read_text()
    page = re.sub("<[^>]+>", "", (tmp_path / "page" / "track.html").read_text())  # numbers are marked up
    assert rose.strip() in page
    assert len(json.loads((tmp_path / "page" / "track.json").read_text())["rows"]) == 3
    assert ElementTree.parse(tmp_path / "junit.xml").find("testsuite").get("failures") == "0"


@pytest.mark.slow
def test_the_newest_releases_are_compared(track, index, tmp_path):
    code, text, _ = track("--last", 1, "1.0", "--json")
    assert code == 0
    document = json.loads(text)
    assert [each["version"] for each in document["versions"]] == ["1.0", "1.2"]
    (change,) = document["changes"]
    assert "1.0 → 1.2: outcome ok → " in change["sentence"]


def against(track, folder, behaviour, release, *more):
    write_wheel(folder, "1.3", code=code(*behaviour))
    return track(release, "--against", folder / "trial-1.3-py3-none-any.whl", *more)


def test_a_build_that_lost_an_order_exits_with_1(track, tmp_path):
    exit_code, text, _ = against(track, tmp_path, ("integrate", 2), "1.1", "--junit", tmp_path / "junit.xml")
    assert exit_code == 1
    build = next(environment.version for environment in list_environments("trial") if environment.is_build)
    assert f"{build} against 1.1: FAILED" in text
    assert "order of the attitude 4 → 2; order of the rates 4 → 2" in text
    assert ElementTree.parse(tmp_path / "junit.xml").find("testsuite").get("failures") == "1"


@pytest.mark.slow
@pytest.mark.parametrize("fault", ["segfault", "raise", "diverge"])
def test_a_build_that_fails_exits_with_1(fault, track, tmp_path):
    exit_code, text, _ = against(track, tmp_path, (fault, 4), "1.1")
    assert exit_code == 1
    assert "outcome ok → " in text


@pytest.mark.slow
def test_a_build_that_is_as_good_or_better_exits_with_0(track, tmp_path):
    assert against(track, tmp_path, ("integrate", 4), "1.1")[0] == 0
    exit_code, text, _ = against(track, tmp_path, ("integrate", 4), "1.0")
    assert exit_code == 0
    assert "order of the attitude 2 → 4" in text


BAD = [
    (("1.0",), "versions: got 1.0, nothing to compare; expected two or more"),
    ((), "versions: got none"),
    (("1.0", "1.1", "1.0"), "versions: got '1.0' twice; expected different versions"),
    (("1.0", "1.5"), "version: got 'trial==1.5'; expected 1.2 (nearest), or one of 1.2, 1.1, 1.0"),
    (("1.0", "--against", "nowhere.whl"), "against: got 'nowhere.whl'; expected a wheel, or a folder with"),
    (("1.0", "1.1", "--junit", "/nowhere/at/all.xml"), "junit: got "),
    (("1.0", "1.1", "--last", "0"), "0 is not in the range"),
]


@pytest.mark.parametrize(("arguments", "message"), BAD)
def test_bad_arguments_are_reported_before_measuring(arguments, message, track):
    code, text, words = track(*arguments)
    assert code == 2
    assert message in words
    assert text == ""


# ------------------------------------------------------------------------------------------------------------------- MuJoCo

RISE = "order of the attitude 1 → 2; order of the rates 1 → 2; energy drift"
FALL = "order of the attitude 2 → 1; order of the rates 2 → 1; energy drift 2e-13 → -17 %"
KNOWN = {
    ("implicit", "3.6.0", "3.7.0"): f"{RISE} -17 % → 2e-13",
    ("implicitfast", "3.6.0", "3.7.0"): f"{RISE} 22 % → 2e-13",
    ("implicit", "3.8.0", "3.8.1"): FALL,
    ("implicitfast", "3.10.0", "3.11.0"): FALL,
    ("discrete", "3.11.0", "3.17.0"): "→ ok",
    ("RK4", "3.17.0", "4.0.0"): "order of the attitude 2 → 4",
}
"""Known changes of MuJoCo, from scripts that call it."""
VERSIONS = ("3.6.0", "3.7.0", "3.8.0", "3.8.1", "3.10.0", "3.11.0", "3.17.0", "4.0.0")


@pytest.mark.engine("mujoco@3.6.0")
def test_the_known_changes_between_two_versions_of_mujoco():
    settings = ("--scenes", "brick_flip", "--settings", "RK4,Euler", "--json")
    done = CliRunner().invoke(main, ["track", "mujoco", "3.6.0", "4.0.0", *settings])
    assert done.exit_code == 0
    texts = {load["setting"]: load["sentence"] for load in json.loads(done.stdout)["changes"]}
    assert "3.6.0 → 4.0.0: order of the attitude 2 → 4" in texts["RK4"]
    assert "order" not in texts.get("Euler", "")


@pytest.mark.engine("mujoco@3.7.0")
def test_exactly_the_known_changes_of_mujoco_are_found():
    done = CliRunner().invoke(main, ["track", "mujoco", *VERSIONS, "--scenes", "brick_flip", "--json"])
    assert done.exit_code == 0
    document = json.loads(done.stdout)
    texts = {(each["setting"], each["from"], each["to"]): each["sentence"] for each in document["changes"]}
    measured = {key for key, text in texts.items() if "times as long" not in text or ";" in text}
    assert measured == set(KNOWN)
    assert all(words in texts[key] for key, words in KNOWN.items())
    orders = {row["version"]: row["rates_order"]["slope"] for row in document["rows"] if row["setting"] == "RK4"}
    assert all(abs(order - 4) < 0.25 for order in orders.values())
