import numpy as np
import pytest

from conservative import Reduced, RigidBody, Scene, registry, scenes
from conservative.attitude import rotation_about
from conservative.benchmarks.measures import samples
from conservative.benchmarks.studies import sphere_curves
from conservative.reports.labels import with_names
from conservative.reports.run.measure import Measurements
from conservative.reports.run.plan import plan_report
from conservative.reports.run.provenance import provenance
from conservative.reports.tables import lines
from conservative.reports.view import build

from .made_up import curves, measurements


@pytest.mark.parametrize("name", ["brick_flip", "lagrange_top"])
def test_curves_lie_on_the_unit_sphere(name):
    found = lines.curves(with_names(samples.frame(curves(registry.scene(name), registry.method("reduced")))))
    assert np.abs(np.linalg.norm(found[["x", "y", "z"]].to_numpy(), axis=1) - 1).max() < 1e-13  # measured 3e-16
    assert 200 < len(found) <= sphere_curves.SAMPLES


def test_polhode_is_the_same_whatever_the_body_axes():
    base = scenes.brick_flip()
    S = rotation_about((1.0, 2.0, -0.5), 0.7)
    turned = Scene("turned", RigidBody(S.T @ base.body.inertia @ S), base.R_WB0 @ S, S.T @ base.w_WB_B0, base.t_end, dt=base.dt)
    one, other = (
        np.abs(lines.curves(with_names(samples.frame(curves(scene, Reduced()))))[["x", "y", "z"]].to_numpy())
        for scene in (base, turned)
    )
    assert np.abs(one - other)[:50].max() < 1e-9  # measured 3e-13


def test_methods_without_a_curve_are_named():
    plan = plan_report(["brick_flip"], ["reduced", "lame"], quick=True)
    found = Measurements(measurements().table, samples.frame(curves(scenes.brick_flip(), Reduced())))
    (scene,) = build(plan, found, provenance([])).scenes
    assert scene.without_curve == ("lame",)


def test_picks_one_method_of_each_family_that_has_no_preferred_one():
    names = [
        m.name
        for m in sphere_curves.select_methods(
            [registry.method(n) for n in ("gauss:stages=2", "gauss", "reduced:order=4", "reduced", "exact")]
        )
    ]
    assert names == ["reduced", "gauss:stages=2"]
