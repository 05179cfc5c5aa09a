"""Which files are mutated, which tests have to notice it, and the mutants that no test can notice: `mutation.toml`."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from conservative.errors import BadInput

from .mutants import Mutant

TABLE = Path(__file__).with_name("mutation.toml")


@dataclass(frozen=True)
class Room:
    """Files that are mutated together.

    Attributes
    ----------
    name
        What the command calls it.
    files, exclude
        Globs relative to the root, and names of files that are not mutated.
    tests
        What pytest is given, by the stem of the file's name; "all" for files without any of their own.
    """

    name: str
    files: list[str]
    tests: Mapping[str, list[str]]
    exclude: tuple[str, ...] = ()

    def list_files(self, root: Path) -> list[str]:
        """Return the paths of the files, relative to the root."""
        found = {path.relative_to(root).as_posix() for pattern in self.files for path in root.glob(pattern)}
        return sorted(file for file in found if Path(file).name not in (*self.exclude, "__init__.py"))

    def tests_of(self, file: str) -> list[str]:
        """Return what pytest is given for a mutant of a file."""
        return self.tests.get(Path(file).stem) or self.tests["all"]


def read_rooms() -> dict[str, Room]:
    """Return all rooms by name."""
    return {name: Room(name, **found) for name, found in _read()["rooms"].items()}


def choose_rooms(names: list[str], root: Path) -> list[tuple[Room, list[str]]]:
    """Return rooms with the files to mutate: all of them, or what is named, a room or a file of one.

    Raises
    ------
    BadInput
        A name is neither.
    """
    rooms = read_rooms()
    files = {file: room for room in rooms.values() for file in room.list_files(root)}
    if unknown := [name for name in names if name not in rooms and name not in files]:
        raise BadInput("names", unknown, f"rooms ({', '.join(rooms)}) or their files, relative to the root")
    chosen = [file for file, room in files.items() if not names or file in names or room.name in names]
    found = [(room, [file for file in chosen if files[file] is room]) for room in rooms.values()]
    return [(room, members) for room, members in found if members]


def find_reason(mutant: Mutant) -> str:
    """Return why no test can notice a mutant; empty where that is not known."""
    key = (mutant.file, mutant.before, mutant.after)
    return next((each["reason"] for each in _read().get("equivalent", ()) if _key(each) == key), "")


def list_equivalents() -> list[tuple[str, str, str]]:
    """Return file, line before and line after of the mutants that no test can notice."""
    return [_key(each) for each in _read().get("equivalent", ())]


def _key(each: Mapping[str, str]) -> tuple[str, str, str]:
    return each["file"], each["before"], each["after"]


def _read() -> dict[str, Any]:
    return tomllib.loads(TABLE.read_text(encoding="utf-8"))
