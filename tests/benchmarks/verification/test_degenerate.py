"""Degenerate recordings, right and wrong: at rest, constant, of two rows, of balls, at times and rates of any size."""

import warnings

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import conservative as cv
from conservative.benchmarks.verification.recordings.table import Options, read
from conservative.benchmarks.verification.recordings.verdict import verify_recording
from conservative.references.exact.method import free_body

T = np.linspace(0, 6, 121)
RATES = 0.4, 3.0, 0.5
KINDS = {"both": ("q_", "w_"), "attitudes": ("q_",), "rates": ("w_",)}


def scene(J=(2e-3, 6e-3, 7e-3), w=RATES, **loads):
    return cv.Scene("box", cv.RigidBody(list(J)), np.eye(3), list(w), 6.0, **loads)


MOVING, RESTING, ONE_AXIS = scene(), scene(w=(0, 0, 0)), scene(w=(0, 3.0, 0))
BALL, SYMMETRIC = scene((3e-3,) * 3), scene((2e-3, 2e-3, 3e-3))


def columns(of, t=T, kind="both", at=None):
    """The exact motion at times of the file; `at` are the times of the motion, if they are others."""
    R, w = free_body(of.body, of.R_WB0, of.w_WB_B0, t - t[0] if at is None else at)
    q = Rotation.from_matrix(R).as_quat(scalar_first=True)
    motion = {f"q_{part}": q[:, i] for i, part in enumerate("wxyz")} | {
        f"w_{axis} (rad/s)": w[:, i] for i, axis in enumerate("xyz")
    }
    return {"t (s)": t} | {name: x for name, x in motion.items() if name.startswith(KINDS[kind])}


def changed(table, change):
    return {name: x if name[0] == "t" else change(name, x.copy()) for name, x in table.items()}


def frozen(table):
    return changed(table, lambda name, x: 0 * x + x[0])


def zero(table):
    return changed(table, lambda name, x: 0 * x + (name == "q_w"))


def one_row_moved(table):
    def move(name, x):
        x[60] += 0.01
        return x

    return changed(table, move)


def verify(folder, of, table, from_row=True):
    path = folder / "run.csv"
    rows = np.column_stack([*table.values()]).tolist()
    path.write_text("\n".join([",".join(table), *(",".join(map(repr, row)) for row in rows)]) + "\n")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return verify_recording(of, read(path, Options()), from_row)


def assert_verdict(found, verdict, mistake=""):
    assert found.verdict == verdict, found.sentence
    assert found.findings[0].mistake == mistake, found.sentence


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("of", "note"),
    [(MOVING, ""), (RESTING, "at rest"), (ONE_AXIS, "constant"), (BALL, "constant"), (SYMMETRIC, "Two moments are equal")],
    ids=["any", "at rest", "one axis", "ball", "symmetric"],
)
def test_a_right_motion_is_right_and_the_notes_say_what_it_does_not_show(of, note, kind, tmp_path):
    found = verify(tmp_path, of, columns(of, kind=kind))
    assert_verdict(found, "right")
    assert any(note in sentence for sentence in found.notes) if note else not found.notes


FROZEN = {"both": "frozen motion", "attitudes": "frozen motion", "rates": "no gyroscopic term"}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("of", [MOVING, SYMMETRIC, BALL, ONE_AXIS], ids=["any", "symmetric", "ball", "one axis"])
def test_a_body_that_should_move_is_frozen(of, kind, tmp_path):
    """The rates of a ball, or of a body that turns about a principal axis, are constant: they cannot show it."""
    found = verify(tmp_path, of, frozen(columns(of, kind=kind)))
    hidden = kind == "rates" and of in (BALL, ONE_AXIS)
    named = [cause.key for cause in found.findings[0].causes]  # constant rates go on, or are frozen too
    assert (found.verdict, FROZEN[kind] in named) == (("right", False) if hidden else ("wrong", True)), found.sentence
    assert not hidden or "do not show" in found.notes[0]


def test_a_file_of_zeros_does_not_show_the_motion_of_a_scene(tmp_path):
    for kind in ("both", "rates"):
        for of in (MOVING, BALL):
            table = zero(columns(of, kind=kind))
            found = verify(tmp_path, of, table)
            assert_verdict(found, "undecided")
            assert "--start scene" in found.findings[0].detail
    assert verify(tmp_path, of, table, from_row=False).verdict == "wrong"


