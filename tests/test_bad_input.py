"""Bad input to the public API and the command line: the message has argument, value and valid values, and no file is left.

A row has a call, the argument, a part of the value, and a part of the valid values.
"""

import math
from fractions import Fraction

import numpy as np
import pytest
from click.testing import CliRunner

import conservative as cv
from conservative import registry
from conservative.attitude import rotation_about
from conservative.references.environments.catalogue import MuJoCo
from conservative.references.exact import method
from conservative.references.model_files.scene_bodies import body_from_mjcf
from conservative.references.precise import Precise
from conservative.references.solvers.heyoka import Heyoka
from conservative.references.solvers.scipy import SciPy
from conservative.reports.cli.main import main

NAN, INF, HUGE = math.nan, math.inf, 10**400
ONE = np.eye(3)
BODY = cv.RigidBody((1.0, 2.0, 2.5))
BRICK = cv.scenes.brick_flip()
TOP = cv.scenes.lagrange_top()
TURN = rotation_about((1, 2, 3), 0.7)
FLAT = TURN @ np.diag((1e-14, 1, 1)) @ TURN.T
HOOK = np.array([0.0, 0.1, 0.4])
SHEAR = ONE + 1e-3 * np.outer((1, 0, 0), (0, 1, 0))


def scene(**changed):
    arguments = {"name": "s", "body": BODY, "R_WB0": ONE, "w_WB_B0": (0, 0, 1), "t_end": 1.0} | changed
    return cv.Scene(**arguments)


def field(**changed):
    arguments = {
        "energy": lambda R: (R[2] @ HOOK) ** 4,
        "gradient": lambda R: np.outer([0, 0, 1], 4 * (R[2] @ HOOK) ** 3 * HOOK),
    }
    return cv.FunctionPotential(**arguments | changed)


class Texts(cv.UniformGravity):
    features = frozenset({"gravity"})


