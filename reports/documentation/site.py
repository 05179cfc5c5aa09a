"""The documentation as a site: the pages of the project, a page for every public name, and the commands, with a search.

    python -m conservative.reports.documentation.site

It is built from a checkout, without a network, and opens from disk. `contents.md` arranges the pages. Each section of a long
page is a page of its own, so that no text exists twice.
"""

from __future__ import annotations

import argparse
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

ROOT = Path(__file__).resolve().parents[2]
HERE = ROOT / "reports" / "documentation"
CONTENTS = "reports/documentation/contents.md"
ROOMS = (".github", "conservative", "references", "benchmarks", "reports")
DIVIDED = ("README.md", *(f"{room}/README.md" for room in ROOMS[1:]), "conservative/extending.md", "conservative/reference.md")
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
    "html_theme": "furo",
    "html_title": f"conservative {VERSION}",
    "html_show_copyright": False,
    "html_show_sourcelink": False,
    "html_use_index": False,
    "html_domain_indices": False,
}
MODULES = (
    "conservative.attitude",
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

    Their headings move up by one level. Only the first page contributes the text above them.
    """
    text, folder = (ROOT / path).read_text(encoding="utf-8"), posixpath.dirname(path)
    starts = [match.start() for match in HEADING.finditer(text) if match[0].startswith("## ")]
    found = {"index": text[: starts[0]]} if path == "README.md" else {}
    for start, end in zip(starts, [*starts[1:], len(text)], strict=True):
        title = text[start + 3 : text.index("\n", start)]
        found[posixpath.join(folder, anchor(title))] = HEADING.sub(lambda match: match[1] or match[0], text[start:end])
    return found


def linked(name: str, path: str, text: str, pages: dict[str, dict[str, str]], source: Path) -> str:
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


def written(source: Path) -> None:
    """Write the pages of the site into a folder."""
    from conservative.reports.cli.main import main

    pages = {path: sections(path) for path in DIVIDED}
    whole = [ROOT / "CHANGELOG.md", *(page for room in ROOMS for page in (ROOT / room).rglob("*.md")), *HERE.glob("*.ipynb")]
    for path in sorted({page.relative_to(ROOT).as_posix() for page in whole} - {*DIVIDED, CONTENTS}):
        pages[path] = {posixpath.splitext(path)[0].lstrip("."): (ROOT / path).read_text(encoding="utf-8")}
    paper = pages["reports/documentation/paper.md"]  # its title is a field, above headings of the first level
    for name, text in paper.items():
        paper[name] = "# Paper\n\n" + re.sub("^#", "##", re.sub(r"\A---\n.*?^---$", "", text, flags=re.M | re.S), flags=re.M)
    del pages["README.md"]["read-on"]  # links, which the site has beside each page
    texts = {}
    for path, parts in pages.items():
        suffix = posixpath.splitext(path)[1]
        for name, text in parts.items():
            texts[name + suffix] = text if suffix == ".ipynb" else linked(name, path, text, pages, source)
    texts["index.md"] += (ROOT / CONTENTS).read_text(encoding="utf-8")
    public = [name for name in cv.__all__ if name not in ("scenes", "shapes", "VERSION")]
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
    """Write a formula as MathML, which browsers show without a script."""
    from docutils import nodes
    from docutils.utils.math.latex2mathml import tex2mathml

    translator.body.append(f"<div class='math'>{tex2mathml(node.astext(), as_block=True)}</div>")
    raise nodes.SkipNode


def setup(app: Any) -> None:
    """Extend Sphinx: our docstrings and formulas."""
    app.connect("autodoc-process-docstring", as_restructured, priority=400)  # before napoleon
    app.add_html_math_renderer("mathml", (show_block, None), (show_block, None))


def listing(title: str, folder: str, names: Iterable[str]) -> str:
    """Return a page with links to the pages of a folder."""
    entries = "\n".join(f"{folder}/{name}" for name in names)
    return f"# {title}\n\n```{{toctree}}\n:maxdepth: 1\n\n{entries}\n```\n"


def main() -> None:
    """Build the site, and print the path of its first page."""
    parser = argparse.ArgumentParser(prog="python -m conservative.reports.documentation.site", description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, default=Path("site"), help="[default: site]")
    parser.add_argument("--report", type=Path, help="folder of a report to include: conservative report --out FOLDER")
    folder, report = (given := parser.parse_args()).folder, given.report
    if report and not (report / "index.html").is_file():
        parser.error(f"--report: got {report}; expected a folder that conservative report wrote")
    require_extra("the documentation site", "docs")
    from sphinx.application import Sphinx

    with tempfile.TemporaryDirectory() as place:
        source, built = Path(place) / "source", Path(place) / "site"
        written(source)
        if report:
            with (source / "results.md").open("a", encoding="utf-8") as page:
                page.write('\n## Report of this version\n\n<a href="report/index.html">All methods, tables and charts</a>\n')
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
