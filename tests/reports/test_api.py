"""The pages of the API reference: one command makes them, without a warning, and every public name is there."""

import re
import subprocess
import sys
from types import ModuleType

import pytest

import conservative

pytestmark = pytest.mark.slow

LOADED = re.compile(r'<(?:script|img|iframe|source)[^>]*\ssrc="([^"]*)"|<link[^>]*\shref="([^"]*)"|url\((http[^)]*)\)')


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    """Pages by their path; written by another process, as pdoc runs the code under `if TYPE_CHECKING`."""
    folder = tmp_path_factory.mktemp("api")
    command = [sys.executable, "-W", "error", "-m", "conservative.reports.documentation.api", str(folder)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    assert done.stdout.strip() == str(folder / "conservative.html")
    return {path.relative_to(folder).as_posix(): path.read_text(encoding="utf-8") for path in folder.rglob("*.html")}


def described(page):
    return set(re.findall(r'<(?:section|div) id="([^"]+)"', page))


def test_every_public_name_is_described(pages):
    modules = {name for name in conservative.__all__ if isinstance(getattr(conservative, name), ModuleType)}
    assert modules == {"scenes", "shapes"}
    assert set(conservative.__all__) - described(pages["conservative.html"]) <= modules
    assert {f"conservative/{name}.html" for name in modules} <= pages.keys()
    for builder in (getattr(conservative.scenes, name) for name in vars(conservative.scenes) if not name.startswith("_")):
        if callable(builder):
            assert builder.__name__ in described(pages[f"{builder.__module__.replace('.', '/')}.html"])


def test_pages_load_nothing_from_elsewhere(pages):
    loaded = {"".join(found) for page in pages.values() for found in LOADED.findall(page)}
    assert not [address for address in loaded if re.match(r"https?:|//", address)]