API = [
    # bodies
    (lambda: cv.RigidBody((1, 2, NAN)), "inertia", "nan", "three positive moments"),
    (lambda: cv.RigidBody((1, -2, 2)), "inertia", "-2", "positive"),
    (lambda: cv.RigidBody([[1, 0.1, 0], [0, 1, 0], [0, 0, 1]]), "inertia", "off by 0.1", "symmetric"),
    (lambda: cv.RigidBody([[1, 2, 0], [2, 1, 0], [0, 0, 1]]), "inertia", "-1", "positive definite"),
    (lambda: cv.RigidBody((1, 2)), "inertia", "shape (2,)", "(3,)"),
    (lambda: cv.RigidBody("heavy"), "inertia", "'heavy'", "(3,)"),
    # scenes
    (lambda: scene(name=""), "name", "''", "one character"),
    (lambda: scene(name="n" * 1001), "name", "'nnn", "1,000"),
    (lambda: scene(body=(1, 2, 3)), "body", "(1, 2, 3)", "RigidBody"),
    (lambda: scene(R_WB0=SHEAR), "R_WB0", "|R'R - 1| = 0.001", "rotation"),
    (lambda: scene(R_WB0=np.diag([1, 1, -1])), "R_WB0", "reflection", "determinant +1"),
    (lambda: scene(R_WB0=(1, 0, 0, 0)), "R_WB0", "shape (4,)", "(3, 3)"),
    (lambda: scene(w_WB_B0=(0, 1)), "w_WB_B0", "shape (2,)", "(3,)"),
    (lambda: scene(t_end=-1), "t_end", "-1", "above 0"),
    (lambda: scene(t_end="long"), "t_end", "'long'", "finite"),
    (lambda: scene(potential="gravity"), "potential", "'gravity'", "Potential"),
    (lambda: scene(dt=-0.1), "dt", "-0.1", "above 0"),
    # potentials
    (lambda: cv.UniformGravity(NAN, (0, 0, 1)), "weight", "nan", "finite"),
    (lambda: cv.UniformGravity(1.0, (0, 0, INF)), "com_B", "inf", "finite"),
    (lambda: cv.LinearSpring(INF, (1, 0, 0), (0, 0, 1)), "stiffness", "inf", "finite"),
    (lambda: cv.PointAttraction(1.0, (1, 0, 0), (0, NAN, 1)), "anchor_W", "nan", "finite"),
    (lambda: cv.GravityGradient(0.0, (1, 2, 2.5)), "rate", "0.0", "above 0"),
    (lambda: cv.GravityGradient(1.0, (1, 2, 2.5), (0, 0, 0)), "direction_W", "[0.0, 0.0, 0.0]", "not all 0"),
    (lambda: cv.GravityGradient(1.0, (1, 2, -3)), "inertia", "-3", "positive"),
    (lambda: cv.LinearSpring(0, (1, 0, 0), (0, 0, 1)), "stiffness", "0", ""),
    (lambda: cv.LinearSpring(1, (1, 2), (0, 0, 1)), "point_B", "(2,)", ""),
    (lambda: cv.LinearSpring(1, (1, 0, 0), (0, 0, 1), -0.1), "rest_length", "-0.1", ""),
    (lambda: cv.PointAttraction(0, (1, 0, 0), (0, 0, 1)), "strength", "0", ""),
    (lambda: cv.PointAttraction(1, (0, 0, 0), (0, 0, 0)), "anchor_W", "the fixed point", ""),
    # shapes
    (lambda: cv.shapes.box((1, -2, 3), mass=1), "size", "-2.0", "above 0, m"),
    (lambda: cv.shapes.cone(NAN, 1, mass=1), "radius", "nan", "above 0, m"),
    (lambda: cv.shapes.box((1, 2, 3)), "mass", "neither", "density"),
    (lambda: cv.shapes.box((1, 2, 3), mass=1, density=2), "density", "mass = 1", "not both"),
    (lambda: cv.shapes.box((1, 2, 3), density="iron"), "density", "'iron'", "kg/m^3"),
    (lambda: cv.shapes.box((1, 2, 3), mass=1).about((0, 0, INF)), "com_B", "inf", "three finite numbers"),
    (lambda: cv.shapes.box((1, 2, 3), mass=1).rotate(2 * ONE), "R_BS", "|R'R - 1| = 3", "rotation matrix"),
    # runs
    (lambda: cv.integrate("brick_flip"), "scene", "'brick_flip'", "Scene"),
    (lambda: cv.integrate(BRICK, 0), "dt", "0", "above 0"),
    (lambda: cv.integrate(BRICK, NAN), "dt", "nan", "finite"),
    (lambda: cv.integrate(BRICK, 7.0), "dt", "7", "at most t_end = 6"),
    (lambda: cv.integrate(BRICK, 0.01, t_end=-1), "t_end", "-1", "above 0"),
    (lambda: cv.integrate(BRICK, 0.01, sample_every=0), "sample_every", "0", "1 or more"),
    (lambda: cv.integrate(BRICK, 0.01, method="redused"), "method", "'redused'", "'reduced' (nearest)"),
    (lambda: cv.integrate(BRICK, 0.01, method=cv.Reduced), "method", "Reduced", "Method"),
    (lambda: cv.integrate(BRICK, 0.01, on_failure="ignore"), "on_failure", "'ignore'", "'raise', 'return'"),
    (lambda: cv.integrate(BRICK, error=0.0), "error", "0.0", "above 0"),
    (lambda: cv.integrate(BRICK, method=cv.Reduced(), error=1e-6), "method", "Reduced", "None together with error"),
    # methods
    (lambda: cv.Convected(tol=0), "tol", "0", "above 0"),
    (lambda: cv.Reduced(order=3), "order", "3", "2, 4, 6, 8, 10"),
    (lambda: cv.Gauss(stages=0), "stages", "0", "1 to 10"),
    (lambda: cv.integrate(TOP, 0.01, cv.MoserVeselov()), "method", "lagrange_top", "does not support uniform gravity"),
    (lambda: cv.integrate(BRICK, 0.7, cv.MoserVeselov()), "dt", "0.7", "|w| dt < 6"),
    (lambda: cv.integrate(BRICK, 0.01, cv.Gauss(frame="non_spinning")), "method", "brick_flip", "symmetric"),
    (lambda: MuJoCo("RK5"), "integrator", "'RK5'", "'RK4'"),
    (lambda: Heyoka(tol=0), "tol", "0", "above 0"),
    (lambda: SciPy(rtol=-1.0), "rtol", "-1.0", "below 1"),
    (lambda: Precise(bits=10), "bits", "10", "53"),
    (lambda: method.free_body(BODY, SHEAR, (0, 0, 1), [0.0]), "R_WB0", "0.001", "rotation"),
    (lambda: method.free_body(BODY, ONE, (0, 0, 1), [0.0, NAN]), "t", "nan", "finite"),
    # numbers that no float can follow, and those out of range
    (lambda: cv.RigidBody((HUGE, 1, 1)), "inertia", "1000", "three positive moments"),
    (lambda: cv.RigidBody((1e61, 1, 1)), "inertia", "1e+61", "the largest 0 or of magnitude 1e-60 to 1e+60"),
    (lambda: cv.RigidBody((0, 1, 1)), "inertia", "not all positive", "for a rod or a linear molecule (1e-9 I, I, I)"),
    (lambda: cv.RigidBody((-1, 1, 1)), "inertia", "not all positive", "three positive moments"),
    (lambda: scene(body=cv.RigidBody((1e31, 1e31, 1e31)), potential=field()), "inertia", "1e+31", "beside a field or a load"),
    (lambda: scene(body=cv.RigidBody((1e31, 1e31, 1e31), (0, 0, 1))), "inertia", "1e+31", "only ratios matter"),
    (lambda: cv.RigidBody(("1", "2", "3")), "inertia", "'1'", "three positive moments"),
    (lambda: cv.RigidBody(FLAT), "inertia", "e-15", "ratio up to 1e+13"),
    (lambda: scene(t_end=HUGE), "t_end", "1000", "above 0"),
    (lambda: scene(t_end=10**5000), "t_end", "a value of type int", "above 0"),
    (lambda: scene(w_WB_B0=(Fraction(HUGE), 0, 0)), "w_WB_B0", "Fraction", "three finite rates"),
    (lambda: cv.UniformGravity(-1e-200, (0, 0, 1)), "weight", "-1e-200", "0 or of magnitude"),
    (lambda: cv.shapes.box((1, 2, 3), mass=HUGE), "mass", "1000", "above 0"),
    (lambda: cv.scenes.lagrange_top(height=1e-30), "inertia", "e-", "1e-60"),
    (lambda: Heyoka(tol=1e-99), "tol", "1e-99", "from 1e-20"),
    # resources
    (lambda: cv.integrate(BRICK, 1e-15), "sample_every", "5999999999999995 steps", "samples fit in memory"),
    (lambda: cv.integrate(BRICK, 1e-18), "dt", "6e+18 steps", "6.66e-16 s or more"),
    (lambda: cv.Grid(0.01, 10**12), "every", "1000000000001 samples", "samples fit in memory"),
    (lambda: cv.Grid(0.01, 2**60, 2**60), "n_steps", "1152921504606846976", "2^53"),
    (lambda: cv.Grid(0.01, 10, "2"), "every", "'2'", "1 to 2^53"),
    # settings and parts that are of no use at all
    (lambda: scene(extra_invariants=[1.0]), "extra_invariants", "[1.0]", "Invariants"),
    (lambda: scene(potential=cv.UniformGravity), "potential", "UniformGravity", "a Potential"),
    (lambda: scene(name="a\0b"), "name", "x00", "a text"),
    (lambda: cv.MethodInfo(supports={"gravity"}), "supports", "'gravity'", "Feature.GRAVITY"),
    (lambda: cv.MethodInfo(supports="rotors"), "supports", "'rotors'", "Feature.ROTOR"),
    (
        lambda: cv.MethodInfo(supports=frozenset({"uniform gravity", cv.Feature.ROTOR})),
        "supports",
        "'uniform gravity'",
        "Feature.GRAVITY",
    ),
    (lambda: cv.MethodInfo(supports=[cv.Feature.GRAVITY]), "supports", "Feature.GRAVITY", "a set of members"),
    (lambda: scene(potential=Texts(1.0, (0, 0, 1))), "features", "'gravity'", "Feature.GRAVITY"),
    (lambda: cv.Invariant("i" * 1001, "J", 1.0, len), "name", "'iii", "1,000"),
    (lambda: cv.Invariant("i", "J", 0.0, len), "scale", "0.0", "above 0"),
    (lambda: cv.Invariant("i", "J", 1.0, None), "evaluate", "None", "a function"),
    (lambda: body_from_mjcf("a\0b", "arm"), "path", "x00", "without NUL"),
    # functions of potentials
    (lambda: field(energy=lambda R: "one"), "energy", "'one'", "a real number"),
    (lambda: field(energy=lambda R: 1 / 0), "energy", "ZeroDivisionError", "a real number"),
    (lambda: field(energy=3), "energy", "3", ""),
    (lambda: field(gradient=None), "gradient", "None", ""),
    (lambda: field(gradient=lambda R: np.full((3, 3), NAN)), "gradient", "nan", ""),
    (lambda: field(gradient=lambda R: -np.outer([0, 0, 1], 4 * (R[2] @ HOOK) ** 3 * HOOK)), "gradient", "", ""),
    (lambda: field(scale=0), "scale", "0", "above 0"),
    (lambda: field(gradient=lambda R: None), "gradient", "None", "a matrix (3, 3)"),
    (lambda: field(gradient=lambda R: [1, 2, 3]), "gradient", "[1, 2, 3], not a matrix (3, 3)", "a matrix (3, 3)"),
    (lambda: field(axis_W=(0, 0, 2)), "axis_W", "2.0", "a unit vector"),
    (lambda: field(axis_W=(1, 0, 0)), "axis_W", "a torque of", "symmetric"),
    (lambda: field(scale=INF), "scale", "inf", "above 0"),
    # names
    (lambda: registry.scene("a\0.toml"), "scene", "x00", "a text"),
    (lambda: registry.method(3), "method", "3", "a text"),
    (lambda: registry.scene("brick_flip:none"), "scene brick_flip", "'none'", "a number"),
    (lambda: registry.scene("brick_flipp"), "scene", "'brick_flipp'", "'brick_flip' (nearest)"),
    (lambda: registry.scene("brick_flip:wobble=1"), "scene brick_flip", "wobble", "disturbance"),
    (lambda: registry.method("mujocco"), "method", "'mujocco'", "'mujoco' (nearest)"),
    (lambda: registry.method("convected:eps=1e-8"), "method convected", "eps", "tol"),
]


