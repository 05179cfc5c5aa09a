import math

import numpy as np
import pytest

import conservative as cv
from conservative import registry, shapes
from conservative.scene_files import scene_file

from .scene_text import ANGLE, AXIS, GOOD, TENSOR, R, body_of


def test_a_file_gives_the_scene_it_says(written):
    path = written(GOOD)
    scene = scene_file.load(path)
    assert (scene.name, scene.t_end, scene.dt, scene.source) == ("my_body", 3.0, 0.01, str(path))
    np.testing.assert_array_equal(scene.body.inertia, TENSOR)
    np.testing.assert_array_equal(scene.w_WB_B0, (0.5, -1.5, 2.5))
    np.testing.assert_allclose(scene.R_WB0, R, atol=1e-15)  # measured 2e-16
    np.testing.assert_allclose(scene.potential.moment_B, (1.25, -2.5, 3.75), rtol=1e-15)


def test_the_registry_takes_a_file_for_a_name(written):
    assert registry.scene(str(written(GOOD))).name == "my_body"


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
        "R_WB.rotation_vector = " + str((ANGLE * AXIS / np.linalg.norm(AXIS)).tolist()),
    ],
)
def test_every_form_of_an_attitude_says_the_same(written, text):
    lines = GOOD.splitlines()[:-2]
    scene = scene_file.load(written("\n".join([*lines, text])))
    np.testing.assert_allclose(scene.R_WB0, R, atol=1e-15)  # measured 2e-16


def test_forms_agree_with_scipy():
    rotation = pytest.importorskip("scipy.spatial.transform").Rotation
    np.testing.assert_allclose(R, rotation.from_rotvec(ANGLE * AXIS / np.linalg.norm(AXIS)).as_matrix(), atol=1e-15)


@pytest.mark.parametrize(
    ("text", "matrix"),
    [("", np.eye(3)), ("R_WB.rotation_vector = [0, 0, 0]", np.eye(3)), ("R_WB.quaternion_wxyz = [0,2,0,0]", None)],
)
def test_attitudes_at_the_edges(written, text, matrix):
    scene = scene_file.load(written("\n".join([*GOOD.splitlines()[:-2], text])))
    np.testing.assert_array_equal(scene.R_WB0, np.diag([1, -1, -1]) if matrix is None else matrix)


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
def test_every_ready_made_potential(written, text, potential):
    head, rest = GOOD.split("[potential]")
    scene = scene_file.load(written(head + "[potential]\n" + text + "\n[start]" + rest.split("[start]")[1]))
    assert type(scene.potential) is type(potential)
    np.testing.assert_array_equal(scene.potential.gradient(R), potential.gradient(R))
