"""A report has no number in a sentence that its rows do not support; and what breaks that is found."""

import tomllib
from pathlib import Path

import pandas as pd
import pytest
from click.testing import CliRunner

from conservative import registry
from conservative.benchmarks.measures import measurement
from conservative.benchmarks.measures.measure import Measure
from conservative.reports import document, view
from conservative.reports.cli.main import main
from conservative.reports.documentation.audit import __main__ as command
from conservative.reports.documentation.audit import report
from conservative.reports.documentation.audit.blocks import of_html, of_markdown
from conservative.reports.labels import with_names
from conservative.reports.page import libraries, many_bodies, markdown, page, random_bodies, scene_charts
from conservative.reports.run.measure import Measurements
from conservative.reports.run.plan import plan_report
from conservative.reports.run.provenance import provenance
from conservative.reports.tables import engine_tables, random_ratios, summary, throughput

from . import test_throughput
from .made_up import measurements
from .made_up_engines import at_step
from .rows import point, row
from .test_random_ratios import ENGINE_ALONE, OURS_ALONE, SLOWER, TWICE

BODIES = [each for lines in (*TWICE, *SLOWER, *OURS_ALONE, *ENGINE_ALONE) for each in lines]
LINES = [
    *(
        each
        for dt, error in ((2, 1e-2), (1, 1e-10))
        for each in point("gauss", "ours", error, 4e-6 / dt, dt=dt, scene="brick_flip")
    ),
    *point("heyoka", "engine", 1e-5, 1e-6, version="7.13.2", setting="lean", scene="brick_flip"),
    *point("moser_veselov", "ours", 1e-13, 2e-7, scene="brick_flip"),
]
EACH_STEP = [
    row("each_step", method, measure, value, 0.01, scene="brick_flip", role=role)
    for method, role, kept, alone in (("gauss", "ours", 4e-6, 2e-6), ("heyoka", "engine", 9e-6, 1e-6))
    for measure, value in ((Measure.ATTITUDE_MAX, 1e-8), (Measure.TIME_SAMPLED, kept), (Measure.TIME, alone))
]
ENGINES = [*at_step("drake==1.0", "a", 1e-6), *at_step("exudyn==2.0", "b", 1e-5)]
METHODS = ["reduced:order=4", "heyoka:tol=1e-9"]
RAN = [row("paper", registry.method(name).name, "energy drift max", 1e-15, scene="brick_flip") for name in METHODS]
ADDED = pd.concat([measurement.frame([*BODIES, *LINES, *ENGINES, *EACH_STEP, *RAN]), test_throughput.ROWS])


@pytest.fixture(scope="module")
def shown():
    """A report of made-up rows with every section that has sentences about who is faster; its pictures are not drawn."""
    plan = plan_report(["brick_flip"], METHODS, bodies=4, seed=7)
    found = measurements()
    return view.build(plan, Measurements(pd.concat([found.table, ADDED]), found.samples), provenance(["report"]))


@pytest.fixture(scope="module")
def rows(shown):
    return report.Rows(with_names(shown.table), "conservative report")


@pytest.fixture(scope="module")
def texts(shown):
    charts = {scene.name: scene_charts.build(scene) for scene in shown.scenes}
    random = random_bodies.chart(shown.random)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(libraries, "packed", dict)  # which takes long and has no sentence, as do pictures
        patch.setattr(many_bodies, "chart", lambda view: None)
        md = markdown.render(shown, charts, {}, lambda name, chart: f"{name}.svg", random)
        return {"report.md": md, "index.html": page.render(shown, charts, {}, random)}


def test_every_number_of_a_report_is_supported(rows, texts):
    assert list(report.find(rows, texts)) == []
    shown = " ".join(texts["report.md"].split())
    for words in (
        "gets to 1e-6 rad",
        "an engine is faster than",
        "general integrators reach",
        "times as long (among",
        "solves integrable",
    ):
        assert words in shown, words


PLANTED = "On the brick heyoka is 17.3 times as fast as ours."


@pytest.mark.parametrize(
    ("file", "place", "planted"),
    [
        ("report.md", "## Hard cases\n\n", f"{PLANTED}\n\n"),
        ("report.md", "- **random bodies, spring**", f"- **brick_flip**: {PLANTED}\n"),
        ("report.md", "## Truth\n\n", "MuJoCo takes twice as long.\n\n"),
        ("index.html", '<h3 id="lost">', f"<p>{PLANTED}</p>"),
        ("index.html", "</figcaption>", f" {PLANTED}"),
        ("index.html", '<section id="brick_flip"', "<p>heyoka takes <b>17.3</b> times as long</p>"),
    ],
)
def test_a_planted_sentence_fails(file, place, planted, rows, texts):
    assert place in texts[file]
    (found,) = report.find(rows, {file: texts[file].replace(place, planted + place, 1)})
    assert found.startswith(f"{file}:")
    assert ('"17.3" in' in found) or ('"twice" in' in found)
    assert found.endswith("no row of the evidence supports it")


