"""Files are read whatever their columns are called, and what cannot be read is a sentence."""

import tracemalloc

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

from conservative.benchmarks.verification.recordings.formats import GONE
from conservative.benchmarks.verification.recordings.table import ROWS, Options, read, read_all
from conservative.benchmarks.verification.verify import verify
from conservative.errors import REMOVED, BadInput

from .made import FREE, T, exact

R, W = exact(FREE)
Q = Rotation.from_matrix(R).as_quat(scalar_first=True)
RATES = {f"w_{axis} (rad/s)": W[:, i] for i, axis in enumerate("xyz")}
EULER = Rotation.from_matrix(R).as_euler("ZYX", degrees=True)


def write(path, columns, ending="csv"):
    frame = pd.DataFrame(columns)
    path = path / f"run.{ending}"
    if ending == "jsonl":
        frame.to_json(path, orient="records", lines=True, double_precision=15)
    else:
        frame.to_csv(path, index=False, sep="," if ending == "csv" else "\t")
    return path


def load(path, quaternion=None, euler=None, world=False, units=None):
    return read(path, Options(quaternion, euler, world, units))


TABLES = {
    "wxyz": ({"time": T, **{f"q_{part}": Q[:, i] for i, part in enumerate("wxyz")}, **RATES}, {}),
    "xyzw by name": (
        {"time": T, **{f"q_{part}": Q[:, (i + 1) % 4] for i, part in enumerate("xyzw")}, **RATES},
        {},
    ),
    "xyzw by option": ({"time": T, **{f"q{i}": Q[:, (i + 1) % 4] for i in range(4)}, **RATES}, {"quaternion": "xyzw"}),
    "xyzw in the name": ({"time": T, **{f"quaternion_xyzw_{i}": Q[:, (i + 1) % 4] for i in range(4)}, **RATES}, {}),
    "wxyz in the name": ({"time": T, **{f"quaternion_wxyz.{i + 1}": Q[:, i] for i in range(4)}, **RATES}, {}),
    "xyzw, and letters": ({"time": T, **{f"quaternion_xyzw_{part}": Q[:, i] for i, part in enumerate("wxyz")}, **RATES}, {}),
    "unit of rates by option": (
        {"t": T, "p": np.degrees(W[:, 0]), "q": np.degrees(W[:, 1]), "r": np.degrees(W[:, 2])}
        | {name: np.radians(EULER[:, i]) for i, name in enumerate(("yaw", "pitch", "roll"))},
        {"units": "deg/s", "euler": "zyx"},
    ),
    "milliseconds, deg": (
        {"time_ms": 1e3 * T, "Gyro_deg_s_X": np.degrees(W[:, 0]), "Gyro_deg_s_Y": np.degrees(W[:, 1])}
        | {
            "Gyro_deg_s_Z": np.degrees(W[:, 2]),
            "yaw (deg)": EULER[:, 0],
            "pitch (deg)": EULER[:, 1],
            "roll (deg)": EULER[:, 2],
        },
        {"euler": "zyx"},
    ),
    "units by option": (
        {"t": T, "p": np.degrees(W[:, 0]), "q": np.degrees(W[:, 1]), "r": np.degrees(W[:, 2])}
        | {f"m{i}{j}": R[:, i, j] for i in range(3) for j in range(3)},
        {"units": "deg"},
    ),
    "world rates": (
        {"t": T, **{f"q_{part}": -3 * Q[:, i] for i, part in enumerate("wxyz")}}
        | {f"omega_{i + 1} [rad/s]": (R @ W[..., None])[:, i, 0] for i in range(3)},
        {"world": True},
    ),
    "our own": (
        {"t": T, **{f"R_WB_{i + 1}{j + 1}": R[:, i, j] for i in range(3) for j in range(3)}}
        | {f"w_WB_B_{i + 1}": W[:, i] for i in range(3)},
        {},
    ),
}


@pytest.mark.parametrize("ending", ["csv", "tsv", "jsonl"])
@pytest.mark.parametrize("name", TABLES)
def test_the_same_motion_in_other_columns(name, ending, tmp_path):
    columns, options = TABLES[name]
    recording = load(write(tmp_path, columns, ending), **options)
    np.testing.assert_allclose(recording.t, T, atol=1e-12)
    np.testing.assert_allclose(recording.data[0], R, atol=1e-12)  # measured: 3e-15
    np.testing.assert_allclose(recording.data[1], W, atol=1e-12)


def test_the_columns_of_nesc(tmp_path):
    names = [f"bodyAngularRateWrtEi_deg_s_{axis}" for axis in ("Yaw", "Roll", "Pitch")]
    angles = {f"eulerAngle_deg_{axis}": EULER[:, i] for i, axis in enumerate(("Yaw", "Pitch", "Roll"))}
    rates = dict(zip(names, np.degrees(W[:, [2, 0, 1]]).T, strict=True))
    recording = load(write(tmp_path, {"time": T, "altitudeMsl_ft": T, **angles, **rates, "feVelocity_ft_s_X": T}))
    np.testing.assert_allclose(recording.data[1], W, rtol=1e-14)
    assert recording.data[0] is None
    assert (recording.degrees, set(recording.layout.unused) >= set(angles)) == (True, True)
    assert "horizon" in recording.layout.unused["eulerAngle_deg_Yaw"]


