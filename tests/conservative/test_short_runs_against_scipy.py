"""Every method over a few steps of generic motions, against DOP853: in a second as plain Python, too."""

import numpy as np
import pytest

import conservative as cv

from .exact_motion import BODY, FIELDS, TURN, distance, free, in_field, top

FREE = [
    free((1, 1.4, 2), (2, 0.1, 0.2)),
    free((1, 1.4, 2), (-0.1, 0.2, -2)),
    free((2, 1.4, 1), (2, 0.1, -0.2)),
    free((1, 1.4, 2), (0.3, -1.9, 0.3)),
    free((1.4, 2, 1), (-0.4, 0.5, 0.7), np.eye(3)),
]
SYMMETRIC = [free((1, 1, 2), (1, 0.3, 0.5)), free((2, 1, 1), (1, 0.3, 0.5)), free((1, 1, 1), (1, 0.3, 0.5), np.eye(3))]
REST = free((1, 1.4, 2), (0, 0, 0))
TOPS = [top(), top((1, 1, 1.7), (0.1, 0.2, 3.0)), top((1, 1, 0.3), (0.4, 0.2, 0)), top(weight=1e-4), top(turn=np.eye(3))]
IN_FIELDS = [in_field(name) for name in FIELDS]


@pytest.mark.parametrize("scene", [*FREE, *SYMMETRIC, REST, TOPS[1], TOPS[2], IN_FIELDS[0]], ids=lambda scene: scene.name)
@pytest.mark.parametrize("stages", [3, 5, 8, 9])
def test_gauss(scene, stages):
    first = distance(scene, cv.Gauss(stages), 0.1, 3)
    if stages > 3:
        assert first < 1e-12  # measured 1.2e-13
    else:
        assert distance(scene, cv.Gauss(stages), 0.05, 6) < max(first / 40, 2e-12)  # 2^6 = 64


@pytest.mark.parametrize("scene", [*FREE, *SYMMETRIC, REST], ids=lambda scene: scene.name)
def test_moser_veselov(scene):
    assert distance(scene, cv.MoserVeselov(), 0.3, 40) < 1e-12
    assert distance(scene, cv.MoserVeselov(10), 0.1, 3) < 1e-12  # measured 1e-13
    for order, factor in ((2, 3.5), (4, 13), (6, 50), (8, 180)):
        coarse, fine = distance(scene, cv.MoserVeselov(order), 0.2, 2), distance(scene, cv.MoserVeselov(order), 0.1, 4)
        assert fine < max(coarse / factor, 1e-12)


@pytest.mark.parametrize("scene", [*TOPS, *SYMMETRIC], ids=lambda scene: scene.name)
def test_lame(scene):
    for dt, n in ((0.1, 3), (0.7, 2), (1e-3, 2)):
        assert distance(scene, cv.Lame(), dt, n) < 3e-12


@pytest.mark.parametrize("scene", [*IN_FIELDS, TOPS[1], TOPS[2]], ids=lambda scene: scene.name)
def test_projected(scene):
    assert distance(scene, cv.Projected(), 0.1, 3) < 3e-11  # measured 1.3e-11, of the spinning top
    coarse, fine = distance(scene, cv.Projected(), 0.4, 2), distance(scene, cv.Projected(), 0.2, 4)
    assert fine < max(coarse / 100, 1e-12)  # 2^8 = 256


@pytest.mark.parametrize("scene", [*IN_FIELDS, *FREE, *SYMMETRIC, REST, *TOPS[:3]], ids=lambda scene: scene.name)
def test_taylor(scene):
    if cv.Taylor().unsupported(scene) is None:
        assert distance(scene, cv.Taylor(), 0.1, 3) < 3e-11
        coarse, fine = distance(scene, cv.Taylor(6), 0.2, 3), distance(scene, cv.Taylor(6), 0.1, 6)
        assert fine < max(coarse / 25, 1e-12)  # 2^6 = 64


