import csv
import json
import shlex
import subprocess
import sys
import tomllib

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner
from PIL import Image

import conservative as cv
from conservative.errors import REMOVED
from conservative.reports.cli.main import main

from ..environments import run_python
from ..sampling import sampled


def conservative(*arguments):
    """Run a command where tables have room, however wide the terminal is in which the tests were started."""
    return CliRunner(env={"COLUMNS": "200"}).invoke(main, [str(argument) for argument in arguments])


def one_line(text):
    return text.startswith("Error: ") and text.count("\n") == 1


def test_import_brings_in_nothing_heavy():
    heavy = ["numpy", "pandas", "numba", "altair", "rich", "jinja2", "mujoco", "scipy"]
    code = f"import sys, conservative.reports.cli.main; print([name for name in {heavy} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("command", [[], *([name] for name in main.commands)])
def test_help_has_examples_and_exit_codes(command):
    done = conservative(*command, "--help")
    assert done.exit_code == 0
    assert "Examples:" in done.stdout
    assert "Exit codes:" in done.stdout


def test_the_name_alone_says_what_can_be_done():
    done = conservative()
    assert done.exit_code == 0
    for line in done.stdout.splitlines():
        name = line.split()[1]
        assert name in main.commands or name == "--help"


def test_run_equals_the_known_rates():
    done = conservative("run", "brick_flip", "--method", "reduced", "--dt", "0.01", "--json")
    assert done.exit_code == 0
    summary = json.loads(done.stdout)
    # Rates of the scheme itself at t = 6
    error = np.abs(np.subtract(summary["last"]["w_WB_B"], (-0.2856185, 0.36022433, 9.99151229))).max()
    assert error < 1e-8  # measured 3.8e-9, the digits printed there
    assert summary["counters"]["steps"] == 600
    assert summary["drift"]["energy"] < 1e-14  # measured 4.5e-16
    assert summary["outcome"] == {"kind": "ok", "reason": "", "step": None, "time": None, "residual": None}


def test_several_methods_are_a_table():
    arguments = ("run", "brick_flip", "-m", "reduced", "-m", "reduced:order=4")
    second, fourth = json.loads(conservative(*arguments, "--json").stdout)
    assert [second["method"], fourth["method"]] == ["reduced", "reduced:order=4"]
    assert 1e-2 < second["error"]["attitude"] < 0.1  # measured 5.5e-2
    assert fourth["error"]["attitude"] < 1e-3
    assert fourth["drift"]["energy"] < 1e-13
    assert fourth["wall_time"] > 0
    lines = conservative(*arguments).stdout.splitlines()
    assert any(line.split()[:2] == ["reduced:order=4", "ok"] for line in lines)
    assert any(line.split()[:2] == ["reduced", "ok"] for line in lines)


def test_methods_are_shown_as_they_were_typed_and_the_others_beside_one_that_does_not_support_the_scene(tmp_path):
    done = conservative("run", "brick_flip", "-m", "lame,mujoco:RK4", "-m", "reduced")
    shown = {line.split()[0]: line.split()[1] for line in done.stdout.splitlines()[3:] if len(line.split()) > 6}
    assert (done.exit_code, shown) == (1, {"lame": "unsupported", "mujoco:RK4": "ok", "reduced": "ok"})
    assert "symmetric about one axis" in done.stderr
    watched = conservative("watch", "brick_flip", "-m", "lame,mujoco:RK4", "--out", tmp_path / "motion.html", "--json")
    runs = json.loads(watched.stdout)["runs"]
    assert (watched.exit_code, [run["typed"] for run in runs]) == (0, ["lame", "mujoco:RK4"])
    alone = conservative("run", "brick_flip", "-m", "lame")
    assert (alone.exit_code, one_line(alone.stderr)) == (2, True)


@pytest.mark.parametrize("scene", sampled(["lagrange_top", "brick_flip", "unstable_spin", "tumbling_satellite"], 1))
def test_without_a_method_and_a_step_a_run_is_accurate(scene):
    summary = run_as_json(scene)
    assert (summary["status"], summary["choice"]["error"], summary["choice"]["reached"]) == ("ok", 1e-6, True)
    assert summary["error"]["attitude"] < 1e-11  # measured 1e-14 to 6e-14
    assert summary["error"]["samples"] > 60
    finer = run_as_json(scene, "--error", "1e-9", "--dt", f"{summary['t_end'] / 100}")
    assert finer["error"]["attitude"] < 1e-9  # measured 1e-14 to 4e-14
    assert (finer["choice"]["error"], finer["error"]["samples"]) == (1e-9, 101)
    assert conservative("run", scene, "--error", "1e-9", "-m", "reduced").exit_code == 2


