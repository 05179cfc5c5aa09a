import copy
import json
import math
import re
from html.parser import HTMLParser

import numpy as np
import pytest
import vl_convert

from conservative import Reduced, RigidBody, Scene, registry, scenes
from conservative.attitude import rotation_about
from conservative.benchmarks.measures import samples
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.measures.measurement import frame
from conservative.benchmarks.measures.samples import Samples
from conservative.benchmarks.studies import sphere_curves, studies
from conservative.benchmarks.studies.study import Study
from conservative.errors import Diverged
from conservative.method import Role
from conservative.reports import document
from conservative.reports.charts import figures, spheres, vega_embed
from conservative.reports.page import page
from conservative.reports.run.provenance import provenance
from conservative.reports.tables import claims, overview, tables
from conservative.reports.tables.work_precision import points

from . import rows
from .rows import point


def row(study, method, measure, value, dt=0.1, scene="brick_flip", **fields):
    return rows.row(study, method, measure, value, dt, scene=scene, **fields)


def ladder(method, order, scene="brick_flip"):
    """Errors over steps of a method that has just this order."""
    return [
        row("convergence", method, "attitude error max", dt**order, dt, scene) for dt in (0.1, 0.05, 0.025, 0.0125, 0.00625)
    ]


def made_up():
    lines = [
        *point("reduced", "ours", 1e-2, 1e-6, scene="brick_flip"),
        *point("reduced", "ours", 1e-4, 1e-5, 0.01, "brick_flip"),
    ]
    lines += [*point("scipy:DOP853", "engine", 1e-3, 1e-4, scene="brick_flip")]
    drift = [
        row("long_runs", "reduced", "energy drift max", 2e-15),
        row("long_runs", "mujoco", "energy drift max", 3e-2, role="engine"),
    ]
    absent = row("import_time", "no_such_library", Measure.IMPORT, math.nan, scene="", role="engine", outcome="missing")
    return frame([*lines, *drift, *ladder("reduced", 2), row("speed", "reduced", "first call time", 0.25), absent])


def measured():
    t = np.linspace(0.5, 60, 120)
    common = {"study": "long_runs", "scene": "brick_flip", "role": Role.OURS, "dt": 0.1, "quantity": "energy"}
    lines = [Samples(method=name, label=name, t=t, value=1e-15 * t, **common) for name in ("reduced", "mujoco")]
    return document.Measured(made_up(), samples.frame([*lines, *curves(registry.scene("brick_flip"), Reduced())]))


def curves(scene, *methods):
    return list(studies.findings(Study("sphere_curves", (scene,), methods)))


@pytest.fixture(scope="module")
def text():
    return page.render(document.plan(["brick_flip"], ["reduced"], quick=True), measured(), provenance(["report"]))


class Outward(HTMLParser):
    """Collects every reference of a tag, and the ids and links within the page."""

    def __init__(self):
        super().__init__()
        self.references, self.ids, self.anchors = [], [], []

    def handle_starttag(self, tag, attributes):
        found = dict(attributes)
        self.ids += filter(None, [found.get("id")])
        if tag == "a":
            self.anchors.append(found["href"])
        else:
            self.references += [found[name] for name in ("src", "href", "data", "action") if name in found]


def test_page_refers_to_nothing_outside_itself(text):
    parser = Outward()
    parser.feed(text)
    assert parser.references == ["data:,"]
    assert "url(" not in text.partition("</style>")[0]
    assert all(anchor.startswith("#") and anchor[1:] in parser.ids for anchor in parser.anchors)
    assert len(parser.ids) == len(set(parser.ids))


def test_page_without_data_leaves_room_for_it(text):
    assert len(text.encode()) < 1.2e6  # measured 0.95e6; the page of every method on both scenes is 1.9e6 of 3e6


def test_sections_come_in_the_order_of_a_reader_who_chooses(text):
    titles = [re.sub(r"\s+", " ", title) for title in re.findall(r"<h[23][^>]*>(.*?)</h[23]>", text.partition("<script")[0])]
    wanted = ["Verdict", "brick_flip", "Work against precision", "Drift over time", "Convergence", "The motion itself"]
    assert titles[:6] == wanted
    assert titles[6:9] == ["Hard cases", "What is paid once: compile and import", "Audit of claims"]
    assert titles[-1] == "How this was made"
    for part in ("conservative report", "commit", "processor", "mujoco"):
        assert part in text[text.index("<footer") :]


def test_hard_cases_that_were_not_studied_are_said_so(text):
    assert "made without the study of hard cases" in text


def test_a_library_that_is_not_there_has_no_import_time(text):
    assert re.search(r"no_such_library</th><td>engine</td><td>–</td>", text)


