"""Programs that are registered as engines: a name and a command line in the file of a project or of the user.

    [engines]                       # conservative.toml
    my_engine = "build/my_engine"   # relative to this file

The project's file is in the working directory, or in the nearest folder above it in the same repository or in the home folder;
CONSERVATIVE_PROJECT names another folder to start from. A file that other users could have written is not read, because its
programs would run. The one in the folder that CONSERVATIVE_PROJECT names is read, whoever wrote it. The user's file is in the
configuration folder of platformdirs. A name in the project's file takes precedence over one in the user's.
"""

from __future__ import annotations

import os
import re
import shlex
import warnings
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from .errors import BadInput, require_extra
from .posix import is_own
from .toml_reader import read


@dataclass(frozen=True)
class Program:
    """A registered program: its name, the file that it is registered in, and its command line, relative to that file."""

    name: str
    file: Path
    command: str

    def __str__(self) -> str:
        return f"{self.name}: {self.command} ({self.file})"

    @property
    def words(self) -> tuple[str, ...]:
        """The command line. Words that name a file are absolute paths."""
        words, folder = shlex.split(self.command), self.file.parent
        return tuple(str(path) if (path := folder / word).is_file() else word for word in words)


def project_file() -> Path:
    """Return the project's file, which may not exist."""
    here = Path(os.environ.get("CONSERVATIVE_PROJECT", "")).absolute()
    folders = [here, *here.parents]
    ends = [i for i, folder in enumerate(folders) if folder == Path("~").expanduser() or (folder / ".git").exists()]
    places = [folder / "conservative.toml" for folder in folders[: max(ends, default=0) + 1]]
    return next(filter(Path.is_file, places), places[0])


def _is_trusted(file: Path) -> bool:
    """Return whether a file can be read: it is of this user, or the user names its folder. Warn if not."""
    named = os.environ.get("CONSERVATIVE_PROJECT")
    if (named and Path(named).absolute() == file.parent) or is_own(file):
        return True
    remedy = f"To use its programs, set CONSERVATIVE_PROJECT={file.parent}"
    warnings.warn(f"{file} is not read, because other users can have written it. {remedy}", stacklevel=3)
    return False


def user_file() -> Path:
    """Return the user's file, which may not exist. Raise `MissingExtra` without platformdirs."""
    require_extra("An engine or a program in a process of its own", "environments", "platformdirs")
    from platformdirs import user_config_path

    return user_config_path("conservative-rotation") / "conservative.toml"


def list_programs() -> dict[str, Program]:
    """Return the registered programs by name. Raise `BadInput` if a file cannot be read or has other values than texts."""
    programs, files = dict[str, Program](), []
    with suppress(ImportError):  # without platformdirs
        files.append(user_file())
    with suppress(OSError):  # the working directory was removed
        files.append(project_file())
    for file in files:
        if file.is_file() and _is_trusted(file):
            programs |= read_programs(file)
    return programs


def read_programs(file: Path) -> dict[str, Program]:
    """Return the programs in a file by name. Raise `BadInput` as `list_programs`."""
    allowed = 'a table [engines] of texts, such as my_engine = "build/my_engine"'
    commands = read(file, allowed).texts("engines", allowed)
    try:
        if wrong := next(filter(re.compile(r"[@=:,\s]").search, commands), None):
            raise ValueError(f"the name {wrong!r} has one of '@', '=', ':' and ',', or a space")  # no command could take it
        return {name: Program(name, file, command) for name, command in commands.items() if shlex.split(command)}
    except ValueError as error:  # also for a quote that is not closed
        raise BadInput(str(file), str(error), allowed) from None
