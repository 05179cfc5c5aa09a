"""Rows that are left out, times that go on, and columns that forbid the verdict "right"."""

import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import conservative as cv
from conservative.benchmarks.verification.recordings.table import Options, read
from conservative.benchmarks.verification.recordings.verdict import verify_recording
from conservative.errors import BadInput
from conservative.references.exact.method import free_body

from .made import FREE, T, exact

R, W = exact(FREE)
Q = Rotation.from_matrix(R).as_quat(scalar_first=True)
RATES = {f"w_{axis} (rad/s)": W[:, i] for i, axis in enumerate("xyz")}
QUATERNION = {f"q_{part}": Q[:, i] for i, part in enumerate("wxyz")}
MOTION = {**QUATERNION, **RATES}


def verify(folder, table, scene=FREE, error=None, **options):
    """The verification of a table, whose numbers are written with 17 digits, nan as an empty field."""
    values = [np.asarray(column) for column in table.values()]
    rows = ["" if x != x else f"{x:.17g}" for row in zip(*values, strict=True) for x in row]
    lines = [",".join(rows[i : i + len(values)]) for i in range(0, len(rows), len(values))]
    (folder / "run.csv").write_text("\n".join([",".join(table), *lines]) + "\n")
    return verify_recording(scene, read(folder / "run.csv", Options(**options)), error=error)


def with_nan(rows):
    return {name: np.where(rows, np.nan, x) if name in QUATERNION else x for name, x in MOTION.items()}


def test_rows_without_numbers_are_gaps_but_not_at_the_end(tmp_path):
    found = verify(tmp_path, {"t": T} | with_nan((T > 2) & (T < 3)))
    assert found.verdict == "right"
    assert (found.details.compared, found.details.in_file) == (102, 121)
    assert verify(tmp_path, {"t": T} | with_nan(T > 5)).verdict == "undecided"  # a program that ends in nan


ROWS = np.arange(len(T))
TWICE = np.repeat(ROWS, np.where(ROWS % 7 == 3, 3, 1))
REPEATED = {
    "some rows": TWICE,
    "nearly all rows": np.repeat(ROWS, np.where(ROWS % 9 == 0, 1, 2)),
    "two loggers": np.stack([ROWS, np.maximum(ROWS - 4, 0)], axis=1).ravel(),
    "in blocks": np.concatenate([np.tile(block, 2) for block in np.split(ROWS[:-1], 6)]),
}


@pytest.mark.parametrize("name", REPEATED)
def test_the_same_row_twice_is_read_once(name, tmp_path):
    rows = REPEATED[name]
    found = verify(tmp_path, {"t": T[rows]} | {column: x[rows] for column, x in MOTION.items()})
    assert (found.verdict, found.details.description.left_out) == (
        "right",
        {"equal to another row, with its time": len(rows) - len(set(rows))},
    )


def in_order(rows, t=T):
    """The motion in another order of rows, each with its time."""
    return {"t": t[rows]} | {column: x[rows] for column, x in MOTION.items()}


def one_time(row, t):
    """The motion with one wrong time."""
    times = T.copy()
    times[row] = t
    return {"t": times} | MOTION


SWAPPED = np.array([*ROWS[:40], 41, 40, *ROWS[42:]])
FEW = {
    "a late row": (in_order(np.insert(np.delete(ROWS, 30), 34, 30)), "earlier than a row before", 1),
    "two rows swapped": (in_order(SWAPPED), "earlier than a row before", 1),
    "a time in the future": (one_time(50, 1e6), "later than the rows after", 1),
    "a first time in the future": (one_time(0, 1e6), "later than the rows after", 1),
    "an equal time": (one_time(50, T[49]), "with the time of another row, and other values", 1),
    "a clock set back after the start": (one_time(ROWS[:2], T[:2] + 50), "after or before the clock was set back", 2),
    "no numbers": ({"t": T} | with_nan(ROWS == 9), "without numbers", 1),
    "infinite": ({"t": T} | {name: np.where(ROWS % 7 == 2, np.inf, x) for name, x in MOTION.items()}, "without numbers", 17),
    "-9999": ({"t": T} | {name: np.where(ROWS % 7 == 2, -9999, x) for name, x in MOTION.items()}, "such as -9999", 17),
    "-9999 of one sensor": (
        {"t": T} | {name: np.where(ROWS % 7 == 2, -9999, x) if name in RATES else x for name, x in MOTION.items()},
        "such as -9999",
        17,
    ),
    "lost sight": (
        {"t": T} | {name: np.where(ROWS % 7 == 2, 0, x) if name in QUATERNION else x for name, x in MOTION.items()},
        "zeros",
        17,
    ),
}


