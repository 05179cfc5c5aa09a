"""Each mistake in a scene file, and the line and key that the answer has to name."""

import pytest

from conservative.scene_files import scene_file
from conservative.scene_files.toml_reader import LARGEST, BadFile, key_lines

from .scene_text import ANGLE, AXIS, GOOD, body_of, replaced

# what is wrong: (text, line, key, part of what was got, part of what is allowed)
BAD = {
    "unknown at the top": (replaced("t_end =", "t_ende ="), 2, "t_ende", "unknown key 't_ende'", "'t_end' (nearest)"),
    "unknown in the body": (replaced("inertia =", "inertai ="), 6, "body.inertai", "unknown key", "'inertia' (nearest)"),
    "unknown after a long array": (
        replaced("weight =", "wheight ="),
        14,
        "potential.wheight",
        "unknown key 'wheight'",
        "'weight' (nearest)",
    ),
    "unknown in the start": (replaced("w_WB_B =", "w_WB_W ="), 18, "start.w_WB_W", "unknown key", "'w_WB_B' (nearest)"),
    "unknown form": (replaced("R_WB.angle", "R_WB.angel"), 20, "start.R_WB.angel", "unknown key", "'angle' (nearest)"),
    "unknown table": (replaced("[potential]", "[potental]"), 12, "potental", "unknown key", "'potential' (nearest)"),
    "unknown kind": (
        replaced('"uniform_gravity"', '"unifrom_gravity"'),
        13,
        "potential.kind",
        "'unifrom_gravity'",
        "'uniform_gravity' (nearest)",
    ),
    "no t_end": (replaced("t_end = 3", ""), 1, "t_end", "the key is missing", "above 0, s"),
    "no body": (GOOD.replace("[body]", "[start.x]"), 1, "body", "table [body] is missing", "inertia"),
    "no start": (GOOD.split("[start]")[0], 1, "start", "table [start] is missing", "w_WB_B"),
    "empty body": (body_of(""), 5, "body.inertia", "the body is missing", "inertia, shape, mjcf, urdf"),
    "no rates": (replaced("w_WB_B = [0.5, -1.5, 2.5]", ""), 17, "start.w_WB_B", "the key is missing", "rad/s"),
    "no weight": (replaced("weight = 12.5", ""), 12, "potential.weight", "the key is missing", "weight, com_B"),
    "no kind": (
        replaced('kind = "uniform_gravity"', ""),
        12,
        "potential.kind",
        "the key is missing",
        "uniform_gravity, linear_spring",
    ),
    "no angle": (replaced(f"R_WB.angle = {ANGLE}", ""), 19, "start.R_WB.angle", "the key is missing", "axis, angle"),
    "two forms": (
        GOOD + "R_WB.rotation_vector = [0, 0, 1]",
        19,
        "start.R_WB",
        "beside rotation_vector",
        "or one of: quaternion",
    ),
    "two bodies": (replaced("[body]", '[body]\nshape = "box"'), 7, "body.inertia", "inertia beside shape", "one of inertia"),
    "text t_end": (replaced("t_end = 3", 't_end = "3"'), 2, "t_end", "'3'", "above 0, s"),
    "true dt": (replaced("dt = 0.01", "dt = true"), 3, "dt", "True", "above 0, s"),
    "a date": (replaced("dt = 0.01", "dt = 2026-01-01"), 3, "dt", "datetime.date", "above 0, s"),
    "number for a table": ("start = 3\n" + GOOD.split("[start]")[0], 1, "start", "3", "a table"),
    "array of tables": (replaced("[body]", "[[body]]"), 5, "body", "inertia", "a table"),
    "number for a name": ("name = 3\n" + GOOD, 1, "name", "3", "a text"),
    "empty name": ('name = ""\n' + GOOD, 1, "name", "''", "one character or more"),
    "texts for numbers": (
        replaced("[0.5, -1.5, 2.5]", '["0.5", "-1.5", "2.5"]'),
        18,
        "start.w_WB_B",
        "['0.5'",
        "arrays of them",
    ),
    "truths for numbers": (
        replaced("[0.1, -0.2, 0.3]", "[true, false, true]"),
        15,
        "potential.com_B",
        "[True",
        "arrays of them",
    ),
    "two rates": (replaced("[0.5, -1.5, 2.5]", "[0.5, -1.5]"), 18, "start.w_WB_B", "shape (2,)", "three finite rates"),
    "ragged": (replaced("[0.5, -1.5, 2.5]", "[0.5, [-1.5], 2.5]"), 18, "start.w_WB_B", "[0.5, [-1.5], 2.5]", "three finite"),
    "nan rate": (replaced("2.5]\nR_WB", "nan]\nR_WB"), 18, "start.w_WB_B", "nan", "three finite rates"),
    "infinite t_end": (replaced("t_end = 3", "t_end = inf"), 2, "t_end", "inf", "above 0, s"),
    "negative dt": (replaced("dt = 0.01", "dt = -0.01"), 3, "dt", "-0.01", "above 0, s"),
    "nan weight": (replaced("12.5", "nan"), 14, "potential.weight", "nan", "a finite number, N"),
    "too large an integer": (replaced("12.5", "1" + 400 * "0"), 14, "potential.weight", "1000", "numbers"),
    "integer of 9,999 digits": (replaced("12.5", 9999 * "1"), 20, "", "not TOML", "TOML 1.0"),
    "not symmetric": (replaced("[3.1, 0.2, -0.1]", "[3.1, 0.9, -0.1]"), 6, "body.inertia", "not symmetric", "kg m^2"),
    "not positive": (replaced("2.7, 0.3]", "-2.7, 0.3]"), 6, "body.inertia", "not all positive", "kg m^2"),
    "no rotation": (
        replaced(f"R_WB.axis = {AXIS.tolist()}\nR_WB.angle = {ANGLE}", "R_WB = [[1, 0, 0], [0, 1, 0], [0, 0, 1.1]]"),
        19,
        "start.R_WB",
        "|R'R - 1| = 0.21",
        "a rotation matrix",
    ),
    "no direction": (replaced(str(AXIS.tolist()), "[0, 0, 0]"), 19, "start.R_WB.axis", "[0, 0, 0]", "not all 0"),
    "empty attitude": (
        body_of("inertia = [1, 2, 3]").split("R_WB")[0] + "R_WB = {}",
        10,
        "start.R_WB",
        "empty table",
        "quaternion",
    ),
    "unknown shape": (body_of('shape = "bix"'), 6, "body.shape", "'bix'", "'box' (nearest)"),
    "another shape's key": (body_of('shape = "box"\nradius = 1'), 7, "body.radius", "unknown key", "size"),
    "no size": (body_of('shape = "box"\nmass = 1'), 5, "body.size", "the key is missing", "box takes size, mass, density"),
    "no mass": (body_of('shape = "box"\nsize = [1, 2, 3]'), 5, "body.mass", "neither mass nor density", "one of them"),
    "negative size": (body_of('mass = 1\nshape = "box"\n\nsize = [1, -2, 3]'), 9, "body.size", "-2.0", "above 0, m"),
    "mass and density": (
        body_of('shape = "box"\nsize = [1, 2, 3]\nmass = 1\ndensity = 2'),
        9,
        "body.density",
        "beside mass",
        "not both",
    ),
    "g without mass": (replaced("weight = 12.5", "g = 9.81"), 14, "potential.g", "only the inertia is known", "weight, N"),
    "g and weight": (
        body_of('shape = "box"\nsize = [1, 2, 3]\nmass = 1\n[potential]\nkind = "uniform_gravity"\nweight = 1\ng = 9.81'),
        12,
        "potential.g",
        "g beside weight",
        "g alone",
    ),
    "no such file": (body_of('urdf = "no.urdf"\nname = "x"'), 6, "body.urdf", "No such file", "<robot>"),
    "no name": (body_of('mjcf = "no.xml"'), 5, "body.name", "the key is missing", "name of the body in"),
    "not TOML": (replaced("dt = 0.01", "dt = = 0.01"), 3, "", "Invalid value", "TOML 1.0"),
    "unclosed": (GOOD + "\nR_WB.x = [", 22, "", "not TOML", "TOML 1.0"),
    "twice": (replaced("dt = 0.01", "dt = 0.01\ndt = 0.02"), 4, "", "Cannot overwrite", "TOML 1.0"),
    "not UTF-8": (GOOD.encode() + b"\n# \xff", 22, "", "not UTF-8", "TOML file"),
    "code": (replaced("12.5", "__import__('os').getpid()"), 14, "", "Invalid value", "TOML 1.0"),
    "deep": (replaced("12.5", 5000 * "["), None, "", "not TOML", "TOML 1.0"),
}


@pytest.mark.parametrize("name", BAD)
def test_a_mistake_is_answered_with_file_line_key_what_was_got_and_what_is_allowed(written, name):
    text, line, key, got, allowed = BAD[name]
    path = written(text)
    with pytest.raises(BadFile) as caught:
        scene_file.load(path)
    error = caught.value
    assert (error.line, error.path) == (line or error.line, path)
    assert error.argument == f"{path}, line {error.line}" + (f": {key}" if key else "")
    assert got in str(error.got)
    assert allowed in error.allowed
    assert str(error) == f"{error.argument}: got {error.got}; allowed: {error.allowed}"


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
