"""The command line `conservative`. What needs more than click is imported when a command runs, so that --help is instant."""

from __future__ import annotations

import signal
import sys
from pathlib import Path
from typing import Any

import click

from conservative.extras import require_extra

from ..terminal.interrupts import Terminated, interruptible, notes
from . import completion

EXIT_CODES = """Exit codes:
    0    done
    1    a run failed: it did not converge, or diverged; or the gate is not passed
    2    the command or an input cannot be used, or an engine or a baseline is missing
    130  interrupted by Ctrl-C, 143 by SIGTERM; a report keeps what is finished, and --resume goes on
"""


_TIMES = "required: fail where the baseline has no times of this machine; known: then compare all but times, and say so."


def _epilog(*examples: str) -> str:
    """Return what every --help ends with; a backspace on a line of its own keeps click from joining the lines after it."""
    return "\n".join(["\b", "Examples:", *(f"  {example}" for example in examples), "", "\b", EXIT_CODES])


class _UserError(click.ClickException):
    exit_code = 2


class _Interrupted(click.ClickException):
    exit_code = 130

    def show(self, file: Any = None) -> None:
        """Say it on a line of its own, below the ^C that a terminal shows."""
        click.echo("\n" * sys.stderr.isatty() + self.message, err=True)


class _Terminated(_Interrupted):
    exit_code = 143


class Commands(click.Group):
    """Commands whose user errors end as one line on stderr and an exit code, never as a traceback."""

    def invoke(self, ctx: click.Context) -> Any:
        try:
            with interruptible(signal.SIGINT):
                return super().invoke(ctx)
        except KeyboardInterrupt as stop:
            kind = _Terminated if isinstance(stop, Terminated) else _Interrupted
            raise kind("; ".join(["Interrupted", *notes(stop)])) from None
        except (ValueError, ImportError, ArithmeticError) as error:
            raise _as_click(error) from None

    def main(self, *args: Any, **kwargs: Any) -> Any:
        kwargs.setdefault("prog_name", "conservative")
        return super().main(*args, **kwargs)


def _as_click(error: Exception) -> Exception:
    """Return the click exception for what a user can act on; anything else is a bug and keeps its traceback."""
    from conservative.errors import BadInput, IntegrationFailed, MissingEngine, MissingExtra

    text = "; ".join([str(error), *notes(error)])
    if isinstance(error, BadInput | MissingEngine | MissingExtra):
        return _UserError(text)
    return click.ClickException(text) if isinstance(error, IntegrationFailed) else error


@click.group(
    cls=Commands,
    epilog=_epilog(
        "conservative report                      everything, into report/",
        "conservative run brick_flip --dt 0.01    one run",
        "conservative list                        scenes and methods",
    ),
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
)
@click.version_option(package_name="conservative-rotation", message="%(prog)s %(version)s")
def main() -> None:
    """Integrate the rotation of rigid bodies so that energy and momentum stay, and measure that beside other engines.

    Completion of names and files: eval "$(_CONSERVATIVE_COMPLETE=bash_source conservative)", or zsh_source, or fish_source.
    """


def _listed(argument: str, texts: tuple[str, ...]) -> list[str]:
    """Return names out of `a,b:setting=1,other=2,c`: what has an equals sign and no colon belongs to the name before it.

    An option that is given but names nothing, as `--scenes "$EMPTY"` does, would mean everything: it is a mistake.
    """
    found: list[str] = []
    for item in (item.strip() for text in texts for item in text.split(",")):
        if found and "=" in item and ":" not in item:
            found[-1] += f",{item}"
        elif item:
            found.append(item)
    if texts and not found:
        raise click.BadParameter("it names nothing", param_hint=f"--{argument}")
    return found


