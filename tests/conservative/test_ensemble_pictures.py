"""Pictures of many bodies: what they show, with how few rows, and that none is wrong where bodies fail or stand still."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import rotation_about
from conservative.integration import pictures
from conservative.integration.distributions import angle_quantiles, mean_attitudes
from conservative.method import Grid
from conservative.methods.many import Bodies

SCENE = cv.scenes.brick_flip()
GRID = Grid(0.1, 600)


def ensemble(n, grid=GRID, attitude="2deg"):
    """Bodies that turn about an axis fixed in the world, at rates of their own, and drifts of any kind."""
    starts = cv.spread(SCENE, n, attitude=attitude)
    turns = np.stack([rotation_about((1, 2, 3), 0.01 * t) for t in grid.t])
    drifts = {"energy": np.linspace(1e-16, 3e-13, n), "momentum": np.full(n, 2e-15)}
    bodies = Bodies(SCENE, starts["R_WB0"], starts["w_WB_B0"], None, {})
    R = turns[None] @ starts["R_WB0"][:, None]
    return cv.Ensemble(bodies, grid, R, np.zeros((n, grid.n_samples, 3)), drifts, "mine==1/turn", {})


def drawn(found, **options):
    """Return the specification, and the rows of each of its charts by what they are."""
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


def test_a_picture_of_any_number_has_few_rows_and_the_spread_is_that_of_all():
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


def test_the_axis_is_that_of_symmetry_where_there_is_one():
    turned = cv.scenes.brick_flip().rename("turned", body=cv.RigidBody((2.0, 1.0, 1.0)))
    few = ensemble(5, Grid(0.1, 1))
    spec, _ = drawn(replace(few, bodies=replace(few.bodies, scene=turned)))
    assert spec["vconcat"][0]["hconcat"][0]["title"]["text"].startswith("Body axis 1 ")
    assert drawn(few)[0]["vconcat"][0]["hconcat"][0]["title"]["text"].startswith("Body axis 3 ")


@pytest.mark.parametrize("axis", [(0, 0, 0), (1, 2, math.nan)])
def test_an_axis_that_is_no_direction_is_refused(axis):
    with pytest.raises(cv.BadInput, match=r"axis_B: got .*allowed: a direction"):
        ensemble(3, Grid(0.1, 1)).plot(axis_B=axis)


def test_bodies_that_fail_are_counted_and_left_out_even_all_of_them():
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
