"""The report: measure, build its view, render that; whole or not at all."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from conservative import files
from conservative.errors import BadInput

from .run import checkpoint
from .run.measure import measure
from .run.plan import Plan
from .run.provenance import provenance
from .terminal.progress import Step, announce
from .terminal.report_folder import MANIFEST, report_folder
from .view import View, build

SCHEMA = 2
"""Version of the layout of measurements.json; a change that breaks a reader raises it."""


def write(plan: Plan, out: Path, step: Step, resume: bool = False) -> View:
    """Measure and write the report into the folder `out`; return what it shows.

    Where that is interrupted, or ends in an error, the studies that are done are kept (`checkpoint`), and the exception has a
    note that says so; with `resume` they are not measured again.

    Raises
    ------
    BadInput
        The folder cannot be written, or there is nothing that can be resumed; told before any work.
    """
    source = provenance()  # before any work: files, and the commit, can change while that goes on
    progress = checkpoint.begin(plan, out, source, resume)
    source = replace(source, resumed=progress.describe_earlier(), environments=plan.locks)
    try:
        with report_folder(out) as folder:
            measurements = measure(plan, step, progress)
            view = build(plan, measurements, source)
            step(1.0, "pictures and page")
            announce("pictures and page")
            render(view, folder, plan.png)
    except BaseException as error:
        if progress.results or not isinstance(error, BadInput):
            error.add_note(progress.summary)
        raise
    progress.remove()
    return view


def render(view: View, folder: Path, png: bool) -> None:
    """Write pictures, tables, page, CSV, and last the JSON that lists them."""
    from .page import figures, markdown, page  # here, as altair takes a second to import

    charts = figures.charts(view)
    text = markdown.render(view, charts, lambda name, chart: draw(chart, folder / name, png))
    files.write_text(folder / "report.md", text, "out")
    files.write_text(folder / "index.html", page.render(view, charts), "out")
    files.write_text(folder / "measurements.csv", view.table.to_csv(index=False, lineterminator="\n"), "out")
    names = sorted({path.name for path in folder.iterdir()} | {MANIFEST})
    files.write_text(folder / MANIFEST, manifest(view, names), "out")


def manifest(view: View, names: list[str]) -> str:
    """Return measurements.json; a value that could not be measured is null."""
    rows = view.table.astype(object).where(view.table.notna(), None).to_dict("records")  # pandas' own JSON cuts off digits
    return json.dumps({"schema": SCHEMA, **asdict(view.source), "files": names, "rows": rows}, indent=1, ensure_ascii=False)


def draw(chart: Any, path: Path, png: bool) -> str:
    """Write a picture as SVG, and as PNG where asked; return the name of the SVG."""
    import vl_convert

    specification = chart.to_json()
    svg = path.with_suffix(".svg")
    files.write_text(svg, vl_convert.vegalite_to_svg(specification), "out")
    if png:
        files.write_bytes(path.with_suffix(".png"), vl_convert.vegalite_to_png(specification, scale=2), "out")
    return svg.name
