"""The report: measure, draw, write; whole or not at all."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import pandas as pd

from conservative.benchmarks.studies import long_runs
from conservative.outcome import OutcomeKind
from conservative.scene import Scene

from .charts import figures, paper
from .page import page
from .run import checkpoint
from .run.measure import Measured as Measured
from .run.measure import measure
from .run.plan import Plan as Plan
from .run.plan import plan as plan
from .run.provenance import Provenance, provenance
from .tables import headline, orders, overview, tables, work_precision
from .terminal import atomic_files
from .terminal.progress import Step

SCHEMA = 2
"""Version of the layout of measurements.json; a change that breaks a reader raises it."""


def write(made: Plan, out: Path, step: Step, resume: bool = False) -> Measured:
    """Measure and write the report into the folder `out`; return what was measured.

    Where that is interrupted, or ends in an error, the finished studies are kept (`partial`), and the exception has a note that
    says so; with `resume` they are not measured again.

    Raises
    ------
    BadInput
        The folder cannot be written, or there is nothing that can be resumed; found before any work.
    """
    kept = checkpoint.begun(made, out, provenance(), resume)
    showing = made.spans(name for name in made.pieces if name not in kept.pieces)
    with atomic_files.report_folder(out) as folder:
        try:
            measured = measure(made, step, kept)
            source = replace(provenance(), resumed=kept.earlier)
            write_files(made, measured, folder, source, lambda what: step(showing[what][0], what))
        except BaseException as error:
            error.add_note(kept.story)
            raise
    kept.remove()
    return measured


def write_files(made: Plan, measured: Measured, folder: Path, source: Provenance, begin: Callable[[str], None]) -> None:
    """Write pictures, tables, page, CSV, and last the JSON that lists them; `begin` is told which of `SHOWING` comes next."""
    begin("pictures")
    text = render(made, measured, source, lambda name, chart: draw(chart, folder / name, made.png))
    (folder / "report.md").write_text(text, encoding="utf-8")
    begin("page")
    (folder / "index.html").write_text(page.render(made, measured, source), encoding="utf-8")
    measured.table.to_csv(folder / "measurements.csv", index=False)
    files = sorted({path.name for path in folder.iterdir()} | {atomic_files.MANIFEST})
    (folder / atomic_files.MANIFEST).write_text(as_json(measured.table, source, files), encoding="utf-8")


def as_json(table: pd.DataFrame, source: Provenance, files: list[str]) -> str:
    """Return measurements.json; a value that could not be measured is null."""
    rows = json.loads(table.to_json(orient="records", double_precision=15))
    return json.dumps({"schema": SCHEMA, **asdict(source), "files": files, "rows": rows}, indent=1, ensure_ascii=False)


def draw(chart: Any, path: Path, png: bool) -> str:
    """Write a picture as SVG, and as PNG where asked; return the name of the SVG."""
    import vl_convert

    specification = chart.to_json()
    svg = path.with_suffix(".svg")
    svg.write_text(vl_convert.vegalite_to_svg(specification), encoding="utf-8")
    if png:
        path.with_suffix(".png").write_bytes(vl_convert.vegalite_to_png(specification, scale=2))
    return svg.name


Draw = Callable[[str, Any], str]


def render(made: Plan, measured: Measured, source: Provenance, draw: Draw) -> str:
    """Return report.md; `draw(name, chart)` makes a picture and returns the name of its file."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    found = work_precision.contests(work_precision.points(measured.table))
    environment = Environment(
        loader=PackageLoader("conservative.reports"), undefined=StrictUndefined, keep_trailing_newline=True, autoescape=False
    )
    others = [f"{name} {version}" for name, version in source.packages.items() if name not in source.compared]
    return environment.get_template("report.md.j2").render(
        scenes=[scene.name for scene in made.scenes],
        quick=made.quick,
        verdict=headline.lines(found),
        by_scene={scene.name: _scene_parts(scene, measured, found, draw) for scene in made.scenes},
        durations=f"{long_runs.DURATIONS:g}",
        paper=list(_paper_parts(made, measured, draw)),
        hard_cases=_matrix(overview.hard_cases(measured.table)),
        stability=_matrix(overview.stability(measured.table)),
        truths=tables.markdown(tables.truths(measured.table)),
        failures=tables.markdown(tables.failures(measured.table)),
        unsupported=tables.markdown(tables.unsupported(measured.table)),
        made=source,
        others=", ".join(others),
    )


def _matrix(cells: overview.Cells | None) -> str:
    if cells is None:
        return "Not part of this run: a full report, without `--quick` and `--scenes`, has it."
    header, body = cells
    return tables.markdown((list(header), [[str(cell) for cell in row] for row in body]))


def _scene_parts(scene: Scene, measured: Measured, contests: list[work_precision.Contest], draw: Draw) -> dict[str, str]:
    table, name = measured.table, scene.name
    errors = orders.errors(table)
    return {
        "source": scene.source,
        "t_end": f"{scene.t_end:g}",
        "dt": f"{scene.dt:g}",
        "contests": tables.markdown(tables.contests([c for c in contests if c.scene == name])),
        "drift": tables.markdown(tables.drift(table, name)),
        "accuracy": tables.markdown(tables.accuracy(table, name)),
        "order": tables.markdown(tables.order(table, name)),
        "time": tables.markdown(tables.time(table, name)),
        "work_precision": draw(f"work_precision_{name}", figures.work_precision(work_precision.points(table), name)),
        "drift_picture": draw(f"drift_{name}", figures.drift(tables.drift_samples(measured.samples), name)),
        "convergence": draw(f"convergence_{name}", figures.convergence(errors, orders.fits(errors), name)),
    }


def _paper_parts(made: Plan, measured: Measured, draw: Draw) -> Iterator[str]:
    """Yield the paper's figures that belong to the scenes of the report."""
    scenes, samples = {scene.name for scene in made.scenes}, measured.samples
    if "brick_flip" in scenes:
        picture = draw("paper_figure_1", paper.figure_1(paper.body_rates(samples), paper.conservation(samples)))
        yield f"![Figure 1 of the paper: rates of the brick, errors of energy and momentum]({picture})"
    if "lagrange_top" in scenes:
        picture = draw("paper_figure_2", paper.figure_2(paper.centre_of_mass(samples)))
        yield f"![Figure 2 of the paper: centre of mass of the top]({picture})"
        yield "Error of the centre of mass of the top after one period of precession (the whole number of steps next to it):"
        yield tables.markdown(tables.positions(measured.table))


def failed(measured: Measured) -> list[str]:
    """Return what of ours failed at the steps of the paper: one line each."""
    rows = measured.table
    fine = [OutcomeKind.OK, OutcomeKind.UNSUPPORTED, OutcomeKind.MISSING, OutcomeKind.SKIPPED]
    bad = rows[(rows["study"] == "paper") & (rows["role"] == "ours") & ~rows["outcome"].isin(fine)]
    found = zip(bad["method"], bad["scene"], bad["dt"], tables.endings(bad), strict=True)
    return list(dict.fromkeys(f"{method} on {scene}, dt = {dt:g} s: {status}" for method, scene, dt, status in found))