LOST = ("lagrange_top", "-m", "reduced", "--t-end", "0.6")
"""A run whose attitude error is 3 rad."""


def test_a_lost_motion_is_never_ok_without_a_sentence(tmp_path):
    """In any command that makes it, also without a reference solution."""
    assert run_as_json(*LOST)["status"].startswith("inaccurate: the attitude error is 3")
    assert run_as_json(*LOST, "--no-truth")["status"] == "ok, but its attitude error is not known"
    watched = conservative("watch", *LOST, "--out", tmp_path / "motion.html")
    assert "reduced: inaccurate: the attitude error is 3" in watched.stdout
    assert run_as_json("lagrange_top", "--no-truth")["status"] == "ok"  # its error is estimated


@pytest.mark.slow
def test_a_sweep_of_lost_motions_has_a_sentence():
    swept = conservative("sweep", *LOST, "--starts", "2", "--spread", "rate=1%")
    assert "the motions are inaccurate" in swept.stdout
    assert swept.exit_code == 1
    coarse = ("-m", "taylor:order=16", "--dt", "0.25", "--t-end", "0.5")  # accurate, but not with twice the step
    fine = ("--dt", "0.0001", "--t-end", "0.01")
    for right in (("brick_flip", *coarse), ("lagrange_top", *fine)):
        swept = conservative("sweep", *right, "--starts", "2", "--spread", "rate=1%")
        assert "inaccurate" not in swept.stdout
        assert swept.exit_code == 0


def test_a_chaotic_motion_that_no_step_reaches_is_not_ok(tmp_path):
    (tmp_path / "chaotic.toml").write_text(CHAOTIC)
    summary = run_as_json(tmp_path / "chaotic.toml", "--error", "1e-12", "--no-truth")
    assert not summary["choice"]["reached"]
    assert summary["status"].startswith(("less accurate than asked for", "inaccurate"))


@pytest.mark.parametrize("ending", sampled(["svg", "png"], 1, ["png"]))
def test_a_run_has_a_picture_and_a_folder(ending, tmp_path):
    picture, folder = tmp_path / f"picture.{ending}", tmp_path / "out"
    for _ in range(2):  # its own files are replaced
        done = conservative("run", "brick_flip", "--t-end", "0.1", "--picture", picture, "--out", folder, "--json")
        assert done.exit_code == 0, done.output
    assert picture.read_bytes().startswith({"svg": b"<!-- Written", "png": b"\x89PNG"}[ending])
    if ending == "png":
        with Image.open(picture) as image:
            assert image.info["Software"] == "Written by conservative"
            image.load()  # its checksums are right
    assert json.loads((folder / "run.json").read_text()) == json.loads(done.stdout)
    assert len((folder / "run.csv").read_text().splitlines()) == 12
    picture.write_bytes(b"mine")
    assert conservative("run", "brick_flip", "--picture", picture).exit_code == 2


def test_a_sweep_takes_one_method():
    done = conservative("sweep", "brick_flip", "--spread", "rate=1%", "-m", "gauss", "-m", "reduced")
    assert (done.exit_code, "methods: got gauss, reduced; expected one method" in done.stderr) == (2, True)


def test_a_table_shows_the_methods_that_fail_and_exits_with_1():
    done = conservative("run", "lagrange_top", "-m", "reduced", "-m", "convected:1e-29", "--t-end", "0.1")
    assert done.exit_code == 1
    assert "not converged in step" in done.stdout
    assert any(line.split()[:2] == ["reduced", "inaccurate"] for line in done.stdout.splitlines())  # 1.8 rad


