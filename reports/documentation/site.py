"""The documentation as a site: the pages of the project, a page for every public name, and the commands, with a search.

    python -m conservative.reports.documentation.site

It is built from a checkout, without a network, and opens from disk. `contents.md` arranges the pages. Each section of a long
page is a page of its own, so that no text exists twice.
"""

from __future__ import annotations

import argparse
import json
import math
import posixpath
import re
import shutil
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import conservative as cv
from conservative.errors import require_extra
from conservative.version import VERSION

from .flip import figure

ROOT = Path(__file__).resolve().parents[2]
HERE = ROOT / "reports" / "documentation"
CONTENTS, LANDING = "reports/documentation/contents.md", "reports/documentation/landing.md"
LIVE = {"index": False, "reports/documentation/why_does_it_flip": True}
"""Pages whose picture becomes the live figure, and whether it has sliders."""
COLUMNS = 6
"""Largest number of columns of a table; a wider one becomes several, each with the first column."""
PACKAGES = (".github", "conservative", "references", "benchmarks", "reports")
DIVIDED = (
    "README.md",
    *(f"{room}/README.md" for room in PACKAGES[1:]),
    "conservative/extending.md",
    "conservative/reference.md",
)
"""Pages that become one page per section of the second level."""
SETTINGS = {
    "project": "conservative",
    "version": VERSION,
    "extensions": [
        "myst_nb",
        "sphinx.ext.autodoc",
        "sphinx.ext.napoleon",
        "sphinx_click",
        "conservative.reports.documentation.site",
    ],
    "html_math_renderer": "mathml",
    "myst_heading_anchors": 4,
    "myst_fence_as_directive": ["math"],
    "nb_execution_mode": "force",
    "nb_execution_raise_on_error": True,
    "nb_execution_timeout": 600,
    "suppress_warnings": ["mystnb.unknown_mime_type"],  # charts have a picture too
    "default_role": "code",
    "highlight_language": "text",
    "autodoc_typehints": "signature",
    "napoleon_attr_annotations": False,  # the signature has the types
    "autodoc_type_aliases": {"Array": "Array", "ArrayLike": "ArrayLike", "Given": "ArrayLike | tuple | Callable"},
    "html_static_path": [str(HERE / "site.css")],
    "html_css_files": ["site.css"],
    "html_theme": "furo",
    "html_title": f"conservative {VERSION}",
    "html_show_copyright": False,
    "html_show_sourcelink": False,
    "html_use_index": False,
    "html_domain_indices": False,
}
MODULES = (
    "conservative.attitude",
    "conservative.benchmarks.verification",
    "conservative.invariants",
    "conservative.methods.automatic",
    "conservative.methods.coefficients.compositions",
    "conservative.methods.non_spinning",
    "conservative.references.engine",
    "conservative.references.exact.method",
    "conservative.registry",
    "conservative.scene_files.scene_file",
)
"""Modules that users import besides `conservative`."""
CODE_OR_LINK = re.compile(r"^ *```.*?^ *```$|^    [^\n]*$|`[^`]*`|\[([^\]]*)\]\(([^)\s]+)\)", re.MULTILINE | re.DOTALL)
HEADING = re.compile(r"^(?:```.*?^```$|#(#+ [^\n]*)$)", re.MULTILINE | re.DOTALL)


