"""What the commands share: the end of every --help, and the reading of lists of names."""

from __future__ import annotations

from pathlib import Path

import click

EXIT_CODES = """Exit codes:
    0    done
    1    a run failed: it did not converge, or diverged; or the gate is not passed
    2    the command or an input cannot be used, or an engine or a baseline is missing
    130  interrupted by Ctrl-C, 143 by SIGTERM; report and sweep keep what is finished, and --resume goes on
"""


class FilePath(click.Path):
    """A path, which no system takes with a NUL in it."""

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        if "\0" in str(value):
            self.fail(f"got {value!r}; allowed: a path without NUL", param, ctx)
        return Path(str(value))


class Count(click.ParamType):  # type: ignore[type-arg]  # generic only for the checker, not before click 8.2
    """A number of things, 1 or more, which may be written as 1e6."""

    name = "count"

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> int:
        try:
            number = float(str(value))
            if number >= 1 and number.is_integer():
                return int(number)
        except (ValueError, OverflowError):  # the latter: infinite
            pass
        self.fail(f"got {value!r}; allowed: an integer of 1 or more, such as 1000 or 1e6", param, ctx)


find_links_option = click.option(
    "--find-links",
    type=click.Path(path_type=Path, exists=True, file_okay=False, resolve_path=True),
    help="Folder of wheels to take everything from, without a network.",
)
allow_build_option = click.option(
    "--allow-build", is_flag=True, help="Run a package's own code to build it, where it has no wheel."
)


def epilog(*examples: str) -> str:
    """Return what every --help ends with; a backspace on a line of its own keeps click from joining the lines after it."""
    return "\n".join(["\b", "Examples:", *(f"  {example}" for example in examples), "", "\b", EXIT_CODES])


def split_names(argument: str, texts: tuple[str, ...]) -> list[str]:
    """Return names out of `a,b:setting=1,other=2,c`: what has an equals sign and no colon belongs to the name before it.

    An option that is given but names nothing, as `--scenes "$EMPTY"` does, would mean everything: it is a mistake.
    """
    names: list[str] = []
    for item in split_list(argument, texts):
        if names and "=" in item and ":" not in item:
            names[-1] += f",{item}"
        else:
            names.append(item)
    return names


def split_list(argument: str, texts: tuple[str, ...]) -> list[str]:
    """Return what is between the commas; an option that is given but names nothing is a mistake, as in `split_names`."""
    items = [item.strip() for text in texts for item in text.split(",") if item.strip()]
    if texts and not items:
        raise click.BadParameter("it names nothing", param_hint=f"--{argument}")
    return items
