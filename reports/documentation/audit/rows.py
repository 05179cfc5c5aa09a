"""What follows from the rows of a report's measurements.csv, for its audit: costs of classes of methods, ranges of ratios."""

from __future__ import annotations

import json
import math
import shlex
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pandas as pd

from conservative import registry
from conservative.benchmarks.studies.studies import ENGINES, RANDOM, THROUGHPUT
from conservative.errors import BadInput
from conservative.scene import Scene

from ...labels import with_names
from ...tables import each_step, random_contests, throughput_lines
from ...tables.cells import factor, tolerance
from ...tables.classes import OF_ENGINES, MethodClass, with_classes
from ...tables.random_contests import ANY
from ...tables.work_precision import DECADES, cost, points
from ..readme_table import read
from .sentences import NoSupportError

OURS = (MethodClass.GENERAL,)
SOLUTIONS = (MethodClass.SOLUTION,)
Cheapest = tuple[str, float]
"""Name of a line, and its time, s per simulated second."""


@dataclass(frozen=True)
class Duel:
    """An error, rad, and the cheapest line of ours and of an engine there; None where a side does not get there."""

    error: float
    ours: Cheapest | None
    engine: Cheapest | None

    @property
    def ratio(self) -> float:
        """The engine's time over ours; nan where a side does not get there."""
        return self.engine[1] / self.ours[1] if self.ours and self.engine else math.nan


@dataclass(frozen=True, eq=False)
class Rows:
    """The rows of a report, with names (see `labels.with_names`), and the command that made it."""

    table: pd.DataFrame
    command: str = ""

    @classmethod
    def of(cls, folder: Path) -> Rows:
        """Return the rows of the report in a folder."""
        told = json.loads((folder / "measurements.json").read_text(encoding="utf-8"))
        return cls(with_names(read(folder / "measurements.csv")), str(told["command"]))

    @cached_property
    def points(self) -> pd.DataFrame:
        """Errors and times, with classes."""
        apart = self.table["study"].isin((*ENGINES, RANDOM, THROUGHPUT))
        return with_classes(points(self.table[~apart].reset_index(drop=True)))

    @cached_property
    def contests(self) -> tuple[random_contests.Contest, ...]:
        """Ours against the cheapest engine on random bodies."""
        return tuple(each for each in random_contests.contests(self.table) if each.engine == ANY)

    @cached_property
    def many(self) -> tuple[throughput_lines.Contest, ...]:
        """Ours against engines on many bodies."""
        return tuple(throughput_lines.contests(throughput_lines.lines(self.table)))

    @cached_property
    def names(self) -> frozenset[str]:
        """Names of methods, of their lines and families, and of scenes."""
        family = self.table["family"].str.cat(self.table["version"], sep=" ")
        columns = [*(self.table[name] for name in ("name", "line", "method", "family", "label", "scene")), family]
        return frozenset(str(name).strip() for column in columns for name in column.dropna().unique()) - {""}

    @cached_property
    def scenes(self) -> dict[str, Scene]:
        """The scenes that can be had by what the command calls them, or by the names in the rows."""
        found: dict[str, Scene] = {}
        for name in [*dict.fromkeys(self.table["scene"].dropna()), *_scenes_in(self.command)]:
            with suppress(BadInput):
                found |= {(scene := registry.scene(str(name))).name: scene}
        return found

    def cheapest(self, scene: str, classes: Iterable[MethodClass], error: float) -> Cheapest | None:
        """Return the cheapest line of some classes on a scene; None where none gets there."""
        return cheapest(self.points[self.points["scene"] == scene], classes, error)

    def each_step(self, scene: str) -> each_step.EachStep:
        """Return what was found where each of a scene's own steps is kept."""
        return each_step.of_scene(self.table, scene)

    @cached_property
    def duels(self) -> dict[tuple[str, MethodClass], list[Duel]]:
        """Ours of a class against engines at each decade, by scene."""
        return {
            (str(scene), kind): [
                Duel(e, self.cheapest(scene, (kind,), e), self.cheapest(scene, OF_ENGINES, e)) for e in DECADES
            ]
            for scene in self.points["scene"].unique()
            for kind in (MethodClass.GENERAL, MethodClass.SOLUTION)
        }

    def field(self, name: str) -> list[random_contests.Contest]:
        """Return the contests on random bodies in a field; raise `NoSupportError` without any."""
        found = [contest for contest in self.contests if contest.field == name]
        if not found:
            raise NoSupportError(f"no random body is in a field {name!r}")
        return found


def cheapest(points: pd.DataFrame, classes: Iterable[MethodClass], error: float) -> Cheapest | None:
    """Return the cheapest line of some classes among points; None where none gets to the error."""
    here = points[points["class"].isin([kind.value for kind in classes])]
    costs = ((str(name), cost(line, error)) for name, line in here.groupby("name", sort=False))
    return min((each for each in costs if not math.isnan(each[1])), key=lambda each: each[1], default=None)


def _scenes_in(command: str) -> list[str]:
    words = shlex.split(command)
    after = [words[i + 1] for i, word in enumerate(words[:-1]) if word == "--scenes"]
    together = [word.removeprefix("--scenes=") for word in words if word.startswith("--scenes=")]
    return [name for text in (*after, *together) for name in text.split(",")]


def told(duels: Sequence[Duel], which: Callable[[Duel], bool]) -> str:
    """Return the errors of some duels as a sentence has them: `1e-1 to 1e-8`, or one by one."""
    errors = [duel.error for duel in duels if which(duel)]
    if len(errors) > 2 and np.allclose(np.diff(np.log10(errors)), -1):
        return f"{tolerance(errors[0])} to {tolerance(errors[-1])}"
    return ", ".join(map(tolerance, errors)) or "no error"


def extent(values: Iterable[float]) -> str:
    """Return the range of some factors as a sentence has it."""
    every = list(values)
    if not every:
        return "nothing"
    low, high = factor(min(every)), factor(max(every))
    return low if low == high else f"{low} to {high}"
