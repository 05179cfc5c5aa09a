"""Names, orders, invariants, limits and refusals of our methods."""

import math

import numpy as np
import pytest

import conservative as cv
from conservative.features import Feature
from conservative.invariants import JACOBI_INTEGRAL
from conservative.methods import moser_veselov
from conservative.methods.coefficients import explicit

from .one_body import free, in_field, top

TOP, FREE, GRAVITY, SPRUNG = top(), free((1, 1.4, 2), (0.3, -1.9, 0.3)), in_field("gravity"), in_field("spring")
AXIS = "momentum along the field's axis"


@pytest.mark.parametrize(
    ("method", "name", "order", "conserves"),
    [
        (cv.Reduced(), "reduced", 2, {"energy", "momentum", "vertical momentum", AXIS}),
        (cv.Reduced(4, frame="auto"), "reduced:order=4,frame=auto", 4, {"momentum", "vertical momentum", AXIS}),
        (cv.Convected(), "convected", 2, {"energy", "momentum", "vertical momentum", AXIS}),
        (cv.Gauss(3), "gauss:stages=3", 6, {"energy", "momentum", "vertical momentum", "axial momentum"}),
        (cv.MoserVeselov(4), "moser_veselov:order=4", 4, {"energy", "momentum", "axial momentum"}),
        (cv.MoserVeselov(), "moser_veselov", None, {"energy", "momentum", "axial momentum"}),
        (cv.Lame(), "lame", None, {"energy", "vertical momentum", "axial momentum"}),
        (cv.Projected(), "projected", 8, {"energy", JACOBI_INTEGRAL, "vertical momentum", AXIS}),
        (cv.Splitting(), "splitting", 6, {"momentum", "vertical momentum", AXIS, "axial momentum"}),
        (cv.NoSquish(4), "no_squish:order=4", 4, {"momentum", "vertical momentum", AXIS}),
        (cv.LieVariational(), "lie_variational", 2, {"momentum", "vertical momentum", AXIS, "axial momentum"}),
        (
            *(cv.Taylor(9), "taylor:order=9", 9),
            {"energy", JACOBI_INTEGRAL, "momentum", "vertical momentum", AXIS, "axial momentum"},
        ),
        (
            cv.Substepped("reduced:order=4"),
            "substepped:method=reduced:order=4",
            4,
            {"energy", "momentum", "vertical momentum", AXIS},
        ),
    ],
    ids=lambda value: getattr(value, "name", ""),
)
def test_order_and_invariants(method, name, order, conserves):
    kept = {invariant for invariant in method.conserves if not invariant.endswith(" balance")}
    assert (method.name, method.order, kept, method.role) == (name, order, conserves, cv.Role.OURS)
    balances = {invariant.removesuffix(" balance") for invariant in method.conserves - kept}
    assert balances == (kept if Feature.TORQUE in method.supports else set())


@pytest.mark.parametrize(
    ("make", "argument"),
    [
        (lambda: cv.Gauss(11), "stages"),
        (lambda: cv.Gauss(True), "stages"),
        (lambda: cv.Gauss(2, "own"), "frame"),
        (lambda: cv.Reduced(12), "order"),
        (lambda: cv.Reduced(True), "order"),
        (lambda: cv.registry.method("reduced:composition=suzuki_5"), "method reduced"),
        (lambda: cv.registry.method("reduced:tol=1e-9"), "method reduced"),
        (lambda: cv.registry.method("rattle:composition=suzuki_5"), "method rattle"),
        (lambda: cv.Reduced(frame="own"), "frame"),
        (lambda: cv.Splitting(5), "order"),
        (lambda: cv.MoserVeselov(True), "order"),
        (lambda: cv.MoserVeselov(12), "order"),
        (lambda: cv.MoserVeselov("best"), "order"),
        (lambda: cv.Splitting([4]), "order"),
        (lambda: cv.Taylor(3), "order"),
        (lambda: cv.Taylor(19), "order"),
        (lambda: cv.Taylor(True), "order"),
        (lambda: cv.Substepped(most=0), "most"),
        (lambda: cv.Substepped("substepped"), "method"),
        (lambda: cv.Substepped("lame"), "method"),
        (lambda: cv.Substepped(3), "method"),
        (lambda: cv.Substepped("reducd"), "method"),
        (lambda: cv.Substepped("reduced:order=3"), "order"),
    ],
)
def test_wrong_settings_are_refused(make, argument):
    with pytest.raises(cv.BadInput) as raised:
        make()
    assert raised.value.argument == argument


