"""Engines of other packages: a recommendation survives them, and no test depends on the installed ones."""

import os
import subprocess
import sys

import pytest

from conservative import registry
from conservative.benchmarks.recommendation.recommend import Question, list_engines, recommend
from conservative.outcome import OutcomeKind

from ..environments import PATIENCE, ROOT, variables
from .foreign_engines import Fast, Harmful, Slow

ENTRY_POINTS = """[conservative.methods]
foreign_fast = foreign_engines:Fast
foreign_slow = foreign_engines:Slow
foreign_harm = foreign_engines:Harmful
"""
METADATA = "Metadata-Version: 2.1\nName: foreign_engines\nVersion: 1.0\n"
DEPENDENT = (
    "tests/benchmarks/test_recommendation.py::test_every_engine_has_a_line_for_each_setting_that_is_no_tolerance",
    "tests/benchmarks/test_recommendation.py::test_bad_questions",
    "tests/benchmarks/test_selection.py",
    "tests/conservative/test_registry.py",
)
"""Quick tests that use all registered methods, and so would notice another engine."""


def question(*methods):
    return Question(registry.scene("brick_flip"), 1e-6, 6.0, methods, (), 1.0, time_limit=15.0)


@pytest.mark.slow
def test_a_recommendation_survives_engines_that_hang_or_end_their_process():
    answer = recommend(question(Harmful("hang"), Harmful("abort"), Slow(), Fast()))
    by_line = {advice.line: advice for advice in answer.advice}
    assert answer.advice[0].reached
    assert by_line["foreign_fast"].reached
    assert any(probe.outcome.ok for probe in by_line["foreign_slow"].probes)  # the first step is too long for it
    for how, kind in (("hang", OutcomeKind.TIMEOUT), ("abort", OutcomeKind.CRASHED)):
        advice = by_line[Harmful(how).name]
        assert not advice.reached
        assert {probe.outcome.kind for probe in advice.probes} == {kind}
        assert advice.reason.startswith(str(kind))
    assert len(by_line[Harmful("hang").name].probes) == 1


@pytest.fixture
def installed(tmp_path):
    """Environment variables of a process that has the engines of this folder installed as a package."""
    record = tmp_path / "foreign_engines-1.0.dist-info"
    record.mkdir()
    (record / "METADATA").write_text(METADATA)
    (record / "entry_points.txt").write_text(ENTRY_POINTS)
    (tmp_path / "foreign_engines.py").write_text((ROOT / "tests/benchmarks/foreign_engines.py").read_text())
    return variables(PYTHONPATH=os.pathsep.join([str(ROOT), str(tmp_path)]))


def python(variables, *arguments):
    done = subprocess.run(
        [sys.executable, *arguments], env=variables, cwd=ROOT, capture_output=True, text=True, timeout=PATIENCE
    )
    return done.returncode, done.stdout + done.stderr


def test_the_engines_are_found_where_they_are_installed(installed):
    code = "from conservative.benchmarks.recommendation.recommend import list_engines; print(*(m.name for m in list_engines()))"
    status, text = python(installed, "-c", code)
    assert status == 0, text
    assert {"foreign_fast", "foreign_slow", "foreign_harm"} <= set(text.split())
    assert "foreign_fast" not in {method.name for method in list_engines()}


@pytest.mark.slow
def test_no_test_depends_on_which_engines_are_installed(installed):
    status, text = python(installed, "-m", "pytest", "-n0", "-q", "-p", "no:cacheprovider", *DEPENDENT)
    assert status == 0, text
