"""Recordings with numbers beyond all others, and files that are no tables: each is refused by name or compared rightly."""

import os
import resource
import subprocess
import sys
import warnings

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import conservative as cv
from conservative.attitude import to_quaternion
from conservative.benchmarks.verification.recordings import table, verdict
from conservative.benchmarks.verification.recordings.formats.table import chunks

from ...environments import PATIENCE
from ...sampling import sampled
from .made import FREE, T, exact

pytestmark = pytest.mark.usefixtures("unnamed")
T = T[::3]
R, W = exact(FREE, T)
TURNS = Rotation.from_matrix(R)
VECTORS = TURNS.as_rotvec()
ANGLES = np.linalg.norm(VECTORS, axis=1, keepdims=True)
Q = to_quaternion(R)
ATTITUDES = {
    "qw,qx,qy,qz": Q,
    "q0,q1,q2,q3": Q,
    ",".join(f"R_{i}{j}" for i in "123" for j in "123"): R.reshape(-1, 9),
    "axis_x,axis_y,axis_z,axis_angle": np.hstack([VECTORS / ANGLES, ANGLES]),
    "rotvec_x,rotvec_y,rotvec_z": VECTORS,
    "sigma_1,sigma_2,sigma_3": TURNS.as_mrp(),
    "crp_1,crp_2,crp_3": Q[:, 1:] / Q[:, :1],
    "yaw,pitch,roll": TURNS.as_euler("ZYX"),
}


def judged(folder, names, attitudes, rates=W, t=T, scene=FREE):
    """Return whether a recording is right, None if it is refused by the name of its file."""
    rows = np.column_stack([t, attitudes, rates])
    path = folder / "run.csv"
    path.write_text(f"t,{names},w_x,w_y,w_z\n" + "\n".join(",".join(map(repr, row)) for row in rows.tolist()))
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        try:
            recording = table.read(path, table.Options(units="rad"))
        except cv.BadInput as refused:
            assert str(path) in str(refused)  # noqa: PT017
            return None
        return verdict.verify_recording(scene, recording, True, None, lambda *_: None).verdict == "right"


@pytest.mark.parametrize("names", sampled(ATTITUDES, 2, keep=["qw,qx,qy,qz", "axis_x,axis_y,axis_z,axis_angle"]))
def test_attitudes_of_any_size(names, tmp_path):
    usual = ATTITUDES[names]
    assert judged(tmp_path, names, usual)
    for size in (1e200, -1e200, 1e-200, 5e-324):
        some = usual.copy()
        some[5] = some[5] * size
        assert not judged(tmp_path, names, some)
    for lost in (np.nan, np.inf, 0.0):  # a sensor that lost sight: such a row is left out, but an angle of 0 is an attitude
        some[5] = lost
        assert judged(tmp_path, names, some) == ("axis" not in names or lost != 0)
    if len(names.split(",")) in (4, 9) and "axis" not in names:
        for size in (1e200, 1e155, 1e-200):
            assert judged(tmp_path, names, usual * size) is None
    for size in (1e8, 1e20, 1e308):  # one component: digits of the others are not relative to it
        some = usual.copy()
        some[5, 0] = size
        assert not judged(tmp_path, names, some)


@pytest.mark.parametrize(("size", "rates"), [(1e8, W.astype(np.float32)), (1e20, W), (1e200, W)])
def test_one_rate_of_any_size_is_wrong(size, rates, tmp_path):
    """Up to version 0.3 the last digit of the largest number was allowed for all: 1e200 was "right"."""
    some = np.array(rates, dtype=float)
    some[5, 0] = size
    assert not judged(tmp_path, "qw,qx,qy,qz", Q, some)


def test_times_of_any_size(tmp_path):
    for t in (T * 1e200, T * 1e-200, T - 1e308, np.append(T[:-1], 1e308)):
        assert judged(tmp_path, "qw,qx,qy,qz", Q, t=t) is None


def test_rates_that_no_scene_has_are_at_rest(tmp_path):
    still = np.broadcast_to(Q[0], Q.shape)
    resting = FREE.rename("resting", w_WB_B0=[0, 0, 0])
    assert judged(tmp_path, "qw,qx,qy,qz", still, np.full_like(W, 1e-200), scene=resting)


