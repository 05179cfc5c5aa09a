"""Trajectories and ensembles as tables, cards and pictures, and the distributions of attitudes that pictures show."""

import json
import math
import re
import sys
from dataclasses import replace
from itertools import product

import numpy as np
import pytest

import conservative as cv
from conservative import presentation
from conservative.attitude import angle_between, rotation_about
from conservative.batch import Batch
from conservative.errors import Diverged
from conservative.grid import Grid
from conservative.integration import distributions, pictures
from conservative.integration.distributions import QUANTILES, angle_quantiles, blocks, mean_attitudes, project
from conservative.integration.spread import spread
from conservative.scenes import brick_flip

from ..sampling import sampled

R0 = rotation_about((0.3, -1.2, 0.7), 0.83)
TENSOR = [[3.1, 0.2, -0.1], [0.2, 2.7, 0.3], [-0.1, 0.3, 1.9]]


@pytest.fixture(scope="module")
def trajectory():
    scene = cv.Scene(
        "a <b>body</b>", cv.RigidBody(TENSOR), R0, (0.5, -1.5, 2.5), 3.0, cv.UniformGravity(12.5, (0.1, -0.2, 0.3))
    )
    return cv.integrate(scene, 0.001)


def test_a_table_has_every_sample_and_every_digit(trajectory):
    frame = trajectory.to_pandas()
    assert tuple(frame.columns) == presentation.COLUMNS
    assert len(frame) == len(trajectory) == 3001
    np.testing.assert_array_equal(frame["t"], trajectory.t)
    np.testing.assert_array_equal(frame["R_WB_23"], trajectory.R_WB[:, 1, 2])
    np.testing.assert_array_equal(frame["w_WB_B_3"], trajectory.w_WB_B[:, 2])
    np.testing.assert_array_equal(frame["energy"], trajectory.energy)
    np.testing.assert_array_equal(frame["momentum_W_1"], trajectory.momentum_W[:, 0])
    assert frame.attrs == {"scene": "a <b>body</b>", "method": trajectory.label, "outcome": "ok"}


def test_quaternions_and_errors_of_a_trajectory(trajectory):
    q = trajectory.quaternion_wxyz
    assert np.abs(cv.attitude.from_quaternion(q) - trajectory.R_WB).max() < 1e-14  # measured 2e-15
    W = rotation_about((0.2, 0.5, -1), 0.01)
    turned = replace(trajectory, R_WB=W @ trajectory.R_WB)
    np.testing.assert_allclose(turned.error(trajectory), 0.01, rtol=1e-12)
    with pytest.raises(cv.BadInput, match="truth: got"):
        trajectory.error(replace(turned, t=turned.t + 1e-3))


def test_a_picture_draws_rates_and_drifts(trajectory):
    specification = json.loads(trajectory.plot().to_json())
    rates, drifts = (specification["datasets"][chart["data"]["name"]] for chart in specification["vconcat"])
    assert {row["of"] for row in rates} == {"about axis 1", "about axis 2", "about axis 3"}
    assert {row["of"] for row in drifts} == {"energy", "vertical momentum"}
    assert len(rates) == 3 * presentation.MOST_DRAWN
    assert max(row["value"] for row in drifts) < 1e-13  # measured 8e-16
    axis_1 = [row for row in rates if row["of"] == "about axis 1"]
    assert max(row["value"] for row in axis_1) == trajectory.w_WB_B[:, 0].max()  # whatever the number of samples
    assert min(row["low"] for row in axis_1) == trajectory.w_WB_B[:, 0].min()
    few = replace(trajectory, t=trajectory.t[:2], R_WB=trajectory.R_WB[:2], w_WB_B=trajectory.w_WB_B[:2])
    specification = json.loads(few.plot().to_json())
    assert len(specification["datasets"][specification["vconcat"][0]["data"]["name"]]) == 6  # every sample of a short run


UNITS = {3.0: "s", 7000.0: "s", 7200.0: "h", 1e5: "h", 2e5: "days"}
WIDTHS = {2.4: (1.7, 2.0), 1e-3: (0.0, 0.02)}


