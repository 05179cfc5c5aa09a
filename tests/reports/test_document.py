"""The renderers on small documents, and the charts of the page."""

import copy
import json
import math
import re
from html import escape
from html.parser import HTMLParser

import altair as alt
import pandas as pd
import pytest
import vl_convert
from markdown_it import MarkdownIt

from conservative.outcome import OK
from conservative.reports import report
from conservative.reports.charts import figures, style, vega_embed
from conservative.reports.document import SVG_MARK, html, latex, markdown, terminal, text
from conservative.reports.document.model import (
    Cell,
    Check,
    Document,
    Emphasis,
    Facts,
    Figure,
    Grade,
    Interval,
    Item,
    Items,
    LegendEntry,
    Paragraph,
    Section,
    Style,
    Table,
    filled,
)
from conservative.reports.rows.points import front, points

from .made_up import table

PICTURE = Figure(
    "picture", "A picture", "It shows <a>.", picture=object(), panels=[], legend=[LegendEntry("a", "#000000", "", "")]
)
GRID = Table(
    ["case", "m"], [["needle", Cell("both", parts=(Cell("✓ 1", Grade.GOOD), Cell("✗ 2", Grade.BAD)))]], "Grid", Style.GRID
)
NOTES = Table(["class", "µs"], [[Cell("ours", note="a, b"), Cell("12", note="a")]], "Notes")
SORTED = Table(["method", "ratio"], [["<b>|", Cell("1.100", Grade.BAD, interval=Interval(1.1, 1.0, 1.2, 1.05))]], "Sorted")
FACTS = Facts([("command", "`conservative`")])
DOCUMENT = Document(
    "conservative test",
    "A title",
    [
        Section(
            "First",
            [
                Paragraph("The verdict: 1e-3 rad.", Emphasis.LEAD),
                PICTURE,
                Items([Item("is slow", "engine", marked=True)]),
                Section("Nothing for Markdown", [Figure("page_only", "On the page", panels=[])]),
            ],
            "first",
        ),
        Section(
            "Second",
            [GRID, NOTES, Section("Folded", [SORTED], folded=True, source={"study": ["a", "b"]}), FACTS],
            "second",
            source={"scene": "brick"},
        ),
    ],
    data={"value": math.nan, "outcome": OK, "grade": Grade.GOOD, "rows": [{"x": 1.0}]},
    checks=[Check("scene", "method", "said", "too slow\x00"), Check("scene", "other")],
    failures=["too slow"],
)


def test_markdown_has_every_block_and_the_picture_in_a_file():
    drawn = []
    text = markdown.render(DOCUMENT, lambda figure: drawn.append(figure) or f"{figure.name}.svg")
    assert drawn == [PICTURE]
    parts = [
        "# A title",
        "## First",
        "**The verdict: 1e-3 rad.**",
        "![A picture](picture.svg)",
        "- **engine**: is slow",
        "## Second",
        "Grid",
        "| case | m |\n| --- | ---: |\n| needle | both |",
        "Notes",
        "| class | µs |\n| --- | ---: |\n| ours (a, b) | 12 (a) |",
        "### Folded",
        "Sorted",
        "| method | ratio |\n| --- | ---: |\n| \\<b>\\| | 1.100 |",
        "|  |  |\n| --- | ---: |\n| command | `conservative` |",
    ]
    assert text == "\n\n".join(parts) + "\n"


@pytest.mark.parametrize(
    "name", ["<img src=x onerror=alert(1)>", "a*b*c", "_a_", "moser_veselov", "[x](y)", "&lt;", r"a\*b", "# x", "a|b", "a/b"]
)
def test_markdown_shows_every_name_as_it_is(name):
    blocks = [Paragraph(f"{name} is slow."), Items([Item(name, name)]), Facts([(name, name)]), Section(name, [Paragraph("x")])]
    content = Document("c", name, [*blocks, Table(["case", name], [[name, Cell(name)]], name), Figure("f", name, picture=1)])
    page = MarkdownIt("gfm-like", {"linkify": False}).render(markdown.render(content, lambda figure: "f.svg"))
    assert page.count(escape(name)) == 12
    assert not re.search("<img src=x|<a |<em>", page)


