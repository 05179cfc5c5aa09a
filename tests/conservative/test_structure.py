"""Symmetry, symplecticity and conservation of every method that declares its structure, measured."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import conservative as cv
from conservative.attitude import hat
from conservative.registry import list_families

from ..sampling import sampled
from .one_body import free, in_field, top

SCENES = [free((1, 1.4, 2), (0.3, -2.0, 1.0)), in_field("spring"), top((1, 1, 0.6), (0.3, -1.2, 2.0), 2.0)]
STEPS = 0.4, 0.8, 1.2  # s; 0.9 to 2.7 rad, so that a defect of a method of order 16 is above round-off
VISIBLE = {  # settings that show their defects
    "convected": ("tol=1e-13",),
    "taylor": ("order=8", "order=16", "tolerance=1e-3"),
    "textbook": (*cv.Textbook.method_info.variants, "scheme=generalized_alpha,rho=1.0"),
}
PART = {"no_squish": 0.5, "rattle": 0.25, "lie_variational": 0.25}  # of STEPS: differences of longer steps have larger errors
ROUND_OFF, DEFECT = 4e-12, 1e-10  # measured: at most 6e-13, no_squish:order=10 2e-12, and at least 3e-10


METHODS = [
    pytest.param(method, id=method.name)
    for name, family in list_families().items()
    for method in map(family.configure, VISIBLE.get(name, family.method_info.variants))
    if method.method_info.structure(method) is not None
]


def take_step(method, scene, dt, R_WB, L_B):
    """Return attitude and body momentum after one step from another state of the scene's body."""
    start = cv.Scene(scene.name, scene.body, R_WB, scene.body.inverse @ L_B, dt, scene.potential)
    end = method.solve(start, cv.Grid(dt, 1, 1))
    if end.failure is not None:
        raise end.failure
    return end.R_WB[-1], scene.body.inertia @ end.w_WB_B[-1]


def measure_asymmetry(method, scene, dt):
    """Return the distance from the start after a step, a reversal of the rates, and another step.

    A step of -dt is a step of dt between two reversals of the rates, for a potential that does not depend on time.
    """
    L_B = scene.body.inertia @ scene.w_WB_B0
    R_WB, end = take_step(method, scene, dt, scene.R_WB0, L_B)
    R_WB, end = take_step(method, scene, dt, R_WB, -end)
    return max(np.abs(R_WB - scene.R_WB0).max(), np.abs(end + L_B).max())


def symplectic_form(L):
    """Return the canonical form of T*SO(3) for changes (rotation in body axes, change of L): -d(L . Q' dQ)."""
    return np.block([[-hat(L), np.eye(3)], [-np.eye(3), np.zeros((3, 3))]])


def differentiate(method, scene, dt):
    """Return body momenta at both ends of a step, and its derivative (6, 6) for changes as above, by differences of order 6."""
    R0, L0 = scene.R_WB0, scene.body.inertia @ scene.w_WB_B0
    R1, L1 = take_step(method, scene, dt, R0, L0)

    def image(change):
        R, L = take_step(method, scene, dt, R0 @ Rotation.from_rotvec(change[:3]).as_matrix(), L0 + change[3:])
        return np.concatenate([Rotation.from_matrix(R1.T @ R).as_rotvec(), L - L1])

    weights, width = ((1, 45 / 60), (2, -9 / 60), (3, 1 / 60)), 0.005
    changes = [sum(c * (image(k * x) - image(-k * x)) for k, c in weights) / width for x in width * np.eye(6)]
    return L0, L1, np.column_stack(changes)


def measure_symplecticity(method, scene, dt):
    """Return the largest entry of D' W(L1) D - W(L0), with the derivative D of a step."""
    L0, L1, D = differentiate(method, scene, dt)
    return np.abs(D.T @ symplectic_form(L1) @ D - symplectic_form(L0)).max()


def largest(measure, method):
    """Return the largest measurement in any supported scene, at any of the steps that the method can take."""
    found = []
    for scene in (scene for scene in SCENES if method.unsupported(scene) is None):
        for dt in STEPS:
            try:
                found.append(measure(method, scene, PART.get(method.family, 1.0) * dt))
            except (cv.BadInput, cv.NotConverged, cv.Diverged):  # too long
                continue
    return max(found)


FIRST = list({method.values[0].family: method.values[0] for method in reversed(METHODS)}.values())
SAMPLE = sampled(METHODS, len(FIRST) + 1, FIRST)
"""The first setting of each method, and one other."""


@pytest.mark.parametrize("method", SAMPLE)
def test_symmetry(method):
    asymmetry = largest(measure_asymmetry, method)
    assert asymmetry < ROUND_OFF if method.method_info.structure(method).symmetric else asymmetry > DEFECT


@pytest.mark.parametrize("method", SAMPLE)
def test_symplecticity(method):
    defect = largest(measure_symplecticity, method)
    assert defect < ROUND_OFF if method.method_info.structure(method).symplectic else defect > DEFECT


@pytest.mark.parametrize(
    ("method", "poisson"),
    [*((cv.MoserVeselov(order), True) for order in (2, 4, 6, 8, 10, "exact")), (cv.Reduced(), False), (cv.Gauss(2), False)],
    ids=lambda value: getattr(value, "name", ""),
)
def test_the_momentum_of_a_free_body_moves_by_a_poisson_map_or_almost(method, poisson):
    """D hat(L0) D' = hat(L1), with the derivative D of the momentum alone: weaker than a symplectic map of (Q, L)."""
    L0, L1, D = differentiate(method, SCENES[0], 0.4)
    defect = np.abs(D[3:, 3:] @ hat(L0) @ D[3:, 3:].T - hat(L1)).max()
    assert defect < ROUND_OFF if poisson else defect > DEFECT  # measured: at most 1.1e-12, or at least 1.1e-7


@pytest.mark.parametrize("method", SAMPLE)
def test_conservation(method):
    """`conserves` lists what 100 steps of 0.7 rad conserve, and no less."""
    drifts = {}
    for scene in (scene for scene in SCENES if method.unsupported(scene) is None):
        run = method.run(scene, dt=0.3, t_end=30.0)
        for invariant in scene.invariants:
            drifts[invariant.name] = max(drifts.get(invariant.name, 0.0), np.abs(run.drift(invariant)).max())
    kept = {name for name, drift in drifts.items() if drift < 1e-12}  # measured: at most 3e-15, or at least 4e-11
    assert kept == method.conserves & set(drifts)
