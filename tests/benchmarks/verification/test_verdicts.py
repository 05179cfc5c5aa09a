"""Files of other programs, with noise, few digits and mistakes. Motions are closed forms, and steps are own loops."""

import json
import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import conservative as cv
from conservative import registry
from conservative.benchmarks.verification import explain
from conservative.benchmarks.verification.mistakes import BY_KEY
from conservative.benchmarks.verification.mistakes.attitudes import integrate
from conservative.benchmarks.verification.recordings.formats.table import CHUNK
from conservative.benchmarks.verification.recordings.table import Options, Recording, read
from conservative.benchmarks.verification.recordings.verdict import Unit, verify_recording
from conservative.errors import BadInput
from conservative.references.exact.method import free_body

from ...sampling import sampled
from .made import BODY, START

J, W0 = [2e-3, 6e-3, 7e-3], [0.2, 2.0, 0.3]
SCENE = cv.Scene("tumbler", cv.RigidBody(J), np.eye(3), W0, 10.0)
T = np.linspace(0, 10, 501)
R, W = free_body(SCENE.body, np.eye(3), W0, T)
Q = Rotation.from_matrix(R).as_quat(scalar_first=True)
ZERO = np.zeros((len(T), 3))


def verdict(t, R, w, scene=SCENE, error=None, **about):
    return verify_recording(scene, Recording(t, (R, w), rows=len(t), **about), error=error)


def table(header, *columns, digits="%.12g"):
    return "\n".join([header, *(",".join(digits % x for x in row) for row in np.column_stack(columns))]) + "\n"


BAD = {
    "unnamed": ("time,z,y,x", (T, W), "--columns time=time,w=x:y:z"),
    "header alone": ("t,w_x (rad/s),w_y (rad/s),w_z (rad/s)", (T[:0], W[:0]), "no row of numbers"),
    "equal times": ("t,w_x (rad/s),w_y (rad/s),w_z (rad/s)", (np.repeat(T[::2], 2)[: len(T)], W), "row 2"),
}


@pytest.mark.parametrize("name", BAD)
def test_a_file_that_is_not_clear_is_one_sentence_with_the_remedy(name, tmp_path):
    header, columns, expected = BAD[name]
    (tmp_path / "run.csv").write_text(table(header, *columns))
    with pytest.raises(BadInput) as error:
        read(tmp_path / "run.csv", Options())
    assert expected in str(error.value)


def test_byte_order_marks_and_line_ends_are_read(tmp_path):
    header = '"Time (s)","Gyroscope x (rad/s)","Gyroscope y (rad/s)","Gyroscope z (rad/s)"'
    text = "\ufeff" + table(header, T, W).replace("\n", "\r\n")
    (tmp_path / "run.csv").write_bytes(text.encode())
    assert verify_recording(SCENE, read(tmp_path / "run.csv", Options())).verdict == "right"


@pytest.mark.parametrize("error", [float("nan"), -1.0, 0.0, "abc", True])
def test_an_error_that_is_no_size_is_refused(error):
    with pytest.raises(BadInput, match="error: got"):
        verdict(T, R, W, error=error)


def test_the_noise_of_the_first_row_is_no_fault(unnamed, no_moments):
    """Near the separatrix the first row alone is off by 0.9 rad/s after 4 s; the fit leaves the noise."""
    phone, t = cv.Scene("phone", cv.RigidBody([1e-3, 2e-3, 3e-3]), np.eye(3), [0.02, 6, 0.02], 4.0), np.linspace(0, 4, 401)
    w = free_body(phone.body, np.eye(3), phone.w_WB_B0, t)[1] + np.random.default_rng(1).normal(0, 0.01, (401, 3))
    found = verdict(t, None, w, phone)
    assert (found.verdict, found.findings[0].by) == ("right", "noise")
    assert found.details.noise[1] * np.linalg.norm(w, axis=1).max() == pytest.approx(0.01, rel=0.1)  # measured: 0.0099
    other = phone.rename("other", body=cv.RigidBody([1e-3, 2.2e-3, 3e-3]))
    assert verdict(t[::2], None, w[::2], other).verdict == "wrong"


@pytest.mark.parametrize("rows", [[10, 47, 103], [10, 47, 103, 160, 201, 222, 275, 300, 301, 333, 402, 450, 480]])
def test_a_few_rows_and_some_more_are_named_with_the_first_of_them(rows):
    """Up to two in a hundred are outliers of the comparison, more of them are found by the search for mistakes."""
    t = np.linspace(0, 10, 501)
    R, w = free_body(SCENE.body, np.eye(3), W0, t)
    w[rows] += (0.01, -0.02, 0.01)
    (cause,) = verdict(t, R, w).findings[0].causes
    assert cause.key == "single rows"
    assert (cause.numbers["row"], cause.numbers["time"]) == (11, t[10])
    assert "row 11 at 0.2 s" in cause.sentence


