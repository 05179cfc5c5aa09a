"""Differences between two versions: conclusions and noise."""

from dataclasses import replace

import numpy as np
import pytest

import conservative as cv
from conservative.benchmarks.measures.change import Range
from conservative.benchmarks.measures.convergence_order import Order
from conservative.benchmarks.studies.case import Case
from conservative.benchmarks.studies.line import LinePoint
from conservative.benchmarks.versions.changes import Aspect, find_changes, list_transitions
from conservative.benchmarks.versions.engine import (
    ERRORS,
    NO_STEP,
    TIME_FACTOR,
    fit_orders,
    plan_versions,
    ratio,
    require_several,
)
from conservative.benchmarks.versions.times import ratio_of
from conservative.outcome import Outcome, OutcomeKind

from .made_up_engine import BAD, GOOD, TIMES, history, near
from .made_up_engine import versions as made_up


def changes(was, now, was_times=TIMES, now_times=TIMES):
    found = find_changes(was, now, was_times, now_times)
    return {(change.row.measure, change.row.quantity): change.lost for change in found}


# ------------------------------------------------------------------------------------------------------- what is a conclusion


def test_a_lost_order_and_a_lost_invariant_are_losses():
    result = changes(GOOD, BAD)
    assert result == {
        (Aspect.ATTITUDE_ORDER, ""): True,
        (Aspect.RATES_ORDER, ""): True,
        (Aspect.DRIFT, "energy"): True,
        (Aspect.ERROR, ""): True,  # the attitude is lost
    }


def test_a_gain_is_a_change_and_no_loss():
    result = changes(BAD, GOOD)
    assert set(result) == set(changes(GOOD, BAD))
    assert not any(result.values())


@pytest.mark.parametrize("kind", [kind for kind in OutcomeKind if kind is not OutcomeKind.OK])
def test_a_run_that_no_longer_reaches_its_end_is_a_loss(kind):
    failed = replace(GOOD, outcome=Outcome(kind, "why"))
    assert changes(GOOD, failed) == {(Aspect.OUTCOME, ""): True}
    assert changes(failed, GOOD) == {(Aspect.OUTCOME, ""): False}
    assert changes(failed, replace(failed, outcome=Outcome(kind, "another reason"))) == {}


def test_energy_that_is_lost_instead_of_gained_is_a_change():
    gained = replace(BAD, drifts={"energy": near(0.22)})
    assert changes(gained, replace(gained, drifts={"energy": near(-0.17)})) == {(Aspect.DRIFT, "energy"): False}


def test_a_small_drift_instead_of_a_large_one_is_a_change():
    before, after = (replace(GOOD, drifts={"energy": near(drift)}) for drift in (3e-3, 1e-6))
    assert changes(before, after) == {(Aspect.DRIFT, "energy"): False}
    assert changes(after, before) == {(Aspect.DRIFT, "energy"): True}


# ------------------------------------------------------------------------------------------------------------- what is noise

ALIKE = {
    "the same": GOOD,
    "orders within half": replace(GOOD, attitude_order=Order(1.6, 0.01), rates_order=Order(2.4, 0.01)),
    "an order that is badly known": replace(GOOD, attitude_order=Order(1.2, 0.4)),
    "drifts of one class": replace(GOOD, drifts={"energy": near(9e-11), "momentum": near(9e-2)}),
    "drifts close to the edge of a class": replace(GOOD, drifts={"energy": near(5e-13), "momentum": near(9e-3)}),
    "errors within a factor": replace(GOOD, error=near(6e-3)),
    "an error that differs as much by one step more": replace(GOOD, error=Range(3e-1, 4e-3, 4e-1)),
    "no order where the error is the same": replace(GOOD, rates_order=Order(reason="no descent")),
    "nothing known of a drift": replace(GOOD, drifts={"energy": Range.of([np.nan]), "momentum": near(9e-3)}),
}


@pytest.mark.parametrize("what", ALIKE)
def test_noise_changes_no_conclusion(what):
    assert changes(GOOD, ALIKE[what]) == {}
    assert changes(ALIKE[what], GOOD) == {}


def test_a_drift_across_the_edge_is_no_change_within_a_factor():
    before, after = (replace(GOOD, drifts={"energy": near(drift)}) for drift in (0.6e-10, 1.4e-10))
    assert changes(before, after) == {}
    after = replace(after, drifts={"energy": near(4e-10)})
    assert changes(before, after) == {(Aspect.DRIFT, "energy"): True}