@main.command(
    short_help="Measure everything and write a report.",
    epilog=_epilog(
        "conservative report",
        "conservative report --quick --out quick_report",
        "conservative report --scenes lagrange_top,my_body.toml --methods reduced,mujoco:RK4,heyoka",
        "conservative report --resume                 go on after Ctrl-C, with the same options",
    ),
)
@click.option("--scenes", multiple=True, metavar="A,B", shell_complete=completion.scenes, help="[default: the paper's two]")
@click.option("--methods", multiple=True, metavar="M,N", shell_complete=completion.methods, help="[default: all registered]")
@click.option("--quick", is_flag=True, help="Coarser: fewer steps, fewer rounds of timing.")
@click.option("--skip-missing", is_flag=True, help="Rows that say so instead of an error where an engine is not installed.")
@click.option("--png", is_flag=True, help="Pictures as PNG, too.")
@click.option("--json", "as_json", is_flag=True, help="The measurements on stdout, as measurements.json has them.")
@click.option("--resume", is_flag=True, help="Take the studies that an interrupted report has finished, and do the rest.")
@click.option(
    "--out", type=click.Path(path_type=Path), default="report", show_default=True, help="Folder, replaced as a whole."
)
def report(
    scenes: tuple[str, ...],
    methods: tuple[str, ...],
    quick: bool,
    skip_missing: bool,
    png: bool,
    as_json: bool,
    resume: bool,
    out: Path,
) -> None:
    """Run our methods beside every engine and leave tables, pictures and measurements in a folder.

    The folder is there whole or not at all; until then, what is finished is in a file beside it, OUT.partial.json.
    A family's bare name, such as mujoco, stands for all its variants.
    """
    require_extra("conservative report", "report")
    from .. import document
    from ..run import checkpoint
    from ..terminal import atomic_files
    from ..terminal.progress import progress

    plan = document.plan(_listed("scenes", scenes), _listed("methods", methods), quick, skip_missing, png)
    if not resume and checkpoint.path_for(out).exists():
        click.echo(
            f"{checkpoint.path_for(out)}: unfinished work that --resume goes on with; without it, to be replaced", err=True
        )
    with interruptible(signal.SIGTERM), progress() as step:
        measured = document.write(plan, out, step, resume)
    click.echo((out / atomic_files.MANIFEST).read_text(encoding="utf-8") if as_json else out / "report.md")
    bad = document.failed(measured)
    if bad:
        raise click.ClickException("; ".join(bad))


@main.command(
    short_help="Compare benchmarks with a baseline.",
    epilog=_epilog(
        "pytest --benchmark --gate                     run and compare; leaves the results where this command finds them",
        "conservative gate                             compare them again",
        'conservative gate --update "Fewer corrections"   accept them, with the reason',
        "conservative gate --json | jq '.verdicts[].violations'",
    ),
)
@click.argument("results", nargs=-1, type=click.Path(path_type=Path))
@click.option("--baseline", type=click.Path(path_type=Path), help="The baseline.  [default: benchmarks/baseline.json]")
@click.option("--times", type=click.Choice(["required", "known"]), default="required", show_default=True, help=_TIMES)
@click.option(
    "--update", metavar="REASON", help="Accept RESULTS, all runs of one commit, and write the reason into the history."
)
@click.option("--json", "as_json", is_flag=True, help="Violations and notes, or the new entry of the history, as JSON.")
def gate(results: tuple[Path, ...], baseline: Path | None, times: str, update: str | None, as_json: bool) -> None:
    """Compare RESULTS of `pytest --benchmark` with the baseline; by default those of the last run with --gate.

    Exits with 1 and a line for each violation, or with 2 where there is no baseline to compare with.
    """
    from . import gate

    found = gate.gate(results, baseline, times) if update is None else gate.update(results, baseline, update)
    click.echo(found.as_json() if as_json else found)
    if not found.passed:
        raise click.exceptions.Exit(1)


