"""Scenes from TOML files: every form of every part, fields that turn, and mistakes reported with line and key."""

import math
import os
import subprocess
import sys

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import conservative as cv
from conservative import registry, shapes, toml_reader
from conservative.scene_files import scene_file
from conservative.toml_reader import DEEPEST, LARGEST, BadFile, key_lines, read

from ..environments import PATIENCE

AXIS, ANGLE = np.array([0.3, -1.2, 0.7]), 0.83
R = Rotation.from_rotvec(ANGLE * AXIS / np.linalg.norm(AXIS)).as_matrix()
TENSOR = [[3.1, 0.2, -0.1], [0.2, 2.7, 0.3], [-0.1, 0.3, 1.9]]

GOOD = f"""# a comment
t_end = 3
dt = 0.01

[body]
inertia = [
    {TENSOR[0]},   # a comment inside
    {TENSOR[1]},
    {TENSOR[2]},
]

[potential]
kind = "uniform_gravity"
weight = 12.5
com_B = [0.1, -0.2, 0.3]

[start]
w_WB_B = [0.5, -1.5, 2.5]
R_WB.axis = {AXIS.tolist()}
R_WB.angle = {ANGLE}
"""


ORBIT = "[orbit]\nrate = 0.3\nnormal_W = [0, 0, 2]\n"


def replaced(old, new):
    assert GOOD.count(old) == 1, old
    return GOOD.replace(old, new)


def in_field(text):
    """Return GOOD with another potential, and perhaps an orbit."""
    head, rest = GOOD.split("[potential]")
    return head + "[potential]\n" + text + "\n[start]" + rest.split("[start]")[1]


def body_of(text):
    head, rest = GOOD.split("[body]")
    return head + "[body]\n" + text + "\n\n[start]" + rest.split("[start]")[1]


@pytest.fixture
def written(tmp_path):
    def write(text):
        path = tmp_path / "my_body.toml"
        path.write_bytes(text.encode() if isinstance(text, str) else text)
        return path

    return write


def test_every_number_of_a_file_is_in_the_scene(written):
    path = written(GOOD)
    scene = registry.scene(str(path))
    assert (scene.name, scene.t_end, scene.dt, scene.source) == ("my_body", 3.0, 0.01, str(path))
    np.testing.assert_array_equal(scene.body.inertia, TENSOR)
    np.testing.assert_array_equal(scene.w_WB_B0, (0.5, -1.5, 2.5))
    np.testing.assert_allclose(scene.R_WB0, R, atol=1e-15)  # measured 2e-16
    np.testing.assert_allclose(scene.potential.moment_B, (1.25, -2.5, 3.75), rtol=1e-15)


def test_the_template_loads_as_it_is_and_integrates(written):
    scene = scene_file.load(written(scene_file.template()))
    cone = shapes.cone(0.05, 0.1, density=2700).about((0, 0, 0.075))
    np.testing.assert_allclose(scene.body.inertia, cone.inertia, rtol=1e-15)
    np.testing.assert_allclose(scene.potential.moment_B, cone.gravity(9.81).moment_B, rtol=1e-15)
    trajectory = cv.integrate(scene, scene.dt, t_end=0.1)
    drift = np.abs(trajectory.energy - trajectory.energy[0]).max() / scene.energy_scale
    assert drift < 1e-13  # measured 5e-16


@pytest.mark.parametrize(
    "text",
    [
        "R_WB = " + str(R.tolist()),
        f"R_WB = {{ axis = {AXIS.tolist()}, angle = {ANGLE} }}",
        "R_WB.quaternion_wxyz = "
        + str([3 * math.cos(ANGLE / 2), *(3 * math.sin(ANGLE / 2) * AXIS / np.linalg.norm(AXIS)).tolist()]),
        "R_WB.quaternion_xyzw = "
        + str([*(3 * math.sin(ANGLE / 2) * AXIS / np.linalg.norm(AXIS)).tolist(), 3 * math.cos(ANGLE / 2)]),
        "R_WB.rotation_vector = " + str((ANGLE * AXIS / np.linalg.norm(AXIS)).tolist()),
    ],
)
def test_every_form_of_an_attitude_is_equivalent(written, text):
    lines = GOOD.splitlines()[:-2]
    scene = scene_file.load(written("\n".join([*lines, text])))
    np.testing.assert_allclose(scene.R_WB0, R, atol=1e-15)  # measured 2e-16


