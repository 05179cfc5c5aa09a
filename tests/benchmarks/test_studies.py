import math
from contextlib import nullcontext
from functools import cache

import numpy as np
import pytest

import conservative as cv
from conservative.benchmarks.measures import errors
from conservative.benchmarks.measures.measure import Measure, Value
from conservative.benchmarks.measures.measurement import Measurement
from conservative.benchmarks.studies import studies
from conservative.benchmarks.studies.paper import APPROXIMATE, PROPERTIES, agreement_row
from conservative.benchmarks.studies.selection import Missing
from conservative.benchmarks.studies.speed import MEASURES
from conservative.benchmarks.studies.study import Study, remember_truths
from conservative.grid import grid_for
from conservative.method import Role
from conservative.outcome import OutcomeKind
from conservative.references.truth import Disagreement, Truth, reference
from conservative.registry import method

from ..sampling import sampled
from .generic_study import SCENE, Broken, truth

ABSENT = Missing("mujoco", error=cv.MissingEngine("MuJoCo", "mujoco"))
KINDS = {
    "unsupported": OutcomeKind.UNSUPPORTED,
    "refuses": OutcomeKind.UNSUPPORTED,
    "raises": OutcomeKind.CRASHED,
    "diverges": OutcomeKind.DIVERGED,
    "gives nan": OutcomeKind.DIVERGED,
    "is skewed": OutcomeKind.NOT_CONSERVED,
    "gives nothing": OutcomeKind.INVALID,
}
BROKEN = tuple(Broken(how) for how in KINDS)
CROSSING = [name for name in studies.STUDIES if name not in ("motion", "throughput", "long_time")]
"""Studies of any scene with a row for every method, also for failures. The others have their own tests."""


def rows(name, *methods, quick=True, **settings):
    study = Study(name, (SCENE,), methods, quick=quick, truth=truth, **settings)
    return list(studies.rows(study))


@cache
def table(name):
    """Rows of a study of three orders, by (method, dt, measure)."""
    measured = rows(name, cv.Reduced(), cv.Convected(tol=1e-12), method("scipy:rtol=1e-9"))
    assert all(row.study == name and row.scene == "generic" for row in measured)
    return {(row.method, row.dt, Value(row.measure, row.value, row.quantity).key): row for row in measured}


def test_paper_measures_every_method_at_three_steps():
    measured = table("paper")
    assert {dt for name, dt, _ in measured if name == "reduced"} == {0.02, 0.01, 0.005}
    assert {dt for name, dt, _ in measured if name.startswith("scipy")} == {0.02}  # its accuracy does not depend on dt
    for dt in (0.02, 0.01, 0.005):
        assert {measure for name, at, measure in measured if (name, at) == ("reduced", dt)} > {
            value.key for value in errors.blanks(SCENE)
        }
        assert measured["reduced", dt, "energy drift max"].value < 1e-14  # measured 8e-16
        assert measured["reduced", dt, "steps"].value == round(2.0 / dt)
    assert all(row.outcome.ok for row in measured.values())


def test_paper_has_the_agreement_of_the_reference_solutions():
    row = table("paper")["", 0.02, "truth agreement"]
    assert (row.value, row.role, row.label) == (2e-15, Role.TRUTH, "exact and other")
    assert row.detail == ""
    rough = agreement_row(Study("paper", (SCENE,), (method("reduced"),)), SCENE, 0.02, Truth(None, 1e-9, ("a", "b"), 1.0, True))
    assert rough.detail == APPROXIMATE


def test_paper_errors_are_those_of_the_run():
    grid = grid_for(SCENE, 0.01)
    run = cv.integrate(SCENE, dt=0.01)
    direct = {value.key: value.value for value in errors.measure_errors(run, truth(SCENE, grid).trajectory)}
    assert table("paper")["reduced", 0.01, "attitude error final"].value == direct["attitude error final"]


