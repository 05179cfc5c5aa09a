"""How a study is declared, beside the function that makes its findings.

`STUDY = Declaration(findings, ...)` in the file of a study says all that commands and reports have to know about it, and
`studies.STUDIES` lists the declarations.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import IntEnum, auto
from typing import Any

from conservative.method import Method
from conservative.scene import Scene

from . import selection
from .study import Maker, Study


class Extent(IntEnum):
    """The shortest report that a study is part of."""

    EVERY = auto()
    FULL = auto()
    LONG = auto()
    """A full report that is not quick."""


@dataclass(frozen=True)
class Declaration:
    """A study as it is declared; its name is that of its file.

    Attributes
    ----------
    findings
        Function that yields its rows and samples.
    extent
        In which reports it is.
    named
        It also measures the engines that are named for a report, as it measures all methods.
    apart
        Its rows have a section of their own and are not among the tables of the scenes.
    timed
        It measures times, which need an idle machine, so that it does not run on a cluster.
    in_turn
        In a full report and alone, several processes measure its times in turn.
    scenes
        Its own scenes, which a report has only if none is named; None: the scenes of the report.
    draw
        Function that draws its bodies and returns the study, from methods and keywords; None: it has scenes.
    settings, of_engines
        The settings of a family that a bare name stands for if the study runs alone, and those of the named engines.
    in_report
        The methods of a report that are in the study.
    options
        Options of `conservative study` that not every study has.
    more
        Keywords of the study in a report.
    """

    findings: Maker
    extent: Extent = Extent.EVERY
    named: bool = False
    apart: bool = False
    timed: bool = False
    in_turn: bool = False
    scenes: Callable[[], tuple[Scene, ...]] | None = None
    draw: Callable[..., Study] | None = None
    settings: selection.Settings = selection.in_tables
    of_engines: Callable[[Sequence[Method]], tuple[Method, ...]] = tuple
    in_report: Callable[[Sequence[Method]], tuple[Method, ...]] = tuple
    options: tuple[str, ...] = ("scenes", "methods")
    more: tuple[tuple[str, Any], ...] = ()

    @property
    def name(self) -> str:
        """Name of the study."""
        return self.findings.__module__.rpartition(".")[2]

    @property
    def about(self) -> str:
        """Description: the first line of its file."""
        return (sys.modules[self.findings.__module__].__doc__ or "").partition("\n")[0].rstrip(".")

    def plan(self, methods: Sequence[Method], scenes: Sequence[Scene] = (), processes: int = 1, **settings: Any) -> Study:
        """Return the study of methods, with the scenes or else its own; `settings` are fields of `Study`, or of the draw."""
        settings["processes"] = processes if self.in_turn else 1
        if self.draw:
            return self.draw(tuple(methods), **settings)
        return Study(self.name, tuple(scenes) or (self.scenes or selection.scenes)(), tuple(methods), **settings)