def test_text_cannot_become_markup():
    assert "</script" not in page._in_script({"name": "</script><b>"})
    assert json.loads(page._in_script({"name": "</script>"})) == {"name": "</script>"}
    scene = Scene("<b>", scenes.brick_flip().body, np.eye(3), (0.1, 0.2, 3.0), 1.0, dt=0.1, source="<i>")
    shown = page.render(document.Plan((scene,), (Reduced(),), quick=True), measured(), provenance([]))
    assert "<i>" not in shown
    assert "&lt;i&gt;" in shown
    assert "Nothing was measured that could be drawn" in shown


def drawn(spec, hidden=()):
    """Return the picture of a chart with some lines hidden, as the browser would draw it."""
    spec = copy.deepcopy(spec) | {"width": 300}
    for parameter in spec["params"]:
        parameter["value"] = list(hidden)
    return vl_convert.vegalite_to_svg(json.dumps(spec))


def test_chart_draws_its_lines_and_the_switch_takes_one_away():
    (spec,) = vega_embed.embedded(figures.work_precision(points(made_up()), "brick_flip"), page._hovering("error"))
    colour = vega_embed.legend(["reduced"], True)[0].colour
    assert drawn(spec).count(colour) > 1
    assert colour not in drawn(spec, ["reduced"])
    assert vega_embed.legend(["scipy DOP853"], True)[0].colour in drawn(spec, ["reduced"])
    assert "legend" not in json.dumps(spec).replace('"legend": null', "")


def test_legend_has_the_lines_of_the_charts():
    figure = page._work_precision(points(made_up()), "brick_flip")
    assert [entry.name for entry in figure.legend] == ["reduced", "scipy DOP853"]
    panels = page._drift(tables.drift_samples(measured().samples), "brick_flip").charts
    assert len(panels) == 1
    assert panels[0]["datasets"].popitem()[1].count("\n") == 2 * page.DRIFT_SAMPLES + 1


def test_data_are_short_and_exact_to_their_digits():
    data = vega_embed.as_csv([{"name": "a, b", "x": 1 / 3, "left": 1}, {"name": "c", "x": 1e-17, "left": 2}], {"name", "x"})
    assert data["values"].splitlines() == ["name,x", '"a, b",0.3333333', "c,1e-17"]
    assert data["format"]["parse"] == {"x": "number"}


def test_verdict_names_the_cheapest_and_what_it_keeps():
    header, body = overview.verdict(made_up(), points(made_up()))
    found_rows = [dict(zip(header, line, strict=True)) for line in body]
    assert [line["error, rad"] for line in rows] == ["1e-03"]  # nothing reaches 1e-6 or 1e-9
    assert rows[0]["cheapest"] == "reduced"
    assert "energy ✓" in rows[0]["conserves"]
    assert rows[0]["fails"] == "nowhere here"


def test_verdict_tells_where_the_cheapest_fails():
    failed = row("long_runs", "reduced", "energy drift max", math.nan, scene="other", outcome=Diverged(0.36, "why").outcome)
    cannot = [row("long_runs", "reduced", "energy drift max", math.nan, scene=f"s{k}", outcome="unsupported") for k in range(5)]
    found = overview.verdict(frame([failed, *cannot]), points(made_up()))
    assert found[1][0][-1] == "diverged: other; unsupported: s0, s1 and 3 more scenes"


def test_a_step_that_a_method_does_not_have_is_no_failure_on_the_scene():
    found_rows = [
        row("convergence", "a", "attitude error max", math.nan, outcome="unsupported"),
        row("long_runs", "a", "energy drift max", 1e-15),
    ]
    assert overview._troubles(frame(found_rows)).empty
    assert len(overview._troubles(frame(found_rows[:1]))) == 1


@pytest.mark.parametrize(
    ("value", "text", "status"),
    [
        (3e-15, "✓ 3.0e-15", "good"),
        (2e-6, "≈ 2.0e-06", "fair"),
        (0.3, "✗ 0.3", "bad"),
        (math.inf, "✗ inf", "bad"),
        (math.nan, "–", "none"),
    ],
)
def test_drift_is_graded_by_symbol_and_colour(value, text, status):
    assert overview.graded(value) == overview.Cell(text, status)


def test_hard_cases_are_a_matrix():
    found_rows = [
        row("hard_cases", "reduced", "energy drift max", 1e-15, scene="needle"),
        row("hard_cases", "reduced", "energy drift max", math.nan, scene="falling_top", outcome="not converged"),
        row("hard_cases", "mujoco", "energy drift max", 0.1, scene="needle", role="engine"),
    ]
    header, body = overview.hard_cases(frame(found_rows))
    assert header == ["method", "needle", "falling_top"]
    assert [[str(cell)[0] for cell in line[1:]] for line in body] == [["✓", "✗"], ["✗", "–"]]
    assert overview.hard_cases(made_up()) is None