def test_limits_are_included():
    assert [cv.Gauss(stages).stages for stages in (1, 10)] == [1, 10]
    assert [cv.Taylor(order).order for order in (4, 18)] == [4, 18]
    assert cv.Substepped(most=1).most == 1
    heun = explicit.HEUN_3
    assert heun.c == pytest.approx((0, 1 / 3, 2 / 3))
    factors, columns, starts = heun.packed
    assert (factors.tolist(), columns.tolist()) == ([1 / 3, 2 / 3, 1 / 4, 3 / 4], [0, 1, 0, 2])
    assert starts.tolist() == [0, 0, 1, 2, 4]


def test_methods_give_the_reason_for_unsupported_scenes():
    said = [method.unsupported(scene) for method, scene in ((cv.Gauss(), SPRUNG), (cv.Lame(), SPRUNG), (cv.Lame(), GRAVITY))]
    assert all(each.startswith("it does not support a spring; ") for each in said[:2])
    assert said[2] == "body and field symmetric about one axis"
    assert cv.MoserVeselov().unsupported(GRAVITY).startswith("it does not support uniform gravity; ")
    assert cv.Projected().unsupported(FREE) == "it is for bodies in a field"
    assert cv.Splitting().unsupported(FREE).startswith("it is for bodies in a field")
    assert cv.Reduced(frame="non_spinning").unsupported(FREE).startswith("frame non_spinning needs")
    assert cv.Substepped("gauss").unsupported(SPRUNG) == said[0]
    assert "a potential of Python functions" in cv.Taylor().unsupported(in_field("function"))
    for method, scene in (
        (cv.Gauss(), FREE),
        (cv.Lame(), TOP),
        (cv.MoserVeselov(), FREE),
        (cv.Projected(), SPRUNG),
        (cv.Reduced(), FREE),
        (cv.Taylor(), FREE),
        (cv.Taylor(), TOP),
        (cv.Taylor(), SPRUNG),
    ):
        assert method.unsupported(scene) is None


def test_the_longest_step_of_moser_veselov():
    speed = np.linalg.norm(FREE.w_WB_B0)
    assert cv.MoserVeselov(4).longest_step(FREE) == pytest.approx(0.99 * 1.5 / speed)
    nu = abs(moser_veselov.find_polhode(FREE)[1].nu)
    limit = min(6.0 / speed, 2 * math.acos(0.2) / nu)
    assert moser_veselov.step_limit(FREE, exact=True) == pytest.approx(limit)
    assert moser_veselov.step_limit(free((1, 1.4, 2), (0, 0, 0)), exact=True) == math.inf
    spindle = free((1, 1, 0.05), (0.1, 0.1, 1.0))  # its polhode turns at (1 - 0.05) rad/s: half a period is the limit
    assert moser_veselov.step_limit(spindle, exact=True) == pytest.approx(2 * math.acos(0.2) / 0.95)
    ball = free((1, 1, 1), (0, 0, 2))
    assert moser_veselov.step_limit(ball, exact=True) == pytest.approx(3.0)
    for exact, order in ((True, "exact"), (False, 4)):
        bound = moser_veselov.step_limit(FREE, exact)
        with pytest.raises(cv.BadInput, match="dt"):
            cv.MoserVeselov(order).prepare(FREE, cv.Grid(bound, 1, 1))
    assert cv.MoserVeselov().prepare(FREE, cv.Grid(0.999 * moser_veselov.step_limit(FREE, exact=True), 1, 1))
