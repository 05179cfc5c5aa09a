"""Bodies from tensors, moments and shapes, and their axes of symmetry."""

import math
import warnings

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import conservative as cv
from conservative import shapes
from conservative.attitude import rotation_about
from conservative.invariants import axial_direction
from conservative.methods.principal_axes import principal_start
from conservative.references.exact.method import free_body

from ..bodies import impossible_body
from .one_body import body_in_axes


def test_moments_and_tensor_describe_the_same_body():
    body = body_in_axes(rotation_about((1, 2, 3), 0.8), 1.0, 2.0, 2.5)
    np.testing.assert_allclose(body.moments, [1, 2, 2.5], rtol=1e-14)
    np.testing.assert_allclose(body.R_BP @ np.diag(body.moments) @ body.R_BP.T, body.inertia, atol=1e-14)
    assert np.linalg.det(body.R_BP) == pytest.approx(1)
    np.testing.assert_allclose(body.inverse @ body.inertia, np.eye(3), atol=1e-14)
    diagonal = cv.RigidBody((13, 5, 10))  # keeps its axes and their order
    np.testing.assert_array_equal(diagonal.moments, [13, 5, 10])
    np.testing.assert_array_equal(diagonal.R_BP, np.eye(3))


@pytest.mark.parametrize(
    ("moments", "axis"), [((2, 2, 1), 2), ((1, 2, 2), 0), ((2, 1, 2), 1), ((2, 2, 2), 2), ((1, 2, 3), None)]
)
def test_symmetry_axis(moments, axis):
    assert cv.RigidBody(moments).symmetry_axis() == axis


def test_repr_is_an_expression():
    body = cv.RigidBody((1, 2, 2.5))
    again = eval(repr(body), {"RigidBody": cv.RigidBody})
    np.testing.assert_array_equal(again.inertia, body.inertia)


@pytest.mark.parametrize("off", [1e-3, 1e-6, 1e-9])
def test_a_nearly_symmetric_body_has_no_axis(off):
    nearly = cv.RigidBody((1, 1 + off, 2))
    assert axial_direction(nearly, None) is None
    assert axial_direction(nearly, cv.UniformGravity(1, (0, 0, 1))) is None
    assert axial_direction(cv.RigidBody((1, 1, 2)), cv.UniformGravity(1, (off, 0, 1))) is None
    assert axial_direction(cv.RigidBody((1, 1 + off, 1)), cv.UniformGravity(1, (0.2, 0.3, 0.4))) is None


def test_a_body_symmetric_to_round_off_has_an_axis():
    round_off = 4 * np.finfo(float).eps
    np.testing.assert_array_equal(axial_direction(cv.RigidBody((1, 1 + round_off, 2)), None), (0, 0, 1))
    field = cv.UniformGravity(1, (round_off, 0, -1))
    np.testing.assert_array_equal(axial_direction(cv.RigidBody((1, 1, 2)), field), (0, 0, -1))


def test_moments_are_compared_relative_to_each_other():
    assert impossible_body((1, 1e-13, 5e-13)).symmetry_axis(1e-12) is None
    assert impossible_body((1, 1e-13, 1e-13)).symmetry_axis(1e-12) == 0
    assert cv.RigidBody((1, 1, 1e-13)).symmetry_axis(1e-12) == 2


def test_rounding_a_tensor_leaves_a_body_symmetric():
    draw = np.random.default_rng(0)
    for _ in range(100):
        R = rotation_about(draw.normal(size=3), draw.uniform(0, 3))
        tensor = R @ np.diag([1e-9, 1e-9, 1.0]) @ R.T
        assert impossible_body((tensor + tensor.T) / 2).symmetry_axis(1e-12) == 2


@pytest.mark.parametrize("small", [1e-3, 1e-15, 1e-28])
def test_a_rod_has_all_digits_of_its_small_moment(small):
    scene = cv.Scene("rod", impossible_body((small, 1.0, small)), np.eye(3), (0.1, 0.2, 0.3), 1.0)
    start = principal_start(scene, "non_spinning")
    assert (small, small, small) == start.J
    assert start.spin[1] == 1.0


DENSITY = 731.0
R_BS = rotation_about((0.3, -1.2, 0.7), 0.83)
COM_B = np.array([0.21, -0.13, 0.34])


def box_cloud(nodes, weights):
    """Return points (n, 3) of the solid relative to its centre of mass, and the volume of each."""
    a, b, c = 0.3, 0.7, 1.1
    u, du = nodes / 2, weights / 2
    x, y, z = np.meshgrid(a * u, b * u, c * u, indexing="ij")
    return np.stack([x, y, z], -1).reshape(-1, 3), (a * b * c * np.einsum("i,j,k->ijk", du, du, du)).ravel()


def about_an_axis(nodes, weights, height, low, radius_at):
    """Return points of a solid of revolution: height and radius by Gauss quadrature, angle in equal steps."""
    n_angles = 16
    angle = np.arange(n_angles) * 2 * math.pi / n_angles
    s, ds = (nodes + 1) / 2, weights / 2
    h, f, phi = np.meshgrid(s, s, angle, indexing="ij")
    R = radius_at(h)
    points = np.stack([f * R * np.cos(phi), f * R * np.sin(phi), low + height * h], -1)
    volume = np.einsum("i,j->ij", ds, ds)[:, :, None] * height * f * R**2 * 2 * math.pi / n_angles
    return points.reshape(-1, 3), volume.ravel()