def test_a_single_row_is_found_in_the_whole_file(tmp_path):
    """A file of more rows than fits keep, in more chunks than one: the times go on, and a row of each chunk is off."""
    n = CHUNK + 3000
    t = np.linspace(0, 40, n)
    w = free_body(SCENE.body, np.eye(3), W0, t)[1]
    w[[CHUNK - 1235, CHUNK + 1234]] += [0.3, 0, 0]
    np.savetxt(
        tmp_path / "run.csv", np.column_stack([t, w]), "%.15g", ",", header="t,w_x_rad_s,w_y_rad_s,w_z_rad_s", comments=""
    )
    found = verify_recording(SCENE, read(tmp_path / "run.csv", Options()))
    assert (found.verdict, found.details.explaining[0].name) == ("wrong", "single rows")
    assert found.details.explaining[0].values["row"] == CHUNK - 1234
    t[CHUNK] = t[CHUNK - 1]  # between two chunks
    np.savetxt(
        tmp_path / "run.csv", np.column_stack([t, w]), "%.15g", ",", header="t,w_x_rad_s,w_y_rad_s,w_z_rad_s", comments=""
    )
    assert read(tmp_path / "run.csv", Options()).left_out == {"with the time of another row, and other values": 1}


def test_matrices_that_are_no_rotations_are_not_right():
    scaled = np.abs((1 + 0.05 * T) ** 2 - 1)
    assert verdict(T, R, W, unit_errors=scaled).verdict == "wrong"
    assert verdict(T, R, W, unit_errors=1e-12 * scaled).verdict == "right"


def product(p, q):
    return np.array([p[0] * q[0] - p[1:] @ q[1:], *(p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:]))])


def rotated(q, w, h):
    return product(q, Rotation.from_rotvec(w * h).as_quat(scalar_first=True))


def in_place(q, w, h):
    (a, b, c, d), (x, y, z) = q, w * h / 2
    a = a - b * x - c * y - d * z
    b = b + a * x + c * z - d * y
    c = c + a * y - b * z + d * x
    return np.array([a, b, c, d + a * z + b * y - c * x])


ATTITUDES = {
    "first-order step q + h/2 q w, normalised, by the rates of the start": lambda q, a, b, h: (
        q + h / 2 * product(q, np.array([0.0, *a]))
    ),
    "a rotation by the rates of the start": lambda q, a, b, h: rotated(q, a, h),
    "components are updated in place, one after another, by the rates of the start": lambda q, a, b, h: in_place(q, a, h),
    "as if they were in world axes": lambda q, a, b, h: product(
        Rotation.from_rotvec((a + b) / 2 * h).as_quat(scalar_first=True), q
    ),
}


def attitudes_of(name):
    """Return the attitudes that follow from right rates by a rule of `ATTITUDES`."""
    q = [Q[0]]
    for a, b, h in zip(W[:-1], W[1:], np.diff(T), strict=True):
        q.append(ATTITUDES[name](q[-1], a, b, h))
        q[-1] = q[-1] / np.linalg.norm(q[-1])
    return Rotation.from_quat(q, scalar_first=True).as_matrix()


KEYS = (
    "attitude by normalisation, old rates",
    "stale rates",
    "attitude in place, old rates",
    "attitude by rotation, mean rates on the wrong side",
)


@pytest.mark.parametrize(("name", "key"), [*zip(ATTITUDES, KEYS, strict=True)])
def test_a_rule_makes_the_attitudes_that_are_made_by_hand(name, key):
    made = integrate(BY_KEY[key].matrices, np.eye(3), W, np.diff(T), 1)
    assert np.abs(made - attitudes_of(name)).max() < 1e-12  # measured: 4e-14


@pytest.mark.parametrize("name", sampled(ATTITUDES, 1, keep=list(ATTITUDES)[-1:]))
def test_attitudes_that_are_not_the_integral_of_right_rates_are_named(name):
    found = verdict(T, attitudes_of(name), W)
    assert name in found.details.explaining[0].sentence
    assert max(found.details.explaining[0].left) < 1e-11 < 1e-5 < max(found.details.explaining[0].plain)  # measured: 4e-14


