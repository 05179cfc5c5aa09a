"""`conservative run`."""

from __future__ import annotations

from pathlib import Path

import click

from conservative.deferred_imports import DEFAULT_METHOD
from conservative.errors import require_extra

from . import completion
from .options import OutputCommand, OutputFile, epilog


@click.command(
    cls=OutputCommand,
    short_help="Integrate a scene once.",
    epilog=epilog(
        "conservative run brick_flip --method reduced --dt 0.01",
        "conservative run lagrange_top -m mujoco:RK4 --dt 0.001 --t-end 2 --json",
        "conservative run brick_flip:disturbance=1e-6 -m heyoka:1e-12 --csv flip.csv",
    ),
)
@click.argument("scene", shell_complete=completion.scenes)
@click.option(
    "--method",
    "-m",
    shell_complete=completion.methods,
    help=f"Method with settings.  [default: {DEFAULT_METHOD}, or the first that supports the field]",
)
@click.option("--dt", type=float, help="Step size (sampling interval of adaptive methods), s.  [default: the scene's]")
@click.option("--t-end", type=float, help="Duration, s.  [default: the scene's]")
@click.option("--json", "as_json", is_flag=True, help="Print the summary as JSON.")
@click.option("--csv", type=OutputFile("t,R_WB_11,"), help="Write the samples t, R_WB, w_WB_B, energy, momentum.")
def run(scene: str, method: str | None, dt: float | None, t_end: float | None, as_json: bool, csv: Path | None) -> None:
    """Integrate SCENE once and print its outcome, drifts and final state.

    Every step is stored, or at most a million evenly spaced samples. If the run fails, the file contains the samples
    before the failure, and the exit code is 1.
    """
    require_extra("conservative run", "report", "rich")
    from ..run.single_run import json_text, run_once, summary_text
    from ..terminal.progress import show_waiting

    with show_waiting(f"{scene}: {method}" if method else scene) as expect:
        summary = run_once(scene, method, dt, t_end, csv, expect)
    click.echo(json_text(summary) if as_json else summary_text(summary))
    if not summary["outcome"].ok:
        raise click.ClickException(f"{summary['label']} on {summary['scene']}: {summary['outcome']}")
