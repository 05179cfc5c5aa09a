"""The comparison of n versions: every setting on every scene in each version. Times are added by the caller."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Generic, Protocol, TypeVar

from ..studies.study import Progress
from .version import Version

Result = TypeVar("Result")
Measured = TypeVar("Measured", covariant=True)
Times = TypeVar("Times")
TIMING = 0.5
"""Share of the work that is done when the timing begins."""


class Side(Protocol[Measured]):
    """A version whose settings are measured."""

    version: Version

    def measure(self, scene: str) -> Iterable[tuple[str, Measured]]:
        """Yield the name of each setting and its result on a scene; failures are results."""


@dataclass(frozen=True)
class Line(Generic[Result, Times]):
    """One setting on one scene: the result of each version (None for a version without the setting), and the times."""

    scene: str
    setting: str
    results: tuple[Result | None, ...]
    times: Times | None = None


@dataclass(frozen=True)
class Comparison(Generic[Result, Times]):
    """Versions, in the order of comparison, and a line for each setting on each scene."""

    versions: tuple[Version, ...]
    lines: tuple[Line[Result, Times], ...]

    @property
    def steps(self) -> Iterator[tuple[Line[Result, Times], Result | None, Result | None]]:
        """Lines with their results in two consecutive versions, version by version."""
        for pair in pairwise(range(len(self.versions))):
            for line in self.lines:
                yield line, line.results[pair[0]], line.results[pair[1]]


def compare(
    sides: Sequence[Side[Result]], scenes: Sequence[str], tell: Progress = lambda share, what: None
) -> Comparison[Result, Times]:
    """Return the comparison of two or more versions, in their order, on registered scenes; without times."""
    lines: list[Line[Result, Times]] = []
    for number, scene in enumerate(scenes):
        by_version: list[dict[str, Result]] = []
        for place, side in enumerate(sides):
            tell(TIMING * (number + place / len(sides)) / len(scenes), f"{scene}: {side.version.name}")
            by_version.append(dict(side.measure(scene)))
        settings = dict.fromkeys(setting for results in by_version for setting in results)
        lines += [Line(scene, setting, tuple(results.get(setting) for results in by_version)) for setting in settings]
    tell(TIMING, f"timing {len(lines)} rows")
    return Comparison(tuple(side.version for side in sides), tuple(lines))