@pytest.mark.parametrize("scene", [*IN_FIELDS, *FREE, *SYMMETRIC, REST, *TOPS[:3]], ids=lambda scene: scene.name)
def test_reduced_takes_the_steps_of_the_papers_equations(scene):
    """The two share no line of code: three unknowns here, eighteen there."""
    runs = [method.prepare(scene, cv.Grid(0.1, 9, 1))() for method in (cv.Reduced(), cv.Convected(1e-13))]
    np.testing.assert_allclose(runs[0].R_WB, runs[1].R_WB, rtol=0, atol=1e-12)  # measured 7e-15
    np.testing.assert_allclose(runs[0].w_WB_B, runs[1].w_WB_B, rtol=0, atol=1e-11)
    coarse, fine = distance(scene, cv.Convected(), 0.1, 3), distance(scene, cv.Convected(), 0.05, 6)
    assert fine < max(coarse / 3.4, 1e-12)


@pytest.mark.parametrize("scene", [*IN_FIELDS, FREE[0], SYMMETRIC[0], TOPS[1]], ids=lambda scene: scene.name)
@pytest.mark.parametrize("frame", ["body", "auto"])
def test_compositions_have_their_order(scene, frame):
    for order, factor in ((4, 13), (6, 40)):
        method = cv.Reduced(order, frame=frame)
        coarse, fine = distance(scene, method, 0.1, 3), distance(scene, method, 0.05, 6)
        assert fine < max(coarse / factor, 1e-12)


METHODS = [
    cv.Reduced(),
    cv.Reduced(4, frame="auto"),
    cv.Convected(),
    cv.Gauss(4),
    cv.Lame(),
    cv.MoserVeselov(),
    cv.MoserVeselov(6),
    cv.Projected(),
    cv.Taylor(),
]


@pytest.mark.parametrize("method", METHODS, ids=lambda method: method.name)
@pytest.mark.parametrize("scene", [FREE[0], SYMMETRIC[0], TOPS[1], *IN_FIELDS], ids=lambda scene: scene.name)
def test_samples_are_every_third_state_and_the_last(method, scene):
    if method.unsupported(scene):
        return
    every, third = (method.prepare(scene, cv.Grid(0.02, 41, each))() for each in (1, 3))
    chosen = [*range(0, 41, 3), 41]
    np.testing.assert_allclose(third.t, 0.02 * np.array(chosen), rtol=1e-14)
    np.testing.assert_array_equal(third.R_WB, every.R_WB[chosen])
    np.testing.assert_array_equal(third.w_WB_B, every.w_WB_B[chosen])
    assert third.counters == every.counters
    assert third.counters.steps == 41
    for invariant in scene.invariants:
        if method.name != "convected" and invariant.name in method.conserves:
            assert abs(every.drift(invariant)).max() < 4e-15, invariant.name  # measured 9e-16


@pytest.mark.parametrize(
    ("method", "scene", "stages", "iterations", "evaluations"),
    [
        (cv.Reduced(), FREE[0], 20, 50, None),
        (cv.Reduced(), IN_FIELDS[0], 20, 60, None),
        (cv.Reduced(6), FREE[0], 180, 540, None),
        (cv.Gauss(5), FREE[0], 100, 80, None),
        (cv.Projected(), IN_FIELDS[0], 240, 3, 240),
        (cv.Taylor(12), IN_FIELDS[0], 240, 20, 240),
        (cv.MoserVeselov(), FREE[0], 20, 0, None),
        (cv.Lame(), TOPS[1], 20, 0, None),
    ],
    ids=lambda value: getattr(value, "name", ""),
)
def test_work_is_counted(method, scene, stages, iterations, evaluations):
    counters = method.prepare(scene, cv.Grid(0.05, 20, 20))().counters
    assert (counters.steps, counters.evaluations) == (20, evaluations)
    assert counters.stages == stages
    assert 0.5 * iterations <= counters.iterations <= iterations


def test_bodies_with_products_of_inertia_are_generic():
    assert abs(BODY.inertia - np.diag(np.diag(BODY.inertia))).max() > 0.1
    assert abs(TURN - np.eye(3)).max() > 0.5
