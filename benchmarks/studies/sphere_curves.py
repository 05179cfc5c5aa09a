"""The study of curves on a sphere, one for each method in the charts.

The runs are those of `long_runs`. The curve of a free body is its polhode: the angular momentum in principal axes, relative to
its initial length. The curve of a body in a field is the trace of an axis, a unit vector in world axes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from conservative.attitude import Array
from conservative.method import Method, Role
from conservative.potentials.uniform_gravity import UniformGravity
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from ..measures.measurement import Samples
from .case import Success
from .long_runs import case_for
from .study import Progress, Study

SAMPLES = 700
"""Largest number of samples of a curve."""
AXES = ("x", "y", "z")
"""Quantities of a curve, in units of the sphere's radius."""


def findings(study: Study, progress: Progress) -> Iterator[Samples]:
    """Yield three lines for each curve, one per coordinate; none for methods that do not support the scene or fail.

    The first reference method that supports the scene comes first.
    """
    drawn = select_methods(study.methods)
    pairs = [(scene, method) for scene in study.scenes for method in [*truth(scene, study.methods), *drawn]]
    for k, (scene, method) in enumerate(pairs):
        progress(k, len(pairs), f"{scene.name}: {method.name}")
        case = case_for(study.name, scene, method)
        done = study.attempt(case)
        if not isinstance(done, Success):
            continue
        trajectory = done.trajectory
        some = np.unique(np.linspace(0, len(trajectory) - 1, SAMPLES).round().astype(int))
        for axis, values in zip(AXES, project_on_sphere(trajectory)[some].T, strict=True):
            yield case.samples(axis, trajectory.t[some], values)


def select_methods(methods: Sequence[Method]) -> list[Method]:
    """Return the methods in the charts: of each family those of `Card.pictures`, or else the first."""
    competitors = [method for method in methods if method.role != Role.TRUTH]
    preferred = [method for method in competitors if method in method.settings_for("pictures")]
    firsts = {method.family: method for method in reversed(competitors)}
    return preferred + [method for family, method in reversed(firsts.items()) if family not in {m.family for m in preferred}]


def truth(scene: Scene, methods: Sequence[Method]) -> list[Method]:
    """Return the first reference method that supports a scene, if there is one."""
    return [method for method in methods if method.role == Role.TRUTH and method.unsupported(scene) is None][:1]


def project_on_sphere(trajectory: Trajectory) -> Array:
    """Return the points (n, 3) of a curve, in units of the sphere's radius at the start."""
    scene = trajectory.scene
    if scene.free:
        momentum = trajectory.w_WB_B @ scene.body.inertia  # symmetric
        return np.asarray(momentum @ np.linalg.eigh(scene.body.inertia)[1] / np.linalg.norm(momentum[0]))
    # The traced axis points to the centre of mass; without one it is the third body axis.
    com_B = np.asarray(scene.potential.com_B) if isinstance(scene.potential, UniformGravity) else np.zeros(3)
    length = float(np.linalg.norm(com_B))
    return np.asarray(trajectory.R_WB @ (com_B / length if length else np.eye(3)[2]))