@pytest.mark.parametrize("name", FEW)
def test_rows_without_a_motion_or_out_of_order_are_left_out_and_counted(name, tmp_path, unnamed):
    table, reason, count = FEW[name]
    found = verify(tmp_path, table)
    assert found.verdict == "right", found.sentence
    assert max(found.details.error) < 1e-12  # measured: 3e-14
    ((text, left_out),) = found.details.description.left_out.items()
    assert (reason in text, left_out) == (True, count)
    assert f"{count} row{'s' * (count > 1)} {text}" in found.details.lines[1]
    wrong = {column: x * (1 + 1e-3 * T) if column in RATES else x for column, x in table.items()}
    assert verify(tmp_path, wrong).verdict == "wrong"


MANY = {
    "equal times": {"t": np.floor(T / 0.1) * 0.1} | MOTION,
    "shuffled": in_order(np.random.default_rng(0).permutation(ROWS)),
    "backwards": in_order(ROWS[::-1]),
    "two loggers out of order": in_order(np.stack([ROWS[::2][:-1], ROWS[1::2]], axis=1)[:, ::-1].ravel()),
}


@pytest.mark.parametrize("name", MANY)
def test_many_rows_out_of_order_are_refused_with_the_first_one(name, tmp_path):
    with pytest.raises(BadInput, match="rows out of order, the first of them row"):
        verify(tmp_path, MANY[name])


def test_the_rows_of_the_longer_clock_are_compared_and_the_others_forbid_right(tmp_path, unnamed):
    """The clock was set back in the middle: times of the rows before and after it do not belong together."""
    for first, compared in ((40, 81), (81, 81)):
        t = np.where(first > ROWS, T + 100, T - T[first])
        found = verify(tmp_path, {"t": t} | MOTION)
        assert (found.verdict, found.details.compared) == ("undecided", compared)
        assert "The clock was set back" in found.findings[0].detail
        damped = {column: x * np.exp(-0.01 * T) if column in RATES else x for column, x in MOTION.items()}
        assert verify(tmp_path, {"t": t} | damped).verdict == "wrong"


@pytest.mark.parametrize("value", [np.nan, np.inf, -9999, 0], ids=str)
def test_an_end_without_numbers_is_undecided(value, tmp_path):
    table = {name: np.where(T > 5, value, x) if name in QUATERNION else x for name, x in MOTION.items()}
    assert verify(tmp_path, {"t": T} | table).verdict == "undecided"


def test_more_than_half_of_the_rows_left_out_are_in_the_reason(tmp_path):
    """A sensor of attitudes that is slower than the rates."""
    for every, told in ((4, True), (2, False)):
        found = verify(tmp_path, {"t": T} | with_nan(ROWS % every > 0))
        assert found.verdict == "right"
        assert ("rows are left out" in found.reason) is told


WRAPS = {"time (us)": (1e-6, 2.0**32), "time_ms": (1e-3, 2.0**16), "t": (1.0, 86_400.0), "time (s)": (1.0, 2.0**32 * 1e-6)}


@pytest.mark.parametrize("name", WRAPS)
def test_a_counter_that_begins_again_goes_on(name, tmp_path):
    unit, length = WRAPS[name]
    found = verify(tmp_path, {name: np.mod(T / unit + length - 3.02 / unit, length)} | MOTION)
    assert found.verdict == "right", found.sentence
    assert max(found.details.error) < 1e-7  # measured: 6e-9, by the round-off of times


