"""What all engines share: missing packages, axes, and a mass for a scene that has none."""

import numpy as np
import pytest

import conservative as cv
from conservative import registry
from conservative.attitude import orthonormality, rotation_about
from conservative.references import engine
from conservative.scenes.lagrange_top import cone


@pytest.fixture(autouse=True)
def nothing_kept():
    yield
    engine.version.cache_clear()


def test_a_missing_engine_is_an_error_with_the_line_that_installs_it():
    with pytest.raises(cv.MissingEngine, match="pip install no-such-engine"):
        engine.version("no-such-engine", "NoSuch")
    with pytest.raises(cv.MissingEngine, match="pip install no-such-engine"):
        engine.load("no_such_engine", "no-such-engine", "NoSuch")


@pytest.mark.parametrize("name", ["mujoco:RK4", "pinocchio:RK4", "heyoka:1e-9", "precise:128"])
def test_methods_of_a_missing_engine_cannot_be_made(name, monkeypatch):
    def missing(package):
        raise engine.metadata.PackageNotFoundError(package)

    engine.version.cache_clear()
    monkeypatch.setattr(engine.metadata, "version", missing)
    with pytest.raises(cv.MissingEngine, match=r"pip install (mujoco|pin|heyoka)$"):
        registry.method(name)


def test_symmetric_axes_end_with_the_axis(top, heavy):
    axes = engine.symmetric_axes(top)
    assert orthonormality(axes.R_BF) < 1e-15  # measured 3e-16
    np.testing.assert_allclose(axes.R_BF @ np.diag(axes.J) @ axes.R_BF.T, top.body.inertia, atol=1e-14)  # measured 1.3e-15
    assert axes.J[0] == pytest.approx(2.1, rel=1e-14)
    assert axes.moment[2] == pytest.approx(3.1 * 0.5, rel=1e-14)
    assert engine.symmetric_axes(heavy) is None


def test_a_mass_model_gives_back_inertia_and_weight(heavy, top):
    for scene in (heavy, top, cv.scenes.lagrange_top(), cv.scenes.lie_group_top()):
        axes = engine.principal_axes(scene)
        mass = engine.mass_model(axes)
        c = mass.com
        about_pivot = mass.body.inertia + mass.mass * (c @ c * np.eye(3) - np.outer(c, c))
        np.testing.assert_allclose(about_pivot, np.diag(axes.J), atol=1e-15 * axes.J.max())  # measured 0
        np.testing.assert_allclose(mass.mass * mass.gravity * c, axes.moment, atol=1e-13)  # measured 2e-16
        a, b, largest = np.sort(mass.body.moments)
        assert a + b >= largest


def test_the_paper_s_cone_has_its_own_mass_and_so_has_its_slow_motion():
    """With another mass it would be another body to engines whose joints are constraints between free bodies."""
    mass, lever, J1, _ = cone(0.1, 2700.0)
    for scene in (cv.scenes.lagrange_top(), cv.scenes.lagrange_top(slow=4)):
        found = engine.mass_model(engine.principal_axes(scene))
        assert np.isclose(found.mass, mass, rtol=1e-12)
        ball = (J1 - mass * lever**2) * np.eye(3)
        np.testing.assert_allclose(found.body.inertia, ball, rtol=1e-12, atol=1e-12 * J1)


def test_bodies_without_a_mass_distribution_have_no_mass_model():
    gravity = cv.UniformGravity(2, (0, 0, 1))
    for inertia, potential in (((1, 1, 3), None), ((1, 2, 3), gravity)):  # the second: planar, weight out of its plane
        scene = cv.Scene("odd", cv.RigidBody(inertia), np.eye(3), (1, 2, 3), 1.0, potential)
        assert "no mass distribution" in engine.mass_model_reason(scene)
        with pytest.raises(cv.Unsupported, match="no mass distribution"):
            cv.integrate(scene, 0.1, registry.method("mujoco:RK4"))


def test_a_planar_body_with_its_weight_in_its_plane_has_a_mass_model():
    B = rotation_about((1, 2, -1), 2.0)
    scene = cv.Scene(
        "plate", cv.RigidBody(B @ np.diag((1, 2, 3)) @ B.T), B, (1, 2, 3), 1.0, cv.UniformGravity(2, B @ (0.3, 0.4, 0))
    )
    assert engine.mass_model_reason(scene) is None
