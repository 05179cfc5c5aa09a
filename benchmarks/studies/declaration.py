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
    """A study as it is declared; its name is the name of its file.

    Attributes
    ----------
    findings
        Function that yields its rows and samples.
    extent
        The shortest report that contains it.
    named
        True if engines named for a report are measured too, like its methods.
    apart
        True if its rows have a section of their own and are not among the tables of the scenes.
    timed
        True if it measures times, which need an idle machine, so that it does not run on a cluster.
    in_turn
        True if several processes measure its times in turn, in a full report and alone.
    scenes
        Its own scenes, which a report has only if none is named; None: the scenes of the report.
    draw
        Function that draws its bodies and returns the study, from methods and keywords; None: it has scenes.
    settings, of_engines
        What a bare name of a family stands for if the study runs alone: its settings. `of_engines`: the same for named engines.
    in_report
        Function that selects the study's methods from the methods of a report.
    options
        Options of `conservative study` that not every study has.
    report_keywords
        Fields of the study in a report, or arguments of `draw`, that differ from their defaults.
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
    report_keywords: tuple[tuple[str, Any], ...] = ()

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
