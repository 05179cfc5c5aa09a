"""No right program fails on fresh motions, and each mistake is caught somewhere in each seed.

`pytest` runs a seed, `pytest --all` some, and `pytest --attack` 1,000. By hand:

    python -m tests.attack.fresh_motions results.jsonl 20000 21000 --page
"""

import hashlib
from pathlib import Path

import pytest

from conservative.benchmarks.verification import motions

from ..sampling import sampled
from . import fresh_motions
from .effort import SEED, count


@pytest.mark.parametrize("seed", sampled(range(8), 1))
def test_right_programs_pass_and_mistakes_are_caught(seed):
    row = fresh_motions.outcome(seed)
    assert (row["failures"], row["not caught"]) == ([], [])
    assert row["runs"] > 90 + 900 * bool(fresh_motions.engines())


@pytest.mark.attack
def test_seeds_of_the_page(request):
    """An interrupted attack goes on where it was, unless the code has changed."""
    sources = [*Path(motions.__file__).parent.glob("*.py"), Path(fresh_motions.__file__)]
    code = hashlib.sha256(b"".join(path.read_bytes() for path in sorted(sources))).hexdigest()[:12]
    first = fresh_motions.PUBLISHED.start if SEED == 1 else 1_000_000 * SEED
    path = Path(request.config.cache.mkdir("fresh_motions")) / f"{code}.jsonl"
    for _ in fresh_motions.run(path, range(first, first + count(len(fresh_motions.PUBLISHED)))):
        pass
    bad = [row for row in fresh_motions.load(path) if row["failures"] or row["not caught"]]
    assert not bad, bad[:5]


ROW = {
    "seed": 1, "motions": 43, "runs": 100, "worst": 0.5, "near": [], "failures": [], "not caught": [], "mistakes": 59,
    "agreement": 1e-16, "seconds": 1.0,
}  # fmt: skip


def test_failures_and_missed_mistakes_are_counted():
    rows = [ROW, ROW | {"seed": 2, "failures": [["RK4", "rod", 1.2]] * 2}, ROW | {"seed": 3, "not caught": ["sleep"]}]
    lines = fresh_motions.tables(rows).splitlines()
    counted = [tuple(part.strip() for part in line.split("|")[2:4]) for line in lines if line.startswith("| ")][2:]
    assert counted == [("1", "3"), ("2", "300"), ("1", "3"), ("1", "177")]


def test_a_wrong_program_fails(monkeypatch):
    """The attack would see it."""
    from ..benchmarks.verification.wrong_programs import wrong_programs

    monkeypatch.setattr(fresh_motions, "engines", dict)
    monkeypatch.setattr(fresh_motions, "right_programs", lambda: {"wrong": wrong_programs()["wrong side"]})
    monkeypatch.setattr(fresh_motions, "SHARE", 1)
    monkeypatch.setattr(fresh_motions, "caught", lambda *_: {})
    assert len(fresh_motions.outcome(1)["failures"]) >= 40
