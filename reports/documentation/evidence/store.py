"""The evidence as it is kept beside this file, and how it gets there.

| file | has |
| --- | --- |
| `costs.csv` | the rows of a report that decide the table of costs, and drifts |
| `random.csv.gz` | the rows of a study of random bodies that decide the table of them |
| `origin.json` | of both: command, commit, date, machine and versions |
| `by_hand.csv` | what no study measures: values, command, commit and date, written by a person |
"""

from __future__ import annotations

import gzip
import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import takewhile
from pathlib import Path
from typing import Any

import pandas as pd

from conservative import files, references

from ...labels import with_names
from ...run.provenance import COMPARED
from ...tables.random_contests import Contest, contests
from .. import readme_table
from . import extract

FOLDER = Path(__file__).parent
COSTS, RANDOM, ORIGIN, BY_HAND = "costs.csv", "random.csv.gz", "origin.json", "by_hand.csv"
ENGINES = "| engine | bits | as installed | error, rad | energy drift | at its best | error, rad | energy drift | order |"
"""Header of the table of engines."""
_TOLD = ("command", "date", "commit")
_MACHINE = ("processor", "architecture", "cores", "memory", "system")


@dataclass(frozen=True)
class Evidence:
    """The evidence in a folder."""

    folder: Path = FOLDER

    @cached_property
    def rows(self) -> pd.DataFrame:
        """The rows of the report, with names (see `labels.with_names`)."""
        return with_names(readme_table.read(self.folder / COSTS))

    @cached_property
    def random(self) -> pd.DataFrame:
        """The rows of the study of random bodies, with names."""
        return with_names(readme_table.read(self.folder / RANDOM))

    @cached_property
    def contests(self) -> tuple[Contest, ...]:
        """Contests in them."""
        return contests(self.random)

    @cached_property
    def entries(self) -> tuple[readme_table.Entry, ...]:
        """Rows of README's table of costs, as points."""
        return tuple(readme_table.entries(self.rows))

    @cached_property
    def tables(self) -> tuple[tuple[str, ...], ...]:
        """README's tables of costs and of random bodies, as lines of Markdown."""
        both = readme_table.rows(self.entries), readme_table.random_bodies(self.contests)
        return tuple(tuple(readme_table.markdown(lines)) for lines in both)

    @cached_property
    def origin(self) -> Mapping[str, Mapping[str, str]]:
        """Where each file comes from."""
        found: Mapping[str, Mapping[str, str]] = json.loads((self.folder / ORIGIN).read_text(encoding="utf-8"))
        return found

    @cached_property
    def by_hand(self) -> Mapping[str, tuple[float, ...]]:
        """Values by what they are of."""
        found = pd.read_csv(self.folder / BY_HAND, dtype="string")
        return {
            str(name): tuple(map(float, str(text).split())) for name, text in zip(found["of"], found["values"], strict=True)
        }

    @cached_property
    def engines(self) -> Mapping[str, list[str]]:
        """Cells of the table of engines in references/README.md, which `readme_table --engines` makes, by engine."""
        lines = Path(references.__file__).with_name("README.md").read_text(encoding="utf-8").splitlines()
        rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[lines.index(ENGINES) + 2 :]]
        return {row[0].partition("==")[0]: row for row in takewhile(lambda row: len(row) > 1, rows)}


def keep(measured: Path, folder: Path = FOLDER) -> Path:
    """Keep what decides README's numbers out of the folder of a report, or of a study of random bodies; return the file.

    Raises
    ------
    BadInput
        The folder has neither, or not the rows that README needs; the file that was kept before stays.
    """
    study = (measured / "study.csv").exists()
    rows = readme_table.read(readme_table.rows_in(measured))
    name, pick = (RANDOM, extract.of_random_bodies) if study else (COSTS, extract.of_costs)
    _write(pick(rows), folder / name)
    told = json.loads((measured / ("study.json" if study else "measurements.json")).read_text(encoding="utf-8"))
    origin = json.loads((folder / ORIGIN).read_text(encoding="utf-8")) if (folder / ORIGIN).exists() else {}
    text = json.dumps(origin | {name.partition(".")[0]: _origin(told)}, indent=1, sort_keys=True)
    files.write_text(folder / ORIGIN, f"{text}\n", "evidence")
    return folder / name


def _write(rows: pd.DataFrame, path: Path) -> None:
    content = rows.to_csv(index=False, lineterminator="\n").encode()
    files.write_bytes(path, gzip.compress(content, mtime=0) if path.suffix == ".gz" else content, "evidence")


def _origin(told: Mapping[str, Any]) -> dict[str, str]:
    """Return command, commit, date, machine and versions of a report or of a study, without the folder it was written to."""
    flat = {**told, **told.get("machine", {}), **told.get("packages", {})}
    kept = {name: str(flat[name]) for name in (*_TOLD, *_MACHINE, *COMPARED) if name in flat}
    return kept | {"command": kept["command"].partition(" --out ")[0]}