@pytest.mark.parametrize(
    ("text", "diagonal"),
    [("", [1, 1, 1]), ("R_WB.rotation_vector = [0, 0, 0]", [1, 1, 1]), ("R_WB.quaternion_wxyz = [0,2,0,0]", [1, -1, -1])],
)
def test_attitudes_at_the_edges(written, text, diagonal):
    scene = scene_file.load(written("\n".join([*GOOD.splitlines()[:-2], text])))
    np.testing.assert_array_equal(scene.R_WB0, np.diag(diagonal))


@pytest.mark.parametrize(
    ("text", "shape"),
    [
        ('shape = "box"\nsize = [1, 2.5, 3]\nmass = 1.7', shapes.box((1, 2.5, 3), mass=1.7)),
        ('shape = "cylinder"\nradius = 0.3\nheight = 2\ndensity = 700', shapes.cylinder(0.3, 2, density=700)),
        ('shape = "cone"\nradius = 0.3\nheight = 2\nmass = 3', shapes.cone(0.3, 2, mass=3)),
        ('shape = "ellipsoid"\nsemi_axes = [1, 2, 3]\nmass = 3', shapes.ellipsoid((1, 2, 3), mass=3)),
    ],
)
def test_shapes_turned_and_moved(written, text, shape):
    placed = f"\ncom_B = [0.1, -0.2, 0.3]\nR_BS.axis = {AXIS.tolist()}\nR_BS.angle = {ANGLE}"
    scene = scene_file.load(written(body_of(text + placed)))
    expected = shape.rotate(R).about((0.1, -0.2, 0.3)).inertia
    np.testing.assert_allclose(scene.body.inertia, expected, atol=1e-14 * expected.max())  # measured 2e-16
    assert scene.free
    np.testing.assert_array_equal(scene_file.load(written(body_of(text))).body.inertia, shape.inertia)


@pytest.mark.parametrize(
    ("text", "potential"),
    [
        (
            'kind = "linear_spring"\nstiffness = 3\npoint_B = [1, 2, 3]\nanchor_W = [0.5, 1, -1]\nrest_length = 0.2',
            cv.LinearSpring(3, (1, 2, 3), (0.5, 1, -1), 0.2),
        ),
        (
            'kind = "linear_spring"\nstiffness = 3\npoint_B = [1, 2, 3]\nanchor_W = [0.5, 1, -1]',
            cv.LinearSpring(3, (1, 2, 3), (0.5, 1, -1)),
        ),
        (
            'kind = "point_attraction"\nstrength = 3\npoint_B = [1, 2, 3]\nanchor_W = [5, 1, -1]',
            cv.PointAttraction(3, (1, 2, 3), (5, 1, -1)),
        ),
        ('kind = "gravity_gradient"\nrate = 0.3\ndirection_W = [1, 2, 3]', cv.GravityGradient(0.3, TENSOR, (1, 2, 3))),
        ('kind = "gravity_gradient"\nrate = 0.3', cv.GravityGradient(0.3, TENSOR)),
    ],
)
def test_every_potential_that_does_not_turn(written, text, potential):
    scene = scene_file.load(written(in_field(text)))
    assert type(scene.potential) is type(potential)
    np.testing.assert_array_equal(scene.potential.gradient(R), potential.gradient(R))


def test_a_satellite(written):
    field = scene_file.load(written(in_field('kind = "gravity_gradient"\ndirection_W = [3, 4, 0]\n' + ORBIT))).potential
    known = cv.Orbit(0.3, (0, 0, 1)).gravity_gradient(TENSOR, (3, 4, 0))
    assert field.energy_at(R, np.array(2.0)) == known.energy_at(R, np.array(2.0))
    assert field.potential.rate == 0.3


def test_any_potential_can_turn(written):
    field = scene_file.load(written(GOOD + ORBIT)).potential
    assert isinstance(field, cv.Turning)
    assert isinstance(field.potential, cv.UniformGravity)


