"""Axes of charts name the unit of their values, and colours of lines can be seen on light and dark pages."""

import re
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import vl_convert

import conservative as cv
from conservative import Reduced, Role, registry
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies.motion import project_on_sphere
from conservative.reports.charts import figures, recommendation, spheres
from conservative.reports.charts.style import _OTHERS, PALETTE, SHAPES, colours, look, power_axis, svg_text
from conservative.reports.document.contrast import DARK_PAPER, LEAST, LIGHT_PAPER, colours_in, contrast, stand_ins
from conservative.reports.rows import lines
from conservative.reports.rows import points as work_precision

from .rows import frame, point, row, table


def axes(spec):
    """Yield channel, field and title of every axis of a chart."""
    for channel in ("x", "y"):
        found = spec.get("encoding", {}).get(channel, {})
        if found.get("axis"):
            yield channel, found["field"], found["axis"]["title"]
    for key in ("layer", "vconcat", "hconcat"):
        for part in spec.get(key, ()):
            yield from axes(part)


def drawn(spec, field):
    return sorted({row[field] for rows in spec["datasets"].values() for row in rows if field in row})


def test_time_against_error_is_in_microseconds_and_radians():
    points = work_precision.points(table(point("a", "ours", 1e-3, 2e-6, 0.2), point("a", "ours", 1e-6, 5e-6, 0.1)))
    spec = figures.work_precision(points, work_precision.front(points), "made_up").to_dict()
    assert set(axes(spec)) == {
        ("x", "error", "largest attitude error over the run, rad"),
        ("y", "microseconds", "wall time per simulated second, µs"),
    }
    assert drawn(spec, "microseconds") == pytest.approx([2.0, 5.0], rel=1e-12)
    assert drawn(spec, "error") == [1e-6, 1e-3]


def test_convergence_is_in_seconds_and_drift_is_relative():
    rows = [row("convergence", "a", Measure.ATTITUDE_MAX, dt**2, dt) for dt in (0.4, 0.2, 0.1)]
    errors = lines.errors(frame(rows), Measure.ATTITUDE_MAX)
    spec = figures.convergence(errors, lines.fit_ends(lines.fits(errors)), "made_up").to_dict()
    assert set(axes(spec)) == {("x", "dt", "step, s"), ("y", "error", "largest attitude error over the run, rad")}
    drifts = pd.DataFrame({"family": "a", "name": "a", "t": [1.0, 2.0], "quantity": "energy", "drift": [0.0, 1e-9]})
    spec = figures.signed_drift(drifts).to_dict()
    (panel,) = spec["hconcat"]
    assert (panel["encoding"]["x"]["title"], panel["encoding"]["y"]["axis"]["title"]) == ("t, s", "relative change")
    assert panel["encoding"]["y"]["axis"]["values"] == [0.0, 1e-12, 1e-9]
    assert drawn(spec, "drift") == [0.0, 1e-9]


def test_lines_have_the_colour_of_their_family_and_the_mark_of_their_place():
    families = {"reduced": "reduced", "gauss 2": "gauss", "gauss 3": "gauss"}
    channels = look(families, "shape")
    scales = [channels[name].to_dict()["scale"] for name in ("color", "shape")]
    found = [dict(zip(scale["domain"], scale["range"], strict=True)) for scale in scales]
    assert found == [colours(families), {"reduced": SHAPES[0], "gauss 2": SHAPES[0], "gauss 3": SHAPES[1]}]


def timed(times):
    """Return the points of two methods; the second one was timed in several processes."""
    rows = [("ours", 1e-3, (1e-6,)), ("theirs", 1e-3, (2e-6,)), ("theirs", 1e-6, times)]
    found = pd.DataFrame(rows, columns=["name", "error", "times"])
    time = [float(np.exp(np.nanmean(np.log(each)))) for each in found["times"]]
    return found.assign(
        family=found["name"], time=time, kind="at its best", setting="", sample=1.0, dt=1.0, within="", **{"class": "engines"}
    )


