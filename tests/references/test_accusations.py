"""Each sentence about an engine has a script of the engine alone, which prints what its row says."""

import ast
import importlib
import os
import re
import shutil
import sys
from dataclasses import replace
from types import SimpleNamespace

import pytest

from conservative.errors import BadInput
from conservative.references.accusations import __main__ as command
from conservative.references.accusations import measure, rows

from ..environments import ROOT
from ..sampling import sampled

ACCUSATIONS = {row.script: row for row in rows.read_accusations()}
LOCAL = [name for name, row in ACCUSATIONS.items() if row.engine in measure.LOCAL]
APART = [name for name, row in ACCUSATIONS.items() if row.engine not in measure.LOCAL]

# A Pinocchio that is right, because MuJoCo reads its files.
PINOCCHIO = """
from types import SimpleNamespace
import mujoco, numpy as np
from scipy.spatial.transform import Rotation
exp3 = lambda vector: Rotation.from_rotvec(vector).as_matrix()
JointModelFreeFlyer = lambda: None
def buildModelFromMJCF(path):
    model, R = mujoco.MjModel.from_xml_path(path), np.zeros(9)
    mujoco.mju_quat2Mat(R, model.body_iquat[1])
    inertia = R.reshape(3, 3) @ np.diag(model.body_inertia[1]) @ R.reshape(3, 3).T
    return SimpleNamespace(inertias=[None, SimpleNamespace(mass=model.body_mass[1], inertia=inertia)])
def buildModelFromUrdf(path, joint):
    raise ValueError("the inertia is impossible")
"""
# A MuJoCo that accepts everything, for scripts that count refusals.
MUJOCO = """
import numpy as np
def mju_quat2Mat(R, q):
    R[:] = np.eye(3).ravel()
class MjModel:
    from_xml_string = staticmethod(lambda text: None)
"""
# A Rapier in which a body about its own axis keeps its angular velocity.
RAPIER = """
class Settings {
  setRotation() { return this; } setCanSleep() { return this; } setAdditionalMassProperties() { return this; }
  setAngvel(w) { this.w = w; return this; }
}
class World { createRigidBody(settings) { return { angvel: () => settings.w }; } step() {} }
export default { init: async () => {}, World, RigidBodyDesc: { dynamic: () => new Settings() } };
"""
RIGHT = [(name, "pinocchio", PINOCCHIO) for name in ACCUSATIONS if name.startswith("pinocchio")]
RIGHT += [(name, "mujoco", MUJOCO) for name in ("mujoco_flat_plates.py", "mujoco_small_moments.py")]


def run(accusation, **variables):
    """Run a script in this interpreter."""
    command = [sys.executable, "-P", accusation.path]
    return measure.run(command, accusation.file_path, variables={**os.environ, **variables})


def test_each_row_has_its_script_and_file():
    assert {path.name for path in (rows.HERE / "scripts").iterdir() if path.is_file()} == {*ACCUSATIONS}
    used = [accusation.file_path for accusation in ACCUSATIONS.values() if accusation.file]
    assert all(path.is_file() for path in used)
    assert {*(rows.HERE / "files").iterdir()} <= {*used}
    sentences = [row.sentence for row in rows.read_accusations()]
    assert all(re.fullmatch(r"\S.*\.", sentence) for sentence in sentences)


@pytest.mark.parametrize("name", ACCUSATIONS)
def test_a_script_is_short_and_of_the_engine_alone(name):
    text = ACCUSATIONS[name].path.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 35
    assert "conservative" not in text
    assert all(word in text for word in ("wrong", "right"))
    if name.endswith(".py"):
        imports = [node for node in ast.walk(ast.parse(text)) if isinstance(node, (ast.Import, ast.ImportFrom))]
        modules = [alias.name if isinstance(node, ast.Import) else node.module for node in imports for alias in node.names]
        roots = {module.partition(".")[0] for module in modules} - {*sys.stdlib_module_names, "numpy"}
        # Newton's arrays are Warp's, JAX compiles Brax and MJX, and pybullet_utils is a part of PyBullet.
        assert len(roots - {"warp", "jax", "pybullet_utils"}) == 1


def test_rows_are_measured_and_in_order():
    results = rows.read_results()
    assert {result.script for result in results} == {*ACCUSATIONS}
    assert all(result.verdict in ("right", "wrong") for result in results)
    assert measure.merge(results, []) == results


def check(name):
    """Compare what a script prints here with the row of the version, or its verdict with the row of the newest version."""
    known = [result for result in rows.read_results() if result.script == name]
    found = measure.find_interpreters(ACCUSATIONS[name].engine)
    assert found
    for interpreter in found:
        verdict, printed = interpreter.run(ACCUSATIONS[name].path, ACCUSATIONS[name].file_path)
        same = [result for result in known if result.version == interpreter.version]
        assert (verdict, printed) == (same[0].verdict, same[0].printed) if same else verdict == known[-1].verdict


@pytest.mark.parametrize("name", sampled(LOCAL, 5, keep=["mujoco_flat_plates.py", "pinocchio_euler_sequences.py"]))
def test_a_script_prints_what_its_row_says(name):
    check(name)