GRADIENT = 'kind = "gravity_gradient"\ndirection_W = [3, 4, 0]\n'
SATELLITE = in_field(GRADIENT + ORBIT)
# text, line, key, part of the value or of the expected value in the message
BAD = {
    "orbit without a field": (body_of("inertia = [1, 2, 3]") + ORBIT, 12, "orbit", "a table [potential]"),
    "two rates of an orbit": (in_field(GRADIENT + "rate = 0.3\n" + ORBIT), 15, "potential.rate", "has the rate of the orbit"),
    "orbit without a rate": (SATELLITE.replace("rate = 0.3\n", ""), 15, "orbit.rate", "takes rate, normal_W"),
    "negative rate": (SATELLITE.replace("rate = 0.3", "rate = -1"), 16, "orbit.rate", "above 0"),
    "unknown key of an orbit": (SATELLITE.replace("normal_W =", "normal ="), 17, "orbit.normal", "normal_W"),
    "along the normal": (SATELLITE.replace("[3, 4, 0]", "[3, 4, 1]"), 14, "potential.direction_W", "at right angles"),
    "no direction in an orbit": (
        SATELLITE.replace("direction_W = [3, 4, 0]\n", ""),
        12,
        "potential.direction_W",
        "direction_W",
    ),
    "number for an orbit": ("orbit = 3\n" + GOOD, 1, "orbit", "a table"),
    "unknown at the top": (replaced("t_end =", "t_ende ="), 2, "t_ende", "unknown key 't_ende'"),
    "unknown after a long array": (replaced("weight =", "wheight ="), 14, "potential.wheight", "unknown key 'wheight'"),
    "a rotor in free flight": (
        body_of('shape = "box"\nsize = [1, 2, 3]\nmass = 1\n[rotor]\nmomentum = [0, 0, 1]').replace(
            "[start]", "[start]\nv_WB = [1, 0, 0]"
        ),
        9,
        "rotor",
        "a rotor in free flight",
    ),
    "a motor in free flight": (
        body_of('shape = "box"\nsize = [1, 2, 3]\nmass = 1\n[rotor]\ntimes = [0, 9]\nvalues = [[0, 0, 1], [0, 0, 2]]').replace(
            "[start]", "[start]\np_WB = [1, 0, 0]"
        ),
        9,
        "rotor",
        "a rotor in free flight",
    ),
    "unknown kind": (replaced('"uniform_gravity"', '"unifrom_gravity"'), 13, "potential.kind", "'unifrom_gravity'"),
    "no t_end": (replaced("t_end = 3", ""), 1, "t_end", "the key is missing"),
    "no body": (GOOD.replace("[body]", "[start.x]"), 1, "body", "table [body] is missing"),
    "empty body": (body_of(""), 5, "body.inertia", "the body is missing"),
    "no angle": (replaced(f"R_WB.angle = {ANGLE}", ""), 19, "start.R_WB.angle", "the key is missing"),
    "two forms": (GOOD + "R_WB.rotation_vector = [0, 0, 1]", 19, "start.R_WB", "and rotation_vector"),
    "two bodies": (replaced("[body]", '[body]\nshape = "box"'), 7, "body.inertia", "inertia and shape"),
    "number for a table": ("start = 3\n" + GOOD.split("[start]")[0], 1, "start", "3"),
    "array of tables": (replaced("[body]", "[[body]]"), 5, "body", "inertia"),
    "empty name": ('name = ""\n' + GOOD, 1, "name", "''"),
    "nan weight": (replaced("12.5", "nan"), 14, "potential.weight", "nan"),
    "too large an integer": (replaced("12.5", "1" + 400 * "0"), 14, "potential.weight", "1000"),
    "integer of 9,999 digits": (replaced("12.5", 9999 * "1"), 14, "", "not TOML"),
    "not symmetric": (replaced("[3.1, 0.2, -0.1]", "[3.1, 0.9, -0.1]"), 6, "body.inertia", "not symmetric"),
    "no direction": (replaced(str(AXIS.tolist()), "[0, 0, 0]"), 19, "start.R_WB.axis", "[0.0, 0.0, 0.0]"),
    "empty attitude": (body_of("inertia = [1, 2, 3]").split("R_WB")[0] + "R_WB = {}", 10, "start.R_WB", "empty table"),
    "another shape's key": (body_of('shape = "box"\nradius = 1'), 7, "body.radius", "unknown key"),
    "no mass": (body_of('shape = "box"\nsize = [1, 2, 3]'), 5, "body.mass", "neither mass nor density"),
    "g without mass": (replaced("weight = 12.5", "g = 9.81"), 14, "potential.g", "only the inertia is known"),
    "g and weight": (
        body_of('shape = "box"\nsize = [1, 2, 3]\nmass = 1\n[potential]\nkind = "uniform_gravity"\nweight = 1\ng = 9.81'),
        12,
        "potential.g",
        "g and weight",
    ),
    "no such file": (body_of('urdf = "no.urdf"\nname = "x"'), 6, "body.urdf", "No such file"),
    "not TOML": (replaced("dt = 0.01", "dt = = 0.01"), 3, "", "Invalid value"),
    "twice": (replaced("dt = 0.01", "dt = 0.01\ndt = 0.02"), 4, "", "Cannot overwrite"),
    "not UTF-8": (GOOD.encode() + b"\n# \xff", 22, "", "not UTF-8"),
    "hexadecimal of 5,000 digits": (replaced("12.5", "0x" + 5000 * "f"), 14, "potential.weight", "an integer"),
    "deep": (replaced("12.5", 5000 * "["), 14, "", "at most 32 deep"),
    "deep arrays": (replaced("12.5", 40 * "[" + 40 * "]"), 14, "", "at most 32 deep"),
    "deep inline tables": (replaced("12.5", 400 * "{a = " + "1" + 400 * "}"), 14, "", "at most 32 deep"),
    "a key of many parts": (replaced("weight =", "weight" + " . 'a'" * 20_000 + "=="), 14, "", "a key of more than 32 parts"),
    "a header of many parts": (replaced("[start]", '[start."a.b"' + 20_000 * ".b" + "]"), 17, "", "a key of more than"),
}


