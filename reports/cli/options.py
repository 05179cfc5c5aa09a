"""Parts shared by the commands: options, output files, the end of every --help, and the reading of lists of names."""

from __future__ import annotations

import os
import shlex
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import click

from conservative.errors import REMOVED, BadInput, NotWritten
from conservative.files import require_ending

from ..document import MARK, PICTURES
from . import completion

if TYPE_CHECKING:
    from ..document.model import Document

VOCABULARY: Mapping[str, tuple[tuple[str, ...], tuple[str, ...]]] = MappingProxyType(
    {
        "methods": (("--methods", "-m"), ("--method",)),
        "engines": (("--engines",), ("--engine",)),
        "scenes": (("--scenes",), ()),
        "t_end": (("--t-end",), ("--duration",)),
        "dt": (("--dt",), ()),
        "error": (("--error",), ()),
        "out": (("--out",), ()),
        "picture": (("--picture",), ()),
    }
)
"""Options of several commands: their names, and their names in the last release, which work with a note until the next one."""
FAILED = "a run failed"
FAILED_OR_INACCURATE = f"{FAILED}, or its attitude error is above 0.1 rad"
EXIT_CODES = {
    0: "done",
    2: "invalid command or input, or a missing engine or baseline",
    130: "interrupted by Ctrl-C (143: SIGTERM, 129: SIGHUP)",
}
"""Exit codes of every command; see `Command`."""


OLD_NAMES: Mapping[str, str] = MappingProxyType(
    {
        **dict.fromkeys(("judge", "twins", "importers", "engines check"), "verify"),
        "study motions": "verify --only motions",
        "study twins": "verify --only pairs",
        "track --twins": "track --verify pairs",
    }
)
"""Commands, studies and options of the last release, and what takes their place with the same arguments."""


class OldName(click.ClickException):
    """A name of the last release, in the table `OLD_NAMES`, and the arguments that follow it."""

    exit_code = 2

    def __init__(self, old: str, arguments: Iterable[str] = ()) -> None:
        new = OLD_NAMES[old]
        rest = shlex.join(arguments) or ("SUBJECT..." if new.startswith("verify") else "")
        super().__init__(f"{old} is now {new}. Run: conservative {new} {rest}".rstrip())


class Gone(click.ClickException):
    """An option or a study that is gone, in the table `REMOVED`."""

    exit_code = 2

    def __init__(self, name: str) -> None:
        super().__init__(f"{name} is gone. {REMOVED[name]}")


