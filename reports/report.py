"""`conservative report`: measure, write the measurements, build the document, write it.

What cannot be drawn is a sentence in its place (see `document.attempt`), and measurements are written before anything is drawn.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from conservative import files
from conservative.errors import BadInput, NotWritten

from .document import json
from .document.attempt import attempt, failed_parts, render_all
from .document.model import Block, Document, Emphasis, Figure, Motion, Paragraph, Section
from .run import checkpoint
from .run.measure import measure
from .run.plan import Plan
from .run.provenance import provenance
from .terminal.progress import Tell, announce
from .terminal.report_folder import MANIFEST, report_folder

AGAIN = "All measurements are written. Once the fault is mended, the same command with --resume makes it without measuring."


def write(plan: Plan, out: Path, tell: Tell, resume: bool = False) -> Document:
    """Measure and write the report into the folder `out`, and return its document.

    If the report is interrupted or fails, finished studies are stored (see `checkpoint`), and a note of the exception contains
    their file. With `resume` they are not measured again. They are also stored if a part could not be drawn, which is a failure
    of the document.

    Raises
    ------
    BadInput
        The folder cannot be written, or there is nothing to resume; raised before any work.
    """
    source = provenance()  # before any work: files, and the commit, can change in the meantime
    stored = checkpoint.begin(plan, out, source, resume)
    source = replace(source, resumed=stored.describe_earlier(), environments=plan.locks)
    try:
        with report_folder(out) as folder:
            measurements = measure(plan, tell, stored)
            content = measurements.content(source)
            files.write_text(folder / "measurements.csv", measurements.table.to_csv(index=False, lineterminator="\n"), "out")
            files.write_text(folder / MANIFEST, json.render(content), "out")
            tell(1.0, "pictures and page")
            announce("pictures and page")
            failure = None
            try:
                from .sections.report import build  # here, as altair takes a second to import

                document = render(build(plan, measurements, source), folder, plan.png)
            except NotWritten:
                raise
            except Exception as error:  # the folder has the measurements
                failure = error
            names = sorted(path.name for path in folder.iterdir())
            files.write_text(folder / MANIFEST, json.render({**content, "files": names}, indent=1), "out")
        if failure is not None:
            raise failure
    except BaseException as error:
        if stored.results or not isinstance(error, BadInput):
            error.add_note(stored.summary)
        raise
    pages = [block for page in document.pages.values() for block in page.blocks]
    if not (failed := list(dict.fromkeys(failed_parts([*document.blocks, *(document.brief or []), *pages])))):
        stored.remove()
    return replace(document, failures=[*document.failures, *failed])


def render(document: Document, folder: Path, png: bool) -> Document:
    """Write report.md with its pictures, the page, the pages next to it, and the table for a paper, report.tex.

    Return the document as it was written, in which the parts that could not be made are sentences.
    """
    from .document import latex

    draw = draw_into(folder, png)
    document = write_page(document, draw, folder / "index.html", folder / "report.md")
    if (table := document.for_paper) is not None:
        made = attempt("The file 'report.tex'", lambda: latex.table(table), AGAIN)
        if isinstance(made, Paragraph):
            document = replace(document, blocks=[*document.blocks, made])
        else:
            files.write_text(folder / "report.tex", made, "out")
    pages = dict[str, Document]()
    for name, page in document.pages.items():
        pages[name] = write_page(page, draw, folder / f"{name}.html", folder / f"{name}.md")
    return replace(document, pages=pages)


def write_page(document: Document, draw: Callable[[Figure], str], page: Path, markdown_path: Path) -> Document:
    """Write a document as HTML and as Markdown with its pictures, and return it as `render` does."""
    from .document import html, markdown

    document, pictures = with_pictures(document, draw, AGAIN)
    document = write_text(document, page, html.render)
    return write_text(document, markdown_path, lambda part: markdown.render(part, lambda figure: pictures[figure.name]))


def write_text(document: Document, path: Path, render: Callable[[Document], str]) -> Document:
    """Write a document as a text into a file, and return it as `render` does. No file is written if all of it fails."""
    made = attempt(f"The file {path.name!r}", lambda: render_all(document, render, AGAIN), AGAIN)
    if isinstance(made, Paragraph):
        return replace(document, blocks=[*document.blocks, made])
    files.write_text(path, made[1], "out")
    return made[0]


def with_pictures(document: Document, draw: Callable[[Figure], str], then: str = "") -> tuple[Document, dict[str, str]]:
    """Return a document with a sentence in place of pictures that cannot be drawn, and the names of the files of its pictures.

    `then` is a sentence after each of these sentences.
    """
    from .document import html

    pictures = dict[str, str]()

    def tried(block: Block) -> list[Block]:
        match block:
            case Section():
                return [replace(block, blocks=[shown for part in block.blocks for shown in tried(part)])]
            case Motion():
                made: object = attempt("The animation", lambda: html.motion(block), then)
                return [made if isinstance(made, Paragraph) else block]
            case Figure() if block.picture is not None:
                file = attempt(f"The picture {block.title!r}", lambda: draw(block), then)
                if isinstance(file, str):
                    pictures[block.name] = file
                    return [block]
                return [file, *([replace(block, picture=None)] if block.panels else [])]
            case Paragraph(role=Emphasis.FAILED) if then:
                return [replace(block, text=f"{block.text} {then}")]
        return [block]

    return replace(document, blocks=[shown for part in document.blocks for shown in tried(part)]), pictures


def draw_into(folder: Path, png: bool) -> Callable[[Figure], str]:
    """Return a function that draws a figure as SVG, and as PNG if `png`, and returns the name of the SVG.

    Files in the folder with another content than such a picture are not replaced.
    """
    from .charts.style import picture_file
    from .document import SVG_MARK

    names = dict[str, str]()

    def is_taken(name: str, figure: Figure) -> bool:
        """Return whether another figure has the name, also on a disk that takes a name in capitals for the same, or a user."""
        if names.get(name.casefold(), figure.name) != figure.name:
            return True
        svg = folder / f"{name}.svg"
        if svg.exists():
            return not svg.read_text(encoding="utf-8", errors="replace").startswith(SVG_MARK)
        return svg.with_suffix(".png").exists()

    def draw(figure: Figure) -> str:
        name = files.safe_name(figure.name)
        while is_taken(name, figure):
            name += "_"
        names[name.casefold()] = figure.name
        for kind in (".svg", *[".png"] * png):
            files.write_bytes(folder / f"{name}{kind}", picture_file(figure.picture, kind), "out")
        return f"{name}.svg"

    return draw