def test_errors_of_round_off_are_alike_however_far_apart():
    before, after = (replace(GOOD, error=near(error)) for error in (1e-14, 9e-10))
    assert changes(before, after) == {}
    assert changes(before, replace(GOOD, error=near(2e-9))) == {(Aspect.ERROR, ""): False}


# -------------------------------------------------------------------------------------------------------------------- times


def test_a_time_differs_if_all_repeats_do():
    slow = tuple(2 * time for time in TIMES)
    assert changes(GOOD, GOOD, TIMES, slow) == {(Aspect.TIME, ""): False}
    assert changes(GOOD, GOOD, slow, TIMES) == {(Aspect.TIME, ""): False}
    noisy = (1e-6, 5e-6, 2e-6)
    assert changes(GOOD, GOOD, noisy, slow) == {}
    assert changes(GOOD, GOOD, TIMES, tuple(1.1 * time for time in TIMES)) == {}
    assert changes(GOOD, GOOD, (), slow) == {}
    assert changes(GOOD, GOOD, (np.nan,) * 3, slow) == {}


def test_a_ratio_has_the_statistic_of_the_gate():
    was, now = (1.0, 2.0, 4.0), (4.0, 2.0, 3.0)
    assert ratio(was, now) == ratio_of(list(zip(was, now, strict=True)))
    assert not ratio((1.0, 2.0), (1.2, 3.0)).direction(TIME_FACTOR)
    assert ratio((1.0, 2.0), (1.4, 3.0)).direction(TIME_FACTOR)


# ------------------------------------------------------------------------------------------------------------------- orders


def points(order, steps, reached):
    done, skipped = Outcome(OutcomeKind.OK), Outcome(OutcomeKind.SKIPPED)
    cases = [Case("track", cv.scenes.brick_flip(), cv.Reduced(), cv.Grid(0.1 / 2**k, 1)) for k in range(steps)]
    sizes = [1 / 2 ** (k * order) if k < reached else np.nan for k in range(steps)]
    return tuple(
        LinePoint(case, done if size > 0 else skipped, dict(zip(ERRORS, (0.1 * size, 0.2 * size), strict=True)))
        for case, size in zip(cases, sizes, strict=True)
    )


def test_orders_are_fitted_to_the_steps_that_all_versions_have():
    bent = tuple(replace(point, errors={key: max(e, 1e-3) for key, e in point.errors.items()}) for point in points(2, 8, 8))
    slow, fast = replace(GOOD, points=points(2, 8, 4)), replace(GOOD, points=bent)
    result = fit_orders([slow, fast])
    assert [each.attitude_order.slope for each in result] == pytest.approx([2, 2])
    assert fit_orders([fast])[0].attitude_order.slope != pytest.approx(2, abs=1e-6)


def test_a_version_with_too_few_steps_does_not_limit_the_others():
    result = fit_orders([replace(GOOD, points=points(2, 8, 2)), replace(GOOD, points=points(2, 8, 8))])
    assert np.isnan(result[0].attitude_order.slope)
    assert result[0].attitude_order.reason
    assert result[1].rates_order.slope == pytest.approx(2)


def test_a_method_without_a_step_has_no_order_but_a_reason():
    (result,) = fit_orders([replace(GOOD, points=())])
    assert result.attitude_order.reason == NO_STEP
    failed = replace(GOOD, outcome=Outcome(OutcomeKind.DIVERGED))
    assert fit_orders([failed]) == (failed,)


# ---------------------------------------------------------------------------------------------------------------- histories


def test_changes_go_from_version_to_version():
    result = list_transitions(history(BAD, GOOD, GOOD, BAD))
    assert [bool(each.changes) for each in result] == [True, False, True]
    assert [each.now.version for each in result if each.lost] == ["4.0"]


def test_times_belong_to_their_versions():
    slow = tuple(3 * time for time in TIMES)
    result = list_transitions(history(GOOD, GOOD, GOOD, times=(TIMES, TIMES, slow)))
    assert [[change.row.measure for change in step.changes] for step in result] == [[], [Aspect.TIME]]


@pytest.mark.parametrize(("versions", "message"), [(["1.0"], "two or more"), ([], "none"), (["1.0", "2.0", "1.0"], "twice")])
def test_fewer_than_two_versions_are_refused(versions, message):
    with pytest.raises(cv.BadInput, match=message):
        require_several(versions)
    with pytest.raises(cv.BadInput, match=message):
        plan_versions(made_up(*versions), (), ())
