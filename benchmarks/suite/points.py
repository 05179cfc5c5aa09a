"""The points of the suite behind `pytest --benchmark`, and everything about one of them that does not depend on the clock."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any

import numpy as np

from conservative import registry
from conservative.errors import BadInput
from conservative.grid import Grid, grid_for
from conservative.method import Method, Role
from conservative.scene import Scene

from ..measures import errors
from ..measures.convergence_order import observed_order
from ..measures.measure import Measure
from ..studies import selection, step_ladder
from ..studies.case import Case, Success, attempt
from ..studies.study import FindTruth, remember_truths
from .description import describe
from .motion import PROBES, Motion

SCENES = ("brick_flip", "lagrange_top", "near_separatrix", "falling_top", "asymmetric_top")
"""The paper's two, and a motion along a separatrix, a top that loses its stability, and one without an exact solution."""
PAPER = SCENES[:2]
"""Scenes on which orders are fitted."""
NUDGES = (-2, -1, 1, 2)
"""Changes of the start, in units of the last digit of the largest rate, whose effect is the spread of a measure."""
STEPS = 6
"""Number of steps that an observed order is fitted to; high orders need all of theirs, which are short."""
ROUND_OFF = 1.6
"""Smallest spread of an error or a drift, in units of the precision: few nudges may round to the same number."""
ROUNDED = 1e-13
"""Attitude errors, rad, up to this size are partly round-off, which differs between machines and compilers. No order is fitted
to them: the order of `projected` on the Lagrange top was 7.84 or 7.78 with errors of 1e-14, and is 7.94 without."""
LARGEST = {Measure.ATTITUDE_MAX, Measure.RATES_MAX, Measure.POSITION_MAX, Measure.DRIFT_MAX, Measure.ORTHONORMALITY}
"""Measures that are gated."""


@dataclass(frozen=True)
class Point:
    """A scene, a method, and the scene's own step; `truths` has the exact motions, for all points that share it."""

    scene: Scene
    method: Method
    truths: FindTruth = field(default_factory=remember_truths, repr=False, compare=False)

    @cached_property
    def grid(self) -> Grid:
        """The steps, each with a sample."""
        return grid_for(self.scene, self.scene.dt)

    @property
    def id(self) -> str:
        """The id in pytest, such as `brick_flip-reduced_o4-dt0.01`: letters, digits, `_`, `.`, `+` and `-` only.

        It contains the settings that are not defaults, and always a first setting that is a text, such as an engine's
        integrator.
        """
        shown = []
        for position, setting in enumerate(fields(self.method)):
            value = getattr(self.method, setting.name)
            if isinstance(value, str):
                if position == 0 or value != setting.default:
                    shown.append(value.lower())
            elif value != setting.default:
                shown.append({"order": "o", "stages": "s"}.get(setting.name, setting.name) + str(value))
        return f"{self.scene.name}-{'_'.join([self.method.family, *shown])}-dt{self.scene.dt:g}"

    @property
    def labels(self) -> dict[str, str]:
        """Names and definition of the row; the gate requires that the version of an engine stays the same, not ours."""
        label = self.method.label
        engine = label if self.method.role == Role.ENGINE else ""
        return {
            "scene": self.scene.name,
            "method": self.method.name,
            "label": label,
            "engine": engine,
            "definition": self.definition,
        }

    @property
    def definition(self) -> str:
        """Hash of scene, method and steps."""
        return Motion(describe(self.scene, np.array(PROBES))).definition(self.scene.name, self.method.name)


def points() -> Iterator[Point]:
    """Yield the points: the settings of `MethodInfo.suite` of every registered method on every scene of the suite."""
    selected = selection.methods(skip_missing=True, settings=lambda method: method.settings_for("suite"))
    methods = [method for method in selected if method.role != Role.TRUTH]
    truths = remember_truths()
    return (Point(scene, method, truths) for scene in selection.scenes(SCENES) for method in methods)


def measure(point: Point, few: bool = False) -> tuple[dict[str, float], dict[str, float]]:
    """Return the values that should not change, of a run that reaches its end, and how much round-off alone changes each.

    They are errors, drifts, work and, in the paper's scenes, the observed order. Round-off depends on the method's precision.
    `few` is for slow methods: fewer nudges, and orders from runs that are shorter than the scene.
    """
    exact = point.truths(point.scene, point.grid).trajectory
    scene, measured = point.scene, []
    number: Any = np.float32 if selection.bits_of(point.method) == 32 else np.float64
    last_digit = np.array([1.0, -1.0, 1.0]) * float(np.spacing(number(np.abs(scene.w_WB_B0).max())))
    for units in (0, *(NUDGES[1:-1] if few else NUDGES)):
        trajectory = point.method.solve(replace(scene, w_WB_B0=scene.w_WB_B0 + units * last_digit), point.grid)
        counters = {name: float(count) for name, count in vars(trajectory.counters).items() if count is not None}
        rows = errors.measure_errors(trajectory, exact)
        measured.append({row.key: row.value for row in rows if row.measure in LARGEST} | counters)
    nudged = {name: [values[name] for values in measured] for name in measured[0]}
    least = ROUND_OFF * float(np.finfo(number).eps)
    spreads = {name: max(max(values) - min(values), 0.0 if name in counters else least) for name, values in nudged.items()}
    order = fit_order(point, few) if _is_of_paper(point.scene.name) else {}
    return measured[0] | order, spreads | dict.fromkeys(order, 0.0)


def _is_of_paper(scene: str) -> bool:
    try:
        return registry.read_name(scene, "scene").base in PAPER
    except BadInput:  # a scene of a project may have any name
        return False


def fit_order(point: Point, few: bool = False) -> dict[str, float]:
    """Return the observed order of the attitude; empty if the method has no order or the errors show none."""
    scene, method = point.scene, point.method
    if method.order is None:
        return {}
    exact = point.truths(scene, step_ladder.samples(scene, method)).trajectory
    grids = step_ladder.steps(scene, method)[: STEPS if method.order < step_ladder.HIGH_ORDER else None]
    grids = [grid for grid in grids if grid.n_steps <= point.grid.n_steps] if few else grids
    attempts = [attempt(Case("order", scene, method, grid)) for grid in grids]
    sizes = np.array(
        [errors.measure_errors(run.trajectory, exact)[0].value if isinstance(run, Success) else np.nan for run in attempts]
    )
    order = observed_order([grid.dt for grid in grids], np.where(sizes > ROUNDED, sizes, np.nan))
    return {} if order.reason else {Measure.ORDER.text: order.slope}