@pytest.mark.parametrize(("turn", "t_end"), sampled(product(WIDTHS, UNITS), 3, [(2.4, 7000.0), (1e-3, 7200.0), (2.4, 2e5)]))
def test_a_fast_motion_is_a_band_and_a_long_one_has_hours(turn, t_end):
    """The rates turn by an angle, rad, from sample to sample; there are 10 samples for each point of the line."""
    t, angle = np.linspace(0, t_end, 5001), turn * np.arange(5001)
    unit, width = UNITS[t_end], WIDTHS[turn]
    w_WB_B = np.stack([2 + np.cos(angle), np.sin(angle), 0 * t + 3], axis=1)
    run = cv.Trajectory(brick_flip(), t, np.broadcast_to(np.eye(3), (len(t), 3, 3)), w_WB_B, "made")
    specification = run.plot().to_dict()
    rates = specification["vconcat"][0]
    assert [rate["mark"]["type"] for rate in rates["layer"]] == ["area", "line", "line"]
    rows = [row for row in specification["datasets"][rates["data"]["name"]] if row["of"] == "about axis 1"]
    widths = [row["value"] - row["low"] for row in rows]
    assert width[0] <= min(widths) <= max(widths) <= width[1]  # measured 1.74 to 2.00, and 0 to 0.011
    assert {rate["encoding"]["x"]["title"] for rate in rates["layer"]} == {f"time, {unit}"}
    assert rows[-1]["t"] == pytest.approx(t_end / {"s": 1, "h": 3600, "days": 86400}[unit], rel=0.01)


def test_a_table_of_an_ensemble_in_free_flight_has_the_tables_of_its_bodies():
    scene = cv.scenes.thrown_box()
    found = cv.integrate_many(scene, w_WB_B0=[(1, 2, 3), (3, 1, 2)], dt=0.01, t_end=0.1, method="moser_veselov")
    frame = found.to_pandas()
    np.testing.assert_array_equal(frame[frame["body"] == 1].drop(columns="body"), found[1].to_pandas())
    for motion in (found, found[1]):
        with pytest.raises(AttributeError, match="to_pandas"):
            motion.to_xarray()


def test_a_notebook_shows_the_picture_without_a_network(trajectory, monkeypatch):
    # Altair's own HTML loads its scripts from a server; neither the specification nor the SVG has an address.
    chart = trajectory.plot().properties(title="renamed")
    shown = chart._repr_mimebundle_()
    assert sorted(shown) == ["application/vnd.vegalite.v6+json", "image/svg+xml", "text/plain"]
    assert "cdn" in trajectory.plot().to_html()  # what would be shown otherwise
    assert not re.search(r"(src|href)=", shown["image/svg+xml"])
    assert "renamed" in shown["image/svg+xml"]
    assert len(shown["application/vnd.vegalite.v6+json"]["vconcat"]) == 2
    monkeypatch.setitem(sys.modules, "vl_convert", None)
    assert "image/svg+xml" not in chart._repr_mimebundle_()


def test_a_drift_is_selected_by_name(trajectory):
    energy, _ = trajectory.scene.invariants
    np.testing.assert_array_equal(trajectory.drift("energy"), trajectory.drift(energy))
    with pytest.raises(cv.BadInput, match="'energy' \\(nearest\\), or one of energy, vertical momentum"):
        trajectory.drift("enrgy")


def test_a_card_has_the_outcome_and_escapes_the_text_of_users(trajectory):
    text = trajectory._repr_html_()
    assert "<table>" in text
    assert "a &lt;b&gt;body&lt;/b&gt;" in text
    for part in ("ok", "3001 to 3 s", "3000 steps", "drift of energy", "drift of vertical momentum", trajectory.label):
        assert part in text


def test_a_trajectory_without_samples(trajectory):
    empty = replace(
        trajectory, t=trajectory.t[:0], R_WB=trajectory.R_WB[:0], w_WB_B=trajectory.w_WB_B[:0], failure=Diverged(0.0)
    )
    assert "0 to nothing" in empty._repr_html_()
    assert "diverged" in empty._repr_html_()
    assert len(empty.to_pandas()) == 0
    with pytest.raises(cv.BadInput) as caught:
        empty.plot()
    assert str(caught.value).startswith("trajectory: got ")
    assert "at least one sample" in caught.value.allowed


@pytest.mark.parametrize(("package", "method"), [("pandas", "to_pandas"), ("altair", "plot"), ("pandas", "plot")])
def test_without_the_package_the_error_names_the_extra_that_brings_it(trajectory, monkeypatch, package, method):
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(cv.MissingExtra, match=rf"Trajectory\.{method}.* {package}\..*conservative-rotation\[report\]"):
        getattr(trajectory, method)()


SCENE = cv.scenes.brick_flip()
GRID = Grid(0.1, 600)


