"""`conservative study`."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Any

import click

from conservative.errors import require_extra

from . import completion
from .options import OutputCommand, OutputFile, OutputFolder, epilog, show, split_list, split_names

FILES = {"study.md": "# Study: ", "study.csv": "study,scene,", "study.json": '{\n "study": '}
"""The files of `--out`, and how each begins."""


@click.command(
    cls=OutputCommand,
    short_help="Run one study: random bodies, work-precision, ...",
    epilog=epilog(
        "conservative study random --bodies 40 --seed 7",
        "conservative study random --bodies 5 --methods projected,gauss,heyoka --csv rows.csv",
        "conservative study throughput --sizes 1,1000,1e6 --time-limit 5",
        "conservative study convergence --scenes lagrange_top --methods reduced,gauss --json",
        "conservative study engines_at_one_step --engines all --out one_step",
        "conservative study hard_cases --scheduler tcp://10.0.0.7:8786",
    ),
)
@click.argument("name", shell_complete=completion.studies)
@click.option(
    "--scenes",
    multiple=True,
    metavar="A,B",
    shell_complete=completion.scenes,
    help="Scenes to measure.  [default: the study's own]",
)
@click.option("--methods", multiple=True, metavar="M,N", shell_complete=completion.methods, help="Methods.  [default: all]")
@click.option(
    "--engines",
    multiple=True,
    metavar="E,F",
    shell_complete=completion.engine_lists,
    help="Add engines: NAME, NAME==VERSION, or `all`, the installed ones (see `conservative engines`).",
)
@click.option(
    "--bodies",
    type=click.IntRange(1),
    metavar="N",
    help="Number of random bodies per field in `random`, per kind in `throughput`.  [default: 10; in `throughput` 64]",
)
@click.option("--seed", type=click.IntRange(0), metavar="S", help="Seed of the random bodies.  [default: 0]")
@click.option("--sizes", multiple=True, metavar="N,M", help="For throughput: batch sizes.  [default: 1,10,...,1e6]")
@click.option("--quick", is_flag=True, help="Fewer steps and rounds of timing.")
@click.option("--skip-missing", is_flag=True, help="Mark engines that are not installed instead of failing.")
@click.option("--time-limit", type=float, metavar="S", help="Time budget per run, s.  [default: 0.6, with --quick 0.15]")
@click.option(
    "--scheduler", metavar="ADDRESS", help="Run on the workers of this Dask scheduler; only for studies that measure no times."
)
@click.option("--json", "as_json", is_flag=True, help="Print rows and samples as JSON.")
@click.option("--csv", type=OutputFile(FILES["study.csv"]), help="Write the rows as CSV.")
@click.option("--markdown", type=OutputFile(FILES["study.md"]), help="Write the tables as Markdown.")
@click.option("--out", type=OutputFolder(FILES), help=f"Write {', '.join(FILES)} into this folder.")
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

    NAME is paper, convergence, speed, work_precision, each_step, long_runs, sphere_curves, paper_figures, engines_at_one_step,
    engines_over_steps, stability, hard_cases, random or throughput. A report consists of the same studies. benchmarks/README.md
    describes them.
    """
    require_extra("conservative study", "report")
    from conservative.files import make_folder, text_file

    from .. import document
    from ..run.provenance import provenance
    from ..run.single_study import measure_study, plan_study
    from ..sections.study import build
    from ..terminal.progress import announce, progress

    wanted = [("csv", csv, "study.csv"), ("markdown", markdown, "study.md")]
    with ExitStack() as files:
        # A place that cannot be written is an error before any work.
        if out is not None:
            make_folder(out, "out")
            wanted += [("out", out / content, content) for content in FILES]
        streams = [(files.enter_context(text_file(path, key)), content) for key, path, content in wanted if path is not None]
        planned = plan_study(
            name,
            split_names("scenes", scenes),
            split_names("methods", methods),
            split_list("engines", engines),
            split_list("sizes", sizes),
            **numbers,
        )
        source = provenance()
        made = {"command": source.command, "date": source.date, "commit": source.commit, **source.machine, **source.compared}
        announce(f"study {name.replace('_', ' ')}")
        with progress() as step:
            measured = measure_study(planned, lambda done, total, what: step(done / total, what), scheduler)
        shown = build(name, measured, made)
        for stream, content in streams:
            if content == "study.csv":
                stream.write(measured.table.to_csv(index=False, lineterminator="\n"))
            else:
                stream.write(document.text(shown, "markdown" if content == "study.md" else "json"))
    show(shown, as_json)