def test_fewer_numbers_do_not_win_over_a_much_smaller_rest():
    """A scaled time leaves nothing, a constant shift 20 times as much as is allowed: the shift must not be named."""
    at = np.append(0.0, 0.02 + T[1:] * (1 + 3.5e-5))
    later, w = free_body(SCENE.body, np.eye(3), W0, at)
    found = verdict(T, later, w, error=1e-3, digits=(0.0, 1e-5, 1e-5))
    shift = next(each for each in found.details.tried if each.name == "time shift")
    assert shift.explains
    assert 10 < shift.size < 40  # measured: 22 times the digits, and the scaled time leaves none of them
    assert found.details.explaining[0].name == "phase drift"


def test_an_allowed_error_decides_alone(unnamed, no_moments):
    t, off = T[::10], 1e-3 * np.sin(T[::10])[:, None]
    noise = np.random.default_rng(2).normal(0, 0.01, (len(T), 3))
    assert [verdict(t, None, W[::10] + off, error=error).verdict for error in (None, 1e-2)] == ["wrong", "right"]
    assert [verdict(t, None, (W + noise)[::10], error=error).verdict for error in (None, 1e-3)] == ["right", "wrong"]


def test_angles_called_phi_theta_psi_are_compared(tmp_path):
    turned = Rotation.from_matrix(R) * Rotation.from_rotvec(0.1 * T[:, None] * [0, 1, 0])
    angles = turned.as_euler("ZYX", degrees=True)[:, ::-1]
    header = "Time,P (deg/s),Q (deg/s),R (deg/s),Phi (deg),Theta (deg),Psi (deg)"
    (tmp_path / "run.csv").write_text(table(header, T, np.degrees(W), angles))
    found = verify_recording(SCENE, read(tmp_path / "run.csv", Options(euler="zyx")))
    assert (found.verdict, found.details.error[0]) == ("wrong", pytest.approx(1.0, rel=1e-3))
    assert not found.details.candidates  # turned body axes leave 0.7 rad, and make right rates wrong by 28 deg/s
    assert all(each.left[1] < 1e-6 for each in found.details.tried)
    (tmp_path / "rates.csv").write_text(table("t,w_x (rpm),w_y (rpm),w_z (rpm)", T, W))
    with pytest.raises(BadInput, match="euler: got"):
        read(tmp_path / "rates.csv", Options(euler="zyx"))


def test_a_body_at_rest_beside_a_torque_is_wrong():
    driven = cv.Scene("driven", cv.RigidBody([1.0, 2.0, 3.0]), np.eye(3), [0, 0, 0], 10.0, torque=cv.Torque([1e-3, 0, 0]))
    assert verdict(T, None, ZERO, driven).verdict == "wrong"
    assert verdict(T, None, ZERO, driven.rename("free", torque=None)).verdict == "right"


def test_every_column_is_used_or_has_a_reason(tmp_path):
    (tmp_path / "run.csv").write_text(
        table("t,w_x (rad/s),w_y (rad/s),w_z (rad/s),phase,q_lvlh_w,q_lvlh_x,q_lvlh_y,q_lvlh_z", T, W, T, Q)
    )
    found = verify_recording(SCENE, read(tmp_path / "run.csv", Options()))
    assert set(found.details.unused) == {"phase", "q_lvlh_w", "q_lvlh_x", "q_lvlh_y", "q_lvlh_z"}
    json.dumps(found.details.unused)


SCENES = ("degenerate_separatrix", "hairer_vilmart", "librating_satellite", "volterra_gyrostat")
"""A free body, a top, a satellite and a rotor. `test_parts.py` has others, from the start of the scene."""


