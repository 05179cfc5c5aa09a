"""Tables with more corners than steps, ends of runs, and samples, searches and stores beside break points."""

from __future__ import annotations

import warnings
from dataclasses import replace
from itertools import pairwise, product
from zlib import crc32

import numpy as np
import pytest

import conservative as cv
from conservative import registry
from conservative.errors import NotConserved
from conservative.grid import count_steps, grid_for
from conservative.integration.one import warn_of_steps
from conservative.invariants import sizes
from conservative.methods.between import grid_before
from conservative.methods.pieces import count_most_steps, list_pieces
from conservative.methods.search import begin

from ..independent import Case, angle_between, matrix_of, motion
from ..sampling import sampled

BASE = Case(
    (1.0, 2.0, 2.5),
    matrix_of(np.array((0.8, 0.3, -0.4, 0.5))),
    np.array((0.7, -0.9, 1.2)),
    1.0,
    ("gravity", 3.0, (0.1, 0.2, 0.3)),
)
DT, STEPS = 0.1, 10
ENDS = DT * np.arange(1, STEPS)
LARGEST = {"reduced": 0.02, "projected": 1e-9, "scipy": 1e-9}
"""Largest error, rad and rad/s. Measured: reduced 0.0094, projected 6e-12, scipy 2e-11; 0.24 rad with the fault."""


