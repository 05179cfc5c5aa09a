import copy
import json
from html.parser import HTMLParser

import numpy as np
import pytest
import vl_convert

from conservative import Reduced, Scene, scenes
from conservative.reports.charts import figures, vega_embed
from conservative.reports.page import figures as page_figures
from conservative.reports.page import page
from conservative.reports.run.plan import Plan, plan_report
from conservative.reports.run.provenance import provenance
from conservative.reports.tables import lines
from conservative.reports.tables.work_precision import front, points
from conservative.reports.view import build

from .made_up import measurements, table


@pytest.fixture(scope="module")
def text():
    return rendered(plan_report(["brick_flip"], ["reduced"], quick=True), provenance(["report"]))


def rendered(plan, source):
    view = build(plan, measurements(), source)
    return page.render(view, page_figures.charts(view))


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


def test_text_cannot_become_markup():
    scene = Scene("<b>", scenes.brick_flip().body, np.eye(3), (0.1, 0.2, 3.0), 1.0, dt=0.1, source="<i>")
    shown = rendered(Plan((scene,), (Reduced(),), (), quick=True), provenance([]))
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
    found = points(table())
    (spec,) = vega_embed.embed(figures.work_precision(found, front(found), "brick_flip"), page_figures.hover("error"))
    colour = vega_embed.legend({"reduced": "reduced"}, True)[0].colour
    assert drawn(spec).count(colour) > 1
    assert colour not in drawn(spec, ["reduced"])
    assert vega_embed.legend({"scipy DOP853": "scipy"}, True)[0].colour in drawn(spec, ["reduced"])
    assert "legend" not in json.dumps(spec).replace('"legend": null', "")


def test_legend_has_the_lines_of_the_charts():
    view = build(plan_report(["brick_flip"], ["reduced"], quick=True), measurements(), provenance([]))
    found = page_figures.page_figures(view, page_figures.charts(view))
    assert [entry.name for entry in found["work_precision_brick_flip"].legend] == ["reduced", "scipy"]
    panels = found["drift_brick_flip"].charts
    assert len(panels) == 1
    assert panels[0]["datasets"].popitem()[1].count("\n") == 2 * lines.THIN + 1


def test_data_are_short_and_exact_to_their_digits():
    data = vega_embed.as_csv([{"name": "a, b", "x": 1 / 3, "left": 1}, {"name": "c", "x": 1e-17, "left": 2}], {"name", "x"})
    assert data["values"].splitlines() == ["name,x", '"a, b",0.3333333', "c,1e-17"]
    assert data["format"]["parse"] == {"x": "number"}
