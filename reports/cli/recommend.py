"""`conservative recommend`."""

from __future__ import annotations

from pathlib import Path

import click

from conservative.errors import require_extra

from ..document import SVG_MARK
from . import completion
from .options import (
    Output,
    OutputCommand,
    epilog,
    error_option,
    json_option,
    names_option,
    option,
    output_files,
    picture_file,
    picture_option,
    scene_argument,
    show,
    split_names,
    t_end_option,
)

FILES = {"recommendation.json": '"cost_limit": ', "recommendation.svg": SVG_MARK}
"""The files of `--out`, and how each is recognized."""


@click.command(
    cls=OutputCommand,
    short_help="Find the method, and the step or tolerance, for a body.",
    epilog=epilog(
        "conservative recommend my_body.toml --error 1e-6 --t-end 3600",
        "conservative recommend brick_flip --error 1e-4 --engines mujoco",
        "conservative recommend lagrange_top --json --out recommended | jq .cheapest",
    ),
)
@scene_argument
@error_option("Target: the largest attitude error over the duration, rad.", default=1e-6, show_default=True)
@t_end_option
@names_option("engines", "Engines to probe, in addition to our method.  [default: all installed]", "E,F", completion.methods)
@click.option(
    "--cost-limit", type=float, default=1.0, show_default=True, help="Largest wall time of a setting per simulated second, s."
)
@click.option("--time-limit", type=float, default=60.0, show_default=True, help="Stop an engine's run after this time, s.")
@click.option("--verbose", "-v", is_flag=True, help="Also print the probe runs and the basis of the numbers.")
@json_option
@option("out", f"Write {' and '.join(FILES)} into this folder.", type=Output(FILES))
@picture_option
def recommend(
    scene: str,
    error: float,
    t_end: float | None,
    engines: tuple[str, ...],
    cost_limit: float,
    time_limit: float,
    verbose: bool,
    as_json: bool,
    out: Path | None,
    picture: Path | None,
) -> None:
    """Find the method and setting to use for SCENE, a name or a scene file, and list others that reach the error.

    Our method for the scene and the engines make short probe runs at several settings. Errors after the end of a probe are
    extrapolated, by a law that the result contains.
    """
    require_extra("conservative recommend", "report")
    from ..terminal.progress import progress

    def draw(path: Path | None = None) -> bytes:
        from ..charts import recommendation as charts  # not needed without --out, and slow to import

        return picture_file(charts.picture(recommendation), path)

    with progress(f"looking for methods and settings for an attitude error of {error:g} rad on {scene}") as tell:
        from conservative import registry  # imports take a second, in which the title is shown
        from conservative.benchmarks.recommendation.recommend import ask
        from conservative.benchmarks.recommendation.recommend import recommend as answer

        from ..sections.recommendation import build

        names = split_names("engines", engines) or None
        question = ask(registry.scene(scene), error, t_end, names, cost_limit, time_limit)
        with output_files(out, FILES, picture=picture) as write:
            recommendation = answer(question, tell)
            document = build(recommendation, scene, verbose)
            document = write(document, svg=draw, picture=lambda: draw(picture))
    show(document, as_json)