def test_a_picture_needs_a_folder():
    with pytest.raises(ValueError, match="picture"):
        text(DOCUMENT, "markdown")


def test_json_has_null_for_nan_and_the_values_of_enums():
    content = json.loads(text(DOCUMENT, "json"))
    assert (content["value"], content["grade"], content["outcome"]["kind"]) == (None, "good", "ok")
    assert content["rows"] == [{"x": 1.0}]


def test_junit_has_every_check_and_no_character_that_xml_forbids():
    suite = text(DOCUMENT, "junit")
    assert 'tests="2" failures="1"' in suite
    assert 'message="too slow?"' in suite


def test_a_terminal_shows_the_brief_form_if_there_is_one(capsys):
    terminal.show(DOCUMENT)
    whole = capsys.readouterr().out
    assert "The verdict" in whole
    assert "engine: is slow" in whole
    terminal.show(Document("", "", DOCUMENT.blocks, brief=[Facts([("name", "value"), ("longer name", "")])]))
    assert capsys.readouterr().out == "name         value\nlonger name\n"


def test_empty_blocks_are_left_out():
    paragraph = Paragraph("")
    assert filled(None, Table([], []), Items([]), Section("", []), paragraph) == [paragraph]


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


@pytest.fixture(scope="module")
def page():
    return html.render(DOCUMENT)


def test_page_refers_to_nothing_outside_itself(page):
    parser = Outward()
    parser.feed(page)
    assert parser.references == ["data:,"]
    assert "url(" not in page.partition("</style>")[0]
    assert parser.anchors == ["#main", "#first", "#second", *["measurements.csv"] * 3]  # one below each table
    assert {anchor[1:] for anchor in parser.anchors if anchor.startswith("#")} <= set(parser.ids)
    assert len(parser.ids) == len(set(parser.ids))


def test_text_cannot_become_markup(page):
    assert "<b>engine</b>" in page  # a subject
    for part in ("&lt;b&gt;", "It shows &lt;a&gt;.", "<code>conservative</code>", '<span class="n">1e-3 rad</span>'):
        assert part in page


def test_page_shows_grades_halves_notes_and_intervals(page):
    for part in (
        '<i class="good" aria-hidden="true">✓</i><i class="bad" aria-hidden="true">✗</i>',
        'data-about="m on needle: both"',
        "<b>12</b> <small>a</small>",
        'aria-label="1.100, 1.000 to 1.200"',
        '<li class="lost">',
        "<details><summary>Folded</summary>",
        "Nothing was measured that could be drawn",
    ):
        assert part in page


def test_the_rows_of_a_table_are_those_of_its_sections(page):
    assert "Rows as CSV</a>: scene brick</p>" in page
    assert "Rows as CSV</a>: scene brick; study a, b</p>" in page
    without = html.render(Document("", "", [SORTED]))
    assert "Rows as CSV" not in without


@pytest.mark.parametrize(("rows", "filtered"), [(10, False), (11, True)])
def test_a_long_table_has_a_filter(rows, filtered):
    page = html.render(Document("", "", [Table(["method"], [["reduced"]] * rows)]))
    assert ('type="search"' in page) is filtered


@pytest.mark.parametrize(("lines", "more"), [(8, 0), (9, 1)])
def test_a_legend_has_eight_lines_at_first(lines, more):
    entries = [LegendEntry(f"line {k}", "#000000", "", "") for k in range(lines)]
    page = html.render(Document("", "", [Figure("picture", "A picture", panels=[], legend=entries)]))
    page = page.partition("<main")[2].partition("</main>")[0]
    assert page.count('aria-pressed="true"') == 8
    assert page.count('aria-pressed="false"') == more
    assert (f"<summary>{more} more</summary>" in page) is bool(more)


def test_a_page_carries_only_the_libraries_that_it_needs(page):
    assert ('id="vega"' in page, 'id="datatables"' in page) == (False, True)
    assert "datatables" not in html.render(Document("", "", [Paragraph("")])).partition('"use strict"')[0]