def test_convergence_finds_the_order_of_each_method():
    measured = {(name, measure): row for (name, dt, measure), row in table("convergence").items() if math.isnan(dt)}
    for name in ("reduced", "convected:tol=1e-12"):
        for measure in ("observed order", "observed order rates"):
            assert abs(measured[name, measure].value - 2) < 0.02  # measured 0.001 and 0.004
            assert measured[name, f"{measure} stderr"].value < 0.05  # measured 0.024: the slope still moves
            assert "points" in measured[name, measure].detail
    without = measured["scipy:rtol=1e-09", "observed order"]
    assert without.outcome.kind is OutcomeKind.UNSUPPORTED
    assert math.isnan(without.value)


def test_speed_has_times_per_step_and_per_second():
    measured = table("speed")
    for name in {name for name, _, _ in measured}:
        times = {measure: row for (who, _, measure), row in measured.items() if who == name}
        assert set(times) == {measure.text for measure in MEASURES}
        assert times["time per simulated second"].value > 0
        assert times["time per step"].value <= times["time per step median"].value
    row = measured["reduced", 0.02, "time per simulated second"]
    assert row.value == pytest.approx(measured["reduced", 0.02, "time per step"].value / 0.02, rel=1e-9)
    assert "rounds" in row.detail


def test_work_precision_pairs_error_and_time():
    measured = table("work_precision")
    points = {(name, dt) for name, dt, _ in measured}
    assert len({point for point in points if point[0] == "reduced"}) == 4  # every second of eight steps
    assert len({point for point in points if point[0].startswith("scipy")}) >= 4
    timed = set()
    for point in points:
        error, time = (measured[*point, measure] for measure in ("attitude error final", "time per simulated second"))
        assert (error.outcome, error.series) == (time.outcome, time.series)
        if error.outcome.ok:
            assert error.value > 0
            assert time.value > 0
            timed.add(error.series)
        else:  # this machine, today, would take too long for a fine step
            assert error.outcome.kind is OutcomeKind.SKIPPED
            assert math.isnan(error.value)
            assert math.isnan(time.value)
    assert timed == {row.series for row in measured.values()} == {"reduced", "convected:tol=1e-12", "scipy"}


@pytest.mark.parametrize("name", sampled(CROSSING, 5))
def test_nothing_is_dropped_silently(name):
    measured = rows(name, *BROKEN, ABSENT, skip_missing=True)
    for broken in BROKEN:
        mine = [row for row in measured if row.method == broken.name]
        assert mine
        assert KINDS[broken.how] in {row.outcome.kind for row in mine}
        assert {row.outcome.kind for row in mine} <= {KINDS[broken.how], OutcomeKind.NO_ORDER}
        assert all(math.isnan(row.value) for row in mine if row.measure not in PROPERTIES)
    missing = [row for row in measured if row.method == "mujoco"]
    assert missing
    assert all(row.outcome.kind is OutcomeKind.MISSING and math.isnan(row.value) for row in missing)


@pytest.mark.parametrize("name", [*CROSSING, "motion"])
def test_a_missing_engine_is_an_error_unless_skipped(name):
    with pytest.raises(cv.MissingEngine, match="pip install mujoco"):
        list(studies.findings(Study(name, (SCENE,), (ABSENT,), truth=truth)))


@pytest.mark.parametrize("name", sampled([*CROSSING, "motion"], 4))
def test_a_scene_without_a_reference_solution_loses_no_other_scene(name):
    asked = []

    def find(scene, grid):
        asked.append(scene.name)
        if scene.name == "unknown":
            raise Disagreement(scene.name, ("one", "other"), 0.5, 1e-8)
        return truth(scene, grid)

    scenes, shares = (SCENE.rename("first"), SCENE.rename("unknown"), SCENE), []
    study = Study(name, scenes, (cv.Reduced(),), quick=True, truth=find)
    found = [*studies.findings(study, lambda share, _: shares.append(share))]
    kinds = {(row.scene, row.outcome.kind) for row in found if isinstance(row, Measurement)}
    assert shares == sorted(shares)
    assert {scene for scene, kind in kinds if kind in (OutcomeKind.OK, OutcomeKind.NO_ORDER)} >= {"first", SCENE.name}
    assert (("unknown", OutcomeKind.SKIPPED) in kinds) == ("unknown" in asked)


