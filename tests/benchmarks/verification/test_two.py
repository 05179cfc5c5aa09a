"""Two recordings of one scene that disagree: which one is wrong, and by which mistake."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import conservative as cv
from conservative.benchmarks.verification.explain import Diagnosis, diagnose
from conservative.benchmarks.verification.recordings import verdict
from conservative.benchmarks.verification.recordings.comparison import prepare
from conservative.benchmarks.verification.recordings.table import Options, Recording, read
from conservative.benchmarks.verification.recordings.two import find_relation, verify_two
from conservative.errors import BadInput
from conservative.reports.run.single_run import csv_text

from .made import BODY, FREE, HEAVY, START, T, exact, late, without

R, W = exact(FREE)
OTHER_T = np.linspace(0.5, 5.5, 87)
OTHER = cv.Scene("other", cv.RigidBody(BODY.inertia + np.diag([0.2, 0.0, 0.1])), *START, 6.0)


FOUND = {}
"""Diagnoses by the rows: several tests have the same recording."""


@pytest.fixture(autouse=True)
def search_once(monkeypatch):
    def remember(case, *rest):
        rows = tuple(None if x is None else x.tobytes() for x in (case.t, *case.data))
        if rows not in FOUND:
            FOUND[rows] = diagnose(case, *rest)
        return FOUND[rows]

    monkeypatch.setattr(verdict, "diagnose", remember)


def of(R, w, t=T):
    return Recording(t, (R, w), rows=len(t))


def verify(first, second, scene=FREE, **options):
    return verify_two(scene, ("a.csv", first), ("b.csv", second), **options)


def findings(found):
    return [(finding.subject, finding.verdict) for finding in found.findings]


def test_the_wrong_one_of_two_is_named_with_its_mistake():
    for order in (1, -1):
        found = verify(*[of(R, W), of(*without(FREE))][::order])
        names = ["a.csv", "b.csv"][::order]
        assert found.verdict == "wrong"
        assert findings(found)[:2] == sorted([(names[0], "right"), (names[1], "wrong")])
        assert found.findings[0 if order < 0 else 1].mistake == "no gyroscopic term"
        assert found.findings[2].error > 0.1
        assert found.reason.startswith(f"{names[1]} is wrong")


def test_two_right_ones_agree_whatever_their_columns_times_and_starts():
    R_later, w_later = exact(FREE, OTHER_T)
    for second in (of(R, W), of(R_later, w_later, OTHER_T), of(R_later, None, OTHER_T), of(None, w_later, OTHER_T)):
        found = verify(of(R, W), second)
        assert [verdict for _, verdict in findings(found)] == ["right"] * 3, found.sentence
        assert found.details.difference.error[found.details.difference.worse] < 1e-9  # measured: 2e-13 to 4e-12
    found = verify(of(R, None), of(None, W))
    assert [verdict for _, verdict in findings(found)] == ["right", "right", "not tested"]
    assert found.verdict == "right"


def test_a_difference_between_rows_is_seen():
    """The second one has no row at a time of the first one, and is ahead by 1 ms."""
    moved = of(*exact(FREE, OTHER_T + 1e-3), OTHER_T)
    found = verify(of(R, W), moved, from_row=False)
    difference = found.details.difference
    assert (difference.common, difference.agrees, found.findings[1].mistake) == (False, False, "time shift")
    assert difference.error[0] == pytest.approx(1e-3 * np.linalg.norm(W, axis=1).max(), rel=0.05)
    assert difference.allowed[0] < 1e-4  # measured: 3e-5, by the interpolation between rows


def test_the_time_of_the_largest_difference_is_a_time_of_the_files():
    wrong = W.copy()
    wrong[60] += 0.1
    for begin in (0.0, 1000.0):
        difference = verify(of(R, W, T + begin), of(R, wrong, T + begin)).details.difference
        assert difference.time == pytest.approx(begin + T[60])


def test_two_wrong_ones_have_the_same_mistake_or_another_body(monkeypatch):
    found = verify(of(*without(FREE)), of(*without(FREE)))
    assert "same mistake" in found.reason
    found = verify(of(*without(FREE)), of(*late(FREE, 0.02)))
    assert all(finding.verdict == "wrong" for finding in found.findings)
    assert [finding.mistake for finding in found.findings[:2]] == ["no gyroscopic term", "time shift"]
    monkeypatch.setattr(verdict, "diagnose", lambda *_: Diagnosis())  # other bodies are searched for a minute
    found = verify(of(*exact(OTHER)), of(*exact(OTHER, OTHER_T), OTHER_T))
    assert (found.verdict, found.findings[2].verdict) == ("wrong", "right")
    assert "--body" in found.reason


def test_two_right_ones_from_different_starts_are_undecided(monkeypatch):
    monkeypatch.setattr(verdict, "diagnose", lambda *_: Diagnosis())
    faster = FREE.rename("faster", w_WB_B0=np.multiply(FREE.w_WB_B0, 1.01))
    found = verify(of(R, W), of(*exact(faster)))
    assert [verdict for _, verdict in findings(found)] == ["right", "right", "undecided"]
    assert verify(of(R, W), of(*exact(faster)), from_row=False).verdict == "wrong"


TURN = np.array([0.3, 0.2, 0.7])
PART = T[T >= 0.4]


@pytest.mark.parametrize(
    ("second", "later", "turn"),
    [
        (of(R, W, T + 3.0), 3.0, None),
        (of(R, W, T + 100.0), 100.0, None),
        (of(*exact(FREE, PART), PART + 99.6), 99.6, None),
        (of(*exact(FREE, PART), PART - 2.4), -2.4, None),
        (of(*exact(FREE, OTHER_T), OTHER_T + 99.6), 99.6, None),
        (of(Rotation.from_rotvec(TURN).as_matrix() @ R, W), 0.0, TURN),
        (of(Rotation.from_rotvec(TURN).as_matrix() @ R, W, T + 50.0), 50.0, TURN),
        (of(*exact(FREE, T + 7.0), T + 7.0), 0.0, None),  # the next part of the same motion
        (of(None, W, T + 3.0), 3.0, None),
    ],
)
def test_another_clock_or_world_is_no_difference(second, later, turn):
    recordings = of(R, W), second
    found = verify(*recordings)
    assert [verdict for _, verdict in findings(found)] == ["right"] * 3, found.sentence
    rows = tuple(prepare(FREE, recording, True, None) for recording in recordings)
    relation = find_relation(rows, recordings)
    assert later == pytest.approx(float(second.t[0]) - relation.origin, abs=1e-9)  # measured: up to 2e-12
    np.testing.assert_allclose(
        Rotation.from_matrix(relation.turn).as_rotvec(), np.zeros(3) if turn is None else turn, atol=1e-9
    )  # measured: up to 3e-13
    assert bool(relation.text) == (later != 0 or turn is not None)
    assert (relation.text in " ".join(found.notes)) or not relation.text
    assert found.details.difference.error[found.details.difference.worse] < 1e-9  # measured: up to 5e-11


def test_another_clock_in_a_field_and_if_the_start_is_tested():
    heavy = exact(HEAVY)
    assert verify(of(*heavy), of(*heavy, T + 3.0), HEAVY).verdict == "right"
    assert verify(of(R, W), of(R, W, T + 3.0), from_row=False).verdict == "wrong"


def test_our_own_samples_beside_a_file(tmp_path):
    made = cv.integrate(FREE, 0.05, cv.Taylor())
    (tmp_path / "own.csv").write_text(csv_text(made))
    own = read(tmp_path / "own.csv", Options())
    found = verify(own, of(R, W))
    assert [verdict for _, verdict in findings(found)] == ["right"] * 3


def test_times_that_do_not_overlap_are_not_compared():
    scene = FREE.rename("driven", torque=cv.Torque(lambda t: [0.1 * np.sin(t), 0.0, 0.0]), t_end=6.0)
    first, second = (exact(scene, np.append(0.0, t)) for t in (T[1:50], T[60:]))
    found = verify(of(*first, T[:50]), of(second[0][1:], second[1][1:], T[60:]), scene)
    assert [verdict for _, verdict in findings(found)] == ["right", "right", "not tested"]


def test_the_error_of_input_names_its_file():
    scene = FREE.rename("driven", torque=cv.Torque(lambda t: [0.1 * np.sin(t), 0.0, 0.0]))
    with pytest.raises(BadInput, match=r"run: got b\.csv: a first row at -1 s"):
        verify(of(*exact(scene)), of(R, W, T - 1), scene)