def drawn(spec, hidden=()):
    """Return the picture of a chart with some lines hidden, as the browser would draw it."""
    spec = copy.deepcopy(spec) | {"width": 300}
    for parameter in spec["params"]:
        parameter["value"] = list(hidden)
    return vl_convert.vegalite_to_svg(json.dumps(spec))


def test_chart_draws_its_lines_and_the_switch_takes_one_away():
    found = points(table())
    (spec,) = vega_embed.embed(figures.work_precision(found, front(found), "brick_flip"), ("name", "error"))
    colour = vega_embed.legend({"reduced": "reduced"}, True)[0].colour
    assert drawn(spec).count(colour) > 1
    assert colour not in drawn(spec, ["reduced"])
    assert vega_embed.legend({"scipy DOP853": "scipy"}, True)[0].colour in drawn(spec, ["reduced"])
    assert "legend" not in json.dumps(spec).replace('"legend": null', "")


def test_data_are_short_and_exact_to_their_digits():
    data = vega_embed.as_csv([{"name": "a, b", "x": 1 / 3, "left": 1}, {"name": "c", "x": 1e-17, "left": 2}], {"name", "x"})
    assert data["values"].splitlines() == ["name,x", '"a, b",0.3333333', "c,1e-17"]
    assert data["format"]["parse"] == {"x": "number"}


def test_every_picture_has_files_of_its_own(tmp_path, monkeypatch):
    """`brick_flip:t_end=0.5` and `t_end=0.7` had one file, because a suffix starts at the last point."""
    monkeypatch.setattr(style, "picture_file", lambda chart, kind: f"{SVG_MARK} {chart} {kind}".encode())
    (tmp_path / "mine.svg").write_text("<svg/>")
    (tmp_path / "plot.png").write_text("of a user")
    names = ["a:t_end=0.5", "a:t_end=0.7", "a_t_end=0_7", "A:t_end=0.5", "a:t_end=0.5", "mine", "plot"]
    draw = report.draw_into(tmp_path, png=True)
    found = [draw(Figure(name, "title", "", picture=name)) for name in names]
    plain = ["a_t_end=0_5", "a_t_end=0_7", "a_t_end=0_7_", "A_t_end=0_5_", "a_t_end=0_5", "mine_", "plot_"]
    assert found == [f"{name}.svg" for name in plain]
    for kind in (".svg", ".png"):
        assert [(tmp_path / f"{name}{kind}").read_text().split()[-2:] for name in plain] == [[name, kind] for name in names]
    assert ((tmp_path / "mine.svg").read_text(), (tmp_path / "plot.png").read_text()) == ("<svg/>", "of a user")
    assert report.draw_into(tmp_path, png=False)(Figure("plot_", "t", "", picture="again")) == "plot_.svg"  # an earlier result


def test_a_picture_is_a_file_of_its_kind():
    chart = alt.Chart(pd.DataFrame({"x": [1, 2]})).mark_point().encode(x="x:Q")
    beginnings = {".svg": SVG_MARK.encode(), ".png": b"\x89PNG"}
    assert all(style.picture_file(chart, kind).startswith(begin) for kind, begin in beginnings.items())


def test_a_table_in_latex_has_no_character_with_a_meaning():
    rows = [["a_b & 50 %", "1e-3", "✓ 2.5e-12"], ["{x}^2~\\input#1$", "3", "≈ 1"]]
    found = latex.table(Table(["m", "m", "µs"], rows, "Caption 50 %"))
    lines = found.splitlines()
    assert lines[0].startswith("% Written by conservative")
    assert [line.count(" & ") for line in lines if line.endswith(r"\\")] == [2, 2, 2]
    assert r"a\_b \& 50 \% & $10^{-3}$ & $\checkmark$ $2.5\times10^{-12}$ \\" in lines
    assert r"\{x\}\textasciicircum{}2\textasciitilde{}\textbackslash input\#1\$ & 3 & $\approx$ 1 \\" in lines
    assert r"m & m & \textmu{}s \\" in lines
    assert r"\caption{Caption 50 \%}" in lines
    assert r"\begin{tabular}{lrr}" in lines
    assert r"\begin{longtable}{l}" in latex.table(Table(["n"], [["1"]] * 50))