def ball_cloud(nodes, weights):
    semi_axes = np.array([0.3, 0.7, 1.1])
    unit, volume = about_an_axis(nodes, weights, 2.0, -1.0, lambda h: np.sqrt(1 - (2 * h - 1) ** 2))
    return unit * semi_axes, volume * semi_axes.prod()


CASES = {
    "box": (lambda **k: shapes.box((0.3, 0.7, 1.1), **k), box_cloud),
    "cylinder": (
        lambda **k: shapes.cylinder(0.37, 0.91, **k),
        lambda n, w: about_an_axis(n, w, 0.91, -0.455, lambda h: np.full_like(h, 0.37)),
    ),
    "cone": (
        lambda **k: shapes.cone(0.37, 0.91, **k),
        lambda n, w: about_an_axis(n, w, 0.91, -0.75 * 0.91, lambda h: 0.37 * h),
    ),
    "ellipsoid": (lambda **k: shapes.ellipsoid((0.3, 0.7, 1.1), **k), ball_cloud),
}


@pytest.mark.parametrize("name", CASES)
def test_a_turned_and_moved_shape_has_the_moments_of_its_points(name):
    build, cloud = CASES[name]
    found = build(density=DENSITY).rotate(R_BS).about(COM_B)
    points_S, volume = cloud(*np.polynomial.legendre.leggauss(8))
    points, mass = points_S @ R_BS.T + COM_B, DENSITY * volume
    assert found.mass == pytest.approx(mass.sum(), rel=1e-14)  # measured 6e-16
    np.testing.assert_allclose(mass @ points / mass.sum(), found.com_B, atol=1e-14)  # measured 4e-16
    second = np.einsum("n,ni,nj->ij", mass, points, points)
    inertia = np.trace(second) * np.eye(3) - second
    np.testing.assert_allclose(found.inertia, inertia, rtol=0, atol=2e-14 * inertia.max())  # measured 1.2e-15
    assert np.abs(found.inertia - np.diag(np.diag(found.inertia))).max() > 0.05 * inertia.max()  # generic: all terms count


@pytest.mark.parametrize("name", CASES)
def test_mass_and_density_are_equivalent(name):
    build, _ = CASES[name]
    by_density = build(density=DENSITY)
    by_mass = build(mass=by_density.mass)
    np.testing.assert_allclose(by_mass.inertia, by_density.inertia, rtol=1e-15)  # measured 0


def test_a_cone_on_its_tip_is_the_papers_top():
    h, top = 0.1, cv.scenes.lagrange_top()
    cone = shapes.cone(h / 2, h, density=2700).about((0, 0, 0.75 * h))
    np.testing.assert_allclose(cone.body.inertia, top.body.inertia, rtol=1e-14)  # measured 6e-16
    np.testing.assert_allclose(cone.gravity(9.81).moment_B, top.potential.moment_B, rtol=1e-14)  # measured 2e-16


def test_a_shape_beside_its_fixed_point_turns_about_it():
    shape = shapes.box((1, 2, 3), mass=1.7).about((0.3, -0.2, 0.5))
    turned = shape.rotate(R_BS)
    np.testing.assert_allclose(turned.com_B, R_BS @ shape.com_B, atol=1e-15)
    np.testing.assert_allclose(turned.inertia, R_BS @ shape.inertia @ R_BS.T, atol=1e-14)  # measured 9e-16


def test_scipy_rotations_are_accepted_as_attitudes():
    rotation = Rotation.from_matrix(R_BS)
    shape = shapes.box((1, 2, 3), mass=1.7)
    np.testing.assert_allclose(shape.rotate(rotation).inertia, shape.rotate(R_BS).inertia, atol=1e-14)  # measured 2e-16
    scene = cv.Scene("x", shape.body, rotation, (0.5, -1.5, 2.5), 3.0)
    for R_WB0 in (scene.R_WB0, cv.scenes.brick_flip().rename("y", R_WB0=rotation).R_WB0):
        np.testing.assert_allclose(R_WB0, R_BS, atol=1e-15)  # measured 1e-16
    given, same = (free_body(scene.body, R, (0.5, -1.5, 2.5), [2.0])[0] for R in (rotation, R_BS))
    np.testing.assert_allclose(given, same, atol=1e-14)  # measured 0


TURN = rotation_about((1, 2, 3), 0.7)


@pytest.mark.parametrize("inertia", [(1, 1, 5), (0.5, 2, 3), TURN @ np.diag((1, 2, 3.1)) @ TURN.T])
def test_moments_of_no_mass_distribution_are_accepted_with_a_warning(inertia):
    with pytest.warns(cv.ImpossibleInertia) as said:
        body = cv.RigidBody(inertia)
    assert said[0].message.moments == tuple(body.moments)
    assert said[0].filename == __file__


@pytest.mark.parametrize("inertia", [(1, 2, 3), (1, 2, 3.000001), (1e-9, 1, 1), TURN @ np.diag((1, 2, 3)) @ TURN.T])
def test_bodies_of_a_mass_distribution_have_no_warning(inertia):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        cv.RigidBody(inertia)
        cv.integrate_many(cv.scenes.brick_flip(), inertia=np.asarray(inertia)[None], dt=0.1, t_end=0.1, method="moser_veselov")


def test_an_ensemble_counts_the_bodies_that_no_mass_distribution_has():
    inertia = np.array([(1, 2, 2.5), (1, 1, 5), (0.5, 2, 3)])
    with pytest.warns(cv.ImpossibleInertia) as said:
        cv.integrate_many(cv.scenes.brick_flip(), inertia=inertia, dt=0.01, t_end=0.01, method="reduced")
    assert [(each.message.moments, each.message.bodies, each.filename) for each in said] == [((1, 1, 5), 2, __file__)]
