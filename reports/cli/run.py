"""`conservative run`."""

from __future__ import annotations

from pathlib import Path

import click

from conservative.errors import require_extra

from .options import (
    FAILED_OR_INACCURATE,
    Output,
    OutputCommand,
    epilog,
    json_option,
    methods_option,
    option,
    output_files,
    picture_file,
    picture_option,
    scene_argument,
    show,
    split_names,
    t_end_option,
    target_option,
)

SAMPLES = "t (s),R_WB_11,"
"""Beginning of a file of samples."""
FILES = {"run.csv": SAMPLES, "run.json": '"drift": {'}
"""The files of `--out`, and how each is recognized."""


@click.command(
    cls=OutputCommand,
    short_help="Integrate a scene once.",
    codes={1: FAILED_OR_INACCURATE},
    epilog=epilog(
        "conservative run my_body.toml --error 1e-9 --csv run.csv",
        "conservative run brick_flip -m reduced,mujoco:RK4           a table of both",
        "conservative run lagrange_top -m mujoco:RK4 --dt 0.001 --t-end 2 --json",
        "conservative run brick_flip:disturbance=1e-6 -m heyoka:1e-12 --out flip",
    ),
)
@scene_argument
@methods_option(
    "Methods with settings, such as taylor:order=12 (see `conservative list`). Several make a table. A name alone stands for "
    "the default variant; `report --methods` runs all variants.  [default: chosen for --error; with --dt the paper's, reduced]"
)
@target_option
@option(
    "dt",
    "Step size, s. For adaptive methods and with --error: sampling interval.  [default: the scene's]",
    type=float,
    metavar="S",
)
@t_end_option
@json_option
@click.option(
    "--truth/--no-truth",
    default=None,
    help="Compute errors against the reference solution, at up to 20,000 samples.  [default: unless it takes long]",
)
@click.option("--csv", type=Output(SAMPLES), help="Write t, R_WB, q_WB (wxyz), w_WB_B, energy, momentum of each sample.")
@option("out", f"Write {', '.join(FILES)} into this folder.", type=Output(FILES))
@picture_option
def run(
    scene: str,
    methods: tuple[str, ...],
    error: float | None,
    dt: float | None,
    t_end: float | None,
    truth: bool | None,
    as_json: bool,
    out: Path | None,
    **files: Path | None,
) -> None:
    """Integrate SCENE, a name or a scene file, and print errors, drifts and the final state; with several methods, a table.

    Without --methods and --dt, the method and the step are chosen for an attitude error of 1e-6 rad. With --methods or --dt,
    every step is stored, or a million evenly spaced steps of longer runs. If the run fails, the files contain the samples
    before the failure. The exit code is 1 if a run fails or its attitude error is above 0.1 rad.
    """
    if files["picture"] is not None:
        require_extra("conservative run --picture", "report")
    from ..run import single_run as work
    from ..sections.run import build
    from ..terminal.progress import progress, show_waiting

    names = split_names("methods", methods)
    if len(names) > 1 and (out is not None or any(files.values())):
        raise click.UsageError("Files hold the samples of one method; name one.")
    waiting = progress() if len(names) > 1 else show_waiting(": ".join([scene, *names]))
    with output_files(out, FILES, **files) as write, waiting as tell:
        summaries, trajectory = work.run_methods(scene, names, dt, t_end, truth, tell, error)
        document = build(summaries)
        document = write(
            document,
            csv=lambda: work.csv_text(trajectory),
            picture=lambda: picture_file(trajectory.plot(), files["picture"]),
        )
    show(document, as_json)
