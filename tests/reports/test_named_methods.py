"""Who was named is shown: each setting has its row in the first tables, and headlines name both ends of several settings."""

import pytest

from conservative import registry
from conservative.benchmarks.studies import studies
from conservative.reports.document.cells import angle
from conservative.reports.document.model import Paragraph, Table, walk
from conservative.reports.run.measure import Measurements
from conservative.reports.run.plan import plan_report
from conservative.reports.run.provenance import provenance
from conservative.reports.sections.report import build

from .rows import texts

SCENE = "lagrange_top:t_end=0.1"
NAMED = ["mujoco", "drake:discrete", "reduced", "moser_veselov:order=4"]


@pytest.fixture(scope="module")
def shown():
    """The page of a report of named methods, and its table on the terminal; of two studies only."""
    plan = plan_report([SCENE], NAMED, quick=True, skip_missing=True)
    found = [row for study in plan.studies if study.name in ("motion", "paper") for row in studies.findings(study)]
    document = build(plan, Measurements.of(found), provenance([]))
    first = next(block for block in walk(document.blocks) if isinstance(block, Table))
    return document, first, document.brief[0]


@pytest.mark.parametrize("which", [1, 2], ids=["page", "terminal"])
def test_each_named_setting_has_its_row_with_the_reason_if_it_failed(shown, which):
    rows = {row[0].partition(":")[0].replace(" 4.0.0", ""): " ".join(row) for row in texts(shown[which])}
    settings = [f"mujoco {each}" for each in ("Euler", "RK4", "implicit", "implicitfast", "discrete")]
    settings += ["reduced", *(f"reduced order={order}" for order in (4, 6, 8, 10))]
    assert {*settings, "drake discrete", "moser_veselov order=4"} <= {name for names in rows for name in names.split(", ")}
    assert "conservative engines install drake" in rows["drake discrete"]
    assert "it does not support uniform gravity" in rows["moser_veselov order=4"]


@pytest.mark.parametrize("which", [1, 2], ids=["page", "terminal"])
def test_each_invariant_has_its_column(shown, which):
    """The energy and the vertical momentum of the paper's map are conserved, the axial momentum is not."""
    names = [invariant.name for invariant in registry.scene(SCENE).invariants]
    assert names == ["energy", "vertical momentum", "axial momentum"]
    columns = [next(i for i, head in enumerate(shown[which].header) if head.endswith(name)) for name in names]
    (row,) = [row for row in texts(shown[which]) if row[0] == "reduced"]
    energy, vertical, axial = (float(row[column].lstrip("✓≈✗ ")) for column in columns)
    assert max(energy, vertical) < 1e-14  # measured 5e-16
    assert axial > 1e-3  # measured 1e-2


def test_the_headline_names_both_ends_of_the_settings_of_an_engine(shown):
    first = shown[1]
    column = next(i for i, head in enumerate(first.header) if "attitude" in head)
    errors = {str(row[0]): row[column].value for row in first.rows if hasattr(row[column], "value")}
    engines = sorted((error, name) for name, error in errors.items() if name.startswith("mujoco"))
    ours = sorted((error, name) for name, error in errors.items() if name.startswith("reduced"))
    sentence = next(block.text for block in walk(shown[0].blocks) if isinstance(block, Paragraph))
    for each in (engines, ours):
        assert each[0][0] < 1e-3 < each[-1][0]
        for error, _ in (each[0], each[-1]):
            assert f"by {angle(error)} rad" in sentence


def test_a_default_report_has_no_row_for_what_nobody_named():
    plan = plan_report([SCENE], quick=True)
    assert plan.named == ()
    assert [method.name for method in plan_report([SCENE], ["reduced:order=4"]).named] == ["reduced:order=4"]