@pytest.mark.parametrize("name", BAD)
def test_a_mistake_is_reported_with_file_line_key_and_value(written, name):
    text, line, key, got = BAD[name]
    path = written(text)
    with pytest.raises(BadFile) as caught:
        scene_file.load(path)
    error = caught.value
    assert (error.line, error.path) == (line or error.line, path)
    assert error.argument == f"{path}, line {error.line}" + (f": {key}" if key else "")
    assert got in str(error)
    assert error.allowed


def nested(depth):
    return {"parts": "a." * depth + "a = 1", "arrays": "a = " + "[" * depth + "]" * depth}


@pytest.mark.parametrize("form", ["parts", "arrays"])
def test_the_depth_of_keys_and_arrays_is_bounded_before_it_is_parsed(written, form, monkeypatch):
    read(written(nested(DEEPEST - 1)[form]))
    texts = f'a = "{"b." * 99}"\nc = """\n{"d." * 99}"""  # {"e." * 99}\n"{"f." * 99}" = [\n1.5,\n2.5]'
    assert read(written(texts)).lines == {("a",): 1, ("c",): 2, ("f." * 99,): 4}
    if form == "parts":
        monkeypatch.setattr(toml_reader.tomllib, "loads", lambda text: pytest.fail("parsed, which takes the cube of its parts"))
    with pytest.raises(BadFile, match="32 deep"):
        read(written(nested(DEEPEST + 1)[form]))


def test_a_statement_of_many_lines_is_parsed_once(written, monkeypatch):
    """Earlier versions parsed up to each of its line ends, and refused more than 100 lines."""
    parsed, loads = [], toml_reader.tomllib.loads
    monkeypatch.setattr(toml_reader.tomllib, "loads", lambda text: parsed.append(len(text)) or loads(text))
    text = "t = [\n" + "1, 2,\n" * 2000 + "]\nu = 1"
    assert read(written(text)).lines == {("t",): 1, ("u",): 2003}
    assert sum(parsed) <= 2 * len(text)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no pipes in folders")
@pytest.mark.parametrize("kind", ["pipe", "/dev/zero", "/dev/full", "/dev/stdin of a pipe"])
def test_a_pipe_and_a_device_are_refused(tmp_path, kind):
    place = tmp_path / "pipe.toml"
    if kind == "pipe":
        os.mkfifo(place)
    else:
        place.symlink_to(kind.split()[0])
    command = [sys.executable, "-c", "import sys; from conservative.scene_files.scene_file import load; load(sys.argv[1])"]
    made = subprocess.run([*command, place], input="t_end = 1", text=True, capture_output=True, timeout=PATIENCE, check=False)
    assert "got a pipe or a device, not a file; expected a TOML file" in made.stderr


