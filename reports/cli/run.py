"""`conservative run`."""

from __future__ import annotations

from pathlib import Path

import click

from conservative.deferred_imports import DEFAULT_METHOD
from conservative.errors import require_extra

from . import completion
from .options import Output, OutputCommand, epilog, json_option, scene_argument, show, t_end_option


@click.command(
    cls=OutputCommand,
    short_help="Integrate a scene once.",
    epilog=epilog(
        "conservative run brick_flip --method reduced --dt 0.01",
        "conservative run brick_flip -m reduced -m mujoco:RK4        a table of both",
        "conservative run lagrange_top -m mujoco:RK4 --dt 0.001 --t-end 2 --json",
        "conservative run brick_flip:disturbance=1e-6 -m heyoka:1e-12 --csv flip.csv",
    ),
)
@scene_argument
@click.option(
    "--method",
    "-m",
    "methods",
    multiple=True,
    shell_complete=completion.methods,
    help="Method, or method:settings, such as taylor:order=12 (see `conservative list`). A name alone stands for the "
    "default variant; `report --methods` runs all variants. Repeat the option for a table.  "
    f"[default: {DEFAULT_METHOD}, or the first method that supports the scene's potential]",
)
@click.option("--dt", type=float, help="Step size (sampling interval of adaptive methods), s.  [default: the scene's]")
@t_end_option
@json_option
@click.option(
    "--truth/--no-truth",
    default=None,
    help="Errors against the reference solution, at 200 samples.  [default: unless it takes long]",
)
@click.option(
    "--csv", type=Output("t (s),R_WB_11,"), help="Write t, R_WB, q_WB (wxyz), w_WB_B, energy, momentum of each sample."
)
@click.option("--parquet", type=Output("PAR1"), help="Write the same as a Parquet file.")
def run(
    scene: str,
    methods: tuple[str, ...],
    dt: float | None,
    t_end: float | None,
    truth: bool | None,
    as_json: bool,
    csv: Path | None,
    parquet: Path | None,
) -> None:
    """Integrate SCENE once and print its errors, drifts and final state; with several methods, a table.

    Every step is stored. Longer runs store a million evenly spaced samples. If the run fails, the files contain the samples
    before the failure, and the exit code is 1.
    """
    if parquet is not None:
        require_extra("conservative run --parquet", "parquet", "pyarrow")
    from ..run.single_run import run_methods
    from ..sections.run import build
    from ..terminal.progress import progress, show_waiting

    if len(methods) > 1 and (csv is not None or parquet is not None):
        raise click.UsageError("--csv and --parquet hold the samples of one method; give --method once.")
    with progress() if len(methods) > 1 else show_waiting(": ".join([scene, *methods])) as step:
        summaries = run_methods(scene, methods, dt, t_end, truth, step, csv, parquet)
    show(build(summaries), as_json)