def test_a_sensor_at_rest_shows_noise_and_no_motion(tmp_path):
    random = np.random.default_rng(3)
    table = changed(columns(RESTING, kind="rates"), lambda name, x: x + 0.01 * random.normal(size=len(x)))
    for of in (RESTING, MOVING):
        assert_verdict(verify(tmp_path, of, table), "undecided")


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("make", [columns, lambda of, kind: zero(columns(of, kind=kind))], ids=["motion", "zeros"])
def test_one_row_is_off(make, kind, tmp_path):
    found = verify(tmp_path, MOVING, one_row_moved(make(MOVING, kind=kind)))
    if make is not columns and kind == "attitudes":  # two mistakes: without rates, the attitudes should move
        assert_verdict(found, "wrong")
        return
    assert_verdict(found, "wrong", "single rows")
    assert found.findings[0].causes[0].numbers["row"] == 61


@pytest.mark.parametrize("kind", KINDS)
def test_every_fifth_row_is_off(kind, tmp_path):
    random = np.random.default_rng(7)
    table = changed(
        columns(MOVING, kind=kind), lambda name, x: x + 0.01 * random.normal(size=len(x)) * (np.arange(len(x)) % 5 == 2)
    )
    found = verify(tmp_path, MOVING, table)
    assert_verdict(found, "wrong", "some rows")
    assert (found.findings[0].causes[0].numbers["first"], found.findings[0].causes[0].numbers["period"]) == (3, 5)


@pytest.mark.parametrize("rows", [2, 3])
def test_few_rows(rows, tmp_path, unnamed):
    table = columns(MOVING, T[:rows])
    assert_verdict(verify(tmp_path, MOVING, table), "right")
    assert_verdict(verify(tmp_path, MOVING, frozen(table)), "wrong")


@pytest.mark.parametrize("t", [T[:1], 0 * T + 3, -T, T * 1e-200], ids=["one row", "constant", "backwards", "tiny"])
def test_times_that_are_no_times_are_refused(t, tmp_path):
    with pytest.raises(cv.BadInput, match="run"):
        verify(tmp_path, MOVING, columns(MOVING, t, at=T[: len(t)]))


OF_ANY_SIZE = {
    "rows 1e-12 s apart": (MOVING, 1e-12 * np.arange(121)),
    "an offset of 1e9 s": (MOVING, T + 1.7e9),
    "an offset of 1e12 s": (MOVING, T + 1e12),
    "rates of 1e-12 rad/s": (scene(w=1e-12 * np.array(RATES)), T),
    "rates of 1e-12 rad/s over 1e12 s": (scene(w=1e-12 * np.array(RATES)), 1e12 * T),
    "rates of 1e9 rad/s": (scene(w=1e9 * np.array(RATES)), 1e-9 * T),
    "1e8 rad from row to row": (scene(w=1e9 * np.array(RATES)), T),
}


@pytest.mark.parametrize("name", OF_ANY_SIZE)
def test_times_and_rates_of_any_size(name, tmp_path, unnamed):
    of, t = OF_ANY_SIZE[name]
    table = columns(of, t)
    assert_verdict(verify(tmp_path, of, table), "right")
    grown = changed(table, lambda name, x: x * np.linspace(1, 2, len(x)) if name[0] == "w" else x)
    assert_verdict(verify(tmp_path, of, grown), "undecided" if "from row to row" in name else "wrong")


def test_a_turn_of_any_angle_from_row_to_row_ends_the_search(tmp_path):
    """It did not end before: trial motions were integrated over 1e11 rad."""
    found = verify(tmp_path, MOVING, columns(MOVING, 1e10 * T, at=T))
    assert_verdict(found, "undecided")
    assert "the unit of the time" in found.findings[0].detail
    named = verify(tmp_path, MOVING, columns(MOVING, 1e9 * T, at=T))
    assert_verdict(named, "wrong", "time in ns")


def test_rows_after_the_end_of_a_torque_are_refused_with_the_option_that_leaves_them_out(tmp_path):
    table = cv.Torque((T[:61], 1e-3 * np.sin(T[:61])[:, None] * np.ones(3)))
    driven = MOVING.rename("driven", t_end=3.0, torque=table)
    with pytest.raises(cv.BadInput, match="--until"):
        verify(tmp_path, driven, columns(MOVING))


def test_a_scene_may_end_before_its_file(tmp_path):
    assert_verdict(verify(tmp_path, MOVING.rename("short", t_end=1.0), columns(MOVING)), "right")


def test_nothing_is_a_reading_of_a_body_that_stands_still(tmp_path):
    """In gravity, from another attitude than the equilibrium: both orders of a quaternion were named."""
    hanging = scene(w=(0, 0, 0), potential=cv.UniformGravity(1.0, [0, 0, -0.1]))
    tilted = scene(w=(0, 0, 0)).rename("tilted", R_WB0=Rotation.from_rotvec([0.5, 0, 0]).as_matrix())
    found = verify(tmp_path, hanging, columns(tilted))
    assert found.verdict == "wrong"
    assert {key for cause in found.findings[0].causes for key in cause.keys} <= {"frozen motion", "without the field"}
