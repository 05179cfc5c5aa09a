"""`conservative watch`."""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from conservative.files import require_ending

from .options import (
    FAILED,
    Output,
    OutputCommand,
    epilog,
    json_option,
    methods_option,
    option,
    output_files,
    scene_argument,
    show,
    split_names,
    t_end_option,
    target_option,
)

if TYPE_CHECKING:
    from conservative.grid import Grid
    from conservative.trajectory import Trajectory


@click.command(
    cls=OutputCommand,
    short_help="Show motions side by side, as a page or a GIF.",
    codes={1: f"{FAILED}, and no other reached its end"},
    epilog=epilog(
        "conservative watch brick_flip -m mujoco:Euler,reduced,exact",
        "conservative watch lagrange_top -m mujoco:RK4,taylor --dt 0.01 --out top.html",
        "conservative watch brick_flip -m mujoco:Euler,mujoco:RK4,reduced,exact --out brick.gif",
        "conservative watch brick_flip -m reduced,exact --out brick.png      the last frame",
    ),
)
@scene_argument
@methods_option(
    "Methods, one panel each. The reference solutions `exact` and `precise` are also drawn as outlines in the other panels.  "
    "[default: chosen for --error; with --dt the paper's, reduced]"
)
@target_option
@option(
    "dt",
    "Step size, s; with --error the sampling interval.  [default: the usual step of an engine, or the scene's]",
    type=float,
    metavar="S",
)
@t_end_option
@json_option
@click.option(
    "--out",
    type=Output("Written by conservative watch"),
    default="watch.html",
    show_default=True,
    help="File that ends in .html, .gif, or .png for the last frame. All but .html need the extra `video`.",
)
def watch(
    scene: str,
    methods: tuple[str, ...],
    error: float | None,
    dt: float | None,
    t_end: float | None,
    as_json: bool,
    out: Path,
) -> None:
    """Integrate SCENE, a name or a scene file, with each method and show the motions side by side, on one clock.

    The body is drawn as a box, or a symmetric top as a cone, with the same moments. The arrow is the angular momentum. The
    numbers are the largest drifts and attitude error so far. Motions that end early, or whose attitude error exceeds 0.1 rad,
    are reported. The exit code is 1 if no motion reaches its end. Without --methods and --dt, the motion is accurate to 1e-6
    rad.
    """
    from conservative import registry
    from conservative.method import Role

    from ..animation import KINDS, Animation, largest_values, longest
    from ..document.model import Block, Document, Items, Paragraph
    from ..run import single_run as work
    from ..terminal.progress import progress

    require_ending("out", out, KINDS)
    body, names = registry.scene(scene), split_names("methods", methods)
    target = work.read_error(error, dt, names)

    def integrate(planned: list[work.Planned], t_end: float | None) -> list[tuple[Trajectory, Grid]]:
        made = [] if target is None else [work.run_chosen(body, target, dt, t_end)]
        for competitor in planned:
            tell(0.4 * len(made) / len(planned), competitor.typed)
            made.append((work.run_on(body, competitor.method, competitor.grid), competitor.grid))
        return made

    plan = partial(work.plan_runs, body, names, dt, usual=True)
    planned, drawn, part = [] if target else plan(t_end), [], ""
    shown = [competitor for competitor in planned if not competitor.refusal]
    data = [competitor.refused(body) for competitor in planned if competitor.refusal]
    with output_files(None, (), out=out) as write, progress() as tell:
        tell(0.0, "choosing a method" if target else shown[0].typed)
        runs = integrate(shown, t_end)
        if (end := longest([run for run, _ in runs if len(run)])) < math.inf:
            part = f" Only the first {end:.3g} s are drawn, because the body turns too often."
            shown = [competitor for competitor in plan(end) if not competitor.refusal] if shown else []
            runs = integrate(shown, end)
        exact = (run for competitor, (run, _) in zip(shown, runs, strict=False) if competitor.method.role == Role.TRUTH)
        truth = next(exact, None)
        for number, (run, grid) in enumerate(runs):
            tell(0.4 + 0.2 * number / len(runs), "errors")
            compared = work.compare(run, grid, None)
            if target is None:
                competitor = shown[number]
                summary = work.summarize(run, competitor.method, grid.dt, competitor.typed)
            else:
                summary = work.summarize_chosen(run)
            data.append(summary | {"error": work.describe_errors(compared)})
            if len(run):  # an engine that crashes at its start has no samples
                errors = None if isinstance(compared, str) or run is truth else compared.at_samples(len(run))
                drawn.append((run, f"{summary['typed']}, dt = {summary['dt']:.3g} s", largest_values(run, errors)))
        if failure := runs[0][0].failure if not drawn else None:
            raise failure
        motions, labels, values = zip(*drawn, strict=True)
        outline = next((number for number, run in enumerate(motions) if run is truth), None)
        draw = partial(
            Animation(motions, labels, outline, values).render, out.suffix, lambda share: tell(0.6 + 0.4 * share, "drawing")
        )
        lost = write(Document("conservative watch", body.name, []), out=draw).failures
    notes = [f"{summary['typed']}: {status}." for summary in data if (status := work.status_of(summary)) != work.RIGHT]
    failures = [] if any(run.ok for run, _ in runs) else [f"{run.label} on {body.name}: {run.outcome}" for run, _ in runs]
    where = "" if lost else f"Wrote {out}." + " Open it in a browser." * (out.suffix == ".html")
    blocks: list[Block] = [Paragraph(f"{where}{part}".strip()), *([Items.of(notes)] if notes else [])]
    content = {"out": str(out), "runs": data}
    show(Document("conservative watch", body.name, blocks, data=content, failures=[*lost, *failures]), as_json)