class Command(click.Command):
    """A command that takes the old names of options, and whose help lists its own exit codes.

    `codes` are exit codes and their meanings, in addition to `EXIT_CODES`.
    """

    def __init__(self, *args: Any, codes: Mapping[int, str] | None = None, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.codes = EXIT_CODES | dict(codes or {})

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        names = {str(param.name) for param in self.params}
        new = {old: long for name, ((long, *_), olds) in VOCABULARY.items() if name in names for old in olds}
        for i, word in enumerate(args[: args.index("--") if "--" in args else None]):
            name, *value = word.split("=", 1)
            if name.startswith("-") and f"{self.name} {name}" in OLD_NAMES and not ctx.resilient_parsing:
                raise OldName(f"{self.name} {name}", [*args[:i], *args[i + 1 :]])
            if f"{self.name} {name}" in REMOVED and not ctx.resilient_parsing:
                raise Gone(f"{self.name} {name}")
            if name in new and not ctx.resilient_parsing:  # as in completion
                click.echo(f"{name} is now {new[name]}; the old name works until the next release.", err=True)
                args = [*args[:i], "=".join([new[name], *value]), *args[i + 1 :]]
        return super().parse_args(ctx, args)

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        super().format_epilog(ctx, formatter)
        goes_on = "; --resume continues" * any(param.name == "resume" for param in self.params)
        write_codes(formatter, self.codes | {130: EXIT_CODES[130] + goes_on})


def write_codes(formatter: click.HelpFormatter, codes: Mapping[int, str]) -> None:
    """Write exit codes and their meanings."""
    with formatter.section("Exit codes"):
        formatter.write_dl([(str(code), codes[code]) for code in sorted(codes)])


class Group(click.Group):
    """A group of commands. Its help lists the exit codes that all of them have. An old name is answered with the new one."""

    command_class = Command

    def resolve_command(self, ctx: click.Context, args: list[str]) -> tuple[str | None, click.Command | None, list[str]]:
        root = ctx.find_root()
        old = ctx.command_path.removeprefix(str(root.info_name)).strip()
        old = f"{old} {args[0]}".strip()
        if old in OLD_NAMES and not ctx.resilient_parsing:
            raise OldName(old, args[1:])
        return super().resolve_command(ctx, args)

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        super().format_epilog(ctx, formatter)
        write_codes(formatter, EXIT_CODES | {1: "see --help of the command"})


class FilePath(click.Path):
    """A path without NUL."""

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        if "\0" in str(value):
            self.fail(f"got {value!r}; expected a path without NUL", param, ctx)
        return Path(str(value))


class Output(FilePath):
    """A file that the command writes, or a folder with such files.

    Parameters
    ----------
    marks
        Text within the first `HEAD` bytes of every such file; of a folder, the names of its files with their texts. A
        file without its text was not written by this option.
    """

    def __init__(self, marks: str | Mapping[str, str]) -> None:
        super().__init__()
        self.marks = {"": marks} if isinstance(marks, str) else marks

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        if str(value) == "-":
            self.fail("got '-'; expected the name of a file (--json writes to stdout, ./- is a file of that name)", param, ctx)
        return super().convert(value, param, ctx)


class Picture(Output):
    """A file of a picture: SVG or PNG by its ending."""

    def __init__(self) -> None:
        super().__init__(MARK)

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        path = super().convert(value, param, ctx)
        require_ending("picture", path, PICTURES)
        return path


class OutputCommand(Command):
    """A command with options of type `Output`, and with --force.

    A file that the same option did not write is replaced only with --force. An input of the command, or the file of another
    option, is never replaced.
    """

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.params.append(click.Option(["--force"], is_flag=True, help="Replace files that this command did not write."))

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        rest = super().parse_args(ctx, args)
        force = ctx.meta["force"] = ctx.params.pop("force")
        taken = [Path(word) for param in self.params if not isinstance(param.type, Output) for word in _words(ctx, param)]
        written: dict[str, str] = {}
        for param in self.params:
            if isinstance(param.type, Output) and (path := ctx.params.get(str(param.name))) is not None:
                for name, mark in param.type.marks.items():
                    require_replaceable(path / name, mark, str(param.name), force, taken)
                    place = os.path.normcase(os.path.realpath(path / name))  # the file may not exist yet
                    if written.setdefault(place, str(param.name)) != param.name and not is_special(path / name):
                        got = f"{str(path / name)!r}, the file of --{written[place]}"
                        raise BadInput(str(param.name), got, "another file")
        return rest


def is_special(file: Path) -> bool:
    """Return whether a file is a pipe or a device, such as /dev/null, which several options can write to."""
    with suppress(OSError):
        return file.exists() and not file.is_file() and not file.is_dir()
    return False


HEAD = 4096
"""Number of bytes at the beginning of a file that are searched for a mark."""


def require_replaceable(file: Path, mark: str, option: str, force: bool = False, inputs: Iterable[Path] = ()) -> None:
    """Raise `BadInput` for an option whose file must not be replaced: one without its mark, unless `force`, or an input.

    A file that does not exist, is empty, or is a pipe or a device passes. The mark is within the first `HEAD` bytes.
    """
    try:
        if not file.is_file() or not file.stat().st_size:
            return
    except OSError:  # such as a name that is too long: writing the file reports it
        return
    head, shared = b"", False
    for other in inputs:
        with suppress(OSError, ValueError):  # a word that is not the name of a file
            shared = shared or file.samefile(other)
    if shared:
        raise BadInput(option, f"{str(file)!r}, which the command also reads or writes elsewhere", "another file")
    with suppress(OSError), file.open("rb") as stream:
        head = stream.read(HEAD)
    if not force and mark.encode() not in head:
        allowed = "a new file, an earlier result of the same option, or --force to replace the file"
        raise BadInput(option, f"{str(file)!r}, which this option did not write", allowed)


def _words(ctx: click.Context, parameter: click.Parameter) -> Iterator[str]:
    """Yield the texts in the value of a parameter that can name files. The value can be a list or contain commas."""
    value = ctx.params.get(str(parameter.name))
    for text in value if isinstance(value, tuple) else (value,):
        if isinstance(text, str | Path):
            yield from {str(text), *str(text).split(",")}


class Count(click.ParamType):  # type: ignore[type-arg]  # generic only for the checker, not before click 8.2
    """An integer of 1 or more, such as 1000 or 1e6."""

    name = "count"

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> int:
        with suppress(ValueError):
            number = float(str(value))
            if number >= 1 and number.is_integer():  # False for infinity
                return int(number)
        self.fail(f"got {value!r}; expected an integer of 1 or more, such as 1000 or 1e6", param, ctx)


def option(name: str, help: str, **kind: Any) -> Callable[[Any], Any]:
    """Return the option of a name in `VOCABULARY`, or another."""
    names, _ = VOCABULARY.get(name, ((f"--{name}",), ()))
    return click.option(*names, name, help=help, **kind)


def names_option(name: str, help: str, metavar: str = "A,B", complete: Any = None) -> Callable[[Any], Any]:
    """Return an option that takes several names, separated by commas, and may be repeated."""
    return option(name, help, multiple=True, metavar=metavar, shell_complete=complete)


def methods_option(help: str) -> Callable[[Any], Any]:
    """Return the option for methods."""
    return names_option("methods", help, "M,N", completion.methods)


def error_option(help: str, **kind: Any) -> Callable[[Any], Any]:
    """Return the option for an attitude error."""
    return option("error", help, type=float, metavar="RAD", **kind)


target_option = error_option(
    "Target attitude error, rad. Chooses the method and the step; not with --methods.  [default: 1e-6]"
)
scene_argument = click.argument("scene", shell_complete=completion.scenes)
t_end_option = option("t_end", "Duration, s.  [default: the scene's]", type=float, metavar="S")
picture_option = option("picture", "Write a picture (.svg or .png).", type=Picture(), metavar="FILE")
scheduler_option = click.option("--scheduler", metavar="ADDRESS", help="Run on the workers of this Dask scheduler.")
json_option = click.option("--json", "as_json", is_flag=True, help="Print JSON.")
skip_missing_option = click.option(
    "--skip-missing", is_flag=True, help="Mark engines that are not installed instead of failing."
)
quick_option = click.option("--quick", is_flag=True, help="Fewer steps and rounds of timing.")
engines_option = names_option(
    "engines",
    "Engines to add: NAME, NAME@VERSION, or `all` for all installed engines (see `conservative engines`). A report gets a "
    "section that compares them.",
    "E,F",
    completion.engine_lists,
)
find_links_option = click.option(
    "--find-links",
    type=click.Path(path_type=Path, exists=True, file_okay=False, resolve_path=True),
    help="Install from this folder of wheels, without a network.",
)
allow_build_option = click.option(
    "--allow-build", is_flag=True, help="Build packages without a wheel from source, which runs their code."
)


class _NotMade(Exception):
    """A file has no content."""


@contextmanager
def output_files(out: Path | None, names: Iterable[str], /, **options: Path | None) -> Iterator[Callable[..., Document]]:
    """Open the output files of a command, so that a place that cannot be written is an error before any work.

    Parameters
    ----------
    out, names
        A folder, or None, and the names of its files.
    options
        Single files by the name of their option, such as `junit`.

    Yields
    ------
    Callable
        Writes a document into all files, in the formats of their endings or options. Formats that the renderers do not have,
        and files with other content, are functions without arguments, such as `csv=...`, which return a text or bytes. They are
        called last, and a file that cannot be made leaves the others: it keeps its content, and the returned document has the
        failure. A disk that becomes full leaves the others, too: `NotWritten` is raised after them.
    """
    from conservative.files import make_folder, text_file

    from ..document import text
    from ..document.attempt import attempt
    from ..document.model import Paragraph

    places = {option: (path, option) for option, path in options.items() if path is not None}
    if out is not None:
        make_folder(out, "out")
        places |= {name: (out / name, "out") for name in names}
    with ExitStack() as stack:
        opened = {}
        for name, place in places.items():
            context = stack.enter_context(ExitStack())
            opened[name] = context, context.enter_context(text_file(*place))

        def write(document: Document, **others: Callable[[], str | bytes]) -> Document:
            failures, unwritten = list(document.failures), list[NotWritten]()
            made_by = {name: others.get(name) or others.get(name.rpartition(".")[2]) for name in opened}
            for name in sorted(opened, key=lambda name: made_by[name] is not None):
                context, stream = opened[name]
                make = made_by[name] or partial(text, document, name.rpartition(".")[2])
                try:
                    with suppress(_NotMade), context:  # each file is on the disk before the next one is drawn
                        made = attempt(f"The file {str(places[name][0])!r}", make)
                        if isinstance(made, Paragraph):
                            failures.append(made.text)
                            raise _NotMade  # closes the file, which keeps its content
                        stream.buffer.write(made.encode() if isinstance(made, str) else made)
                except NotWritten as error:  # such as a full disk, on which the others need not be
                    unwritten.append(error)
            if unwritten:
                raise unwritten[0]
            return replace(document, failures=failures)

        yield write


def picture_file(chart: Any, path: Path | None) -> bytes:
    """Return the file of a chart in the format of its name, by default SVG."""
    from ..charts import style  # slow to import

    return style.picture_file(style.apply_style(chart), ".svg" if path is None else path.suffix)


def show(document: Document, as_json: bool, silent: bool = False) -> None:
    """Print a document, or its data as JSON. If it has failures, end the command with exit code 1.

    The failures are the message, unless `silent`, for documents that state them.
    """
    from ..document import terminal, text

    if as_json:
        click.echo(text(document, "json"))
    else:
        terminal.show(document)
    if document.failures:
        raise click.exceptions.Exit(1) if silent else click.ClickException("; ".join(document.failures))


def epilog(*examples: str) -> str:
    """Return the examples of a --help. A backspace on its own line keeps click from joining the following lines."""
    return "\n".join(["\b", "Examples:", *(f"  {example}" for example in examples)])


def split_names(argument: str, texts: tuple[str, ...]) -> list[str]:
    """Return the names in `a,b:setting=1,other=2,c`.

    A part with one equals sign and no colon is a setting of the name before it, if that has settings.

    An empty option, such as `--scenes "$EMPTY"`, is an error, because it would select everything.
    """
    names: list[str] = []
    for item in split_list(argument, texts):
        if names and ":" in names[-1] and "=" in item.replace("==", "") and ":" not in item:
            names[-1] += f",{item}"
        else:
            names.append(item)
    return names


def split_list(argument: str, texts: tuple[str, ...]) -> list[str]:
    """Return the parts between commas. An empty option is an error, as in `split_names`."""
    items = [item.strip() for text in texts for item in text.split(",") if item.strip()]
    if texts and not items:
        raise click.BadParameter("it names nothing", param_hint=f"--{argument}")
    return items