@pytest.mark.parametrize("name", [pytest.param(name, marks=pytest.mark.engine(ACCUSATIONS[name].engine)) for name in APART])
def test_a_script_in_an_environment_prints_what_its_row_says(name):
    check(name)


@pytest.mark.parametrize(("name", "module", "text"), RIGHT, ids=[name for name, *_ in RIGHT])
def test_a_right_engine_is_called_right(tmp_path, name, module, text):
    (tmp_path / f"{module}.py").write_text(text)
    assert run(ACCUSATIONS[name], PYTHONPATH=str(tmp_path))[0] == "right"


@pytest.mark.skipif(not shutil.which("node"), reason="needs Node")
def test_a_right_engine_in_javascript_is_called_right(tmp_path):
    package = tmp_path / "node_modules" / "@dimforge" / "rapier3d-compat"
    package.mkdir(parents=True)
    (package / "package.json").write_text('{"name": "@dimforge/rapier3d-compat", "type": "module", "exports": "./index.js"}')
    (package / "index.js").write_text(RAPIER)
    kind = SimpleNamespace(name="npm", variables=lambda folder: None)
    interpreter = measure.Interpreter("rapier_js", "1", SimpleNamespace(kind=kind, folder=tmp_path))
    accusation = ACCUSATIONS["rapier_js_axis_without_inertia.mjs"]
    assert interpreter.run(accusation.path, None)[0] == "right"
    (package / "index.js").write_text(RAPIER.replace("settings.w }", "({ x: 0, y: 0, z: 0 }) }"))
    assert interpreter.run(accusation.path, None)[0] == "wrong"


@pytest.mark.parametrize(
    ("text", "answer"),
    [
        ("print('noise')\nprint('a number: wrong')", ("wrong", "a number")),
        ("print('right: 1')", ("undecided", "exit code 0: right: 1")),
        ("print('fine: right')\nraise SystemExit(3)", ("undecided", "exit code 3: fine: right")),
        ("raise KeyError('absent')", ("undecided", "exit code 1: KeyError: 'absent'")),
        ("import os; os.abort()", ("undecided", "exit code -6: ")),
        ("", ("undecided", "exit code 0: ")),
    ],
)
def test_only_the_last_word_of_a_script_that_ends_well_counts(tmp_path, text, answer):
    (tmp_path / "script.py").write_text(text)
    verdict, printed = measure.run([sys.executable, tmp_path / "script.py"], None)
    assert (verdict, printed[: len(answer[1])]) == answer


def test_a_hang_is_undecided(tmp_path, monkeypatch):
    (tmp_path / "script.py").write_text("import time; time.sleep(1000)")
    monkeypatch.setattr(measure, "LIMIT", 1.0)
    assert measure.run([sys.executable, tmp_path / "script.py"], None) == ("undecided", "timeout (after 1 s)")


@pytest.fixture
def mended(monkeypatch):
    """A new version of Jolt that is right."""
    new = rows.Result("jolt_small_inertia.mjs", "99.0", "right", "three bodies are kept", "2027-01-01")
    monkeypatch.setattr(command, "measure", lambda names: iter([new]))
    return new


def test_a_version_that_mends_one_fails_the_check_and_changes_the_page(mended, monkeypatch, capsys):
    assert command.main(["--check"]) == 1
    assert "jolt_small_inertia.mjs: wrong in " in capsys.readouterr().out
    monkeypatch.syspath_prepend(ROOT / ".ci" / "readme")
    accused = importlib.import_module("accused")
    before = accused.accusations("motions")
    assert before in accused.PAGES["motions"].read_text(encoding="utf-8")
    merged = measure.merge(rows.read_results(), [mended])
    monkeypatch.setattr(accused, "read_results", lambda: merged)
    assert "99.0: right" in accused.accusations("motions")
    right = [replace(result, verdict="right") for result in merged]
    monkeypatch.setattr(accused, "read_results", lambda: right)
    assert accused.accusations("motions").count("\n") == 2  # the header


def test_the_same_answers_pass_the_check(monkeypatch, capsys):
    known = rows.read_results()
    monkeypatch.setattr(command, "measure", lambda names: iter([*known, replace(known[0], version="99.0")]))
    assert command.main(["--check"]) == 0
    assert "changed" not in capsys.readouterr().out
    # A result that says the same keeps its date, and a result without a verdict is not written.
    assert measure.merge(known, [replace(known[0], version="99.0", verdict="undecided")]) == known
    assert measure.merge(known, [replace(known[0], date="2030-01-01")]) == known


def test_results_are_written(mended, monkeypatch, tmp_path):
    shutil.copyfile(rows.MEASURED, tmp_path / "measured.csv")
    monkeypatch.setattr(rows, "MEASURED", tmp_path / "measured.csv")
    before = rows.read_results()
    assert command.main([]) == 0
    assert {*rows.read_results()} - {*before} == {mended}


def test_unknown_engines_are_refused():
    with pytest.raises(BadInput, match="a script, or one of mujoco, pinocchio"):
        command.main(["joltt"])


def test_engines_that_are_missing_are_named(monkeypatch, capsys):
    monkeypatch.setattr(measure, "list_environments", lambda engine: ())
    assert command.main(["--missing"]) == 0
    names = capsys.readouterr().out.split()
    assert "jolt" in names
    assert not {"mujoco", "pinocchio", ""} & {*names}