@pytest.mark.parametrize("make", [lambda path: path / "no.toml", lambda path: path])
def test_a_file_that_cannot_be_read_is_named(tmp_path, make):
    path = make(tmp_path)
    with pytest.raises(BadFile) as caught:
        scene_file.load(path)
    assert caught.value.argument == str(path)
    assert caught.value.line is None
    assert "conservative new" in caught.value.allowed


def test_a_huge_file_is_refused(written):
    with pytest.raises(BadFile, match="more than 1000000 bytes"):
        scene_file.load(written(GOOD + "#" * LARGEST))


def test_lines_of_keys_are_found_where_they_are_hard_to_find():
    text = '''# [not.a.table]
a = """
b = 1
[c]
"""      # the string ends here
"b" = 'x # y'

 [ "d e".f ] # header
g.h = { i = 1, j = [
  1, # ]
  2 ] }
k = \'\'\'
'' \'\'\'
[[l]]
m = 1
[[l]]
n = 1
'''
    expected = {
        ("a",): 2,
        ("b",): 6,
        ("d e",): 8,
        ("d e", "f"): 8,
        ("d e", "f", "g"): 9,
        ("d e", "f", "g", "h"): 9,
        ("d e", "f", "g", "h", "i"): 9,
        ("d e", "f", "g", "h", "j"): 9,
        ("d e", "f", "k"): 12,
        ("l",): 14,
        ("l", "m"): 15,
        ("l", "n"): 17,
    }
    assert key_lines(text) == expected


def test_windows_line_ends_do_not_move_the_lines(written):
    text = BAD["unknown after a long array"][0].replace("\n", "\r\n")
    with pytest.raises(BadFile) as caught:
        scene_file.load(written(text))
    assert caught.value.line == 14


LOADS = """
[torque]
times = [0.0, 1.0, 3.0]
values = [[0, 0, 0], [0, 0, 0.1], [0.2, 0, 0]]
frame = "world"
[damping]
matrix = [[0.01, 0, 0], [0, 0.01, 0], [0, 0, 0.02]]
"""


def test_torque_and_damping_of_a_file(tmp_path):
    path = tmp_path / "loaded.toml"
    path.write_text(scene_file.template() + LOADS)
    scene = scene_file.load(path)
    np.testing.assert_allclose(scene.torque.at(2.0), [0.1, 0, 0.05])
    assert scene.torque.frame == "world"
    assert scene.damping.matrix[2, 2] == 0.02
    for good, bad, said in (
        ("[0.2, 0, 0]]", "[0.2, 0, 0], [1, 1, 1]]", r"torque\.values: got shape \(4, 3\)"),
        ("1.0, 3.0", "1.0, 0.5", r"torque\.times: got 0\.5 after 1"),
        ("1.0, 3.0", "1.0, 1.5", r"torque: got a table from 0 to 1\.5 s; expected one that covers the run, 0 to 2 s"),
        ("matrix", "tensor", r"damping\.tensor: got the unknown key 'tensor'"),
        ("0.02]", "-0.02]", r"damping\.matrix: got .* with the eigenvalue -0\.02"),
    ):
        path.write_text(scene_file.template() + LOADS.replace(good, bad))
        with pytest.raises(BadFile, match=said):
            scene_file.load(path)


def test_the_factor_of_a_damping_in_a_file(tmp_path):
    path, table = tmp_path / "damped.toml", "times = [0.0, 1.0, 3.0]\nvalues = [0, 2, 1]\n"
    path.write_text(scene_file.template() + LOADS + table)
    assert scene_file.load(path).damping.factor.at(2.0) == 1.5
    for good, bad, said in (
        ("2, 1]", "-2, 1]", r"damping\.values: got -2; expected an array \(3\): a finite number of 0 or more for each time"),
        ("2, 1]", "2]", r"damping\.values: got shape \(2,\)"),
        ("1.0, 3.0", "1.0, 1.5", r"damping: got a table from 0 to 1\.5 s; expected one that covers the run, 0 to 2 s"),
        (table, "times = [0.0, 1.0]\n", r"damping\.values: got nothing"),
    ):
        path.write_text(scene_file.template() + LOADS + table.replace(good, bad))
        with pytest.raises(BadFile, match=said):
            scene_file.load(path)
