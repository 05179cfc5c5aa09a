"""`conservative report`: measure, build the document, write it; completely or not at all."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from conservative import files
from conservative.errors import BadInput

from .document import json
from .document.model import Document, Figure
from .run import checkpoint
from .run.measure import measure
from .run.plan import Plan
from .run.provenance import provenance
from .terminal.progress import Step, announce
from .terminal.report_folder import MANIFEST, report_folder


def render_pages(document: Document, folder: Path) -> None:
    """Write the documents next to a document, and their badges."""
    from .document import html, markdown

    for name, page in document.pages.items():
        files.write_text(folder / f"{name}.md", markdown.render(page), "out")
        files.write_text(folder / f"{name}.html", html.render(page), "out")
        if page.badge:
            files.write_text(folder / f"{name}.svg", page.badge, "out")


def write(plan: Plan, out: Path, step: Step, resume: bool = False) -> Document:
    """Measure and write the report into the folder `out`, and return its document.

    If the report is interrupted or fails, finished studies are stored (see `checkpoint`), and a note of the exception contains
    their file. With `resume` they are not measured again.

    Raises
    ------
    BadInput
        The folder cannot be written, or there is nothing to resume; raised before any work.
    """
    source = provenance()  # before any work: files, and the commit, can change in the meantime
    progress = checkpoint.begin(plan, out, source, resume)
    source = replace(source, resumed=progress.describe_earlier(), environments=plan.locks)
    try:
        with report_folder(out) as folder:
            measurements = measure(plan, step, progress)
            step(1.0, "pictures and page")
            announce("pictures and page")
            from .sections.report import build  # here, as altair takes a second to import

            document = build(plan, measurements, source)
            render(document, folder, plan.png)
            files.write_text(folder / "measurements.csv", measurements.table.to_csv(index=False, lineterminator="\n"), "out")
            render_pages(document, folder)
            names = sorted({path.name for path in folder.iterdir()} | {MANIFEST})
            files.write_text(folder / MANIFEST, json.render({**dict(document.data), "files": names}, indent=1), "out")
    except BaseException as error:
        if progress.results or not isinstance(error, BadInput):
            error.add_note(progress.summary)
        raise
    progress.remove()
    return document


def render(document: Document, folder: Path, png: bool) -> None:
    """Write report.md with its pictures, and the page."""
    from .document import html, markdown

    names = dict[str, str]()

    def draw(figure: Figure) -> str:
        name = files.safe_name(figure.name)
        while names.setdefault(name.casefold(), figure.name) != figure.name:  # some disks take a name in capitals for the same
            name += "_"
        return save_picture(figure.picture, folder / name, png)

    files.write_text(folder / "report.md", markdown.render(document, draw), "out")
    files.write_text(folder / "index.html", html.render(document), "out")


def save_picture(chart: Any, path: Path, png: bool) -> str:
    """Write a picture as SVG, and as PNG if `png`; return the name of the SVG."""
    import vl_convert

    from .charts.style import specification

    picture, svg = specification(chart), path.with_suffix(".svg")
    files.write_text(svg, vl_convert.vegalite_to_svg(picture), "out")
    if png:
        files.write_bytes(path.with_suffix(".png"), vl_convert.vegalite_to_png(picture, scale=2), "out")
    return svg.name