def test_a_window_leaves_out_what_is_not_the_motion(tmp_path):
    """The hand before and after the throw: with its rows the recording is wrong, or cannot be read."""
    held = {name: np.where((T < 2) | (T > 5), 0.3, x) for name, x in RATES.items()}
    found = verify(tmp_path, {"time (ms)": 1e3 * T} | held, start_time=2.0, end_time=5.0)
    assert (found.verdict, found.details.compared, found.details.in_file) == ("right", 61, 121)
    spoiled = {name: np.where(T < 1, 1e300, x) for name, x in MOTION.items()}
    assert verify(tmp_path, {"t": T} | spoiled, start_time=1.0).verdict == "right"
    with pytest.raises(BadInput, match="0 rows, and 121 outside"):
        verify(tmp_path, {"t": T} | MOTION, start_time=7.0)


YAW, PITCH, ROLL = Rotation.from_matrix(R).as_euler("ZYX", degrees=True).T
AWAY = Rotation.from_matrix(R) * Rotation.from_rotvec(0.1 * T[:, None] * [0, 1, 0])
SEEN = {
    "combined is not ned": (
        {f"combined_quat_{p}": AWAY.as_quat(scalar_first=True)[:, i] for i, p in enumerate("wxyz")},
        "wrong",
    ),
    "heading": (
        dict(zip(["heading (deg)", "pitch (deg)", "bank (deg)"], AWAY.as_euler("ZYX", degrees=True).T, strict=True)),
        "wrong",
    ),
    "half of the angles": ({"heading (deg)": YAW, "pitch (deg)": PITCH}, "undecided"),
    "an unknown sequence": ({f"euler_{axis}": T for axis in "xyz"}, "undecided"),
    "a frame that moves": ({f"q_lvlh_{part}": Q[:, i] for i, part in enumerate("wxyz")}, "undecided"),
    "a part of a quaternion": ({"q_x": Q[:, 1], "q_y": Q[:, 2], "q_z": Q[:, 3]}, "undecided"),
    "a quaternion of any name": ({f"b{i}": Q[:, i] for i in range(4)}, "undecided"),
    "no attitude": ({"altitude": T, "quality": T, "gyro_temperature": T, "roll_command": T, "torque_x": T}, "right"),
}


@pytest.mark.parametrize("name", SEEN)
def test_what_looks_like_an_attitude_and_is_not_compared_forbids_right(name, tmp_path, unnamed):
    columns, expected = SEEN[name]
    found = verify(tmp_path, {"t": T} | columns | RATES)
    assert found.verdict == expected
    assert expected != "undecided" or all(column in found.findings[0].detail for column in columns)
    if expected == "undecided":
        chosen = f"time=t,w={':'.join(RATES)}"
        assert verify(tmp_path, {"t": T} | columns | RATES, columns=chosen).verdict == "right"


OTHERS = {
    "yaw, pitch, roll": {"yaw": YAW, "pitch": PITCH, "roll": ROLL},
    "euler of any sequence": dict(
        zip(("euler_x", "euler_y", "euler_z"), Rotation.from_matrix(R).as_euler("ZXZ").T, strict=True)
    ),
    "matrices": {f"R_{i + 1}{j + 1}": R[:, i, j] for i in range(3) for j in range(3)},
    "Rodrigues": {f"sigma_{i + 1}": Rotation.from_matrix(R).as_mrp()[:, i] for i in range(3)},
}


@pytest.mark.parametrize("name", OTHERS)
def test_a_second_attitude_is_compared_with_the_first_one(name, tmp_path):
    assert verify(tmp_path, {"t": T} | MOTION | OTHERS[name]).verdict == "right"
    other = {column: x + 0.01 * np.sin(T) for column, x in OTHERS[name].items()}
    found = verify(tmp_path, {"t": T} | MOTION | other)
    assert found.verdict == "undecided"
    assert all(column in found.findings[0].detail for column in other)


