"""The page of an engine, on made-up measurements."""

import math

import pytest

from conservative import registry
from conservative.benchmarks.measures import measurement
from conservative.benchmarks.verification.finding import Cause, Finding, Verdict
from conservative.outcome import Outcome, OutcomeKind
from conservative.reports import report
from conservative.reports.document import html, markdown
from conservative.reports.document.attempt import failed_parts
from conservative.reports.document.model import Document, Links, Section, Table
from conservative.reports.run.measure import Measurements
from conservative.reports.run.plan import Plan
from conservative.reports.run.provenance import provenance
from conservative.reports.run.verification import Verified
from conservative.reports.sections import engine_page, verified_engines
from conservative.reports.sections.measured import Measured

from .made_up import at_step, named


def verified(version, setting, *verdicts):
    """Return findings on exact motions. Wrong ones have no gyroscopic term."""
    cause = (Cause(("no gyroscopic term",), "The gyroscopic term is missing", 1e-9, 0.3),)
    findings = (
        Finding("a", "motions", str(i), each, 1.0, 0.1, causes=cause * (each == "wrong")) for i, each in enumerate(verdicts)
    )
    return Verified({"family": "a", "engine": "a", "version": version, "setting": setting}, tuple(findings))


@pytest.fixture(scope="module")
def measured():
    found = [
        *at_step("a==2", "Euler", 0.5, as_installed=True, energy=0.2, direction="lost"),
        *at_step("a==2", "RK4", 1e-6),
        *at_step("a==1.10", "Euler", 0.52, as_installed=True),
        *at_step("a==1.10", "RK4", 1e-3),
        *at_step("a@1.9==1.9", "Euler", 3.0, as_installed=True),  # an environment of a version that is named
        *at_step("b==7", "x", math.nan, outcome=Outcome(OutcomeKind.CRASHED, "signal 11 (SIGSEGV)")),
    ]
    right, wrong, _, not_tested = Verdict
    findings = verified("2", "Euler", wrong, right), verified("2", "RK4", right, right, not_tested, wrong)
    plan = Plan((registry.scene("brick_flip"),), (), (), engines=named(found))
    return Measured(plan, Measurements(measurement.frame(found), measurement.samples_frame([]), findings), provenance([]))


@pytest.fixture(scope="module")
def pages(measured):
    return engine_page.pages(measured)


def tables(page):
    inner = [block for each in page.blocks for block in (each.blocks if isinstance(each, Section) else [each])]
    return {each.caption: [list(map(str, row)) for row in each.rows] for each in inner if isinstance(each, Table)}


def test_there_is_a_page_for_each_engine_with_narrow_tables(pages):
    assert list(pages) == ["engine_b", "engine_a"]
    assert [page.title for page in pages.values()] == ["b 7", "a 2"]
    for page in pages.values():
        assert all(len(row) <= 7 for rows in tables(page).values() for row in rows)
        assert html.render(page)


def test_it_has_the_newest_version_as_installed_and_at_its_best(pages):
    (found,) = (rows for name, rows in tables(pages["engine_a"]).items() if "exact motion" in name)
    assert [row[:3] for row in found] == [
        ["as installed: Euler", "0.5", "✗ 0.2 lost"],
        ["at its best: RK4", "1.0e-6", "✓ 1.0e-12"],
    ]


def test_an_engine_that_crashed_says_so(pages):
    text = markdown.render(pages["engine_b"])
    assert "crashed: signal 11 (SIGSEGV)" in text
    assert "Only 7 was measured" in text


def test_it_names_the_version_since_which_an_error_is_the_same(pages):
    text = markdown.render(pages["engine_a"])
    assert "as installed: 0.5 rad since 1.10, 3 rad in 1.9" in text
    assert "at its best: 1.0e-6 rad since 2, 1.0e-3 rad in 1.10" in text
    assert "since at least" not in text
    assert [row[0] for row in tables(pages["engine_a"])["brick_flip: versions"]] == ["a 2", "a 1.10", "a 1.9"]


def test_it_has_the_findings_on_the_engine(pages):
    rows = tables(pages["engine_a"])["Cases of each check"]
    named = "no gyroscopic term (1)"
    assert rows == [["a 2 Euler", "motions", "1", "1", "0", "0", named], ["a 2 RK4", "motions", "2", "1", "0", "1", named]]
    assert "Cases of each check" not in tables(pages["engine_b"])


def test_commands_repeat_it(pages):
    text = markdown.render(pages["engine_a"])
    assert "`conservative report --methods reduced --scenes brick_flip --engines a`" in text
    assert "`conservative verify a`" in text


def test_a_report_writes_the_pages_and_links_them(pages, tmp_path):
    links = Links([(page.title, f"{name}.html") for name, page in pages.items()])
    document = Document("", "all", [links], pages=pages)
    report.render(document, tmp_path, png=False)
    written = {"report.md", "index.html", "engine_a.html", "engine_a.md", "engine_b.html", "engine_b.md"}
    assert {path.name for path in tmp_path.iterdir()} == written
    assert "[b 7](engine_b.html), [a 2](engine_a.html)" in (tmp_path / "report.md").read_text(encoding="utf-8")
    assert '<a href="engine_a.html">a 2</a>' in (tmp_path / "index.html").read_text(encoding="utf-8")


OTHERS = "since 1.10, 3 rad in 1.9"


@pytest.mark.parametrize(("name", "kept"), [("_since", ""), ("findings", OTHERS), ("render", OTHERS)])
def test_a_part_of_a_page_that_fails_is_a_sentence_on_it(name, kept, measured, tmp_path, monkeypatch):
    def fault(*_, **__):
        raise ZeroDivisionError("planted")

    places = {"findings": (verified_engines, "section"), "render": (markdown, "table")}
    monkeypatch.setattr(*places.get(name, (engine_page, name)), fault)
    found = engine_page.pages(measured)
    document = report.render(Document("", "all", [], pages=found), tmp_path, png=False)
    assert list(document.pages) == ["engine_b", "engine_a"]
    sentences = failed_parts(document.pages["engine_a"].blocks)
    assert sentences
    for sentence in sentences:
        assert "ZeroDivisionError: planted" in sentence
        assert "--resume" in sentence
    text = (tmp_path / "engine_a.md").read_text(encoding="utf-8")
    assert "planted" in text
    assert kept in text
    assert ("planted" in (tmp_path / "engine_a.html").read_text(encoding="utf-8")) == (name != "render")  # of Markdown alone
