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

from ..environments import PATIENCE
from .test_animation_in_browser import WEBGL
from .test_page_in_browser import start, wait

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
    (report / "engine_a.html").write_text("<p>an engine</p>")
    command = [sys.executable, "-m", "conservative.reports.documentation.site", str(folder), "--report", str(report)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == str(folder / "index.html")
    pages = {path.relative_to(folder).as_posix(): path.read_text(encoding="utf-8") for path in folder.rglob("*.html")}
    assert reached(pages, folder) >= pages.keys() - {"search.html"}  # the target of a form
    assert len(pages) > 120  # 165
    index = json.loads((folder / "searchindex.js").read_text().removeprefix("Search.setIndex(").rstrip(")"))
    assert {"moserveselov", "quaternion", "wirbel"} - {*index["terms"], *index["titleterms"]} == {"wirbel"}
    check_names_and_options(pages)
    assert pages["conservative/methods/DERIVATION.html"].count("<math") == 22
    assert not [page for page, text in pages.items() if re.search("_SupportsArray|TypeAliasForwardRef", text)]
    assert max(columns(text) for text in pages.values()) == 6
    check_in_browser(folder, tmp_path / "profile")
    loaded = {"".join(found) for page in pages.values() for found in LOADED.findall(page)}
    assert loaded
    assert not [address for address in loaded if re.match(r"https?:|//", address)]


def columns(text):
    """Return the largest number of cells in a row of a page's tables."""
    return max((len(re.findall("<t[hd]", row)) for row in re.findall("<tr.*?</tr>", text, re.DOTALL)), default=0)


def check_in_browser(folder, profile):
    """Open pages from disk on a phone and a screen."""
    browser = start(profile, *WEBGL)
    try:
        for width in (390, 1280):
            size = {"width": width, "height": 844, "deviceScaleFactor": 1, "mobile": width == 390}
            browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
            for page in ("index", "reports/documentation/why_does_it_flip", "results"):
                browser.get((folder / f"{page}.html").as_uri())
                wait(browser, "return document.documentElement.scrollWidth <= innerWidth")
                if page != "results":
                    wait(browser, "return document.querySelector('.motion[data-drawn=\"3d\"]')")
            browser.get(f"{(folder / 'search.html').as_uri()}?q=quaternion")
            wait(browser, "return document.querySelectorAll('#search-results .context').length > 10")  # 25
        assert "quaternion" in browser.find_element("css selector", "#search-results .context").text.lower()
        assert [entry for entry in browser.get_log("browser") if entry["source"] != "rendering"] == []
    finally:
        browser.quit()


def test_a_wide_table_is_divided_and_keeps_its_first_column():
    from docutils import nodes
    from docutils.core import publish_doctree

    rule, names, ones = (" ".join(each) for each in (["=="] * 8, [f"{name} " for name in "abcdefgh"], ["1 "] * 8))
    tree = publish_doctree("\n".join([rule, names, rule, ones, ones, rule]))
    site.divide_tables(None, tree)
    rows = [[cell.astext() for cell in row.findall(nodes.entry)] for row in tree.findall(nodes.row)]
    assert rows == [[*"abcde"], [*"11111"], [*"11111"], [*"afgh"], [*"1111"], [*"1111"]]
    assert [group["cols"] for group in tree.findall(nodes.tgroup)] == [5, 4]
    assert [len(list(table.findall(nodes.colspec))) for table in tree.findall(nodes.table)] == [5, 4]


def check_names_and_options(pages):
    modules = {name for name in conservative.__all__ if isinstance(getattr(conservative, name), ModuleType)}
    assert modules == {"scenes", "shapes", "verification"}
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
    assert site.redirect_links("a/two", "a/README.md", text, pages, tmp_path) == (
        "[x](one.md) [y](one.md#deep) [z](one.md) `[y](#none)` [w](https://example.org)\n\n    [code](#two)\n"
    )


def test_each_section_of_a_readme_is_a_page_once():
    pages = site.sections("conservative/README.md")
    text = (site.ROOT / "conservative/README.md").read_text(encoding="utf-8")
    assert pages["conservative/many-bodies"].startswith("# Many bodies\n")
    assert "\n## On a cluster\n" in pages["conservative/many-bodies"]
    assert sum(len(page.splitlines()) for page in pages.values()) == len(text[text.index("\n## ") + 1 :].splitlines())
