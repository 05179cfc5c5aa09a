"""Samples of the studies as lines of pictures: drifts, curves on spheres, the figures of the paper."""

import numpy as np
import pytest

from conservative import Reduced, RigidBody, Scene, registry, scenes
from conservative.attitude import rotation_about
from conservative.benchmarks.measures import measurement
from conservative.benchmarks.measures.measurement import Samples
from conservative.benchmarks.studies import motion
from conservative.method import Role
from conservative.reports.rows import lines
from conservative.reports.rows.names import with_names

from .made_up import curves, curves_of, row
from .rows import frame

T = np.linspace(0.5, 60, 120)


def test_drifts_of_motions_have_their_sign_and_the_name_without_a_tolerance():
    who = {"method": "engine:tol=1e-9", "label": "", "series": "engine", "family": "engine", "setting": "tol=1e-9"}
    common = {"study": "motion", "scene": "made_up", "role": Role.ENGINE, "dt": 0.1, **who}
    found = [Samples(quantity=f"drift of {name}", t=T, value=-T, **common) for name in ("energy", "momentum")]
    rows = with_names(measurement.samples_frame([*found, Samples(quantity="x", t=T, value=T, **common)]))
    drifts = lines.signed_drifts(rows, "made_up", ("energy", "momentum"))
    assert drifts.groupby("quantity")["drift"].min().to_dict() == {"energy": -T.max(), "momentum": -T.max()}
    assert set(drifts["name"]) == {"engine"}


def points(samples):
    """Return the points (n, 3) of lines on a sphere."""
    return lines.curves(with_names(measurement.samples_frame(samples)))[["x", "y", "z"]].to_numpy()


@pytest.mark.parametrize("name", ["brick_flip", "lagrange_top"])
def test_curves_lie_on_the_unit_sphere(name):
    found = points(curves_of(name))
    assert np.abs(np.linalg.norm(found, axis=1) - 1).max() < 1e-13  # measured 3e-16
    assert 200 < len(found) <= motion.SAMPLES


def test_polhode_is_the_same_whatever_the_body_axes():
    base = scenes.brick_flip()
    S = rotation_about((1.0, 2.0, -0.5), 0.7)
    turned = Scene("turned", RigidBody(S.T @ base.body.inertia @ S), base.R_WB0 @ S, S.T @ base.w_WB_B0, base.t_end, dt=base.dt)
    one, other = (np.abs(points(samples)) for samples in (curves_of("brick_flip"), curves(turned, Reduced())))
    assert np.abs(one - other)[:50].max() < 1e-9  # measured 3e-13


def test_picks_one_method_of_each_family_that_has_no_preferred_one():
    names = [
        m.name
        for m in motion.select_methods(
            [registry.method(n) for n in ("gauss:stages=2", "gauss", "reduced:order=4", "reduced", "exact")]
        )
    ]
    assert names == ["reduced", "gauss:stages=2"]


def test_an_order_is_known_only_if_the_fit_tells_it_from_the_next_one():
    found = {"sure": (4.1, 0.04), "vague": (15.1, 1.56), "no fit": (np.nan, np.nan)}
    measures = ("observed order", "observed order stderr")
    rows = [
        row("convergence", name, measure, value)
        for name, pair in found.items()
        for measure, value in zip(measures, pair, strict=True)
    ]
    assert lines.orders(frame(rows)).dropna().to_dict() == {"sure": 4.1}
