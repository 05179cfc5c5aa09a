"""`conservative sweep`."""

from __future__ import annotations

from contextlib import AbstractContextManager, ExitStack, nullcontext
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import click

from conservative.errors import require_extra

from . import completion
from .options import Count, FilePath, epilog, split_list

if TYPE_CHECKING:
    from ..run.sweep import Sweep


@click.command(
    short_help="Integrate many random starts of one scene.",
    epilog=epilog(
        "conservative sweep my_body.toml --starts 100000 --spread attitude=5deg,rate=2% --out sweep.zarr",
        "conservative sweep lagrange_top --spread inertia=1% --spread potential.weight=2% --dt 0.001 --json",
        "conservative sweep brick_flip --starts 1000 --spread attitude=any --error 1e-6",
        "conservative sweep my_body.toml --starts 1e6 --spread rate=any --out big.zarr --scheduler tcp://host:8786",
    ),
)
@click.argument("scene", shell_complete=completion.scenes)
@click.option("--starts", type=Count(), default=1000, show_default=True, metavar="N", help="How many.")
@click.option(
    "--spread",
    multiple=True,
    required=True,
    metavar="WHAT=HOW,...",
    shell_complete=completion.spreads,
    help="Standard deviations: attitude=5deg or any; rate=0.1 (rad/s), 5deg/s, 10% or any; inertia=1%; potential.weight=2%.",
)
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, metavar="S", help="Of the random starts.")
@click.option("--method", "-m", shell_complete=completion.methods, help="Name, with settings.  [default: by the scene]")
@click.option("--dt", type=float, help="Step, s.  [default: the scene's]")
@click.option("--error", type=float, help="Attitude error over the run, rad, instead of a method and a step.")
@click.option("--t-end", type=float, help="Duration, s.  [default: the scene's]")
@click.option(
    "--samples", type=click.IntRange(2), default=51, show_default=True, metavar="M", help="Samples kept of each, at most."
)
@click.option("--out", type=FilePath(), help="Folder for the samples (Zarr); beside it, a picture with the ending .svg.")
@click.option("--resume", is_flag=True, help="Do what is not yet in the folder --out; all else as it was.")
@click.option("--threads", type=click.IntRange(1), metavar="N", help="[default: one a processor]")
@click.option("--scheduler", metavar="ADDRESS", help="Run on the workers of this Dask scheduler.")
@click.option("--json", "as_json", is_flag=True, help="The summary as JSON on stdout.")
def sweep(scene: str, starts: int, spread: tuple[str, ...], out: Path | None, as_json: bool, **options: Any) -> None:
    """Integrate many random starts, and bodies, about those of SCENE, and show how they spread, drifted and ended.

    Starts are normally distributed: attitudes turned by a rotation vector, rates and numbers of the potential changed, each
    component by the standard deviation given; of the inertia, the second moments of mass. The same seed gives the same starts.
    A percentage is relative to the scene's value, of a vector to its length.
    """
    require_extra("conservative sweep", "report")
    from ..run import sweep as work
    from ..tables.sweep import json_text, summary_text

    varied = work.read_spread(split_list("spread", spread))
    with ExitStack() as stack:
        picture = stack.enter_context(_open_picture(out))
        client = stack.enter_context(_connect(options.pop("scheduler")))
        planned = work.plan(scene, starts, varied, path=out, client=client, **options)
        summary = _run(planned, picture)
    summary |= {"out": str(out) if out else None, "picture": str(work.picture_path(out)) if out else None}
    click.echo(json_text(summary) if as_json else summary_text(summary))
    if summary["failures"]:
        raise click.ClickException(_failed_text(summary))


def _open_picture(out: Path | None) -> AbstractContextManager[IO[str] | None]:
    """Return the file of the picture: a place that cannot be written is an error before any work."""
    from conservative.files import text_file

    from ..run.sweep import picture_path

    return nullcontext() if out is None else text_file(picture_path(out), "out")


def _connect(address: str | None) -> AbstractContextManager[Any]:
    if address is None:
        return nullcontext()
    from conservative.integration.cluster import open_client

    return open_client(address)


def _run(planned: Sweep, picture: IO[str] | None) -> dict[str, Any]:
    """Return the summary of a sweep, and write its picture."""
    from ..charts.sweep import svg
    from ..run.sweep import run_sweep, summarize
    from ..terminal.progress import progress

    with progress() as step:
        result = run_sweep(planned, step)
        step(1.0, "summary and picture")
        if picture is not None:
            picture.write(svg(result.ensemble))
        return summarize(planned, result)


def _failed_text(summary: dict[str, Any]) -> str:
    n, first = summary["bodies"] - summary["outcomes"]["ok"], summary["failures"][0]
    failed = f"{n:,} of {summary['bodies']:,} bodies failed, the first of them number {first['body']}: {first['text']}"
    return f"{summary['label']} on {summary['scene']}: {failed}"
