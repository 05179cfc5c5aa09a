"""The gate on a program in C: no violation for changes that are equal in exact arithmetic, and the cause of every mistake.

The whole command but for times runs: two builds, each in the process of its version.
"""

import pytest

from conservative.benchmarks.verification.mistakes import BY_KEY
from conservative.benchmarks.versions.project import MOTION, compare_projects, decide
from conservative.benchmarks.versions.version import Checkout, Version
from conservative.reports.run.causes import find_causes
from conservative.version import VERSION

from ..benchmarks.versions.rewrites import MISTAKES, build, rewrite
from .effort import count

pytestmark = pytest.mark.attack
SCENES = "brick_flip", "near_separatrix", "falling_top", "asymmetric_top"


@pytest.fixture
def gate(tmp_path, monkeypatch):
    """Return a function that returns the violations of a changed program against the same one without the changes."""
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))

    def version(name, flags, changes):
        folder = tmp_path / name
        folder.mkdir(exist_ok=True)
        build(folder, "program", *flags, changes=changes)
        (folder / "conservative.toml").write_text('[engines]\nmine = "./program"\n')
        return Version(name, name, Checkout("conservative", VERSION, folder, "", ()))

    def run(flags, changes, scenes):
        was = version("was", [flag for flag in flags if flag.startswith("-D")], {})
        return decide(
            compare_projects(was, version("is", flags, changes), scenes, ["mine"], processes=0, explain=find_causes)
        ).violations

    return run


def test_sixty_changes_that_are_equal_in_exact_arithmetic_are_no_violations(gate):
    alarms = {number: found for number in range(60 * count(1)) if (found := gate(*rewrite(number), SCENES))}
    print({number: [each.finding for each in found] for number, found in alarms.items()})
    assert not alarms


@pytest.mark.parametrize("name", MISTAKES)
def test_a_physical_mistake_is_found_and_named(name, gate):
    for flags in (["-DREAL=float"], ["-DEULER"]):
        found = gate(flags, MISTAKES[name], ("brick_flip", "falling_top"))
        assert {each.measure for each in found} == {MOTION}
        assert any(BY_KEY[name].sentence.partition("{")[0] in each.now for each in found)