HEADER = "t,w_x,w_y,w_z\n"
FILES = {
    "a line of 100,000 digits": HEADER + "0,1,2,3\n1,1,2," + "9" * 100_000 + "\n",
    "only digits": "9" * 100_000,
    "3 million fields in a row": HEADER + "0,1,2,3\n" + "1," * 3_000_000,
    "3 million names": "t," * 3_000_000,
    "20,000 columns": ",".join(f"c{i}" for i in range(20_000)) + "\n" + ",".join("1" * 20_000) + "\n",
    "a name of 150,000 letters": "t," + "gyro" * 37_500 + ",w_y,w_z\n0,1,2,3\n1,1,2,3\n",
    "brackets in a name": "t," + "(" * 150_000 + ",w_y,w_z\n0,1,2,3\n1,1,2,3\n",
    "lines without numbers": ("x" * 900_000 + "\n") * 5,
    "nothing": "",
    "a field of nothing": "\0" * 1000,
}
WORDS = {
    "3 million fields in a row": "line 3 has more than 1000000 characters",
    "3 million names": "line 1 has more than 1000000 characters",
    "20,000 columns": "20000 columns",
}
"""Messages of the limits of sizes. Without one of these limits, a file meets a later limit or none."""
JSON = {
    "digits": '{"t": 0, "w_x": 1, "w_y": 2, "w_z": ' + "9" * 100_000 + "}\n",
    "401 digits": '{"t": 0, "w_x": 1, "w_y": 2, "w_z": 3}\n{"t": 1, "w_x": 1, "w_y": 2, "w_z": ' + "9" * 401 + "}\n",
    "deep": "[" * 100_000,
    "deep later": '{"t": 0, "w_x": 1, "w_y": 2, "w_z": 3}\n' + '{"t": ' * 50_000 + "\n",
    "a list": '{"t": 0, "w_x": 1, "w_y": 2, "w_z": 3}\n[1, 2, 3, 4]\n',
    "booleans": '{"t": 0, "w_x": 1, "w_y": 2, "w_z": 3}\n{"t": 1, "w_x": true, "w_y": 2, "w_z": 3}\n',
}


def limit_memory():
    resource.setrlimit(resource.RLIMIT_AS, (3 << 30, 3 << 30))


def test_files_that_are_no_tables(tmp_path):
    paths = []
    for kind, files in (("csv", FILES), ("jsonl", JSON)):
        for i, text in enumerate(files.values()):
            paths.append(tmp_path / f"{i}.{kind}")
            paths[-1].write_text(text)
    paths += [tmp_path, tmp_path / "none.csv"]
    for name, target in (("zero.csv", "/dev/zero"), ("in.csv", "/dev/stdin")):
        (tmp_path / name).symlink_to(target)
        paths.append(tmp_path / name)
    for name in ("pipe.csv", "pipe.jsonl"):
        os.mkfifo(tmp_path / name)
        paths.append(tmp_path / name)
    code = """
import sys
from pathlib import Path
from conservative.benchmarks.verification.recordings.table import Options, read
from conservative.errors import BadInput
for path in sys.argv[1:]:
    try:
        read(Path(path), Options(units="rad"))
        print(path, "was read")
    except BadInput as error:
        assert len(str(error)) < 7000, (path, len(str(error)))
        assert "run: got " + path in str(error), str(error)
        print(repr(str(error)[:200]))
print("done")
"""
    made = subprocess.run(
        [sys.executable, "-c", code, *map(str, paths)],
        input="0,1,2,3\n", text=True, capture_output=True, timeout=PATIENCE, check=False, preexec_fn=limit_memory,
    )  # fmt: skip
    assert made.returncode == 0, made.stderr[-2000:]
    *refused, done = made.stdout.splitlines()
    assert (len(refused), done) == (len(paths), "done")
    for (name, _), line in zip(FILES.items(), refused, strict=False):
        assert WORDS.get(name, "") in line


def test_a_name_that_is_not_used_is_shown_in_part(tmp_path):
    path, rows = tmp_path / "run.csv", np.column_stack([T, W])
    names = "t,w_x,w_y,w_z," + "k" * 150_000
    path.write_text(names + "\n" + "\n".join(",".join(map(repr, [*row, 0.0])) for row in rows.tolist()))
    found = verdict.verify_recording(FREE, table.read(path, table.Options(units="rad")), True, None, lambda *_: None)
    (name,) = found.details.unused
    assert len(name) < 2000  # 150,000


def test_lines_are_read_in_parts_of_bounded_size():
    lines = ["x" * 1000] * 100
    assert [len(part) for part in chunks(lines, 40, 10**9)] == [40, 40, 20]
    assert [len(part) for part in chunks(lines, 10**9, 30_000)] == [31, 31, 31, 7]


@pytest.mark.parametrize("columns", ["time=²,w=2:3:4", "time=" + "9" * 5000 + ",w=2:3:4"])
def test_numbers_of_columns_that_are_none(columns, tmp_path):
    (tmp_path / "run.csv").write_text("0,1,2,3\n1,1,2,3\n")
    with pytest.raises(cv.BadInput, match="columns"):
        table.read(tmp_path / "run.csv", table.Options(columns=columns))