def ensemble(n, grid=GRID, attitude="2deg"):
    """Return an ensemble that turns about an axis fixed in the world, with made-up drifts."""
    starts = cv.spread(SCENE, n, attitude=attitude)
    turns = np.stack([rotation_about((1, 2, 3), 0.01 * t) for t in grid.t])
    drifts = {"energy": np.linspace(1e-16, 3e-13, n), "momentum": np.full(n, 2e-15)}
    bodies = Batch(SCENE, starts["R_WB0"], starts["w_WB_B0"], None, {})
    R = turns[None] @ starts["R_WB0"][:, None]
    return cv.Ensemble(bodies, grid, R, np.zeros((n, grid.n_samples, 3)), drifts, "mine==1/turn", {})


def drawn(found, **options):
    """Return the specification of the picture, and the rows of its charts by name."""
    spec = json.loads(found.plot(**options).to_json())
    discs, over_time, drifts = spec["vconcat"]
    rows = {
        "discs": [spec["datasets"][layer["data"]["name"]] for disc in discs["hconcat"] for layer in disc["layer"]],
        "spread": spec["datasets"][over_time["layer"][0].get("data", over_time.get("data"))["name"]],
        "drifts": spec["datasets"][drifts["data"]["name"]],
    }
    return spec, rows


def test_few_bodies_are_points_and_many_are_counted():
    few, many = ensemble(pictures.MOST_POINTS, Grid(0.1, 3)), ensemble(3000, Grid(0.1, 3))
    assert len(drawn(few)[1]["discs"][0]) == pictures.MOST_POINTS
    cells = drawn(many)[1]["discs"][0]
    assert sum(row["bodies"] for row in cells) == 3000
    assert len(cells) < 1700  # 41 by 41


def test_a_picture_of_many_bodies_has_few_rows_and_the_spread_of_all():
    found = ensemble(1500)
    _, rows = drawn(found)
    assert all(len(part) <= 2000 for part in [*rows["discs"], rows["spread"], rows["drifts"]])
    assert len(rows["spread"]) == pictures.MOST_TIMES < len(found.t)
    last = angle_quantiles(found.R_WB, mean_attitudes(found.R_WB))[-1]
    shown = [rows["spread"][-1][key] for key in ("low", "middle", "high")]
    assert shown == pytest.approx(np.degrees(last), rel=1e-12)


def test_drifts_are_counted_in_bins_of_decades():
    _, rows = drawn(ensemble(1500, Grid(0.1, 3)))
    counts = {(row["of"], round(math.log10(row["drift"]), 2)): row["bodies"] for row in rows["drifts"]}
    assert counts["momentum", -14.75] == 1500
    assert counts["momentum", -15.0] == 0.5  # none, below the axis
    energies = np.linspace(1e-16, 3e-13, 1500)
    assert counts["energy", -13.25] == np.count_nonzero((energies >= 10**-13.25) & (energies < 1e-13))


def test_the_axis_of_symmetry_is_drawn_if_there_is_one():
    turned = cv.scenes.brick_flip().rename("turned", body=cv.RigidBody((2.0, 1.0, 1.0)))
    few = ensemble(5, Grid(0.1, 1))
    spec, _ = drawn(replace(few, bodies=replace(few.bodies, scene=turned)))
    assert spec["vconcat"][0]["hconcat"][0]["title"]["text"].startswith("Body axis 1 ")
    assert drawn(few)[0]["vconcat"][0]["hconcat"][0]["title"]["text"].startswith("Body axis 3 ")


@pytest.mark.parametrize("axis", [(0, 0, 0), (1, 2, math.nan)])
def test_an_axis_without_direction_is_refused(axis):
    with pytest.raises(cv.BadInput, match=r"axis_B: got .*expected a direction"):
        ensemble(3, Grid(0.1, 1)).plot(axis_B=axis)


def test_failed_bodies_are_left_out_even_if_all_fail():
    found = ensemble(3, Grid(0.1, 2))
    found.R_WB[1, 1:] = math.nan
    found.drifts["energy"][1] = math.nan
    one = replace(found, failures={1: cv.Diverged(0.1)})
    assert len(drawn(one)[1]["discs"][0]) == 2
    found.R_WB[:, 1:] = math.nan
    for values in found.drifts.values():
        values[:] = math.nan
    _, rows = drawn(replace(found, failures=dict.fromkeys(range(3), cv.Diverged(0.1))))
    assert rows["discs"][0] == []
    assert [row["middle"] for row in rows["spread"]][1:] == [None, None]
    assert {row["bodies"] for row in rows["drifts"]} == {0.5}