def test_the_order_that_fits_is_the_order_of_all_rows(tmp_path):
    """Of more than 4,000 rows, the others were read as wxyz up to version 0.3: a right file was wrong."""
    t = np.linspace(0, 6, 9001)
    R_WB, w = exact(FREE, t)
    q = Rotation.from_matrix(R_WB).as_quat()
    columns = {"t": t} | {f"q{i}": q[:, i] for i in range(4)} | {f"w_{axis} (rad/s)": w[:, i] for i, axis in enumerate("xyz")}
    found = verify(tmp_path, columns)
    assert (found.verdict, found.details.compared) == ("right", 9001)


def test_angles_of_a_top(tmp_path):
    """Precession, nutation, spin: zxz, in this order."""
    angles = dict(zip(("phi", "theta", "psi"), Rotation.from_matrix(R).as_euler("ZXZ").T, strict=True))
    assert verify(tmp_path, {"t": T} | angles | RATES, euler="zxz", units="rad").verdict == "right"
    turned = {name: angles[name] for name in ("psi", "theta", "phi")}
    assert verify(tmp_path, {"t": T} | turned | RATES, euler="zxz", units="rad").verdict == "right"


BRICK = cv.Scene("brick", cv.RigidBody([2e-3, 5e-3, 6e-3]), np.eye(3), [0.5, 4.0, -0.6], 10.0)
AT_200_HZ = np.arange(560) / 200
FLIGHT = slice(170, 400)  # rows


def hand(t, size, seed=1):
    """The motion of a hand: slow sines of three frequencies in each axis, rad/s."""
    random = np.random.default_rng(seed)
    waves = [random.normal(size=3) * np.sin(random.uniform(3, 18) * t[:, None] + random.normal(size=3)) for _ in range(3)]
    return size * sum(waves)


def flight(rows, after=lambda w, t: w, w=(0.5, 4.0, -0.6), body=BRICK.body):
    """The rates of the free body, changed by a mistake, in so many rows."""
    t = AT_200_HZ[:rows]
    return after(free_body(body, np.eye(3), np.array(w), t)[1], t[:, None])


def thrown(size=0.5, count=230, **of):
    """The hand, a flight, and the hand again."""
    before, after = hand(AT_200_HZ[:170], size), hand(AT_200_HZ[: 560 - 170 - count], size, 2)
    return np.vstack([before, flight(count, **of), after])


def stepped_euler(rows):
    w, J = [np.array([0.5, 4.0, -0.6])], BRICK.body.moments
    for _ in range(rows - 1):
        w.append(w[-1] + np.cross(J * w[-1], w[-1]) / J / 200)
    return np.array(w)


OTHER = cv.RigidBody([2.2e-3, 5e-3, 6e-3])
KICKED = np.vstack([flight(200), flight(360, w=(0.1, 3.0, 0.9))])
SHAKEN = np.random.default_rng(5).normal(size=(260, 3))
RECORDED = {
    "a throw": (thrown(), "right"),
    "a hand that holds still": (thrown(0.01), "undecided"),
    "two throws": (np.vstack([thrown()[:500], thrown(count=150)[140:400]]), "undecided"),
    "the file ends in the flight": (thrown()[:400], "undecided"),
    "a short flight": (thrown(count=72), "right"),
    "a flight about one axis": (thrown(w=(0, 0, 4.0)), "undecided"),
    "a burst of noise before and after": (
        np.vstack([flight(170) + SHAKEN[:170], flight(400)[170:], flight(560)[400:] + SHAKEN[:160]]),
        "wrong",
    ),
    "a bias before and after": (flight(560) + 0.4 * ((np.arange(560) < 170) | (np.arange(560) > 400))[:, None], "wrong"),
    "only a hand": (hand(AT_200_HZ, 1.0), "wrong"),
    "a throw of another body": (thrown(body=OTHER), "wrong"),
    "a damped flight": (thrown(after=lambda w, t: w * np.exp(-0.2 * t)), "wrong"),
    "a damped motion": (flight(560, after=lambda w, t: w * np.exp(-0.1 * t)), "wrong"),
    "a kick in the middle": (KICKED, "wrong"),
    "explicit Euler": (stepped_euler(560), "wrong"),
    "another body": (flight(560, body=OTHER), "wrong"),
    "asleep": (np.vstack([flight(400), np.zeros((160, 3))]), "wrong"),
    "halted": (np.vstack([flight(400), np.repeat(flight(400)[-1:], 160, axis=0)]), "wrong"),
    "a constant error from a row on": (flight(560) + 0.5 * (np.arange(560) >= 300)[:, None], "wrong"),
    "noise from a row on": (
        flight(560) + (np.arange(560) >= 300)[:, None] * np.random.default_rng(5).normal(size=(560, 3)),
        "wrong",
    ),
}


