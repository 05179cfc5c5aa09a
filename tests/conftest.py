"""Selection of tests by marker, handlers of signals, and programs that end with the test that started them.

`pytest` runs everything that needs neither minutes, a browser, an engine in an environment of its own, nor many processes.
Tests that do are marked. `pytest --all` runs them as well, except the random search for failures: `pytest --attack`.
"""

import gc
import os
import shutil
import signal
import tarfile
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from conservative.errors import BadInput
from conservative.registry import Name, read_name

from .environments import ROOT, build, programs

MARKERS = {
    "slow": "needs kills, builds, clusters, many processes or seconds, or is not in a sample of cases; runs with --all",
    "browser": "needs chromium and its driver; runs with --browser or --all",
    "engine(name)": "needs an engine in an environment of its own; runs with --engines name or --all",
    "attack": "searches for failures at random; runs with --attack",
    "late": "runs last, with kernels that other tests have compiled",
}
ENGINES = "exudyn,rapier3d,bsk,box3d,mujoco@3.6.0" + ",jolt,rapier_js" * bool(shutil.which("npm"))
ENGINES += ",ode,bullet" * all(Path("/usr/include", name).exists() for name in ("ode", "bullet", "nlohmann"))
"""Engines whose tests `--all` runs. They install within a minute; the others take gigabytes."""

# A shell starts background jobs with SIGINT ignored, nohup with SIGHUP ignored, and every process started from there inherits
# that. With a handler, programs that tests start have the default again. The handler for SIGHUP does nothing, as nohup wants.
signal.signal(signal.SIGINT, signal.default_int_handler)
if signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
    signal.signal(signal.SIGHUP, lambda number, frame: None)


def pytest_addoption(parser):
    parser.addoption("--all", action="store_true", help=f"Also run the tests marked slow and browser, and --engines {ENGINES}.")
    parser.addoption("--browser", action="store_true", help="Also run the tests that need chromium and its driver.")
    parser.addoption("--engines", metavar="NAME[@VERSION],...", default="", help="Also run the tests of these engines.")
    parser.addoption("--attack", action="store_true", help="Also run the tests that search for failures at random.")


# No verdict depends on how busy the machine is, not even that examples are drawn too slowly.
settings.register_profile("default", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("default")


def pytest_configure(config):
    for name, meaning in MARKERS.items():
        config.addinivalue_line("markers", f"{name}: {meaning}")
    for name in [name for name in os.environ if name.startswith("PYTEST_XDIST")]:
        del os.environ[name]  # a pytest that a test starts is no worker, and pytest-benchmark would take it for one


def pytest_collection_modifyitems(config, items):
    items.sort(key=lambda item: item.get_closest_marker("late") is not None)
    everything = config.getoption("--all")
    texts = (config.getoption("--engines") or (ENGINES if everything else "")).split(",")
    try:
        engines = {read_name(text.strip(), "engines", settings=False) for text in texts if text.strip()}
    except BadInput as error:
        raise pytest.UsageError(str(error)) from None
    wanted = {
        "slow": everything,
        "browser": everything or config.getoption("--browser"),
        "attack": config.getoption("--attack"),
    }
    for item in items:
        for mark in item.iter_markers():
            if not wanted.get(mark.name, True):
                item.add_marker(pytest.mark.skip(reason=f"{mark.name}: {MARKERS[mark.name]}"))
            if mark.name == "engine" and not {name := read_name(mark.args[0]), Name(name.base)} & engines:
                item.add_marker(pytest.mark.skip(reason=f"needs {mark.args[0]}: runs with --engines {mark.args[0]}"))


def pytest_collection_finish():
    """Freeze the objects of modules and collected tests: `time_interleaved` collects before it measures, half a second each."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(10_000, 20, 20)  # collections in a large process took 8 % of the time of all tests


@pytest.fixture
def start():
    """Start programs as `subprocess.Popen` does; they and their children are killed at the end of the test."""
    with programs() as popen:
        yield popen


@pytest.fixture(scope="session")
def sdist(tmp_path_factory):
    """The source distribution of this checkout."""
    return build(ROOT, "sdist", tmp_path_factory.mktemp("sdist"))


@pytest.fixture(scope="session")
def wheel(sdist, tmp_path_factory):
    """The wheel that pip builds from the source distribution."""
    folder = tmp_path_factory.mktemp("source")
    with tarfile.open(sdist) as archive:
        archive.extractall(folder, **({"filter": "data"} if hasattr(tarfile, "data_filter") else {}))  # not before 3.11.4
    (source,) = folder.iterdir()
    return build(source, "wheel", tmp_path_factory.mktemp("wheel"))
