"""`conservative watch`."""

from __future__ import annotations

from pathlib import Path

import click

from conservative.deferred_imports import DEFAULT_METHOD
from conservative.errors import BadInput

from . import completion
from .options import Output, OutputCommand, epilog, json_option, scene_argument, show, split_names, t_end_option


@click.command(
    cls=OutputCommand,
    short_help="Show motions side by side, as a page or a video.",
    epilog=epilog(
        "conservative watch brick_flip -m mujoco:Euler,reduced,exact",
        "conservative watch lagrange_top -m mujoco:RK4,taylor --dt 0.01 --out top.html",
        "conservative watch brick_flip -m mujoco:Euler,pybullet,reduced,exact --out brick.gif",
    ),
)
@scene_argument
@click.option(
    "--method",
    "-m",
    "methods",
    multiple=True,
    metavar="M,N",
    shell_complete=completion.methods,
    help="Methods, one panel each; the reference solutions `exact` and `precise` are also the outline in the other panels.  "
    f"[default: {DEFAULT_METHOD}, or the first method that supports the scene]",
)
@click.option("--dt", type=float, help="Step size, s.  [default: the step that an engine's users take, or the scene's]")
@t_end_option
@json_option
@click.option(
    "--out",
    type=Output("Written by conservative watch"),
    default="watch.html",
    show_default=True,
    help="File that ends in .html, .gif or .mp4. The last two need the extra `video`.",
)
def watch(scene: str, methods: tuple[str, ...], dt: float | None, t_end: float | None, as_json: bool, out: Path) -> None:
    """Integrate SCENE with each method and show the motions side by side, on one clock.

    The body is its inertia box, the arrow its angular momentum. The numbers are the largest drifts and attitude error so far.
    """
    from conservative import registry
    from conservative.files import text_file
    from conservative.integration.one import read_method
    from conservative.method import Role
    from conservative.trajectory import Trajectory

    from ..animation import KINDS, Animation
    from ..document.model import Document, Paragraph
    from ..run.single_run import bounded_grid, run_on, summarize
    from ..terminal.progress import progress

    if out.suffix not in KINDS:
        raise BadInput("out", repr(str(out)), f"a file that ends in {', '.join(KINDS)}")
    body = registry.scene(scene)
    names = split_names("method", methods) or [read_method(None, body).name]
    chosen = [registry.method(name) for name in names]
    longest = body.t_end if t_end is None else t_end
    steps = [min(method.card.usual_dt or body.dt, longest) if dt is None else dt for method in chosen]
    grids = [bounded_grid(body, method, step, t_end) for method, step in zip(chosen, steps, strict=True)]
    truth = next((number for number, method in enumerate(chosen) if method.role == Role.TRUTH), None)
    runs: list[Trajectory] = []
    with text_file(out, "out") as stream, progress() as tell:
        for method, grid in zip(chosen, grids, strict=True):
            tell(0.5 * len(runs) / len(chosen), method.name)
            runs.append(run_on(body, method, grid))
        labels = [f"{name}, dt = {grid.dt:.3g} s" for name, grid in zip(names, grids, strict=True)]
        drawn = Animation(runs, labels, truth).render(out.suffix, lambda share: tell(0.5 + share / 2, "drawing"))
        stream.buffer.write(drawn)
    data = [summarize(run, method, grid.dt) for run, method, grid in zip(runs, chosen, grids, strict=True)]
    failures = [f"{run.label} on {body.name}: {run.outcome}" for run in runs if not run.ok]
    text = Paragraph(f"Wrote {out}." + " Open it in a browser." * (out.suffix == ".html"))
    show(Document("conservative watch", body.name, [text], data={"out": str(out), "runs": data}, failures=failures), as_json)
