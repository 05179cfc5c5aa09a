"""The study of the paper's figures 1 and 2, the brick that flips and the top.

Lines by quantity: in figure 1, ω1, ω2, ω3 are the body rates of the brick, rad/s, and energy and momentum the signed relative
errors of the energy and of the length of the angular momentum. In figure 2, x1, x2 are coordinates of the centre of mass of the
top, m.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from conservative import registry
from conservative.attitude import Array
from conservative.grid import grid_for
from conservative.methods.convected import Convected
from conservative.methods.reduced import Reduced
from conservative.potentials.uniform_gravity import UniformGravity
from conservative.references.exact.method import Exact
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from ..measures.measure import Measure, Value
from ..measures.measurement import Samples
from .case import Case
from .declaration import Declaration, Extent
from .study import Finding, Progress, Study

BRICK, TOP = "brick_flip", "lagrange_top"
"""Scenes of the figures. A study without a scene omits its figure."""
PAPER_MAP, REDUCED_MAP, EXACT = Convected().name, Reduced().name, Exact().name
"""Methods of the figures: the paper's map with 18 and with three unknowns, and the exact solution."""
BRICK_STEP = 0.01
TOP_STEPS = (0.01, 0.005, 0.0025)
"""Step sizes, s. The figure of the top shows the first two."""
RATES = ("ω1", "ω2", "ω3")
ENERGY, MOMENTUM = "energy", "momentum"
X1, X2 = "x1", "x2"


def findings(study: Study, progress: Progress) -> Iterator[Finding]:
    """Yield the lines of the figures whose scene is in the study, and the position errors of the top as rows.

    Methods and step sizes are those of the paper and do not depend on the study.
    """
    figures = {BRICK: yield_brick, TOP: yield_top}
    names = [scene.name for scene in study.scenes if scene.name in figures]
    for k, name in enumerate(names):
        progress(k / len(names), f"{name}: the paper's figure")
        yield from figures[name](study.name)


def run(study: str, scene: str, method: str, dt: float) -> tuple[Case, Trajectory]:
    """Return the case and the trajectory of a method at a step size, s, or raise the failure of its run."""
    value = registry.scene(scene)
    case = Case(study, value, registry.method(method), grid_for(value, dt))
    trajectory = case.method.solve(value, case.grid)
    if trajectory.failure is not None:
        raise trajectory.failure
    return case, trajectory


def yield_brick(study: str) -> Iterator[Samples]:
    """Yield figure 1: rates by the paper's map; errors of energy and |L|, relative and signed, by both maps."""
    for name in (PAPER_MAP, REDUCED_MAP):
        case, trajectory = run(study, BRICK, name, BRICK_STEP)
        length = np.linalg.norm(trajectory.momentum_W, axis=1)
        rates = dict(zip(RATES, trajectory.w_WB_B.T, strict=True)) if name == PAPER_MAP else {}
        relative = {ENERGY: trajectory.energy / trajectory.energy[0] - 1, MOMENTUM: length / length[0] - 1}
        yield from (case.samples(quantity, trajectory.t, values) for quantity, values in (rates | relative).items())


def yield_top(study: str) -> Iterator[Finding]:
    """Yield figure 2, the paper's map at two steps and the exact motion, then the errors after one period of precession."""
    for name, dt in (*((PAPER_MAP, dt) for dt in TOP_STEPS[:2]), (EXACT, TOP_STEPS[1])):
        case, trajectory = run(study, TOP, name, dt)
        positions = com_W(case.scene, trajectory.R_WB).T
        yield from (case.samples(quantity, trajectory.t, x) for quantity, x in zip((X1, X2), positions, strict=False))
    for dt in TOP_STEPS:
        (case, ours), (_, exact) = (run(study, TOP, name, dt) for name in (PAPER_MAP, EXACT))
        step = round(case.scene.t_end / dt)
        gap = com_W(case.scene, ours.R_WB[step] - exact.R_WB[step])
        yield case.row(Value(Measure.PERIOD, float(ours.t[step])))
        yield case.row(Value(Measure.PERIOD_X1, abs(float(gap[0]))))
        yield case.row(Value(Measure.PERIOD_DISTANCE, float(np.linalg.norm(gap))))


def com_W(scene: Scene, R_WB: Array) -> Array:
    """Return the centre of mass (..., 3), m, world axes, of a scene in uniform gravity at attitudes (..., 3, 3)."""
    assert isinstance(scene.potential, UniformGravity)  # as the top is
    return np.asarray(R_WB @ scene.potential.com_B)


STUDY = Declaration(findings, Extent.FULL)
