"""`conservative sweep`."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import Any

import click

from conservative.errors import BadInput, require_extra

from . import completion
from .options import (
    FAILED_OR_INACCURATE,
    Count,
    FilePath,
    OutputCommand,
    epilog,
    json_option,
    methods_option,
    option,
    output_files,
    picture_file,
    picture_option,
    scene_argument,
    scheduler_option,
    show,
    split_list,
    split_names,
    t_end_option,
    target_option,
)


@click.command(
    cls=OutputCommand,
    short_help="Integrate many random initial states of one scene.",
    codes={1: FAILED_OR_INACCURATE},
    epilog=epilog(
        "conservative sweep my_body.toml --starts 100000 --spread attitude=5deg,rate=2% --picture sweep.svg",
        "conservative sweep lagrange_top --spread inertia=1% --spread potential.weight=2% --json",
        "conservative sweep brick_flip --starts 1000 --spread attitude=any --error 1e-6 --out sweep.zarr",
        "conservative sweep my_body.toml --starts 1e6 --spread rate=any --out big.zarr --scheduler tcp://host:8786",
    ),
)
@scene_argument
@click.option("--starts", type=Count(), default=1000, show_default=True, metavar="N", help="Number of bodies.")
@click.option(
    "--spread",
    multiple=True,
    required=True,
    metavar="WHAT=HOW,...",
    shell_complete=completion.spreads,
    help="Standard deviations: attitude=5deg or 0.1rad; rate=5deg/s, 0.1rad/s or 10%; inertia=1%; potential.weight=2%. "
    "attitude=any and rate=any: uniformly distributed attitudes and directions.",
)
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, metavar="S", help="Seed of the random numbers.")
@methods_option("One method, with settings or without.  [default: chosen for --error; with --dt as in `conservative run`]")
@option("dt", "Step size, s.  [default: chosen for --error; with --methods the scene's]", type=float, metavar="S")
@target_option
@t_end_option
@click.option(
    "--samples",
    type=click.IntRange(2),
    default=6,
    show_default=True,
    metavar="M",
    help="Largest number of samples per body, including the initial and the final state; 96 bytes each.",
)
@option("out", "Write the samples to a new folder (Zarr).", type=FilePath())
@click.option(
    "--resume",
    is_flag=True,
    help="Continue an interrupted sweep in the folder --out, with the same options. Damaged blocks are computed again.",
)
@picture_option
@click.option("--threads", type=click.IntRange(1), metavar="N", help="Number of threads.  [default: one per processor]")
@scheduler_option
@json_option
def sweep(
    scene: str,
    starts: int,
    spread: tuple[str, ...],
    methods: tuple[str, ...],
    out: Path | None,
    picture: Path | None,
    scheduler: str | None,
    as_json: bool,
    **options: Any,
) -> None:
    """Integrate random variations of SCENE, a name or a scene file, and show the spread of attitudes, the drifts and the
    failures.

    Without --methods and --dt, both are chosen for an attitude error of 1e-6 rad. The exit code is 1 if a body fails or the
    attitude error is above 0.1 rad.

    Deviations are normally distributed. --spread gives the standard deviation of each component: of a rotation vector that
    turns the initial attitude, of the initial rate, of the second moments of mass, and of parameters of the potential. A
    percentage is relative to the scene's value, or to the length of a vector. The same seed gives the same bodies.
    """
    require_extra("conservative sweep", "report")
    from conservative.integration.cluster import open_client

    from ..run import sweep as work
    from ..sections.sweep import build
    from ..terminal.progress import progress

    if picture is not None and picture == out:
        raise BadInput("picture", repr(str(picture)), "another name than --out")
    if len(names := split_names("methods", methods)) > 1:
        raise BadInput("methods", ", ".join(names), "one method")
    varied = work.read_spread(split_list("spread", spread))
    with (
        output_files(None, (), picture=picture) as write,
        open_client(scheduler) if scheduler is not None else nullcontext() as client,
    ):
        planned = work.plan(scene, starts, varied, method=names, path=out, client=client, **options)
        if out is not None:
            click.echo(f"Writing {planned.size} to {out}: {starts:,} bodies, {planned.samples} samples each", err=True)
        with progress() as tell:
            ensemble, times = work.run_sweep(planned, tell)
            tell(1.0, "summary and picture")
            summary = work.summarize(planned, ensemble, times)
            summary |= {"out": str(out) if out else None, "picture": str(picture) if picture else None}
            document = write(build(summary), picture=lambda: picture_file(ensemble.plot(), picture))
    show(document, as_json)