@pytest.mark.parametrize("name", ["paper", "motion"])
def test_a_function_that_fails_in_a_last_step_beyond_its_record_loses_no_scene(name):
    def torque(t):
        if t > 0.205:
            raise ValueError("beyond the record")
        return 0.1, 0.0, 0.2

    start = np.eye(3), (0.1, 1.0, 0.2), 0.205
    recorded = cv.Scene("recorded", cv.RigidBody((1, 2, 2.5)), *start, torque=cv.Torque(torque), dt=0.02)
    find = remember_truths(lambda scene, grid: (truth if scene is SCENE else reference)(scene, grid))
    study = Study(name, (recorded, SCENE), (cv.Reduced(),), quick=True, truth=find)
    rows = [*studies.rows(study)]
    reasons = [row.outcome.reason for row in rows if row.scene == "recorded" and not row.outcome.ok]
    assert reasons
    assert all("beyond the record" in reason for reason in reasons)
    assert any(row.scene == SCENE.name and row.outcome.ok for row in rows)


@pytest.mark.parametrize("name", ["paper", "motion"])
def test_drifts_are_measured_without_a_reference_solution(name):
    def find(scene, grid):
        raise Disagreement(scene.name, ("one", "other"), 0.5, 1e-8)

    measured = {}
    for source in (find, truth):
        found = [*studies.rows(Study(name, (SCENE,), (cv.Reduced(),), quick=True, truth=source))]
        measured[source] = {(row.dt, row.measure, row.quantity): row for row in found if row.method}
    assert measured[find].keys() == measured[truth].keys()
    errors_of_samples = {value.measure for value in errors.blanks(SCENE) if not value.quantity} - {Measure.ORTHONORMALITY}
    errors_of_samples.add(Measure.TURNS_OVER_TRUE)
    for key, row in measured[find].items():
        if key[1] in errors_of_samples:
            assert row.outcome.kind is OutcomeKind.SKIPPED
            assert "one and other differ by 0.5 rad" in row.outcome.reason
        else:
            assert row.value == measured[truth][key].value
            assert row.outcome.ok


def test_a_disagreement_is_found_once():
    asked = []

    def find(scene, grid):
        asked.append(grid.t[-1])
        if scene is SCENE and grid.t[-1] > 1:
            raise Disagreement(scene.name, ("one", "other"), 0.5, 1e-8)
        return truth(scene, grid)

    remembered, other = remember_truths(find), SCENE.rename("other")
    for scene, end in ((SCENE, 2.0), (SCENE, 2.0), (SCENE, 3.0), (SCENE, 0.5), (other, 2.0)):
        with pytest.raises(Disagreement) if scene is SCENE and end > 1 else nullcontext():
            assert remembered(scene, cv.Grid(end / 10, 10)).trajectory.ok
    assert asked == [2.0, 0.5, 2.0]


def test_a_bug_of_our_own_is_not_an_outcome():
    class Ours(Broken):
        role = Role.OURS

    with pytest.raises(RuntimeError, match="planted"):
        rows("paper", Ours("raises"))


@pytest.mark.parametrize("name", sampled([*CROSSING, "motion"], 4))
def test_progress_counts_up_to_the_whole(name):
    seen = []
    study = Study(name, (SCENE, SCENE.rename("again")), (cv.Reduced(),), quick=True, truth=truth)
    list(studies.findings(study, lambda *call: seen.append(call)))
    shares, texts = zip(*seen, strict=True)
    assert list(shares) == sorted(shares)
    assert max(shares) < 1
    assert all("generic" in text or "again" in text for text in texts)


@pytest.mark.parametrize(
    ("change", "argument"),
    [
        ({"name": "sped"}, "name"),
        ({"scenes": ()}, "scenes"),
        ({"methods": ()}, "methods"),
        ({"scenes": (SCENE, SCENE)}, "scenes"),
    ],
)
def test_bad_studies(change, argument):
    good = {"name": "speed", "scenes": (SCENE,), "methods": (cv.Reduced(),)}
    with pytest.raises(cv.BadInput) as caught:
        studies.findings(Study(**{**good, **change}))
    assert caught.value.argument == argument
