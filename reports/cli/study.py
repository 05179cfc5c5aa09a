"""`conservative study`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from conservative.errors import REMOVED, require_extra

from . import completion
from .options import (
    FAILED,
    OLD_NAMES,
    Gone,
    OldName,
    Output,
    OutputCommand,
    engines_option,
    epilog,
    json_option,
    methods_option,
    names_option,
    option,
    output_files,
    quick_option,
    show,
    skip_missing_option,
    split_list,
    split_names,
)

FILES = {"study.md": "# Study: ", "study.csv": "study,scene,", "study.json": '{\n "study": '}
"""The files of `--out` beside pictures, and how each begins."""


class StudyCommand(OutputCommand):
    """The command, with the declared studies in its help."""

    def format_help_text(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        super().format_help_text(ctx, formatter)
        from conservative.benchmarks.studies.studies import STUDIES  # takes a second, which only this help needs

        with formatter.section("Names"):
            formatter.write_dl([(name, declared.about) for name, declared in STUDIES.items()])


@click.command(
    cls=StudyCommand,
    codes={1: FAILED},
    short_help="Run one study: random bodies, work-precision, ...",
    epilog=epilog(
        "conservative study random --bodies 40 --seed 7",
        "conservative study random --bodies 5 --methods projected,gauss,heyoka --csv rows.csv",
        "conservative study throughput --sizes 1,1000,1e6 --time-limit 5",
        "conservative study convergence --scenes lagrange_top --methods reduced,gauss --json",
        "conservative study paper --methods reduced --engines all --out at_one_step",
        "conservative study hard_cases --scheduler tcp://10.0.0.7:8786",
    ),
)
@click.argument("name", shell_complete=completion.studies)
@names_option("scenes", "Scenes to measure.  [default: the study's own]", complete=completion.scenes)
@methods_option("Methods.  [default: all]")
@engines_option
@click.option(
    "--bodies",
    type=click.IntRange(1),
    metavar="N",
    help="Number of random bodies per field in `random`, per kind in `throughput`.  [default: 10; in `throughput` 64]",
)
@click.option("--seed", type=click.IntRange(0), metavar="S", help="Seed of the random bodies.  [default: 0]")
@names_option("sizes", "For throughput: batch sizes.  [default: 1,10,...,1e6]", "N,M")
@quick_option
@skip_missing_option
@click.option("--time-limit", type=float, metavar="S", help="Time budget per run, s.  [default: 0.6, with --quick 0.15]")
@click.option(
    "--scheduler", metavar="ADDRESS", help="Run on the workers of this Dask scheduler; only for studies that measure no times."
)
@json_option
@click.option("--csv", type=Output(FILES["study.csv"]), help="Write the rows as CSV.")
@click.option("--markdown", type=Output(FILES["study.md"]), help="Write the tables as Markdown.")
@option("out", f"Write {', '.join(FILES)} and the pictures, as SVG and PNG, into this folder.", type=Output(FILES))
def study(
    name: str,
    scenes: tuple[str, ...],
    methods: tuple[str, ...],
    engines: tuple[str, ...],
    sizes: tuple[str, ...],
    scheduler: str | None,
    as_json: bool,
    csv: Path | None,
    markdown: Path | None,
    out: Path | None,
    **numbers: Any,
) -> None:
    """Run one study and show its rows, or for `random` the time ratios.

    A report consists of the same studies.
    """
    require_extra("conservative study", "report")
    from ..document.attempt import failed_parts
    from ..document.markdown import render
    from ..document.model import without_figures
    from ..report import draw_into, with_pictures
    from ..run.provenance import provenance
    from ..run.single_study import measure_study, plan_study
    from ..sections.study import build
    from ..terminal.progress import announce, progress

    if (old := f"study {name}") in OLD_NAMES:
        raise OldName(old, [*split_names("methods", methods), *split_list("engines", engines)])
    if old in REMOVED:
        raise Gone(old)
    with output_files(out, FILES, csv=csv, markdown=markdown) as write:
        planned = plan_study(
            name,
            split_names("scenes", scenes),
            split_names("methods", methods),
            split_list("engines", engines),
            split_list("sizes", sizes),
            **numbers,
        )
        made = provenance().facts
        announce(f"study {name.replace('_', ' ')}")
        with progress() as tell:
            measured = measure_study(planned, tell, scheduler)
        document = build(name, measured, made)
        failed = failed_parts(document.blocks)

        def page() -> str:
            drawn, pictures = with_pictures(document, draw_into(out or Path(), png=True))
            failed[:] = failed_parts(drawn.blocks)
            return render(drawn, lambda figure: pictures[figure.name])

        written = write(
            document,
            csv=lambda: measured.table.to_csv(index=False, lineterminator="\n"),
            markdown=lambda: render(replace(document, blocks=without_figures(document.blocks))),
            md=page,
        )
    show(replace(written, failures=[*written.failures, *failed]), as_json)