@pytest.mark.parametrize("name", RECORDED)
def test_a_throw_is_verified_by_its_flight_and_a_wrong_program_stays_wrong(name, tmp_path, unnamed, no_moments):
    """Without a search for mistakes, which names most of the wrong programs before a stretch of free motion is looked for."""
    w, expected = RECORDED[name]
    w = w + 0.01 * np.random.default_rng(3).normal(size=w.shape)
    table = {"time (s)": np.arange(len(w)) / 200} | {f"gyro_{axis} (rad/s)": w[:, i].round(5) for i, axis in enumerate("xyz")}
    found = verify(tmp_path, table, scene=BRICK)
    assert found.verdict == expected, found.sentence
    assert (found.details.stretch is None) is (expected == "wrong")
    if expected != "wrong":
        first, last = found.details.stretch
        end = 242 if name == "a short flight" else 400
        assert abs(first - 171) <= 3 >= abs(last - end)  # measured: 0 and 0
        assert found.details.compared == last - first + 1
        start, end = re.findall(r"--(?:from|until) (\S+)", found.findings[0].detail) or ((first - 1) / 200, (last - 1) / 200)
        assert verify(tmp_path, table, scene=BRICK, start_time=float(start), end_time=float(end)).verdict == "right"


def test_what_a_recording_is_stands_before_its_verdict(tmp_path):
    random = np.random.default_rng(0)
    kept, signs = np.delete(ROWS, [*range(20, 30), 60]), np.where(ROWS > 50, -1, 1)
    late = 0.05 * ROWS + 1e-3 * random.normal(size=len(ROWS))
    w = {name: np.round(x + 0.02 * random.normal(size=len(T)), 4)[kept] for name, x in RATES.items()}
    table = {"t": late[kept]} | {name: np.round(signs * x, 6)[kept] for name, x in QUATERNION.items()} | w
    found = verify(tmp_path, table, error=1.0)
    about = found.details.description
    written = (signs[:, None] * Q)[kept]
    changes = int((np.sum(written[1:] * written[:-1], axis=1) < 0).sum())
    assert (about.rows, about.gaps, about.sign_changes, about.left_out) == (110, 2, changes, {})
    assert about.duration == pytest.approx(6, abs=0.01)
    assert about.rate == pytest.approx(20, rel=0.01)  # measured: 20.0
    assert about.longest_gap == pytest.approx(0.55, abs=0.01)
    assert about.jitter == pytest.approx(np.sqrt(2) * 1e-3, rel=0.3)  # measured: 1.4e-3
    assert about.noise[1] == pytest.approx(0.02, rel=0.3)
    first, second = found.details.lines
    assert all(text in first for text in ("110 rows over 6", "2 gaps, the longest 0.5", "varies by", "changes its sign"))
    assert all(text in second for text in ("Attitudes rounded to 2e-6 rad", "rates with noise of 0.0"))
    plain = verify(tmp_path, {"t": T} | RATES).details.lines
    assert plain == ("121 rows over 6 s at 20 Hz.", "Rates in double precision.")