@pytest.mark.parametrize(
    "draw",
    [
        lambda points: figures.work_precision(points, points, "s"),
        lambda points: figures.engines(points, "s"),
        figures.best_of_families,
        lambda points: figures.body_costs(points.assign(size=[1, 1, 10], kind="tops", error=1e-3)),
    ],
)
@pytest.mark.parametrize(("times", "ends"), [((2e-6, 4e-6, np.nan, 8e-6), (2.0, 8.0)), ((3e-6,), None), ((np.nan, 3e-6), None)])
def test_times_of_several_processes_have_bars(draw, times, ends):
    spec = draw(timed(times)).to_dict()
    rules = [mark for mark in found_marks(spec) if mark["mark"]["type"] == "rule"]
    assert len(rules) == (ends is not None)
    for rule in rules:
        assert (rule["encoding"]["y"]["field"], rule["encoding"]["y2"]["field"]) == ("low", "high")
        (row,) = [each for rows in spec["datasets"].values() for each in rows if each["high"] > each["low"]][:1]
        assert (row["low"], row["high"]) == pytest.approx(ends)


def found_marks(spec):
    if "mark" in spec:
        yield spec
    for key in ("layer", "vconcat", "hconcat", "concat"):
        for part in spec.get(key, ()):
            yield from found_marks(part)


def test_guides_have_the_slopes_of_the_fitted_orders():
    dt = np.array([0.1, 0.01])
    errors = pd.concat([pd.DataFrame({"name": f"{k}", "dt": dt, "error": dt**k}) for k in (1, 2, 4)])
    fits = pd.concat([pd.DataFrame({"name": f"{k}", "dt": dt, "error": 3 * dt**k}) for k in (1.9, 2.05, 4.1)])
    guides = figures.order_guides(errors, fits)
    assert guides["text"].unique().tolist() == ["order 2", "order 4"]
    for order, ends in guides.groupby("text"):
        slope = np.diff(np.log(ends["error"])) / np.diff(np.log(ends["dt"]))
        assert slope == pytest.approx(int(order[-1]))
        assert ends["dt"].between(0.01 * (1 - 1e-9), 0.1 * (1 + 1e-9)).all()
        assert ends["error"].between(1e-8 * (1 - 1e-9), 0.1 * (1 + 1e-9)).all()
    assert figures.order_guides(errors, fits.iloc[:0]).empty
    high = pd.concat([pd.DataFrame({"name": f"{k}", "dt": dt, "error": dt**k}) for k in (1, 3, 4, 8, 9, 10)])
    few = pd.DataFrame({"dt": (0.1, 1e-4), "error": (0.1, 1e-12)})  # to which the lines are drawn
    assert figures.order_guides(few, high)["text"].unique().tolist() == ["order 1", "order 3", "order 4", "order 8"]
    for ends, texts in ((fits, 1), (fits.iloc[:0], 0)):
        spec = figures.convergence(errors.assign(family=errors["name"]), ends, "s").to_dict()
        # In one list: the page removes the legend of each layer, and adds the filter of its buttons.
        assert [layer["mark"]["type"] for layer in spec["layer"]].count("text") == 2 * texts  # a white halo and the text


def test_guides_of_growth_stay_within_the_axes_and_have_their_slopes():
    t = np.geomspace(1, 1000, 4)
    part = pd.DataFrame({"t": t, "shown": 1e-15 * t**0.3})  # grows less than the guides
    found = figures.growth_guides(part, part["shown"].max())
    slopes = [np.diff(np.log(ends["shown"])) / np.diff(np.log(ends["t"])) for _, ends in found.groupby("text", sort=False)]
    assert np.concatenate(slopes) == pytest.approx([0.5, 1.0])
    assert found["t"].between(1, 1000).all()
    assert found["shown"].between(1e-15, part["shown"].max() * (1 + 1e-9)).all()