@main.command(
    short_help="Say which method, step or tolerance a body needs.",
    epilog=_epilog(
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
@click.option("--json", "as_json", is_flag=True, help="JSON on stdout.")
@click.option("--out", type=click.Path(path_type=Path), help="Folder for recommendation.json and recommendation.svg.")
def recommend(
    scene: str,
    error: float,
    duration: float | None,
    engine: tuple[str, ...],
    cost_limit: float,
    as_json: bool,
    out: Path | None,
) -> None:
    """Probe our methods and every engine on SCENE, a name or a file, and say what reaches the error, at what cost and drift.

    What a probe cannot cover of the duration is extrapolated by a law that is told with it.
    """
    require_extra("conservative recommend", "report")
    from ..terminal.progress import progress
    from . import recommend as recommending

    with interruptible(signal.SIGTERM), progress() as step:
        found = recommending.run(scene, error, duration, _listed("engine", engine), cost_limit, out, step)
    if as_json:
        click.echo(recommending.as_json(found))
    else:
        recommending.show(found)


@main.command(
    "list",
    short_help="Show scenes and methods.",
    epilog=_epilog(
        "conservative list",
        "conservative list --json | jq '.methods[] | select(.available) | .name'",
    ),
)
@click.option("--json", "as_json", is_flag=True, help="JSON on stdout.")
def list_command(as_json: bool) -> None:
    """Show the scenes, grouped, and the methods, with what they conserve and whether their engine is installed."""
    require_extra("conservative list", "report", "rich")
    from .list import as_json as listed_json
    from .list import show

    if as_json:
        click.echo(listed_json())
    else:
        show()


@main.command(
    short_help="Write a scene file to start from.",
    epilog=_epilog(
        "conservative new > my_body.toml",
        "conservative run my_body.toml",
        "conservative new --json | jq '.choices.shape'",
    ),
)
@click.option("--json", "as_json", is_flag=True, help="Keys with their meanings, what else there is, and the text, as JSON.")
def new(as_json: bool) -> None:
    """Print a scene file with every key explained; every command takes such a file where it takes the name of a scene."""
    from conservative.scene_files.scene_file import template

    from . import new

    click.echo(new.as_json() if as_json else template(), nl=as_json)


@main.command(
    short_help="Integrate one scene once.",
    epilog=_epilog(
        "conservative run brick_flip --method reduced --dt 0.01",
        "conservative run lagrange_top -m mujoco:RK4 --dt 0.001 --t-end 2 --json",
        "conservative run brick_flip:disturbance=1e-6 -m heyoka:1e-12 --csv flip.csv",
    ),
)
@click.argument("scene", shell_complete=completion.scenes)
@click.option(
    "--method", "-m", default="reduced", show_default=True, shell_complete=completion.methods, help="Name, with settings."
)
@click.option("--dt", type=float, help="Step, s; of an adaptive method the distance of samples.  [default: the scene's]")
@click.option("--t-end", type=float, help="Duration, s.  [default: the scene's]")
@click.option("--json", "as_json", is_flag=True, help="The summary as JSON on stdout.")
@click.option("--csv", type=click.Path(path_type=Path), help="Write the samples: t, R_WB, w_WB_B, energy, momentum.")
def run(scene: str, method: str, dt: float | None, t_end: float | None, as_json: bool, csv: Path | None) -> None:
    """Integrate SCENE once and show how it ended, its drifts and its last state.

    Every step is a sample; of more than a million steps, as many samples, evenly spaced, at most.
    A run that fails leaves what it reached in the file, and exits with 1.
    """
    require_extra("conservative run", "report", "rich")
    from ..terminal.progress import waiting
    from . import run

    with waiting(f"{scene}: {method}") as expect:
        summary = run.run(scene, method, dt, t_end, csv, expect)
    click.echo(run.as_json(summary) if as_json else run.as_text(summary))
    if summary["status"] != "ok":
        raise click.ClickException(f"{summary['label']} on {summary['scene']}: {summary['status']}")