@pytest.mark.parametrize(
    ("words", "other"),
    [
        ("an engine is faster than our general integrators in ", "1"),
        ("only an engine gets there in ", "9"),
        ("our general integrators are ", "7"),
        ("only our general integrators reach ", "1e-3, 7"),
        ("which solves integrable motions only, is ", "8"),
        ("gets to 1e-6 rad ", "9"),
        ("gauss (our general integrators) is ", "9"),
        ("heyoka is ", "7"),
        ("with a sample at each ", "1"),
        ("in the geometric mean, ", "9"),
        ("heavy tops, the cheapest of our general integrators against heyoka: at 1e-3 rad heyoka takes ", "9"),
        ("Bodies in each field: ", "3"),
        ("the scene's own step is ", "1"),
        ("zero is drawn at ", "2"),
    ],
)
def test_another_digit_in_a_sentence_fails(words, other, rows, texts):
    text = texts["report.md"]
    assert words in text
    assert list(report.find(rows, {"report.md": text.replace(words, words + other)}))


def test_another_row_fails(rows, texts):
    table = rows.table
    slower = table.assign(value=table["value"].where(table["role"] != "engine", 3 * table["value"]))
    found = " ".join(report.find(report.Rows(slower, rows.command), {"report.md": texts["report.md"]}))
    for words in ("our general integrators are", "in the geometric mean", "times as long (among", "as fast as"):
        assert words in found


@pytest.mark.parametrize(
    ("cell", "other"),
    [
        ("| heyoka 7.13.2 lean | 1.00 |", "| heyoka 7.13.2 lean | 0.90 |"),
        ("| heyoka 7.13.2 lean | 1.00 |", "| scipy DOP853 | 1.00 |"),
        ("| none gets there | – |", "| heyoka 7.13.2 lean | 1.00 |"),
        ("| moser_veselov | 0.200 |", "| none gets there | – |"),
    ],
)
def test_another_cell_fails(cell, other, rows, texts):
    assert cell in texts["report.md"]
    (found,) = report.find(rows, {"report.md": texts["report.md"].replace(cell, other, 1)})
    assert "µs on brick_flip at 1e-" in found
    assert "the rows give" in found


def test_names_are_no_numbers_but_numbers_beside_them_are(rows):
    names = "7.13.2 of heyoka is heyoka 7.13.2 lean."
    (found,) = report.find(rows, {"report.md": f"{names}\n"})
    assert found.startswith('report.md:1: "7.13.2" in "7.13.2 of')


def test_tables_code_and_the_end_are_left_out():
    text = "# A 1\n\nb 2\nc\n- d 3\n| 4 |\n| --- |\n`5`\n    6\n\n## How this was made\n\n7\n"
    blocks = [(block.heading, [number.text for number in block.page.numbers]) for block in of_markdown("x", text)]
    assert [numbers for _, numbers in blocks] == [["1"], ["2"], ["3"], ["5"]]
    page = (
        "<h2>A 1</h2><p>b <b>2</b>\n<li>c 3<table><tr><td>4</td></tr></table><script>5</script><code>6</code><footer>7</footer>"
    )
    assert [number.text for block in of_html("x", page) for number in block.page.numbers] == ["1", "2", "3"]
    assert [block.page.describe(number) for block in of_html("x", page) for number in block.page.numbers][2].startswith("x:2:")


def test_what_is_allowed_stands_in_a_template_or_in_terms():
    terms = [random_ratios.TERMS, throughput.TERMS, summary.TERMS, *(words for pair in engine_tables.TERMS for words in pair)]
    folder = Path(report.__file__).parents[2]
    sources = [*folder.glob("templates/*.j2"), folder / "page" / "paper.py", folder / "page" / "markdown.py"]
    every = " ".join(" ".join([*terms, *(source.read_text(encoding="utf-8") for source in sources)]).split())
    entries = tomllib.loads(report.ALLOWED.read_text(encoding="utf-8"))["allowed"]
    assert [entry["text"] for entry in entries if entry["text"] not in every] == []
    assert all(entry["reason"] for entry in entries)


def write(shown, texts, folder):
    """Write what an audit reads, with a planted sentence."""
    folder.mkdir()
    shown.table.to_csv(folder / "measurements.csv", index=False)
    (folder / "measurements.json").write_text('{"command": "conservative report"}')
    for name, text in texts.items():
        (folder / name).write_text(f"{PLANTED}\n\n{text}" if name == "report.md" else text, encoding="utf-8")


def test_the_command_fails_where_a_sentence_has_no_row(shown, texts, tmp_path, monkeypatch):
    monkeypatch.setattr(document, "write", lambda plan, out, step, resume: write(shown, texts, out) or shown)
    done = CliRunner().invoke(main, ["report", "--methods", "reduced", "--out", str(tmp_path / "report")])
    assert done.exit_code == 1
    assert 'report.md:1: "17.3" in "On the brick heyoka is 17.3 times as fast as ours"' in done.stderr
    assert "Error: numbers in sentences that no row supports: 1" in done.stderr


def test_a_folder_is_audited_by_a_command(shown, texts, tmp_path, monkeypatch, capsys):
    write(shown, texts, tmp_path / "report")
    monkeypatch.setattr("sys.argv", ["audit", str(tmp_path / "report")])
    with pytest.raises(SystemExit, match="1"):
        command.main()
    assert capsys.readouterr().out.startswith('report.md:1: "17.3" in')