@pytest.mark.parametrize(("largest", "tick"), [(9.98e-17, 5e-17), (3e-13, 2e-13), (2e-12, 1e-12), (0.3, 1.0)])
def test_an_axis_of_drifts_has_a_number_beside_zero(largest, tick):
    rows = pd.DataFrame({"t": [0.0, 1.0], "drift": [0.0, -largest], "quantity": "energy", "name": "a", "family": "a"})
    spec = figures.signed_drift(rows).to_dict()
    values = spec["hconcat"][0]["encoding"]["y"]["axis"]["values"]
    assert min(values) == -tick  # up to ten times the largest drift
    assert 0 in values


def test_the_exact_motion_has_one_name_and_methods_without_a_balance_no_line():
    methods = ["precise", "reduced", "scipy"]
    columns = {
        "study": "motion",
        "scene": "s",
        "t": 0.0,
        "quantity": "drift of energy balance",
        "method": methods,
        "family": methods,
    }
    more = {"line": ["precise 256 bits", "reduced", "scipy"], "role": ["truth", "ours", "engine"], "value": [0.0, 1e-9, np.nan]}
    assert lines.signed_drifts(pd.DataFrame(columns | more), "s", ["energy balance"])["name"].tolist() == ["exact", "reduced"]


def test_an_uncertain_fit_has_neither_a_bold_stretch_nor_a_guide():
    fits = pd.DataFrame({"name": ["a", "b"], "stderr": [0.1, 19.0]})
    fits = fits.assign(coarse=1.0, fine=0.1, error_coarse=1.0, error_fine=1e-4)
    assert set(lines.fit_ends(fits)["name"]) == {"a"}


def labels_of_guides(spec):
    halo, text = [layer for layer in spec["layer"] if layer["mark"]["type"] == "text"]
    assert halo["data"] == text["data"]
    return spec["datasets"][text["data"]["name"]]


def test_labels_of_guides_are_beside_their_lines_and_not_on_an_axis():
    dt = np.geomspace(0.1, 0.001, 5)
    errors = pd.concat([pd.DataFrame({"name": f"{k}", "family": f"{k}", "dt": dt, "error": dt**k}) for k in (2, 8)])
    for place in labels_of_guides(figures.convergence(errors, errors.groupby("name").nth([0, -1]), "s").to_dict()):
        order = int(place["text"].removeprefix("order "))
        assert place["error"] == pytest.approx(0.01 * (place["dt"] / 0.1) ** order)  # on the line through the largest error
        assert place["dt"] > 0.0011
        assert place["error"] > 10 * errors["error"].min()


def test_the_cost_of_a_recommendation_is_in_microseconds():
    probe = SimpleNamespace(method=Reduced(), dt=0.25, setting=0.25)
    advice = [SimpleNamespace(reached=reached, best=probe, cost=3e-6, line="reduced") for reached in (True, False)]
    found = recommendation.costs(SimpleNamespace(advice=advice))
    assert found.to_dict("records") == [{"name": "reduced", "setting": "dt = 0.25 s", "cost": pytest.approx(3.0)}]


def test_the_far_side_of_a_sphere_is_faint():
    curve = pd.DataFrame({"name": "a", "family": "a", "x": [1.0, -1.0], "y": [0.0, 0.0], "z": [0.0, 0.0]})
    behind, before = spheres.chart(curve)["layer"][1:]
    assert ["values" in layer["data"] and layer["data"]["values"].count("\n") for layer in (behind, before)] == [2, 2]
    assert behind["mark"]["opacity"] < before["mark"]["opacity"]


