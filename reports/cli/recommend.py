"""`conservative recommend`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from conservative.errors import require_extra

from . import completion
from .options import FilePath, epilog, split_names

if TYPE_CHECKING:
    from conservative.benchmarks.recommendation.recommend import Recommendation

    from ..terminal.progress import Step

FILES = ("recommendation.json", "recommendation.svg")


@click.command(
    short_help="Say which method, step or tolerance a body needs.",
    epilog=epilog(
        "conservative recommend my_body.toml --error 1e-6 --duration 3600",
        "conservative recommend brick_flip --error 1e-4 --engine mujoco",
        "conservative recommend lagrange_top --json --out recommended | jq .cheapest",
    ),
)
@click.argument("scene", shell_complete=completion.scenes)
@click.option("--error", type=float, default=1e-6, show_default=True, help="Largest attitude error over the duration, rad.")
@click.option("--duration", type=float, help="s.  [default: the scene's]")
@click.option("--engine", multiple=True, metavar="A,B", shell_complete=completion.methods, help="[default: all installed]")
@click.option(
    "--cost-limit", type=float, default=1.0, show_default=True, help="Wall time per simulated second, s, that may be spent."
)
@click.option(
    "--time-limit", type=float, default=60.0, show_default=True, help="Time, s, after which an engine's run is ended."
)
@click.option("--json", "as_json", is_flag=True, help="JSON on stdout.")
@click.option("--out", type=FilePath(), help="Folder for recommendation.json and recommendation.svg.")
def recommend(scene: str, engine: tuple[str, ...], as_json: bool, out: Path | None, **limits: Any) -> None:
    """Probe our methods and every engine on SCENE, a name or a file, and say what reaches the error, at what cost and drift.

    What a probe cannot cover of the duration is extrapolated by a law that is told with it.
    """
    require_extra("conservative recommend", "report")
    from ..tables.recommendation import json_text
    from ..terminal.progress import progress

    with progress() as step:
        recommendation = _answer(scene, split_names("engine", engine), limits, out, step)
    if as_json:
        click.echo(json_text(recommendation))
    else:
        _show(recommendation)


def _answer(scene: str, engines: list[str], limits: dict[str, Any], out: Path | None, step: Step) -> Recommendation:
    """Return the recommendation; with `out` it is left there as JSON and as a picture, too.

    Raises
    ------
    BadInput
        A name, a number or the folder cannot be used; found before any work.
    MissingEngine
        An engine that is named is not installed.
    """
    from contextlib import ExitStack

    from conservative import registry
    from conservative.benchmarks.recommendation.question import ask
    from conservative.benchmarks.recommendation.recommend import recommend as answer
    from conservative.files import text_file

    question = ask(registry.scene(scene), engine_names=engines or None, **limits)
    with ExitStack() as files:
        streams = [files.enter_context(text_file(path, "out")) for path in _paths(out)]
        recommendation = answer(question, step)
        for stream, content in zip(streams, _contents(recommendation) if streams else (), strict=True):
            stream.write(content)
    return recommendation


def _contents(recommendation: Recommendation) -> tuple[str, str]:
    """Return the contents of `FILES`."""
    from ..charts.recommendation import svg
    from ..tables.recommendation import json_text

    return json_text(recommendation), svg(recommendation)


def _paths(out: Path | None) -> list[Path]:
    """Return the files of a recommendation; their folder is made if it is not there."""
    from conservative.files import make_folder

    if out is None:
        return []
    make_folder(out, "out")
    return [out / name for name in FILES]


def _show(recommendation: Recommendation) -> None:
    """Print what was asked, what reaches it, what does not, the probes, and what all that rests on."""
    from ..tables.recommendation import notes, question_text, tables
    from ..terminal.tables import print_tables, print_text

    print_text(question_text(recommendation), style="bold")
    print_tables(tables(recommendation))
    print_text("\n".join(notes(recommendation)))
