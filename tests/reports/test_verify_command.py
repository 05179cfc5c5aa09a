"""`conservative verify` of recordings: faults of five flight simulators, files that are written, and exit codes."""

import json
from itertools import product

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

import conservative as cv
from conservative.benchmarks.verification.explain import Diagnosis
from conservative.reports.cli.main import main

from ..benchmarks.verification.made import exact, stepped
from ..sampling import sampled

# The brick of NASA's check case 2, slug ft^2: the motion of a free body depends on the ratios of its moments only.
TOML = """t_end = 30
[body]
inertia = [0.00189422, 0.006211019, 0.007194665]
[start]
w_WB_B = [0.17453292519943295, 0.3490658503988659, 0.5235987755982988]
"""
BRICK = cv.Scene("brick", cv.RigidBody([0.00189422, 0.006211019, 0.007194665]), np.eye(3), np.radians([10, 20, 30]), 30.0)
T = np.linspace(0, 30, 301)
AB2 = "Adams-Bashforth 2 (first step Euler)"


def verify(folder, rates, *options):
    names = [f"bodyAngularRateWrtEi_deg_s_{axis}" for axis in ("Roll", "Pitch", "Yaw")]
    table = pd.DataFrame(np.degrees(rates), columns=names)
    table.insert(0, "time", T)
    table.to_csv(folder / "run.csv", index=False)
    (folder / "body.toml").write_text(TOML)
    done = CliRunner().invoke(
        main, ["verify", str(folder / "run.csv"), "--body", str(folder / "body.toml"), *map(str, options)]
    )
    return done, (json.loads(done.stdout)["subjects"][0] if "--json" in options and done.exit_code < 2 else None)


def late():
    w = exact(BRICK, T + 5e-4)[1]
    return np.concatenate([BRICK.w_WB_B0[None], w[1:]])


FILES = {
    "right, 12 digits": (lambda: np.radians(np.degrees(exact(BRICK, T)[1]).round(10)), None, {}),
    "a step of 10 ms": (lambda: stepped(BRICK, AB2, 10, T)[1], AB2, {"step": 0.01}),
    "half a millisecond": (late, "time shift", {"shift": 5e-4}),
}


@pytest.mark.parametrize("name", sampled(FILES, 2, ["right, 12 digits", "half a millisecond"]))
def test_faults_of_flight_simulators_are_named(name, tmp_path):
    made, fault, values = FILES[name]
    done, found = verify(tmp_path, made(), "--json")
    assert (done.exit_code, found["verdict"]) == ((0, "right") if fault is None else (1, "wrong"))
    (finding,) = found["findings"]
    if fault is None:
        assert finding["causes"] == []
        assert max(found["details"]["error"]) < 1e-11  # measured: 4e-12, the round-off of the digits
    else:
        (cause,) = finding["causes"]
        assert cause["keys"] == [fault]
        assert cause["numbers"] == pytest.approx(values, rel=1e-6)


def test_the_folder_has_every_format_and_is_replaced_by_the_same_command_only(tmp_path):
    out = tmp_path / "out"
    done, _ = verify(tmp_path, late(), "--out", out)
    assert done.exit_code == 1
    text = " ".join(done.stdout.split())
    assert "; its largest error is 4.7e-3 deg/s; " in text
    assert "run.csv is wrong: constant time shift: the file is +0.0005 s ahead of the exact motion after its first row" in text
    assert sorted(path.name for path in out.iterdir()) == ["errors.csv", "errors.svg", "verify.csv", "verify.json", "verify.md"]
    table = pd.read_csv(out / "errors.csv")
    assert table["quantity"].unique().tolist() == ["rate error, deg/s", "drift of energy"]
    assert table["value"].max() == pytest.approx(4.7428e-3, rel=1e-4)
    picture = (out / "errors.svg").read_text()
    assert all(f"run.csv: {quantity}" in picture for quantity in table["quantity"].unique())
    assert pd.read_csv(out / "verify.csv")[["subject", "verdict", "mistakes"]].values.tolist() == [
        ["run.csv", "wrong", "time shift"]
    ]
    assert verify(tmp_path, exact(BRICK, T)[1], "--out", out)[0].exit_code == 0
    (out / "verify.md").write_text("mine")
    assert verify(tmp_path, exact(BRICK, T)[1], "--out", out)[0].exit_code == 2
    assert (out / "verify.md").read_text() == "mine"


