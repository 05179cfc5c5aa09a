"""The documentation site: one command builds it without a warning, and every page is reached and complete."""

import json
import re
import subprocess
import sys
from types import ModuleType
from urllib.parse import unquote

import pytest

import conservative
from conservative.reports.cli.main import main
from conservative.reports.documentation import site

TARGET = re.compile(r'<a [^>]*href="([^"]+)"')
LOADED = re.compile(r'<(?:script|img|iframe|source)[^>]*\ssrc="([^"]*)"|<link[^>]*\shref="([^"]*)"|url\((http[^)]*)\)')


def lost_links(page, pages, folder):
    """Return the links of a page that lead to no file or to no heading, and the pages that the others lead to."""
    lost, found = [], []
    for link in TARGET.findall(pages[page]):
        if not re.match(r"[a-z]+:", link):
            file, _, heading = unquote(link).partition("#")
            path = (folder / page).parent.joinpath(file).resolve() if file else folder / page
            name = path.relative_to(folder).as_posix() if path.is_file() else ""
            lost += [link] if not name or (heading and f'id="{heading}"' not in pages[name]) else []
            found += [name] if name in pages else []
    return lost, found


def reached(pages, folder):
    """Return the pages that links lead to from the first one."""
    seen, waiting = set(), {"index.html"}
    while waiting:
        page = waiting.pop()
        seen.add(page)
        lost, found = lost_links(page, pages, folder)
        assert not lost, page
        waiting |= set(found) - seen
    return seen


@pytest.mark.slow
def test_the_site_is_built_without_warnings_complete_and_searchable(tmp_path):
    folder = tmp_path.resolve() / "site"
    report = tmp_path / "report"
    report.mkdir()
    (report / "index.html").write_text("<p>a report</p>")
    command = [sys.executable, "-m", "conservative.reports.documentation.site", str(folder), "--report", str(report)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == str(folder / "index.html")
    pages = {path.relative_to(folder).as_posix(): path.read_text(encoding="utf-8") for path in folder.rglob("*.html")}
    assert reached(pages, folder) >= pages.keys() - {"search.html"}  # the target of a form
    assert len(pages) > 120  # 154
    index = json.loads((folder / "searchindex.js").read_text().removeprefix("Search.setIndex(").rstrip(")"))
    assert {"moserveselov", "quaternion", "wirbel"} - {*index["terms"], *index["titleterms"]} == {"wirbel"}
    check_names_and_options(pages)
    assert pages["conservative/methods/DERIVATION.html"].count("<math") == 22
    loaded = {"".join(found) for page in pages.values() for found in LOADED.findall(page)}
    assert loaded
    assert not [address for address in loaded if re.match(r"https?:|//", address)]


def check_names_and_options(pages):
    modules = {name for name in conservative.__all__ if isinstance(getattr(conservative, name), ModuleType)}
    assert modules == {"scenes", "shapes"}
    for name in set(conservative.__all__) - modules - {"VERSION"}:
        assert f'id="conservative.{name}"' in pages[f"api/{name}.html"]
    for name in (name for name in vars(conservative.scenes) if callable(getattr(conservative.scenes, name))):
        assert f'id="conservative.scenes.{name}"' in pages["api/conservative.scenes.html"]
    for name, command in main.commands.items():
        for option in (option for parameter in command.params for option in parameter.opts if option.startswith("--")):
            assert option in pages[f"commands/{name}.html"], (name, option)


def test_links_follow_the_sections_of_a_readme(tmp_path):
    pages = {"a/README.md": {"a/one": "# One\n\n## Deep\n", "a/two": "# Two\n"}}
    text = "[x](#one) [y](README.md#deep) [z](README.md) `[y](#none)` [w](https://example.org)\n\n    [code](#two)\n"
    assert site.linked("a/two", "a/README.md", text, pages, tmp_path) == (
        "[x](one.md) [y](one.md#deep) [z](one.md) `[y](#none)` [w](https://example.org)\n\n    [code](#two)\n"
    )


def test_each_section_of_a_readme_is_a_page_once():
    pages = site.sections("conservative/README.md")
    text = (site.ROOT / "conservative/README.md").read_text(encoding="utf-8")
    assert pages["conservative/many-bodies"].startswith("# Many bodies\n")
    assert "\n## On a cluster\n" in pages["conservative/many-bodies"]
    assert sum(len(page.splitlines()) for page in pages.values()) == len(text[text.index("\n## ") + 1 :].splitlines())