@pytest.mark.parametrize("beginning", GONE)
def test_a_format_that_is_gone_is_answered_with_what_to_do(beginning, tmp_path):
    file = tmp_path / ("run.csv.gz" if GONE[beginning] == ".gz" else f"run{GONE[beginning]}")  # not any archive, in a folder
    file.write_bytes(beginning + b"\n0 1 2 3\n1 1 2 3\n")
    for subject in (file, tmp_path):  # a file, and a folder with it
        with pytest.raises(BadInput) as error:
            verify(str(subject), "brick_flip")
        assert error.value.allowed == REMOVED[GONE[beginning]]


def test_the_message_offers_the_columns_that_differ_by_their_axes(tmp_path):
    names = ["stamp_ms", "ax", "ay", "az", "gx", "gy", "gz"]
    np.savetxt(tmp_path / "log.csv", np.column_stack([T, W, W]), "%.17g", ",", header=",".join(names), comments="")
    with pytest.raises(BadInput, match="--columns time=stamp_ms,w=gx:gy:gz"):
        load(tmp_path / "log.csv")


WRONG = {
    "no time": (lambda c: c.pop("time"), "without columns of the time"),
    "one rate": (lambda c: [c.pop(name) for name in list(c)[2:]], "without columns of attitudes or rates"),
    "backwards": (lambda c: c.update(time=np.where(T % 0.2 < 0.1, T, 6 - T)), "rows out of order"),
    "not a number": (lambda c: c.update(q_w=np.where(T[4] == T, "lost", Q[:, 0])), "row 5, column q_w: 'lost'"),
    "norm 0": (lambda c: c.update({f"q_{p}": 0 * T for p in "wxyz"}), "0 rows"),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_file_that_cannot_be_judged_is_a_sentence_with_its_name_and_row(name, tmp_path):
    columns = dict(TABLES["wxyz"][0]) if name != "one rate" else {"time": T, **RATES}
    spoil, expected = WRONG[name]
    spoil(columns)
    path = write(tmp_path, columns)
    with pytest.raises(BadInput, match=r"run: got .*; expected") as error:
        load(path)
    assert expected in str(error.value)
    assert str(path) in str(error.value)


@pytest.mark.parametrize("content", ["", "time,w_x (rad/s),w_y (rad/s),w_z (rad/s)\n0,1,2,3\n", "\x00\xff", None])
def test_a_file_without_a_table(content, tmp_path):
    if content is not None:
        (tmp_path / "run.csv").write_text(content, encoding="latin-1")
    with pytest.raises(BadInput, match=r"run\.csv"):
        load(tmp_path / "run.csv")


@pytest.mark.slow
def test_memory_does_not_grow_with_the_rows(tmp_path):
    n = 400_000
    pd.DataFrame({"time": np.arange(n), "w_x_rad_s": 1.0, "w_y_rad_s": 2.0, "w_z_rad_s": 3.0}).to_csv(
        tmp_path / "long.csv", index=False
    )
    tracemalloc.start()
    recording = load(tmp_path / "long.csv")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert (recording.rows, ROWS <= len(recording.t) <= 2 * ROWS) == (n, True)
    np.testing.assert_array_equal(np.diff(recording.t), np.diff(recording.t)[0])
    assert peak < 30e6  # measured: 14 MB; all rows take 13 MB as numbers and as much again for each copy


def test_an_option_is_refused_if_no_file_of_the_call_uses_it(tmp_path):
    named, plain = tmp_path / "named.csv", tmp_path / "plain.csv"
    quaternion = {f"q_{part}": Q[:, i] for i, part in enumerate("wxyz")}
    pd.DataFrame({"time": T, **quaternion, **RATES}).to_csv(named, index=False)
    numbered = {f"q{i}": Q[:, (i + 1) % 4] for i in range(4)}
    pd.DataFrame({"time": T, **numbered, **{f"w_{x}": W[:, i] for i, x in enumerate("xyz")}}).to_csv(plain, index=False)
    for options in (Options(units="rad", quaternion="xyzw"), Options(quaternion="xyzw", units="rad/s")):
        for recording in read_all([named, plain], options):  # the order applies to numbered columns only
            np.testing.assert_allclose(recording.data[0], R, atol=1e-12)
    for argument, value in (("units", "rad"), ("quaternion", "xyzw"), ("euler", "zyx")):
        with pytest.raises(BadInput, match=f"{argument}: got"):
            read_all([named, named], Options(**{argument: value}))