def verdicts(found_rows, scene="brick_flip"):
    return {found.claim: found.verdict for found in claims.findings(frame(found_rows), [registry.scene(scene)])}


@pytest.mark.parametrize(("order", "verdict"), [(4, claims.HOLDS), (2, claims.FAILS)])
def test_audit_of_an_order(order, verdict):
    assert verdicts(ladder("reduced:order=4", order)) == {"reduced:order=4 is of order 4 (brick_flip)": verdict}


@pytest.mark.parametrize(("drift", "verdict"), [(4e-16, claims.HOLDS), (1e-9, claims.FAILS), (math.nan, claims.FAILS)])
def test_audit_of_a_conserved_quantity(drift, verdict):
    found_rows = [row("paper", "reduced", "energy drift max", value, dt) for dt, value in ((0.01, 4e-16), (0.005, drift))]
    assert verdicts(found_rows) == {"reduced keeps energy to round-off (brick_flip)": verdict}


@pytest.mark.parametrize(("error", "verdict"), [(0.1, claims.HOLDS), (0.2, claims.FAILS), (math.nan, claims.FAILS)])
def test_audit_of_one_map_in_two_programs(error, verdict):
    found_rows = [row("paper", "convected", "attitude error max", 0.1), row("paper", "reduced", "attitude error max", error)]
    found = verdicts(found_rows)
    assert found.get("reduced is the paper's map (brick_flip)", claims.FAILS) == verdict


@pytest.mark.parametrize(("coarse", "verdict"), [(1e-8, claims.HOLDS), (0.5, claims.FAILS), (math.nan, claims.FAILS)])
def test_audit_of_mujoco_by_its_own_documentation(coarse, verdict):
    found_rows = [
        row("paper", "mujoco", "energy drift max", coarse, 0.01, role="engine"),
        row("paper", "mujoco:integrator=Euler", "energy drift max", 0.05, 0.0025, role="engine"),
        row("paper", "mujoco:integrator=implicit", "attitude error max", 0.2, 0.01, role="engine"),
        row("paper", "mujoco:integrator=implicitfast", "attitude error max", 0.2, 0.01, role="engine"),
    ]
    found = verdicts(found_rows)
    assert found["RK4 is better than Euler on energy-conserving systems, even with 4 times its step (brick_flip)"] == verdict
    assert found["implicit and implicitfast coincide for a free body (brick_flip)"] == claims.HOLDS


@pytest.mark.parametrize("name", ["brick_flip", "lagrange_top"])
def test_curves_lie_on_the_unit_sphere(name):
    found = spheres.curves(samples.frame(curves(registry.scene(name), registry.method("reduced"))))
    assert np.abs(np.linalg.norm(found[["x", "y", "z"]].to_numpy(), axis=1) - 1).max() < 1e-13  # measured 3e-16
    assert 200 < len(found) <= sphere_curves.SAMPLES


def test_polhode_is_the_same_whatever_the_body_axes():
    base = scenes.brick_flip()
    S = rotation_about((1.0, 2.0, -0.5), 0.7)
    turned = Scene("turned", RigidBody(S.T @ base.body.inertia @ S), base.R_WB0 @ S, S.T @ base.w_WB_B0, base.t_end, dt=base.dt)
    one, other = (
        np.abs(spheres.curves(samples.frame(curves(scene, Reduced())))[["x", "y", "z"]].to_numpy()) for scene in (base, turned)
    )
    assert np.abs(one - other)[:50].max() < 1e-9  # measured 3e-13


def test_methods_without_a_curve_are_named():
    found = spheres.curves(samples.frame(curves(scenes.brick_flip(), Reduced())))
    assert spheres.absent(found, "brick_flip", [Reduced(), registry.method("lame")]) == ["lame"]


def test_picks_one_method_of_each_family_that_has_no_preferred_one():
    names = [
        m.name
        for m in sphere_curves.drawn(
            [registry.method(n) for n in ("gauss:stages=2", "gauss", "reduced:order=4", "reduced", "exact")]
        )
    ]
    assert names == ["reduced", "gauss:stages=2"]


def test_longest_steps_are_a_matrix():
    largest, first = Measure.LONGEST_STEP, Measure.FAILING_STEP
    found_rows = [
        row("stability", "a", largest, 1.0, scene="needle"),
        row("stability", "a", first, 3.2, scene="needle", outcome="not converged"),
        row("stability", "b", largest, 10.0, scene="needle"),
        row("stability", "c", largest, math.nan, scene="needle", outcome="unsupported"),
    ]
    _, body = overview.stability(frame(found_rows))
    assert [str(line[1]) for line in body] == ["≈ 1 rad, then not converged", "✓ 10 rad and more", "– unsupported"]
    assert overview._troubles(frame(found_rows)).empty