@pytest.mark.parametrize("name", sampled(registry.list_scenes(), 4, keep=SCENES))
def test_our_own_samples_of_every_scene_are_right_whole_and_without_their_start(name):
    scene = registry.scene(name)
    made = cv.integrate(scene, scene.dt, cv.Taylor())
    for k in (0, len(made.t) // 3):
        assert verdict(made.t[k:], made.R_WB[k:], made.w_WB_B[k:], scene).verdict == "right"  # measured: at most 2e-10


def test_times_that_jitter_are_no_noise(monkeypatch, no_moments):
    """Errors of times lie along the motion. Noise of the same size has all directions, and is right."""
    # The other parts of the search find nothing, for seconds, and leave their work to this one.
    monkeypatch.setattr(explain, "SEARCHES", {"other times": explain.SEARCHES["other times"]})
    monkeypatch.setattr(explain, "EFFORT", 5 * explain.EFFORT)
    random, t = np.random.default_rng(4), T[::8]
    at = np.append(0.0, t[1:] + 0.004 * np.clip(random.normal(size=len(t) - 1), -2, 2))
    R_late, w_late = free_body(SCENE.body, np.eye(3), W0, at)
    found = verdict(t, R_late, w_late)
    assert (found.verdict, found.details.explaining[0].name) == ("wrong", "jittered times")
    assert max(found.details.explaining[0].left) < 1e-8  # measured: 4e-14
    t, R_off, w_off = T[::4], R[::4] @ Rotation.from_rotvec(0.005 * random.normal(size=(126, 3))).as_matrix(), W[::4]
    assert verdict(t, R_off, w_off + 0.005 * random.normal(size=w_off.shape)).verdict == "right"


def test_a_quaternion_that_is_not_of_norm_1_is_found_between_the_rows_that_are_kept(tmp_path):
    """Of 9,001 rows every fourth is kept for fits. Attitudes of any norm are repaired, so only the norm is wrong."""
    t = np.linspace(0, 10, 9001)
    q = Rotation.from_matrix(free_body(SCENE.body, np.eye(3), W0, t)[0]).as_quat(scalar_first=True)
    q[5001] *= 1.1
    np.savetxt(tmp_path / "run.csv", np.column_stack([t, q]), "%.17g", ",", header="t,q_w,q_x,q_y,q_z", comments="")
    found = verify_recording(SCENE, read(tmp_path / "run.csv", Options()))
    assert (found.verdict, found.findings[0].causes) == ("wrong", ())
    assert f"{t[5001]:g} s" in found.details.shape


NOISE = 1e-3 * np.linalg.norm(W, axis=1).max()


def notes_on_moments(scene, w):
    found = verdict(T, None, w + NOISE * np.random.default_rng(2).normal(size=w.shape), scene)
    return found.verdict, [note for note in found.notes if "moments" in note], found.details.explaining


def ratios(sentence):
    """The ratios and their intervals."""
    return np.array(re.findall(r"([\d.]+) ± ([\d.e-]+)", sentence), dtype=float).T


def test_a_noisy_recording_has_the_ratios_of_moments_that_fit_it(unnamed):
    right, (note,), _ = notes_on_moments(SCENE, W)
    found, off = ratios(note)
    assert right == "right"
    assert (np.abs(found - [3, 3.5]) <= 2 * off).all()  # measured: 0.6 and 0.8 of an interval
    assert (off < 0.05).all()  # measured: 0.003 and 0.003
    rotor = SCENE.rename("rotor", body=cv.RigidBody(J, [1e-5, 0, 0]))
    assert notes_on_moments(rotor, W)[1] == []  # a motion with a rotor depends on more than ratios


@pytest.mark.slow
def test_a_noisy_recording_of_another_body_has_the_ratios_of_its_moments():
    other = SCENE.rename("other", body=cv.RigidBody([2e-3, 6e-3, 6.5e-3]))
    wrong, notes, (mistake,) = notes_on_moments(other, W)
    assert (wrong, notes, mistake.name) == ("wrong", [], "other moments")
    found, off = ratios(mistake.sentence.partition("(of the body")[0])
    assert (np.abs(found - [3, 3.5]) <= 2 * off).all()


def test_times_that_jitter_are_no_noise_unless_their_digits_or_an_allowed_error_permit_it(unnamed, no_moments):
    jitter = 1e-3 * np.random.default_rng(3).normal(size=len(T))
    moved, rates = free_body(SCENE.body, np.eye(3), W0, np.maximum(T + np.append(0, jitter[1:]), 0))
    assert verdict(T, moved, rates).verdict == "wrong"
    assert verdict(T, moved, rates, error=0.05).verdict == "right"  # measured: an error of 0.006


@pytest.mark.parametrize(
    ("unit", "error", "text"), [(("degrees", 57.3), 2.8, "160 degrees"), (("rad", 1.0), 1.23e-9, "1.2e-9 rad")]
)
def test_an_error_is_a_plain_number_with_its_unit(unit, error, text):
    assert Unit(*unit).show(error) == text


@pytest.mark.parametrize("seed", range(3))
def test_noise_in_rows_between_which_the_body_turns_three_times(seed):
    """18 rad from row to row. Fits that began with 10 rows failed in 12 of 16 such files, with 4 rows in none."""
    t, random = 9.0 * np.arange(41), np.random.default_rng(seed)
    scene = cv.Scene("fast", BODY, *START, 400.0)
    R, w = free_body(BODY, scene.R_WB0, scene.w_WB_B0, t)
    R = R @ Rotation.from_rotvec(0.01 * random.normal(size=(41, 3))).as_matrix()
    w = w + 0.01 * np.linalg.norm(w, axis=1).max() * random.normal(size=(41, 3))
    found = verify_recording(scene, Recording(t, (R, w), rows=41))
    assert found.verdict == "right", found.sentence
