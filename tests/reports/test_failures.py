"""What a method of somebody else's gives and must not is listed under "What failed"."""

import pandas as pd
import pytest

from conservative.benchmarks.measures.measurement import frame
from conservative.benchmarks.studies import studies
from conservative.benchmarks.studies.study import Study
from conservative.reports.tables import runs

from ..benchmarks.generic_study import SCENE, Broken, truth


@pytest.mark.parametrize(
    ("how", "kind"), [("gives nan", "diverged"), ("is skewed", "not conserved"), ("gives nothing", "invalid result")]
)
def test_what_a_foreign_method_must_not_give_is_listed(how: str, kind: str) -> None:
    study = Study("paper", (SCENE,), (Broken(how),), quick=True, truth=truth)
    table = frame(studies.rows(study))
    _, body = runs.failures(named(table))
    assert [row[:2] for row in body] == [["generic", f"broken:how={how}"]] * len(body) != []
    assert all(kind in row[2] and "paper" in row[3] for row in body)


def named(table: pd.DataFrame) -> pd.DataFrame:
    """The column that `conservative.reports.view` adds."""
    return table.assign(name=table["method"])
