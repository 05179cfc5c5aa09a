"""Fields that turn, from a file: a table orbit beside the potential, and complaints with their line."""

import numpy as np
import pytest

import conservative as cv
from conservative.scene_files import scene_file
from conservative.scene_files.toml_reader import BadFile

BODY = "t_end = 1.0\n[body]\ninertia = [1.0, 2.0, 2.5]\n[start]\nw_WB_B = [0.1, 0.2, 0.3]\n"
ORBIT = "[orbit]\nrate = 0.3\nnormal_W = [0, 0, 2]\n"
GRADIENT = '[potential]\nkind = "gravity_gradient"\ndirection_W = [3, 4, 0]\n'
GRAVITY = '[potential]\nkind = "uniform_gravity"\nweight = 2.0\ncom_B = [0, 0, 0.5]\n'


def load(tmp_path, text):
    file = tmp_path / "scene.toml"
    file.write_text(text)
    return scene_file.load(file)


def test_a_satellite(tmp_path):
    field = load(tmp_path, BODY + GRADIENT + ORBIT).potential
    known = cv.Orbit(0.3, (0, 0, 1)).gravity_gradient((1.0, 2.0, 2.5), (3, 4, 0))
    R, t = np.eye(3)[[1, 2, 0]], np.array(2.0)
    assert field.energy_at(R, t) == known.energy_at(R, t)
    assert field.potential.rate == 0.3


def test_any_potential_can_turn(tmp_path):
    field = load(tmp_path, BODY + ORBIT + GRAVITY).potential
    assert isinstance(field, cv.Turning)
    assert isinstance(field.potential, cv.UniformGravity)


@pytest.mark.parametrize(
    ("text", "line", "argument", "hint"),
    [
        (BODY + ORBIT, 6, "orbit", "a table potential beside it"),
        (BODY + GRADIENT + "rate = 0.3\n" + ORBIT, 9, "potential.rate", "has the rate of the orbit"),
        (BODY + GRADIENT + ORBIT.replace("rate = 0.3\n", ""), 9, "orbit.rate", "takes rate, normal_W"),
        (BODY + GRADIENT + ORBIT.replace("0.3", "-1"), 10, "orbit.rate", "above 0"),
        (BODY + GRADIENT + ORBIT + "normal = 3\n", 12, "orbit.normal", "normal_W"),
        (BODY + GRADIENT.replace("0]", "1]") + ORBIT, 8, "potential.direction_W", "at right angles"),
        (BODY + GRADIENT.replace("direction_W = [3, 4, 0]\n", "") + ORBIT, 6, "potential.direction_W", "direction_W"),
        (BODY.replace("t_end = 1.0", "orbit = 3\nt_end = 1.0") + GRADIENT, 1, "orbit", "a table"),
    ],
)
def test_complaints_have_their_line(tmp_path, text, line, argument, hint):
    with pytest.raises(BadFile) as caught:
        load(tmp_path, text)
    assert f"line {line}: {argument}:" in str(caught.value)
    assert hint in str(caught.value)
