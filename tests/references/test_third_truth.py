"""Our exact solution of free bodies against Orekit's, in small."""

import pytest

from conservative import registry
from conservative.benchmarks.verification import third_truth as study
from conservative.references.exact.method import Exact

orekit = pytest.mark.engine("orekit")


@orekit
def test_the_study_passes_on_a_few_bodies(capsys):
    assert study.main(["--count", "5"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("free: 4 of 4 bodies within 1e-10")
    assert lines[-1] == "5 bodies, seed 12: passed"


@orekit
def test_the_study_fails_on_bodies_that_are_not_the_same(monkeypatch, capsys):
    third, (_, trial) = registry.method("orekit"), study.draw_trials(2, 12)
    wrong = study.with_wrong_moment(trial.scene)
    assert study.compare_away([trial.scene], third)
    monkeypatch.setattr(study, "largest", lambda scene, other, method: study_largest(wrong, other, method))
    assert not study.compare_away([trial.scene], third)


study_largest = study.largest


@orekit
def test_a_control_that_is_not_found_fails_the_study(monkeypatch, capsys):
    monkeypatch.setattr(study, "WRONG", 0.0)
    assert study.main(["--count", "2"]) == 1
    assert "NOT FOUND" in capsys.readouterr().out


def test_without_orekit_it_says_what_to_install(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert study.main(["--count", "2"]) == 2
    assert "conservative engines install orekit" in capsys.readouterr().out


def test_bodies_near_the_separatrix_are_held_against_multi_precision(capsys):
    near = [trial.scene for trial in study.draw_trials(6, 12) if trial.near]
    assert len(near) == 2
    wrong = [study.with_wrong_moment(scene) for scene in near]
    assert study.compare_near(near, WithOther(wrong))
    assert "multi-precision integration is with ours on 2" in capsys.readouterr().out


class WithOther(Exact):
    """Another one's solution: of bodies that are not quite the same."""

    def __init__(self, scenes):
        object.__setattr__(self, "scenes", iter(scenes))

    def solve(self, scene, grid):
        return Exact().solve(next(self.scenes), grid)


def test_a_wrong_moment_shows_in_exact_solutions():
    (trial,) = (trial for trial in study.draw_trials(2, 12) if not trial.near)
    assert study.difference(trial.scene, trial.scene, Exact()) == 0
    assert study.difference(trial.scene, study.with_wrong_moment(trial.scene), Exact()) > study.BOUND