def test_a_motion_that_the_integrator_turns_to_the_intermediate_axis_is_noted(tmp_path, monkeypatch):
    angle = 0.8 * np.exp(-T / 4)
    J = BRICK.body.moments
    monkeypatch.setattr("conservative.benchmarks.verification.recordings.verdict.diagnose", lambda *_, **__: Diagnosis())
    done, found = verify(tmp_path, J[1] * 0.5 * np.stack([np.sin(angle), np.cos(angle), 0 * angle], axis=1) / J, "--json")
    assert done.exit_code == 1
    assert "The energy approaches L^2/(2 I2)" in found["notes"][-1]
    assert not any("L^2" in note for note in verify(tmp_path, late(), "--json")[1]["notes"])


@pytest.mark.slow
def test_the_start_of_the_scene_shows_an_error_of_the_first_row(tmp_path):
    w = exact(BRICK.rename("faster", w_WB_B0=1.01 * BRICK.w_WB_B0), T)[1]
    assert verify(tmp_path, w)[0].exit_code == 0
    done, found = verify(tmp_path, w, "--start", "scene", "--json")
    assert (done.exit_code, found["details"]["error"][1] > 0.009) == (1, True)
    assert verify(tmp_path, w, "--start", "scene", "--error", "2")[0].exit_code == 0


def test_our_own_samples_of_a_top_are_right_and_an_unnamed_order_is_found(tmp_path):
    run = CliRunner().invoke(main, ["run", "lagrange_top", "-m", "exact", "--dt", "0.01", "--csv", str(tmp_path / "run.csv")])
    assert run.exit_code == 0, run.output
    done = CliRunner().invoke(main, ["verify", str(tmp_path / "run.csv"), "--body", "lagrange_top", "--json"])
    assert done.exit_code == 0
    quantities = json.loads(done.stdout)["subjects"][0]["details"]["quantities"]
    assert [quantity["name"] for quantity in quantities][:3] == ["attitude error, rad", "rate error, rad/s", "drift of energy"]
    table = pd.read_csv(tmp_path / "run.csv")
    R = table[[f"R_WB_{i}{j}" for i in "123" for j in "123"]].to_numpy().reshape(-1, 3, 3)
    q = cv.attitude.to_quaternion(R)[:, [1, 2, 3, 0]]
    columns = {"t": table["t (s)"], **{f"q{i}": q[:, i] for i in range(4)}}
    pd.DataFrame(columns).to_csv(tmp_path / "order.csv", index=False)
    done = CliRunner().invoke(main, ["verify", str(tmp_path / "order.csv"), "--body", "lagrange_top"])
    assert done.exit_code == 0, done.output
    assert "xyzw fits better" in done.stdout


PARTS = """t_end = 5.0
[body]
inertia = [37.5, 180.0, 187.5]
[rotor]
momentum = [0.0, 0.0, 20.0]
[torque]
times = [0.0, 1.0, 1.0, 3.0, 3.0, 5.0]
values = [[0, 0, 0], [0, 0, 0], [235, 0, 0], [235, 0, 0], [0, 0, 0], [0, 0, 0]]
[start]
w_WB_B = [0.0, 0.1, 0.0]
"""


STARTS = product(["", "rotor", "torque"], ["row", "scene"])


@pytest.mark.parametrize(("gone", "start"), sampled(STARTS, 2, [("rotor", "row"), ("", "scene")]))
def test_parts_of_a_scene_file_are_verified_from_any_row(gone, start, tmp_path):
    (tmp_path / "body.toml").write_text(PARTS)
    made = PARTS
    if gone:
        first, last = PARTS.index(f"[{gone}]"), PARTS.index({"rotor": "[torque]", "torque": "[start]"}[gone])
        made = PARTS[:first] + PARTS[last:]
    (tmp_path / "made.toml").write_text(made)
    options = ["-m", "scipy:DOP853,rtol=1e-13", "--dt", "0.01", "--csv", str(tmp_path / "run.csv")]
    run = CliRunner().invoke(main, ["run", str(tmp_path / "made.toml"), *options])
    assert run.exit_code == 0, run.output
    pd.read_csv(tmp_path / "run.csv").iloc[150:].to_csv(tmp_path / "late.csv", index=False)
    arguments = [str(tmp_path / "late.csv"), "--body", str(tmp_path / "body.toml"), "--start", start, "--error", "1e-8"]
    done = CliRunner().invoke(main, ["verify", *arguments])
    assert done.exit_code == (1 if gone else 0), done.output
    assert (f"it is the motion without the {gone}" in done.stdout) == bool(gone)


@pytest.mark.parametrize(
    ("options", "expected"), [(("--euler", "zzq"), "euler: got 'zzq'"), (("--rates", "world"), "rates: got")]
)
def test_wrong_options_are_one_line(options, expected, tmp_path):
    done, _ = verify(tmp_path, exact(BRICK, T)[1], *options)
    assert (done.exit_code, len(done.stderr.splitlines())) == (2, 1)
    assert expected in done.stderr