def draw_times(kind: str, n: int) -> np.ndarray:
    """Return the times of a table with about n corners in ten steps."""
    random = np.random.default_rng((n, len(kind)))
    low, high = {"first step": (0, DT), "last step": (1 - DT, 1), "middle": (0.55, 0.97)}.get(kind, (0, 1))
    inner = random.uniform(low, high, n)
    if kind == "at steps":  # every step ends at a corner and has others
        inner = np.concatenate([inner, ENDS])
    if kind == "jumps":
        inner = np.repeat(inner[: n // 2], 2)
    if kind == "each step":
        inner = (DT * np.arange(STEPS)[:, None] + random.uniform(0, DT, (STEPS, -(-n // STEPS)))).ravel()
    return np.sort(np.concatenate([[0.0], inner, [1.0]]))


def made(kind: str, n: int) -> Case:
    times = draw_times(kind, n)
    return replace(BASE, torque=(times, np.random.default_rng(n).normal(size=(len(times), 3))))


KINDS = ("anywhere", "first step", "last step", "middle", "at steps", "jumps", "each step")


@pytest.mark.filterwarnings("ignore::conservative.LoadNotResolved")
@pytest.mark.parametrize(("method", "kind", "n"), sampled(product(LARGEST, KINDS, (8, 20, 60)), 8))
def test_samples_of_divided_steps_are_right(method, kind, n):
    case = made(kind, n)
    scene, at = case.scene(), np.random.default_rng(n).uniform(0, 1, 9)
    t = np.unique(np.concatenate([DT * np.arange(STEPS + 1), at]))
    R_WB, w_WB_B = motion(case, t)

    def check(found):
        i = np.argmin(np.abs(t - found.t[:, None]), axis=1)
        assert np.abs(t[i] - found.t).max() < 1e-15
        assert angle_between(found.R_WB, R_WB[i]).max() < LARGEST[method]
        assert np.abs(found.w_WB_B - w_WB_B[i]).max() < LARGEST[method]
        for balance in found.scene.invariants if method != "scipy" else ():
            assert sizes(found.drift(balance)).max() < 1e-13  # measured: 2e-15

    check(cv.integrate(scene, DT, method))
    check(cv.integrate(scene, DT, method, sample_every=3))
    check(cv.integrate(scene, DT, method, t_eval=np.sort(at)))
    many = cv.integrate_many(scene, w_WB_B0=[case.w0, 1.1 * case.w0], dt=DT, method=method, threads=1)
    check(many[0])


@pytest.mark.filterwarnings("ignore::conservative.LoadNotResolved")
def test_errors_have_the_order_of_the_method_beside_many_corners():
    case = made("anywhere", 20)
    right = motion(case, DT * np.arange(STEPS + 1))[0]
    errors = [
        angle_between(cv.integrate(case.scene(), DT / k, "reduced", sample_every=k).R_WB, right).max() for k in (1, 2, 4, 8, 16)
    ]
    assert errors[-1] < errors[0] / 16**2 * 4  # measured: 1/82; steps are not equal where they are divided
    assert all(finer < coarser for coarser, finer in pairwise(errors))


@pytest.mark.filterwarnings("ignore::conservative.LoadNotResolved")
@pytest.mark.slow  # the crossing has them, too
@pytest.mark.parametrize("part", ["rotor", "factor", "frame"])
def test_tables_of_other_parts_have_more_corners_than_steps(part):
    times = np.unique(draw_times("anywhere", 40))
    values = np.random.default_rng(3).normal(size=(len(times), 3))
    case = {
        "rotor": replace(BASE, rotor=(times, 0.3 * values)),
        "factor": replace(BASE, damping=np.diag((0.5, 0.3, 0.7)), factor=(times, values[:, 0] ** 2)),
        "frame": replace(BASE, torque=(times, values), frame="world"),
    }[part]
    found = cv.integrate(case.scene(), DT, "projected")
    assert angle_between(found.R_WB, motion(case, found.t)[0]).max() < 1e-9  # measured: 3e-11


@pytest.mark.parametrize("seed", range(40))
def test_pieces_cover_the_run_once_and_fill_every_sample_once(seed):
    random = np.random.default_rng(seed)
    n, dt = int(random.integers(1, 30)), float(random.uniform(0.01, 2))
    grid = cv.Grid(dt, n, int(random.integers(1, n + 1)))
    breaks = random.uniform(0, n * dt * 1.2, random.integers(0, 80))
    breaks = np.unique(np.concatenate([breaks, dt * random.integers(1, n + 2, random.integers(0, 5))]))
    pieces, rows = list_pieces(grid, breaks), []
    assert pieces[0].t == 0
    for piece, after in pairwise(pieces):
        assert piece.t + piece.n * piece.h == pytest.approx(after.t, abs=1e-12)
    for piece in pieces:
        end = piece.t + piece.n * piece.h
        assert piece.window[0] <= piece.t * (1 + 1e-14)
        assert end <= piece.window[1] * (1 + 1e-14)
        if len(piece.rows):
            rows += piece.rows
            assert grid.t[piece.rows[-1]] == pytest.approx(end, abs=1e-12)
        if len(piece.rows) > 1:  # the kernel writes the start, too
            assert piece.whole
            assert grid.t[piece.rows[0] - 1] == pytest.approx(piece.t, abs=1e-12)
            assert piece.n == len(piece.rows) * grid.every
    assert rows == list(range(1, grid.n_samples))
    assert sum(piece.n for piece in pieces if piece.whole) <= n


def test_a_break_is_moved_to_a_step_by_round_off_only():
    """It divides a step if it is a ten-millionth of its time away, and not if it is at it: 0.3 / 0.1 is 3 but for round-off."""
    for share, divided in ((1e-7, True), (-1e-7, True), (0.0, False)):
        pieces = list_pieces(cv.Grid(0.1, 10), np.array([0.3 * (1 + share)]))
        assert (not all(piece.whole for piece in pieces)) is divided


def test_a_table_of_thousands_of_rows_is_integrated_at_any_step():
    random, n = np.random.default_rng(4), 600
    times, walk = np.linspace(0, 1.2, n), np.cumsum(random.normal(size=(n, 3)), axis=0)
    case = replace(BASE, t_end=1.2, torque=(times, walk / np.abs(walk).max()))
    scene, right = case.scene(), None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", cv.LoadNotResolved)
        for dt in (0.6, 0.4, 0.02, 0.0017):
            found = cv.integrate(scene, dt, "projected" if dt == 0.6 else "reduced", sample_every=10**6)
            steps = found.counters.stages // (12 if dt == 0.6 else 1)
            assert steps <= count_most_steps(grid_for(scene, dt), scene.breaks)
            at_end = cv.integrate(scene, dt, "reduced", t_eval=[1.2])
            right = found.R_WB[1:] if right is None else right
            assert angle_between(at_end.R_WB, right).max() < 1e-5  # measured: 4e-6, of steps of 0.002 s


@pytest.mark.parametrize(
    ("table", "dt", "longest"),
    [
        ("noise", 0.02, 0.01),
        ("noise", 0.01, None),
        ("noise", 0.003, None),
        ("line", 0.5, None),
        ("wave", 0.05, None),
        ("wave", 1.0, 0.5),
    ],
)
def test_a_warning_says_that_steps_do_not_resolve_a_table_that_they_do_not_resolve(table, dt, longest):
    times = np.linspace(0, 4, 401 if table == "noise" else 1001)
    values = {
        "noise": np.random.default_rng(0).normal(size=(len(times), 3)),
        "line": np.outer(times, (1.0, 2.0, 3.0)),
        "wave": np.stack([np.sin(3 * times), np.cos(2 * times), 0 * times], axis=1),
    }[table]
    parts = {
        "torque": replace(BASE, torque=(times, values)),
        "rotor": replace(BASE, rotor=(times, values)),
        "factor": replace(BASE, damping=np.eye(3), factor=(times, 9 + values[:, 0])),
    }
    for case in parts.values():
        scene = replace(case, t_end=4.0).scene()
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            warn_of_steps(scene, cv.Reduced(), grid_for(scene, dt))
        assert [type(each.message) for each in said] == [cv.LoadNotResolved] * (longest is not None)
        warn_of_steps(scene, registry.method("scipy"), cv.Grid(dt, round(4 / dt)))  # chooses its steps; a warning is an error
        for each in said:
            assert each.message.step <= longest * (1 + 1e-12)
            assert each.message.dt == dt


@pytest.mark.parametrize(
    ("of_scene", "t_end", "warns"), [(100.0, 1.0, False), (100.0, 100.0, True), (1.0, 20.0, True), (1.0, 4.0, False)]
)
def test_a_warning_is_about_the_time_of_the_run_and_not_of_the_scene(of_scene, t_end, warns):
    """The torque is fast from 5 s on."""
    torque = cv.Torque(lambda t: (np.sin(200 * t) if t > 5 else 0.0, 0, 0))
    scene = cv.Scene("late", cv.RigidBody((3, 2, 1)), np.eye(3), (1, 0.5, 0.3), of_scene, None, torque=torque)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        warn_of_steps(scene, cv.Reduced(), grid_for(scene, 0.1, t_end))
    assert [each.category for each in said] == [cv.LoadNotResolved] * warns
    for each in said:
        assert 5 < each.message.interval[1] <= t_end
        assert 0 < each.message.step < 0.01  # measured: 0.0015 and 0.0049


@pytest.mark.slow
def test_adaptive_steps_see_a_pulse_after_the_end_of_the_scene():
    torque = cv.Torque(lambda t: (np.exp(-(((t - 1.5) / 0.01) ** 2)), 0, 0))
    scene = cv.Scene("late", cv.RigidBody((3, 2, 1)), np.eye(3), (0.01, 0.005, 0.003), 0.2, None, torque=torque)
    rates = [cv.integrate(each, 0.2, "scipy", t_end=1.6).w_WB_B[-1] for each in (scene, scene.rename("late", t_end=1.6))]
    assert np.abs(rates[0] - rates[1]).max() < 1e-12  # measured: 0; 0.006 rad/s with steps of the scene's own duration


def test_adaptive_runs_have_one_sample_after_the_start_and_no_corner_where_a_sample_is_near_a_break():
    near = 0.5 + 1e-7
    torque = cv.Torque(lambda t: (np.cos(t) + 0.5 * (t > near), 0.2, 0.1), breaks=(near,))
    scene = cv.Scene("near", cv.RigidBody((3, 2, 1)), np.eye(3), (1, 0.5, 0.3), 1.0, None, torque=torque)
    for n in (1, 64):
        found = cv.integrate(scene, 1.0 / n, cv.Projected(1e-8))
        assert len(found) == n + 1
        assert found.control.rough is None


def test_local_errors_of_an_adaptive_run_add_up():
    torque = cv.Torque(lambda t: (np.sin(3 * t), 0.2, np.cos(2 * t)))
    scene = cv.Scene("wave", cv.RigidBody((1, 2, 2.5)), np.eye(3), (0.1, 1.5, 2.0), 8.0, None, torque=torque)
    half, whole = (cv.integrate(scene, end, cv.Projected(1e-6), end).control.local for end in (8.0, 16.0))
    assert whole > 1.5 * half  # measured 2.1 times; the largest local error grows by 3 %


def test_a_warning_of_noise_names_no_step():
    torque = cv.Torque(lambda t: (crc32(repr(t).encode()) / 2**32, 0, 0))
    scene = cv.Scene("noise", cv.RigidBody((3, 2, 1)), np.eye(3), (1, 0.5, 0.3), 2.0, None, torque=torque)
    with pytest.warns(cv.LoadNotResolved) as said:
        warn_of_steps(scene, cv.Reduced(), grid_for(scene, 0.1))
    assert [each.message.step for each in said] == [0.0]


def test_runs_of_one_and_of_many_bodies_warn():
    scene = made("anywhere", 20).scene()
    with pytest.warns(cv.LoadNotResolved, match="20 corners"):
        cv.integrate(scene, DT)
    with pytest.warns(cv.LoadNotResolved, match="20 corners"):
        cv.integrate_many(scene, dt=DT)


@pytest.mark.filterwarnings("ignore::conservative.LoadNotResolved")
@pytest.mark.parametrize("method", ["reduced", "projected"])
def test_a_store_of_a_table_with_many_corners_is_resumed_to_the_same(method, tmp_path):
    pytest.importorskip("zarr")
    case = made("middle", 9)
    options = {"w_WB_B0": [case.w0, 1.1 * case.w0], "dt": DT, "method": method, "threads": 1}
    place = tmp_path / "many.zarr"
    stored = cv.integrate_many(case.scene(), **options, path=place)
    for i, w0 in enumerate(options["w_WB_B0"]):
        right = motion(replace(case, w0=w0), stored.t)[0]
        assert angle_between(np.asarray(stored[i].R_WB), right).max() < LARGEST[method]
    before = {path: path.read_bytes() for path in place.rglob("*") if path.is_file()}
    for part in place.glob("R_WB/c/**/*"):
        if part.is_file():
            part.unlink()
    cv.integrate_many(case.scene(), **options, path=place, resume=True)
    assert {path: path.read_bytes() for path in place.rglob("*") if path.is_file()} == before


@pytest.mark.parametrize("method", [cv.Reduced(), cv.Reduced(4)], ids=lambda each: each.name)
def test_a_body_that_a_load_spins_up_conserves_its_balances_to_the_round_off_of_what_was_supplied(method):
    t = np.linspace(0, 10, 30)
    values = 300 * (1 + 0.3 * np.random.default_rng(0).normal(size=(30, 3)))
    scene = replace(BASE, torque=(t, values), t_end=10.0).scene()
    grid = grid_for(scene, DT)
    found = method.solve(scene, grid)
    assert found.ok  # before, balances were off by 3e-12 and 1e-11 of the scales at the start, and 7e-13 was allowed
    assert np.abs(found.energy).max() > 1000 * scene.energy_scale  # measured: 5,990
    wrong = replace(found, w_WB_B=found.w_WB_B * (1 + 1e-11 * np.arange(len(found)) / len(found))[:, None])
    assert isinstance(method.check(scene, grid, wrong).failure, NotConserved)


# Ends of runs


@pytest.mark.parametrize(
    ("dt", "t_end", "steps"),
    [
        (1e-9, 1.0, 10**9),
        (1e-10, 1.0, 10**10),
        (0.1, 0.30000000001, 4),
        (0.1, 0.3, 3),  # 2.9999999999999996
        (0.1, 0.7, 7),  # 6.999999999999999
        (0.1, 1.1, 11),  # 11.000000000000002
        (0.01, 6.0, 600),
        (1 / 3, 1.0, 3),
        (2.0, 1.0, 1),
    ],
)
def test_a_run_ends_with_the_first_step_at_or_after_its_end(dt, t_end, steps):
    assert count_steps(t_end, dt) == steps
    assert grid_before(cv.scenes.brick_flip(), cv.Reduced(), dt, np.array([t_end])).n_steps == max(1, int(t_end / dt + 1e-6))
    if dt <= t_end:
        assert grid_for(cv.scenes.brick_flip(), dt, t_end, 10**12).n_steps == steps


def test_the_last_sample_is_at_or_after_the_end():
    brick, end = cv.scenes.brick_flip(), 0.30000000001
    assert cv.integrate(brick, 0.1, t_end=end).t[-1] == pytest.approx(0.4)
    assert cv.integrate(brick, dt=0.1, t_end=end, error=1e-3).t[-1] == pytest.approx(0.4)
    assert cv.integrate(brick, t_end=end, error=1e-3).t[-1] == pytest.approx(end, rel=1e-15)


@pytest.mark.parametrize("t_end", [1.0, 0.77])
def test_a_recording_that_ends_with_the_run_is_integrated_at_the_default_step(t_end):
    """The default step follows from the rate, and does not divide the duration."""

    def recorded(t):
        assert 0 <= t <= t_end
        return 0.3 * np.cos(4 * t) * np.array((1.0, 0.5, -0.4))

    scene = replace(BASE, w0=np.array((1.7, -2.9, 7.2))).scene().rename("recorded", t_end=t_end)
    assert t_end / scene.dt % 1 > 0.05
    made = cv.Scene("made", scene.body, scene.R_WB0, scene.w_WB_B0, t_end, scene.potential, torque=cv.Torque(recorded))
    assert scene.dt * 0.99 < made.dt < scene.dt
    kept = scene.rename("recorded", torque=cv.Torque(recorded))  # with the step of a scene without functions
    for each in (made, kept):
        assert cv.integrate(each, method="reduced").t[-1] == pytest.approx(t_end, rel=1e-15)
    assert cv.integrate_many(kept, w_WB_B0=[kept.w_WB_B0] * 2, method="projected", threads=1).ok.all()
    assert cv.integrate(scene, method="reduced").t[-1] > t_end * 1.0001  # steps of scenes without functions do not change


# Samples between steps, and searches


@pytest.mark.filterwarnings("ignore::conservative.LoadNotResolved")
@pytest.mark.parametrize("method", sampled(["projected", "scipy"], 1))
def test_samples_between_steps_see_each_jump_at_its_time(method):
    """Jumps between the step and the sample, at both, and just beside them; a jump of damping as well."""
    times = np.array([0.0, 0.1, 0.1, 0.23, 0.23, 0.231, 0.231, 0.35, 0.35, 0.36, 0.72, 0.72, 1.0])
    values = 8 * np.random.default_rng(7).normal(size=(len(times), 3))
    factor = ([0.0, 0.28, 0.28, 0.5, 0.5, 1.0], [0.0, 0.0, 3.0, 1.0, 0.0, 2.0])
    case = replace(BASE, torque=(times, values), damping=np.diag((0.5, 0.3, 0.7)), factor=factor)
    t = np.array(
        [0.05, 0.1, 0.1 + 1e-9, 0.2, 0.225, 0.23, 0.2305, 0.231, 0.2311, 0.28, 0.3, 0.355, 0.4, 0.5, 0.72, 0.7200001, 1.0]
    )
    found = cv.integrate(case.scene(), 0.1, method, t_eval=t)
    R_WB, w_WB_B = motion(case, t)
    assert angle_between(found.R_WB, R_WB).max() < 2e-9  # measured: 2e-10 and 1e-12
    assert np.abs(found.w_WB_B - w_WB_B).max() < 5e-9  # measured: 6e-10 and 2e-12
    beside = cv.integrate(case.scene(), 0.1, method, t_eval=[0.23, 1.0])  # what others share does not change a sample
    assert np.array_equal(beside.R_WB[0], found.R_WB[5])


@pytest.mark.parametrize("seed", sampled(range(3), 1))
def test_a_search_beside_break_points_compares_runs_that_differ(seed):
    """Steps are so short that runs at one and two times the step differ between all break points, or the estimate is 0."""
    random = np.random.default_rng(seed)
    times = np.concatenate([[0.0], np.sort(random.uniform(0, 1, 30)), [1.0]])
    case = replace(BASE, torque=(times, 5 * random.normal(size=(32, 3))))
    scene = case.scene()
    for method in (cv.Reduced(), cv.Projected()):
        first = begin(method, scene, 1e-2, 1.0)
        once, twice = (
            list_pieces(cv.Grid(1.0 / n, n), scene.breaks) for n in (int(1 / first.dt) // 2 * 2, int(1 / first.dt) // 2)
        )
        assert max(each.h for each in once) < max(each.h for each in twice)
        shortest = [min(piece.h for piece in pieces if not piece.whole) for pieces in (once, twice)]
        assert shortest[0] < 0.9 * shortest[1]
    for error in (1e-2, 1e-6):
        found = cv.integrate(scene, error=error, t_eval=5)
        off = angle_between(found.R_WB, motion(case, found.t)[0]).max()
        assert off < error
        assert found.choice.estimate > 0.1 * off