def test_run_writes_samples(tmp_path):
    path = tmp_path / "run.csv"
    assert conservative("run", "lagrange_top", "--t-end", "0.1", "--csv", path).exit_code == 0
    table = csv.DictReader(path.read_text().splitlines())
    rows = [{name.partition(" ")[0]: value for name, value in row.items()} for row in table]
    assert len(rows) == 11
    assert float(rows[-1]["t"]) == pytest.approx(0.1, abs=1e-15)
    R = np.array([[float(rows[-1][f"R_WB_{i}{j}"]) for j in "123"] for i in "123"])
    assert np.abs(R.T @ R - np.eye(3)).max() < 1e-14  # measured 4e-16
    assert abs(float(rows[-1]["energy"]) / float(rows[0]["energy"]) - 1) < 1e-13  # measured 3e-15


def test_a_run_of_many_steps_keeps_a_limited_number_of_samples(tmp_path, monkeypatch):
    monkeypatch.setattr("conservative.reports.run.single_run.SAMPLES", 100)
    path = tmp_path / "run.csv"
    summary = json.loads(conservative("run", "brick_flip", "--dt", "0.007", "--csv", path, "--json").stdout)
    rows = list(csv.DictReader(path.read_text().splitlines()))
    assert summary["counters"]["steps"] == 858
    assert len(rows) == 97  # every ninth step, the start and the end
    assert float(rows[-1]["t (s)"]) == pytest.approx(858 * 0.007, rel=1e-14)  # measured 0


@pytest.mark.parametrize(("scene", "allowed"), [("brick_flip", 2e-11), ("kovalevskaya_top", 1e-13)])
def test_a_run_says_how_wrong_it_is(scene, allowed):
    right = json.loads(conservative("run", scene, "-m", "taylor", "--json").stdout)["error"]
    assert 0 < right["attitude"] < allowed  # measured 1.2e-11 (brick), 1.4e-14 (top: without closed form)
    wrong = json.loads(conservative("run", scene, "-m", "reduced", "--json").stdout)["error"]
    assert wrong["attitude"] > 1e-2
    assert wrong["rate"] > 1e-3
    skipped = json.loads(conservative("run", scene, "--no-truth", "--json").stdout)["error"]
    assert skipped == {"reason": "not computed (--no-truth)"}


@pytest.mark.slow
def test_a_long_run_without_closed_form_is_compared_when_asked():
    long = ("run", "kovalevskaya_top", "-m", "taylor", "--t-end", "450", "--dt", "0.05", "--json")  # 1,030 rad
    assert "--truth" in json.loads(conservative(*long).stdout)["error"]["reason"]
    assert json.loads(conservative(*long, "--truth").stdout)["error"]["attitude"] < 1e-8  # measured 2.5e-10


LOADED = """t_end = 20.0
body.inertia = [1.0, 2.0, 2.5]
start.w_WB_B = [0.5, 3.0, 0.2]
torque.value = [0.0, 0.3, 0.1]
damping.matrix = [[0.01, 0, 0], [0, 0.02, 0], [0, 0, 0.03]]
"""
WITH_ROTOR = """t_end = 20.0
body.inertia = [1.0, 2.0, 2.5]
start.w_WB_B = [0.5, 3.0, 0.2]
rotor.momentum = [0.3, -0.2, 0.5]
"""
CHAOTIC = """t_end = 80.0
body.inertia = [[0.856, -0.140, 0.260], [-0.140, 0.864, 0.253], [0.260, 0.253, 0.531]]
start = {w_WB_B = [0.341, -1.569, -1.021], R_WB = {axis = [1.081, 0.432, 2.067], angle = 2.372}}
potential = {kind = "point_attraction", strength = 0.52, point_B = [0.137, -0.093, -0.689], anchor_W = [-0.520, -0.566, 0.153]}
"""
NAMED = ["brick_flip:disturbance=1e-6", "tumbling_satellite"]


def run_as_json(*arguments):
    done = conservative("run", *arguments, "--json")
    found = json.loads(done.stdout)
    assert done.exit_code == int(found["status"].startswith("inaccurate")), done.output
    return found


SCENES = {"new": "new", "loads": LOADED, "rotor": WITH_ROTOR, "chaotic": CHAOTIC, **{name: name for name in NAMED}}