@pytest.mark.parametrize(("call", "argument", "got", "allowed"), API, ids=[f"{i}-{row[1]}" for i, row in enumerate(API)])
def test_api(call, argument, got, allowed, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(cv.BadInput) as caught:
        call()
    error = caught.value
    assert error.argument == argument
    assert got in str(error.got)
    assert allowed in error.allowed
    assert str(error) == f"{argument}: got {error.got}; expected {error.allowed}"
    assert not list(tmp_path.iterdir())


COMMANDS = [
    ("run brickflip", "scene", "'brickflip'", "'brick_flip' (nearest)"),
    ("run brick_flip --method redused", "method", "'redused'", "'reduced' (nearest)"),
    ("run brick_flip --dt 0 --csv out.csv", "dt", "0.0", "above 0"),
    ("run brick_flip --dt fast", "--dt", "'fast'", "float"),
    ("run brick_flip -m convected:tol=-1", "tol", "-1", "above 0"),
    ("run lagrange_top -m moser_veselov", "method", "lagrange_top", "does not support uniform gravity"),
    ("run brick_flip --csv no/such/folder/out.csv", "csv", "no/such/folder", "folder"),
    ("run no_such_file.toml", "no_such_file.toml", "no_such_file.toml", "file"),
    ("report --methods reduced,nope", "method", "'nope'", "one of"),
    ("report --out kept.txt", "out", "kept.txt", "folder"),
    ("run brick_flip --csv a\0.csv", "--csv", "x00", "without NUL"),
    ("run a\0.toml", "scene", "x00", "a text"),
    ("run brick_flip --dt 1e-15", "dt", "more than 1e+11 steps", "--t-end"),
    ("reprot", "reprot", "reprot", "report"),
]


@pytest.mark.parametrize(("words", "argument", "got", "allowed"), COMMANDS, ids=[row[0] for row in COMMANDS])
def test_command_line(words, argument, got, allowed, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "kept.txt").write_text("mine")
    outcome = CliRunner().invoke(main, words.split())
    assert outcome.exit_code == 2, outcome.output
    assert "Traceback" not in outcome.output
    assert outcome.stdout == ""
    for piece in (argument, got, allowed):
        assert piece in outcome.stderr
    assert [file.name for file in tmp_path.iterdir()] == ["kept.txt"]
    assert (tmp_path / "kept.txt").read_text() == "mine"
