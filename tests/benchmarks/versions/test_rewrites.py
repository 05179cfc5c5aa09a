"""Rounding is no violation in float and in double, and physical mistakes have their causes.

`tests/attack/test_alarms.py` has all changes and mistakes. Here the programs run without the process of a version.
"""

from pathlib import Path

import pytest

from conservative.benchmarks.suite import points
from conservative.benchmarks.versions.project import decide, decide_values
from conservative.benchmarks.versions.version import Checkout, Version
from conservative.programs import Program
from conservative.references.environments.programs import program_class
from conservative.registry import scene
from conservative.reports.run.causes import find_causes
from conservative.version import VERSION

from ...sampling import sampled
from .made_up import comparison, row
from .rewrites import MISTAKES, build, rewrite


@pytest.fixture
def method(tmp_path):
    """Return a function that compiles a program with changes."""

    def make(*flags, changes=None):
        name = f"p{len(list(tmp_path.iterdir()))}"
        return program_class(Program("mine", Path("conservative.toml"), str(build(tmp_path, name, *flags, changes=changes))))()

    return make


@pytest.mark.parametrize("number", sampled([0, 31, 40], 2))
def test_rounding_is_no_violation(number, method):
    """Number 0 is q * (1 / n) for q / n in float, which was four violations: starts were nudged by the digits of double."""
    flags, changes = rewrite(number)
    brick, rows = scene("brick_flip"), []
    for each in (method(*(flag for flag in flags if flag.startswith("-D"))), method(*flags, changes=changes)):
        values, spreads = points.measure(points.Point(brick, each))
        rows.append(decide_values(row(), values, spreads))
    was, now = rows
    assert was.values != now.values
    assert decide(comparison((was, now, None))).violations == ()
    assert was.spreads["attitude error max"] > (1e-9 if "-DREAL=float" in flags else 1e-15)  # measured 4e-7 or more


def causes(method):
    """The keys of the mistakes on free and on other bodies."""
    setting = {"order": method.order, "precision": method.precision}
    return tuple(cause.key for cause in find_causes(lambda scene, grid: method.prepare(scene, grid)(), setting))


CAUSES = ["no gyroscopic term", "sign of the field", "damping", "transposed"]


@pytest.mark.parametrize("name", sampled(CAUSES, 1, keep=["sign of the field"]))
def test_a_mistake_has_its_cause(name, method):
    free, heavy = causes(method("-DREAL=float", changes=MISTAKES[name]))
    assert heavy == name
    assert free == ("" if name == "sign of the field" else heavy)


def test_a_right_motion_has_no_cause(method):
    assert causes(method("-DEULER")) == ("", "")


@pytest.mark.slow
def test_an_unknown_mistake_has_no_name(method):
    wrong = {"k[1] = (a * x + c * z - d * v) / 2;": "k[1] = (a * x - c * z + d * v) / 2;"}
    assert causes(method(changes=wrong)) == ("unknown", "unknown")


def test_identical_programs_of_two_commits_are_said(tmp_path):
    versions = []
    for name, text in (("was", "1"), ("same", "1"), ("other", "2")):
        (tmp_path / name).mkdir()
        (tmp_path / name / "program").write_text(text)
        (tmp_path / name / "conservative.toml").write_text('[engines]\nmine = "./program --fast"\n')
        versions.append(Version(name, name, Checkout("conservative", VERSION, tmp_path / name, "", ())))
    was, same, other = versions
    (note,) = decide(comparison((row(), row(), None), base=was, head=same)).notes
    assert note.startswith("mine: both versions run identical files")
    assert decide(comparison((row(), row(), None), base=was, head=other)).notes == ()
    assert decide(comparison((row(), row(), None), base=was, head=was)).notes == ()  # of one commit
