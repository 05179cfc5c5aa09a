"""Tests in a real browser run with `pytest --browser`, where a browser that is missing is a failure, not a skip.

Those of real engines run with `pytest --engines exudyn,mujoco==3.6.0`, which installs what is not installed.
"""

import os
import tarfile

import pytest

from .environments import ROOT, build


def pytest_addoption(parser):
    parser.addoption("--browser", action="store_true", help="Also run the tests that need chromium and its driver.")

    parser.addoption("--engines", metavar="NAME[==VERSION],...", default="", help="Also run the tests of these engines.")


def pytest_configure(config):
    config.addinivalue_line("markers", "engine(name): needs an engine in an environment; runs with --engines name")
    config.addinivalue_line("markers", "browser: needs chromium; runs with --browser")
    for name in [name for name in os.environ if name.startswith("PYTEST_XDIST")]:
        del os.environ[name]  # a pytest that a test starts is no worker, and pytest-benchmark would take it for one


def pytest_collection_modifyitems(config, items):
    engines = set(filter(None, config.getoption("--engines").split(",")))
    for item in items:
        marker = item.get_closest_marker("engine")
        if marker and not {marker.args[0], marker.args[0].partition("==")[0]} & engines:
            item.add_marker(pytest.mark.skip(reason=f"needs {marker.args[0]}: runs with --engines {marker.args[0]}"))
    if config.getoption("--browser"):
        return
    for item in items:
        if item.get_closest_marker("browser"):
            item.add_marker(pytest.mark.skip(reason="needs chromium and its driver: runs with --browser"))


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