N = 5000
SPREADS = ("3e-7", "2deg", "any")


@pytest.fixture(scope="module")
def R_WB():
    """Return attitudes (N, 3, 3, 3): three samples with different means and spreads; two bodies fail."""
    about = [rotation_about((1, 2, k), 0.5 + k) for k in range(3)]
    R = np.stack([R @ spread(brick_flip(), N, attitude=each)["R_WB0"] for R, each in zip(about, SPREADS, strict=True)], axis=1)
    R[17, 1:] = R[3000, 2] = math.nan
    return R


class OnDisk:
    """An array in chunks, as on a disk, which records the parts that are read."""

    def __init__(self, values, chunk):
        self.values, self.shape, self.chunks, self.read = values, values.shape, (chunk, *values.shape[1:]), []

    def __getitem__(self, part):
        self.read.append((part.start, len(self.values[part])))
        return self.values[part].tolist()


def test_blocks_are_those_of_the_disk(R_WB, monkeypatch):
    monkeypatch.setattr(distributions, "_BLOCK", 2**17)  # 606 bodies of three samples
    stored = OnDisk(R_WB, 100)
    np.testing.assert_array_equal(np.concatenate(list(blocks(stored))), R_WB)
    assert stored.read[:2] == [(0, 600), (600, 600)]
    np.testing.assert_array_equal(np.concatenate(list(blocks(R_WB, [0, 2]))), R_WB[:, [0, 2]])
    assert max(map(len, blocks(R_WB))) == 606


def test_the_mean_is_the_attitude_that_is_nearest_to_all(R_WB, monkeypatch):
    monkeypatch.setattr(distributions, "_BLOCK", 2**16)
    for sample, mean in enumerate(mean_attitudes(R_WB)):
        R = R_WB[np.isfinite(R_WB[:, sample]).all(axis=(1, 2)), sample]
        assert np.abs(mean.T @ mean - np.eye(3)).max() < 1e-14  # measured 9e-16
        assert np.linalg.det(mean) > 0
        others = [mean @ rotation_about(axis, angle) for axis in np.eye(3) for angle in (1e-3, -1e-3)]
        assert all(np.sum((R - mean) ** 2) < np.sum((R - other) ** 2) for other in others)
    np.testing.assert_array_equal(mean_attitudes(R_WB, [1]), mean_attitudes(R_WB)[[1]])


def test_quantiles_are_right_to_a_quarter_of_a_percent(R_WB):
    mean = mean_attitudes(R_WB)
    found = angle_quantiles(R_WB, mean)
    for sample in range(3):
        angles = angle_between(mean[sample], R_WB[np.isfinite(R_WB[:, sample]).all(axis=(1, 2)), sample])
        exact = np.quantile(angles, QUANTILES, method="inverted_cdf")
        assert np.abs(found[sample] / exact - 1).max() < 0.0026  # measured 0.0022
    np.testing.assert_array_equal(angle_quantiles(R_WB, mean[[2]], [2]), found[[2]])


def test_quantiles_of_equal_attitudes_and_of_failed_bodies():
    R = np.tile(rotation_about((1, 2, 3), 1.0), (4, 2, 1, 1))
    R[:, 1] = math.nan
    found = angle_quantiles(R, R[0] * 1.0)
    assert found[0].tolist() == [0, 0, 0]
    assert np.isnan(found[1]).all()


@pytest.mark.parametrize("centre", [(0.6, 0.0, 0.8), (0, 0, 1), (0, 0, -1)])
def test_the_disc_is_seen_from_outside_and_keeps_areas(centre):
    around = np.stack([np.cross(centre, (0.28, 0.96, 0)), np.cross(centre, (-0.28, -0.96, 0)), centre])
    around /= np.linalg.norm(around, axis=1, keepdims=True)
    angle = np.array([0.4, 0.4, 0])[:, None]
    points, mean = project(np.cos(angle) * centre + np.sin(angle) * around)
    assert mean == pytest.approx(centre, abs=1e-15)
    assert np.linalg.norm(points, axis=1) == pytest.approx([2 * math.sin(0.2), 2 * math.sin(0.2), 0], abs=1e-15)
    up = np.array([0, 0, 1.0] if abs(centre[2]) < 0.99 else [1.0, 0, 0])
    highest, _ = project(np.stack([centre + 0.1 * up, centre + 0.1 * np.cross(up, centre)]) / math.sqrt(1))
    assert highest[0, 1] > abs(highest[0, 0])
    assert highest[1, 0] > highest[0, 0]