@pytest.mark.parametrize(
    ("moments", "rates"),
    [
        ((13, 5, 10), (0.01, 0.02, 10)),
        ((1, 2, 2.5), (3, 0.1, 0.2)),
        ((1, 2, 2.5), (0.1, 0.1, -3)),
        ((1, 1, 1.5), (1, 2, 3)),
        ((1, 2, 2), (1, 2, -3)),
        ((2, 2, 2), (1, 2, 3)),
        ((1, 1, 1.5), (1, 2, 0)),
        ((1, 2, 2.5), (0, 0, 2)),
    ],
)
def test_a_polhode_is_closed_and_goes_through_the_exact_motion(moments, rates):
    scene = cv.Scene("s", cv.RigidBody(moments), np.eye(3), rates, 20.0)
    curve, run = spheres.polhode(scene), registry.method("exact").solve(scene, cv.Grid(0.05, 400))
    points = project_on_sphere(run)
    np.testing.assert_allclose(curve[0], curve[-1], atol=1e-14)  # measured 2e-16
    np.testing.assert_allclose(np.linalg.norm(curve, axis=1), 1, atol=1e-14)  # measured 2e-16
    energy = (curve**2 / np.sort(moments)).sum(axis=1)
    np.testing.assert_allclose(energy, (points[0] ** 2 / np.sort(moments)).sum(), rtol=1e-13)  # measured 1e-15
    apart = [np.linalg.norm(curve - point, axis=1).min() for point in points]
    assert max(apart) < 0.06  # measured 0.047: between two points of the curve
    parts = spheres._split(curve)
    assert sum(len(part) - 1 for part, _ in parts) == len(curve) - 1  # no gap where the curve passes behind the sphere
    assert spheres.polhode(cv.scenes.lagrange_top()) is spheres.polhode(cv.scenes.volterra_gyrostat()) is None


def test_samples_on_a_sphere_are_not_joined():
    k = np.arange(100)
    curve = pd.DataFrame({"name": "a", "family": "a", "x": np.sin(k), "y": np.cos(k), "z": 0.0})
    drawn = re.findall(r' d="([^"]*)"', vl_convert.vegalite_to_svg(spheres.chart(curve)))
    assert sum(path.count("Z") for path in drawn if "L" not in path) >= 100  # a dot each, and no line between any two


@pytest.mark.parametrize(("low", "high", "powers"), [(0.05, 200.0, [0.1, 1.0, 10.0, 100.0]), (1.0, 100.0, [1.0, 10.0, 100.0])])
def test_a_logarithmic_axis_has_a_label_at_each_power_of_ten(low, high, powers):
    assert power_axis("title", low, high).values == pytest.approx(powers)


def test_a_picture_of_a_full_report_has_all_its_samples_and_names_all_its_lines():
    many = pd.DataFrame({"t": np.arange(1.0, 131.0), "quantity": "energy", "drift": 1e-9})
    drifts = pd.concat([many.assign(name=f"a order={i}", family="a") for i in range(40)])  # 5,200 rows, 40 lines
    drawn = svg_text(figures.signed_drift(drifts))
    assert all(f">a order={i}<" in drawn for i in range(40))


def test_the_colour_of_a_family_is_the_same_in_every_picture_and_of_no_other():
    ours = [name for name, each in registry.list_families().items() if each.role in (Role.OURS, Role.BASELINE)]
    together = colours({name: name for name in ours})
    assert len(set(together.values())) == len(ours)
    assert all(colours({name: name}) == {name: together[name]} for name in ours)


COLOURS = (*PALETTE.values(), *_OTHERS)


def test_contrast_is_that_of_the_guidelines():
    assert contrast("#000000", "#FFFFFF") == pytest.approx(21)
    assert contrast("#777777", "#FFFFFF") == pytest.approx(
        4.48, abs=0.01
    )  # the guidelines' own example of what is just too low
    assert contrast("#661100", DARK_PAPER) == pytest.approx(1.41, abs=0.03)  # why there are stand-ins


@pytest.mark.parametrize("paper", [LIGHT_PAPER, DARK_PAPER])
def test_every_colour_of_a_line_is_seen(paper):
    found = stand_ins(COLOURS, paper)
    assert found
    assert min(contrast(found.get(colour, colour), paper) for colour in COLOURS) >= LEAST
    assert all(contrast(colour, paper) < LEAST for colour in found)


def test_colours_are_found_in_a_text():
    assert colours_in('{"color": "#0072b2", "x": "#12345", "id": "#1234567"}') == {"#0072B2"}