def anchor(heading: str) -> str:
    """Return the name under which GitHub knows a heading."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def anchors(text: str) -> set[str]:
    """Return the anchors of a page."""
    return {anchor(line.lstrip("# ")) for line in re.findall(r"^#+ .*$", text, re.MULTILINE)}


def sections(path: str) -> dict[str, str]:
    """Return the pages of the site that a divided page becomes, by name: one for each heading of the second level.

    Their headings move up by one level. The text above them is left out: the landing page replaces it.
    """
    text, folder = (ROOT / path).read_text(encoding="utf-8"), posixpath.dirname(path)
    starts = [match.start() for match in HEADING.finditer(text) if match[0].startswith("## ")]
    pages = {}
    for start, end in zip(starts, [*starts[1:], len(text)], strict=True):
        title = text[start + 3 : text.index("\n", start)]
        pages[posixpath.join(folder, anchor(title))] = HEADING.sub(lambda match: match[1] or match[0], text[start:end])
    return pages


def redirect_links(name: str, path: str, text: str, pages: dict[str, dict[str, str]], source: Path) -> str:
    """Return a page whose links lead to pages of the site and to copies of files; links to folders become text."""

    def target(match: re.Match[str]) -> str:
        label, link = match[1], match[2]
        if link is None or "://" in link:
            return match[0]
        file, _, heading = link.partition("#")
        file = posixpath.normpath(posixpath.join(posixpath.dirname(path), file)) if file else path
        if file in pages:
            named = {page: anchors(content) for page, content in pages[file].items()}
            page = next((page for page in named if heading in named[page]), next(iter(named)))
            goal = page + posixpath.splitext(file)[1] + f"#{heading}" * (heading not in ("", posixpath.basename(page)))
        elif (ROOT / file).is_file():
            goal = file
            (source / goal).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(ROOT / file, source / goal)
        else:
            return label
        return f"[{label}]({posixpath.relpath(goal, posixpath.dirname(name) or '.')})"

    return CODE_OR_LINK.sub(target, text)


def write_pages(source: Path) -> None:
    """Write the pages of the site into a folder."""
    from conservative.reports.cli.main import main

    pages = {path: sections(path) for path in DIVIDED}
    whole = [ROOT / "CHANGELOG.md", *(page for room in PACKAGES for page in (ROOT / room).rglob("*.md")), *HERE.glob("*.ipynb")]
    for path in sorted({page.relative_to(ROOT).as_posix() for page in whole} - {*DIVIDED, CONTENTS}):
        pages[path] = {posixpath.splitext(path)[0].lstrip("."): (ROOT / path).read_text(encoding="utf-8")}
    paper = pages["reports/documentation/paper.md"]  # its title is a field, above headings of the first level
    for name, text in paper.items():
        paper[name] = "# Paper\n\n" + re.sub("^#", "##", re.sub(r"\A---\n.*?^---$", "", text, flags=re.M | re.S), flags=re.M)
    del pages["README.md"]["read-on"]  # links, which the site has beside each page
    pages[LANDING] = {"index": next(iter(pages[LANDING].values()))}
    texts = {}
    for path, parts in pages.items():
        suffix = posixpath.splitext(path)[1]
        for name, text in parts.items():
            texts[name + suffix] = text if suffix == ".ipynb" else redirect_links(name, path, text, pages, source)
    for name, sliders in LIVE.items():
        live = f"```{{raw}} html\n:file: {posixpath.basename(name)}.html\n```"
        texts[f"{name}.md"] = re.sub(r"^!\[.*?\)$", live, texts[f"{name}.md"], count=1, flags=re.MULTILINE)
        texts[f"{name}.html"] = figure(sliders)
    groups = re.findall(r"^# (.*)\n\n((?:.+\n)+)", (ROOT / CONTENTS).read_text(encoding="utf-8"), re.M)
    for title, entries in groups:
        texts[f"contents/{anchor(title)}.md"] = listing(title, "", entries.split())
    # [1:]: without the index itself
    texts["index.md"] += listing("", "", [*LIVE, *(f"contents/{anchor(title)}" for title, _ in groups)][1:], ":hidden:")
    public = [name for name in cv.__all__ if name not in ("scenes", "shapes", "verification", "VERSION")]
    texts |= {f"api/{name}.rst": api(f"conservative.{name}", name) for name in public}
    texts |= {f"api/{name}.rst": api(name, name) for name in (*MODULES, "conservative.scenes", "conservative.shapes")}
    for name, command in main.commands.items():
        function: Any = command.callback
        place = f"{function.__module__}:{function.__name__}"
        texts[f"commands/{name}.rst"] = f".. click:: {place}\n   :prog: conservative {name}\n   :nested: full\n"
    texts["api.md"] = listing("API", "api", [*public, "conservative.scenes", "conservative.shapes", *MODULES])
    texts["commands.md"] = listing("Options of each command", "commands", main.commands)
    for name, text in texts.items():
        (source / name).parent.mkdir(parents=True, exist_ok=True)
        (source / name).write_text(text, encoding="utf-8")


def api(path: str, title: str) -> str:
    """Return the page of a public name or a module, in reStructuredText."""
    members = f"   :members:\n   :exclude-members: {', '.join(cv.__all__)}\n"
    if title == path:
        directive = f".. automodule:: {path}\n{members}" + "   :imported-members:\n" * (path == "conservative.scenes")
    else:
        directive = (
            f".. autoclass:: {path}\n{members}" if isinstance(getattr(cv, title), type) else f".. autofunction:: {path}\n"
        )
    return f"{title}\n{'=' * len(title)}\n\n{directive}"


def as_restructured(app: Any, what: str, name: str, thing: Any, options: Any, lines: list[str]) -> None:
    """Turn the Markdown of a docstring into reStructuredText: indented code, and bars outside code."""
    text = re.sub(r"^(\S.*\n\n)(?=    \S)", r"\1::\n\n", "\n".join(lines), flags=re.MULTILINE)
    code = r"`[^`]*`|^::\n\n(?:(?:    .*)?\n)*"
    lines[:] = re.sub(rf"({code})|\|", lambda match: match[1] or r"\|", text, flags=re.MULTILINE).split("\n")


def show_block(translator: Any, node: Any) -> None:
    """Write a formula, also an inline one, as a block of MathML, which browsers show without a script."""
    from docutils import nodes
    from docutils.utils.math.latex2mathml import tex2mathml

    translator.body.append(f"<div class='math'>{tex2mathml(node.astext(), as_block=True)}</div>")
    raise nodes.SkipNode


def divide_tables(app: Any, doctree: Any) -> None:
    """Divide tables of more than `COLUMNS` columns."""
    from docutils import nodes

    for table in list(doctree.findall(nodes.table)):
        more = len(list(table.findall(nodes.colspec))) - 1
        if more < COLUMNS:
            continue
        width = math.ceil(more / math.ceil(more / (COLUMNS - 1)))
        parts = []
        for start in range(1, more + 1, width):
            parts.append(part := table.deepcopy())
            (group,) = part.findall(nodes.tgroup)
            group["cols"] = 1 + min(width, more + 1 - start)
            for row in [*part.findall(nodes.row), [column for column in group if isinstance(column, nodes.colspec)]]:
                for number, cell in enumerate(list(row)):
                    if number and not start <= number < start + width:
                        cell.parent.remove(cell)
        table.replace_self(parts)


def add_excerpts(app: Any, page: str, template: str, context: Any, doctree: Any) -> None:
    """Load the excerpts into the page of the search."""
    if page == "search":
        app.add_js_file("excerpts.js", priority=100)


def write_excerpts(app: Any, error: Exception | None) -> None:
    """Write the pages without navigation and attributes as a script: a page from disk may not fetch others."""
    texts = {}
    for page in sorted(app.env.found_docs) if error is None else ():
        text = (Path(app.outdir) / f"{page}.html").read_text(encoding="utf-8")
        text = "".join(re.findall(r"<article.*?</article>", text, re.DOTALL))
        text = re.sub(r"<(script|style|svg|math)\b.*?</\1>", "", text, flags=re.DOTALL)
        text = re.sub(r'<(\w+)(?=[^>]*?(\sid="[^"]*"))?[^>]*>', r"<\1\2>", text)  # identifiers stay: results lead to them
        texts[f"./{page}.html"] = f'<div role="main">{text}</div>'
    ours = "const ask = fetch;\n"
    ours += "fetch = async (url, ...more) => (url in EXCERPTS ? new Response(EXCERPTS[url]) : ask(url, ...more));\n"
    script = f"const EXCERPTS = {json.dumps(texts)};\n{ours}"
    (Path(app.outdir) / "_static" / "excerpts.js").write_text(script, encoding="utf-8")


def skip_field(app: Any, what: str, name: str, thing: Any, skip: bool, options: Any) -> bool | None:
    """Leave out the fields of named tuples, which the section Attributes of their docstring describes."""
    return True if type(thing).__name__ == "_tuplegetter" else None


def setup(app: Any) -> None:
    """Extend Sphinx: our docstrings and formulas, narrow tables, and a search with excerpts from disk."""
    from sphinx.util import inspect

    app.connect("autodoc-process-docstring", as_restructured, priority=400)  # before napoleon
    app.connect("autodoc-skip-member", skip_field)
    inspect.TypeAliasForwardRef.__repr__ = lambda self: self.name  # type: ignore[method-assign]  # else the class is shown, in unions
    app.connect("doctree-read", divide_tables)
    app.connect("html-page-context", add_excerpts)
    app.connect("build-finished", write_excerpts)
    app.add_html_math_renderer("mathml", (show_block, None), (show_block, None))


def listing(title: str, folder: str, names: Iterable[str], option: str = ":maxdepth: 1") -> str:
    """Return a page with links to the pages of a folder; without a title, the end of one."""
    entries = "\n".join(posixpath.join("/", folder, name) for name in names)
    return f"# {title}" * bool(title) + f"\n\n```{{toctree}}\n{option}\n\n{entries}\n```\n"


def main() -> None:
    """Build the site, and print the path of its first page."""
    parser = argparse.ArgumentParser(prog="python -m conservative.reports.documentation.site", description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, default=Path("site"), help="[default: site]")
    parser.add_argument("--report", type=Path, help="folder of a report to include: conservative report --out FOLDER")
    folder, report = (arguments := parser.parse_args()).folder, arguments.report
    if report and not (report / "index.html").is_file():
        parser.error(f"--report: got {report}; expected a folder that conservative report wrote")
    require_extra("the documentation site", "docs")
    from sphinx.application import Sphinx

    with tempfile.TemporaryDirectory() as place:
        source, built = Path(place) / "source", Path(place) / "site"
        write_pages(source)
        if report:
            with (source / "results.md").open("a", encoding="utf-8") as page:  # the section Results of README.md
                page.write('\n## Report of this version\n\n<a href="report/index.html">All methods, tables and charts</a>\n')
                for engine in sorted(report.glob("engine_*.html")):
                    page.write(f'\n* <a href="report/{engine.name}">{engine.stem.removeprefix("engine_")}</a>\n')
        app = Sphinx(source, None, built, Path(place) / "doctrees", "html", SETTINGS, status=None, warningiserror=True)
        app.build()
        if app.statuscode:
            raise SystemExit("The site has the warnings above and was not written. Correct them and build again.")
        shutil.copytree(built, folder, dirs_exist_ok=True)
    if report:
        shutil.copytree(report, folder / "report", dirs_exist_ok=True)
    print(folder / "index.html")


if __name__ == "__main__":
    main()
