"""The attack that kills an engine in the middle of a report sees what is lost beside the row that it marks."""

from conservative.benchmarks.verification.kills import SAME
from conservative.benchmarks.verification.report_kills import compare


def row(label="exudyn", dt="0.01", study="paper", outcome="ok", measure="drift max"):
    values = {"study": study, "label": label, "dt": dt, "outcome": outcome, "measure": measure}
    return tuple(values.get(name, "") for name in SAME)


WHOLE = [row(), row(dt="0.005"), row(label="reduced"), row(study="speed")]


def test_a_report_without_loss_and_one_with_a_row_marked_are_right():
    assert list(compare(WHOLE, WHOLE)) == []
    assert list(compare(WHOLE, [row(outcome="crashed"), *WHOLE[1:]])) == []


def test_more_than_a_row_is_seen():
    (two,) = compare(WHOLE, [row(outcome="crashed"), row(dt="0.005", outcome="crashed"), *WHOLE[2:]])
    assert two.startswith("2 runs are marked")
    assert list(compare(WHOLE, WHOLE[1:])) == ["1 rows are missing, and none is marked"]
    (other,) = compare(WHOLE, [row(outcome="crashed"), WHOLE[1], WHOLE[3]])
    assert other.startswith("another row is missing")
    assert any(each.startswith("an unknown row") for each in compare(WHOLE, [*WHOLE, row(label="mujoco")]))