@pytest.mark.parametrize("name", sampled(SCENES, 2, ["new", "loads"]))
def test_the_advice_for_an_inaccurate_run_is_a_command_that_is_accurate(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    scene = SCENES[name]
    place, options = scene, ("-m", "textbook:scheme=gyroscopic")
    if scene not in NAMED:
        place = tmp_path / "my body.toml"
        place.write_text(conservative("new").stdout if scene == "new" else scene)
        options = ("-m", "reduced") if scene == "new" else ("--dt", "0.05" if scene is CHAOTIC else "0.2")
    summary = run_as_json(place, *options)
    assert summary["error"]["attitude"] > 0.1  # measured 0.2 and more
    assert summary["status"].startswith("inaccurate")
    better = summary["error"]["better"]
    assert better["shorter"] is (scene is CHAOTIC)
    assert better["command"] in conservative("run", place, *options).stdout
    name, command, *arguments = shlex.split(better["command"])
    assert (name, command) == ("conservative", "run")
    again = run_as_json(*arguments)
    assert (again["status"], "better" in again["error"]) == ("ok", False)
    assert again["error"]["attitude"] == pytest.approx(better["attitude"], rel=0.2, abs=1e-10)


def test_no_command_is_advised_without_an_accurate_run(monkeypatch):
    monkeypatch.setattr("conservative.reports.run.single_run.LARGE", 1e-18)
    summary = run_as_json("brick_flip", "--dt", "0.1")
    assert summary["error"]["better"] is None
    shown = conservative("run", "brick_flip", "--dt", "0.1").stdout
    assert "inaccurate" in shown
    assert "conservative run" not in shown


def test_a_table_marks_inaccurate_runs_and_says_what_to_do_once():
    names = ("reduced", "reduced:frame=auto", "taylor:order=12")
    lines = conservative(
        "run", "brick_flip", "--dt", "0.1", *(text for name in names for text in ("-m", name))
    ).stdout.splitlines()
    shown = dict(line.split()[:2] for line in lines if line.strip().startswith(names))
    assert shown == dict(zip(names, ("inaccurate", "inaccurate", "ok"), strict=True))
    assert sum("conservative run" in line for line in lines) == 1
    assert "conservative run" not in conservative("run", "brick_flip", "-m", "taylor", "-m", "gauss").stdout


def test_samples_as_csv_equal_the_table_and_replace_their_own_file(tmp_path):
    file = tmp_path / "run.csv"
    for _ in range(2):
        assert conservative("run", "brick_flip", "--dt", "0.01", "--csv", file).exit_code == 0
    table, other = pd.read_csv(file), cv.integrate(cv.scenes.brick_flip(), dt=0.01).to_pandas()
    assert {"t (s)", "q_WB_w", "w_WB_B_1 (rad/s)", "energy (J)", "momentum_W_3 (kg m^2/s)"} <= set(table.columns)
    np.testing.assert_array_equal(table, other)
    file.write_text("mine")
    assert conservative("run", "brick_flip", "--csv", file).exit_code == 2


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        (["run", "brick_flip", "--parquet", "a"], "run --parquet"),
        (["study", "random", "--latex=a"], "study --latex"),
        (["run", "brick_flip", "--picture", "a.pdf"], ".pdf"),
        (["watch", "brick_flip", "--out", "a.mp4"], ".mp4"),
        (["watch", "brick_flip", "--out", "a.MP4"], ".mp4"),
        (["study", "engines_at_one_step", "--engines", "all"], "study engines_at_one_step"),
        (["study", "engines_over_steps", "--engines", "mujoco"], "study engines_over_steps"),
    ],
)
def test_what_is_gone_is_answered_with_what_to_do(arguments, name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = conservative(*arguments)
    assert (done.exit_code, REMOVED[name] in done.stderr, list(tmp_path.iterdir())) == (2, True, [])


def test_what_cannot_be_written_here_is_no_advice(tmp_path):
    done = conservative("watch", "brick_flip", "--out", tmp_path / "a.pdf")  # not as .svg, either
    assert (done.exit_code, ".html, .gif, .png" in done.stderr, ".svg" in done.stderr) == (2, True, False)


def test_a_failed_run_reports_the_failure_and_writes_its_samples(tmp_path):
    path = tmp_path / "run.csv"
    done = conservative("run", "lagrange_top", "-m", "convected:1e-29", "--t-end", "0.1", "--csv", path)
    assert done.exit_code == 1
    assert one_line(done.stderr)
    assert "not converged in step" in done.stderr
    assert "not converged in step" in done.stdout
    assert len(path.read_text().splitlines()) == 2


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        (["brik_flip"], ["scene: got 'brik_flip'", "'brick_flip' (nearest)"]),
        (["brick_flip", "-m", "redused"], ["method: got 'redused'", "'reduced' (nearest)"]),
        (["brick_flip", "-m", "runge"], ["method: got 'runge'; expected one of "]),
        (["brick_flip", "-m", "convected:tool=1"], ["method convected: got 'tool=1'", "'tol' (nearest)"]),
        (["brick_flip", "-m", "convected:tol=-1"], ["tol: got -1", "above 0"]),
        (["brick_flip", "-m", "reduced:tol=1e-9"], ["method reduced: got 'tol=1e-9'", "without tol"]),
        (["brick_flip", "--dt", "0"], ["dt: got 0.0", "above 0"]),
        (["brick_flip", "--dt", "nan"], ["dt: got nan", "above 0"]),
        (["brick_flip", "--dt", "7"], ["dt: got 7", "at most t_end = 6"]),
        (["brick_flip", "--dt", "1e-15"], ["dt: got 1e-15, for more than 1e+11 steps", "--t-end"]),
        (["brick_flip", "--dt", "1e-300"], ["dt: got 1e-300", "of 1e-30 to"]),
        (["brick_flip", "--dt", "5e-324"], ["dt: got 5e-324", "of 1e-30 to"]),
        (["brick_flip", "--t-end", "-1"], ["t_end: got -1.0", "above 0"]),
        (["brick_flip", "--csv", "missing/run.csv"], ["csv: got 'missing/run.csv'", "a folder that exists"]),
    ],
)
def test_mistakes_end_in_one_clear_line(arguments, parts, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = conservative("run", *arguments)
    assert done.exit_code == 2
    assert done.stdout == ""
    assert one_line(done.stderr)
    assert all(part in done.stderr for part in parts)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("command", [("report", "--quick"), ("recommend", "brick_flip")])
def test_commands_with_engines_check_the_time_limit(command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert "--time-limit" in conservative(command[0], "--help").stdout
    done = conservative(*command, "--time-limit", "0")
    assert done.exit_code == 2
    assert one_line(done.stderr)
    assert "time_limit: got 0.0; expected a finite duration above 0, s" in done.stderr
    assert list(tmp_path.iterdir()) == []


TABLE_AS_CSV = ["run", "brick_flip", "-m", "reduced", "-m", "gauss", "--csv", "a.csv"]


@pytest.mark.parametrize(
    "arguments", [["run"], ["run", "brick_flip", "--dt", "fast"], ["nonsense"], ["list", "--xml"], TABLE_AS_CSV]
)
def test_usage_errors_exit_with_2(arguments):
    done = conservative(*arguments)
    assert done.exit_code == 2
    assert "Traceback" not in done.output


def test_a_bug_keeps_its_traceback(monkeypatch):
    def broken():
        raise ValueError("not the user's mistake")

    monkeypatch.setattr("conservative.reports.sections.catalogue.scenes", broken)
    assert isinstance(conservative("list").exception, ValueError)


def test_list_names_scenes_and_methods():
    listed = json.loads(conservative("list", "--json").stdout)
    brick = next(scene for scene in listed["scenes"] if scene["name"] == "brick_flip")
    assert brick["group"] == "free body"
    assert brick["invariants"] == ["energy", "momentum"]
    assert "5.1" in brick["source"]
    reduced = next(method for method in listed["methods"] if method["name"] == "reduced")
    assert reduced["order"] == 2
    assert reduced["available"]
    assert "energy" in reduced["conserves"]
    shown = conservative("list").stdout
    for part in ("Scenes: free body", "lagrange_top", "Methods: ours", "convected"):
        assert part in shown


def test_missing_engine_is_listed_with_its_install_line(monkeypatch):
    from conservative import MissingEngine, Reduced

    def missing(self):
        raise MissingEngine("reduced", "some-package")

    monkeypatch.setattr(Reduced, "label", property(missing))
    listed = json.loads(conservative("list", "--json").stdout)
    entry = next(method for method in listed["methods"] if method["name"] == "reduced")
    assert not entry["available"]
    assert "pip install some-package" in entry["reason"]
    done = conservative("run", "brick_flip", "-m", "reduced")
    assert done.exit_code == 2
    assert "pip install some-package" in done.stderr


def commands(group):
    """Return all commands of a group, those of its groups among them, by name."""
    found = {}
    for name, command in group.commands.items():
        below = {f"{name} {each}": value for each, value in commands(command).items()} if hasattr(command, "commands") else {}
        found |= below or {name: command}
    return found


@pytest.mark.parametrize(("name", "command"), list(commands(main).items()))
def test_every_command_speaks_json(name, command):
    assert "--json" in {name for parameter in command.params for name in parameter.opts}, name


def test_new_writes_a_file_that_every_command_takes_for_a_scene(tmp_path):
    path = tmp_path / "my_body.toml"
    written = conservative("new")
    assert written.exit_code == 0
    path.write_text(written.stdout)
    done = conservative("run", path, "-m", "reduced", "--t-end", "0.1", "--json")
    assert done.exit_code == 0
    summary = json.loads(done.stdout)
    assert (summary["scene"], summary["outcome"]["kind"], summary["dt"]) == ("my_body", "ok", 0.002)


def test_new_as_json_has_keys_meanings_and_choices():
    told = json.loads(conservative("new", "--json").stdout)
    assert tomllib.loads(told["text"]) == tomllib.loads(conservative("new").stdout)
    keys = {entry["key"]: entry for entry in told["keys"]}
    assert keys["t_end"]["value"] == 2.0
    assert keys["t_end"]["meaning"] == "duration, s"
    assert keys["start.R_WB.angle"]["value"] == pytest.approx(1.0471975511965976, abs=1e-15)  # measured 0
    assert all(entry["meaning"] for entry in keys.values())
    assert told["text"].splitlines()[keys["body.shape"]["line"] - 1].startswith("shape = ")
    assert told["choices"]["shape"]["cone"] == ["radius", "height", "mass", "density"]


@pytest.mark.parametrize("table", ["shape", "kind"])
def test_choices_are_those_that_a_scene_file_accepts(table, tmp_path):
    choices = json.loads(conservative("new", "--json").stdout)["choices"][table]
    for name, keys in choices.items():
        path = tmp_path / f"{name}.toml"
        body = f'[body]\nshape = "{name}"\nbad = 1' if table == "shape" else "[body]\ninertia = [1, 2, 2.5]"
        potential = f'[potential]\nkind = "{name}"\nbad = 1\n' if table == "kind" else ""
        path.write_text(f"t_end = 1.0\n{body}\n{potential}[start]\nw_WB_B = [0, 0, 1]\n")
        allowed = conservative("run", path).stderr.partition("one of ")[2].strip().split(", ")
        assert set(keys) == set(allowed) - {"shape", "kind", "com_B" if table == "shape" else "", "R_BS"}


def test_a_balance_that_a_method_does_not_sum_has_no_drift(tmp_path):
    body = "[body]\ninertia = [2.0, 3.0, 4.0]\n[damping]\nmatrix = [[0.2, 0, 0], [0, 0.1, 0], [0, 0, 0.1]]\n"
    (tmp_path / "damped.toml").write_text(f"t_end = 0.5\n{body}[start]\nw_WB_B = [1.0, 0.5, -0.7]\n")
    arguments = ["run", str(tmp_path / "damped.toml"), "--dt", "0.01", "-m", "scipy", "--no-truth"]
    alone, both = (CliRunner().invoke(main, arguments + more) for more in ([], ["-m", "reduced"]))
    for done in (alone, both):
        assert done.exit_code == 0, done.output
        assert "nan" not in done.output
        assert "–" in done.output


def test_a_command_prints_a_warning_as_a_line(tmp_path):
    (tmp_path / "body.toml").write_text("t_end = 0.1\n[body]\ninertia = [1.0, 1.0, 5.0]\n[start]\nw_WB_B = [0.1, 2.0, 0.1]\n")
    code = "import sys; sys.argv[0] = 'conservative'\nfrom conservative.reports.cli.launch import launch\nlaunch()"
    status, out, err = run_python(code, "run", str(tmp_path / "body.toml"), "-m", "moser_veselov", "--json")
    assert (status, "outcome" in json.loads(out)) == (0, True)
    assert err.startswith("Warning: No mass distribution has the moments 1, 1, 5 kg m^2")
    assert err.count("\n") == 1
