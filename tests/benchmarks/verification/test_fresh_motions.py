"""Fresh motions: the same seed gives the same files, two solutions agree, right programs pass, and wrong ones are named."""

import json
from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner

from conservative.attitude import angle_between
from conservative.benchmarks.verification import programs as verified_programs
from conservative.benchmarks.verification.finding import Verdict
from conservative.benchmarks.verification.motions import files, one_file, programs, search
from conservative.benchmarks.verification.motions.integrators import designs
from conservative.benchmarks.verification.motions.motion import load
from conservative.benchmarks.verification.verify import verify
from conservative.errors import BadInput, IntegrationFailed
from conservative.references import precise
from conservative.reports.cli import motions as motions_module
from conservative.reports.cli.main import main

from ...attack import fresh_motions
from ...sampling import sampled
from .right_programs import matrix, of_motion, right_programs
from .wrong_programs import wrong_programs

RIGHT, WRONG = right_programs(), wrong_programs()
SEED, OTHER = 3, 4
PUBLISHED = 20261127
"""Seed of the generator that the published motions were drawn from, 40 of each family and length."""


@cache
def numbers(seed):
    """Return the numbers of the motions of a seed, without solutions."""
    return [{key: value for key, value in vars(m).items() if key not in ("exact", "scene")} for m in search.choose(seed)]


def test_a_seed_gives_one_motion_of_each_family_and_another_seed_other_bodies():
    first, second = numbers(SEED), numbers(OTHER)
    assert [motion["name"] for motion in first] == [*search.FAMILIES]
    assert {motion["name"] for motion in first} < {motion.name for motion in load()}
    assert first == [{key: value for key, value in vars(m).items() if key in first[0]} for m in search.choose(SEED)]
    for a, b in zip(first, second, strict=True):
        assert (a["quaternion"], a["rates"]) != (b["quaternion"], b["rates"])


def test_a_family_does_not_depend_on_the_others(monkeypatch):
    """A family that is added, removed or moved changes no other one."""
    few = {name: search.FAMILIES[name] for name in ("heavy", "gyroscopic_term")}
    monkeypatch.setattr(search, "FAMILIES", few)
    known = {motion["name"]: motion for motion in numbers(SEED)}
    for motion in search.choose(SEED):
        assert (motion.inertia, motion.rates, motion.steps) == tuple(
            known[motion.name][key] for key in ("inertia", "rates", "steps")
        )


def test_published_motions_are_drawn_by_the_same_functions():
    """They were chosen by earlier margins, so that only the draws can be made again."""
    random, published = search.Random(PUBLISHED), {motion.name: motion for motion in load()}
    for name, family in search.FAMILIES.items():
        motion, found = published[name], False
        for length in search.LENGTHS[search.LONGER.get(name, 0) :]:
            drawn = [random.motion(**family[2]) for _ in range(40)]
            if length == (motion.steps, motion.samples):
                found = any(
                    (keys["inertia"], keys["rates"], keys["quaternion"]) == (motion.inertia, motion.rates, motion.quaternion)
                    for keys in drawn
                )
                break
        assert found, name


@pytest.mark.parametrize("seed", [-1, 1.5, True, "7", None])
def test_bad_seeds_are_refused(seed):
    with pytest.raises(BadInput, match="seed"):
        search.fresh(seed)


@pytest.mark.parametrize("name", sampled(search.FAMILIES, 6, keep=["damped_and_driven", "orbit", "tiny_turned", "rotor"]))
def test_two_solutions_agree(name):
    """The solution in integers and collocation in extended precision share no code. Measured: 5e-16 at most."""
    (motion,) = (replace(motion) for motion in search.choose(SEED) if motion.name == name)
    assert search.confirm(motion) <= search.AGREEMENT


def test_another_solution_is_refused(monkeypatch):
    motion = replace(search.choose(SEED)[0])
    motion.exact["w_WB_B"][-1] *= 1 + 1e-14
    with pytest.raises(IntegrationFailed, match="two solutions differ"):
        search.confirm(motion)


@pytest.mark.parametrize("name", sampled(["gyroscopic_term", "rotor", "separatrix", "tiny_turned"], 2))
def test_digits_by_heyoka_in_256_bits(name):
    """A third solution, of free bodies and rotors. Measured: no digit differs."""
    pytest.importorskip("heyoka")
    (motion,) = (replace(motion) for motion in search.choose(SEED) if motion.name == name)
    values = list(motion.rotor_momentum_B or (0, 0, 0))
    form = precise.find_field(None)
    solve = precise._solver(motion.inertia_B, motion.quaternion, list(map(float, motion.rates)), form, values, 256)
    _, _, reals = solve(precise._reals([0.0, *motion.t], 256), None)
    found = np.array([[float(x) for x in row] for row in reals])
    np.testing.assert_array_equal(found[:, :4], motion.exact["quaternion_wxyz"])
    np.testing.assert_array_equal(found[:, 4:], motion.exact["w_WB_B"])


@pytest.fixture
def few(monkeypatch):
    """A seed has the motions of some families only."""
    names = ("gyroscopic_term", "products", "separatrix", "rotor", "heavy", "orbit")
    monkeypatch.setattr(search, "FAMILIES", {name: search.FAMILIES[name] for name in names})
    monkeypatch.setattr(verified_programs, "GENERIC", 2)
    search.fresh.cache_clear()
    files._limits.cache_clear()
    yield
    search.fresh.cache_clear()
    files._limits.cache_clear()


@pytest.mark.parametrize("seed", [SEED, OTHER])
def test_right_methods_pass_and_their_tolerances_are_of_the_seed(few, seed):
    (found,) = verify("taylor:order=12", seed=seed, only=["motions"])
    assert found.verdict is Verdict.RIGHT, found.reason
    right = [finding for finding in found.findings if finding.check == "motions"]
    assert [finding.case for finding in right] == [*search.FAMILIES]
    measured = programs.measure(search.fresh(seed), (10,))
    for finding, limits in zip(right, measured, strict=True):
        assert finding.allowed in limits.tolerances[4, 0.01]


@pytest.mark.parametrize("name", sampled(["no gyroscopic term", "sign of the rotor", "sign of the field", "damping 0.1"], 2))
@pytest.mark.parametrize("seed", [SEED, OTHER])
def test_wrong_programs_are_named(few, name, seed):
    """Programs that share no code with the catalogue, on each motion in its own axes."""
    program = WRONG[name]

    def solve(scene, grid):
        (motion,) = (motion for motion in search.fresh(seed) if motion.name == scene.name)
        steps = np.arange(0, grid.n_steps + 1, grid.every)
        keys = fresh_motions.keys_of(motion)
        states = program.states(of_motion(keys), keys["quaternion_wxyz0"], keys["w_WB_B0"], grid.dt, steps.tolist())
        R, w = np.array([matrix(q) for q, _ in states]), np.array([w for _, w in states], dtype=float)
        return SimpleNamespace(t=grid.dt * steps, R_WB=R, w_WB_B=w, failure=None)

    answers = verified_programs.run_motions(solve, program.order, seed=seed)
    _, named, _ = verified_programs.motion_findings("program", answers)
    assert named
    assert {key for group in named[:1] for explanation in group.explanations for key in explanation.keys} == {program.key}


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"seed": -1}, "integer of 0 or more"),
        ({"seed": 7, "only": ["pairs"]}, "without a check by motions"),
        ({"seed": 7, "known": "known.txt"}, "known errors"),
        ({"seed": 7, "record": "known.txt"}, "known errors"),
    ],
)
def test_a_seed_that_is_not_used_is_refused(options, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(BadInput, match=words):
        verify("taylor", **options)
    assert not list(tmp_path.iterdir())


def test_recordings_have_no_seed(tmp_path):
    (tmp_path / "run.csv").write_text("t,qw,qx,qy,qz\n0,1,0,0,0\n1,1,0,0,0\n")
    with pytest.raises(BadInput, match="seed"):
        verify(tmp_path / "run.csv", "brick_flip", seed=7)
    done = CliRunner().invoke(main, ["verify", str(tmp_path / "run.csv"), "--body", "brick_flip", "--seed", "7"])
    assert done.exit_code == 2
    assert "--seed" in done.output


def test_the_command_writes_the_files_of_a_seed(few, tmp_path):
    arguments = ["motions", "--seed", str(SEED), "--out"]
    for name in ("a", "b"):
        done = CliRunner().invoke(main, [*arguments, str(tmp_path / name)])
        assert done.exit_code == 0, done.output
    first, second = ({path.name: path.read_text() for path in (tmp_path / name).iterdir()} for name in ("a", "b"))
    assert first == second
    assert first.keys() == {f"{name}.{kind}" for name in search.FAMILIES for kind in ("json", "csv")}
    kept = json.loads(first["separatrix.json"])
    assert kept["seed"] == SEED
    assert any(each["mistake"] == "no gyroscopic term" for each in kept["catches"])
    assert first["separatrix.csv"] == files.as_csv(kept)
    (motion,) = (motion for motion in search.fresh(SEED) if motion.name == "separatrix")
    R, w = RIGHT["RK4, matrix, world momentum"].solve(kept, motion.step / 10, motion.steps * 10)
    attitude, rates = files.tolerance(motion, 4)
    assert angle_between(R, kept["R_WB"]).max() <= attitude
    assert np.linalg.norm(w - kept["w_WB_B"], axis=1).max() <= rates * kept["scale"]["rates"]


@pytest.mark.parametrize("other", [["--seed", str(OTHER)], []])
@pytest.mark.parametrize("kind", ["json", "csv"])
def test_the_command_replaces_no_files_of_another_seed(kind, other, few, tmp_path, monkeypatch):
    for name, mark in files.marks(SEED):
        if name.endswith(kind):
            (tmp_path / name).write_text("{\n" * (kind == "json") + mark)
    monkeypatch.setattr(files, "write", lambda *_: pytest.fail("written"))
    done = CliRunner().invoke(main, ["motions", *other, "--out", str(tmp_path)])
    assert (done.exit_code, "--force" in done.output) == (2, True)


@pytest.mark.parametrize("seed", ["-1", "x", "1.5"])
def test_the_command_refuses_bad_seeds(seed, tmp_path):
    done = CliRunner().invoke(main, ["motions", "--seed", seed, "--out", str(tmp_path)])
    assert (done.exit_code, "--seed" in done.output) == (2, True)


def test_languages_of_the_command_are_those_of_the_tests():
    assert set(motions_module.LANGUAGES) == set(one_file.LANGUAGES)


def test_a_test_with_fresh_motions_is_one_file(few, tmp_path):
    path = tmp_path / "test_rotation.py"
    done = CliRunner().invoke(main, ["motions", "--seed", str(SEED), "--language", "python", "--out", str(path)])
    assert done.exit_code == 0, done.output
    text = path.read_text()
    assert all(name in text for name in search.FAMILIES)
    done = CliRunner().invoke(main, ["motions", "--seed", str(SEED), "--language", "python", "--out", str(path)])
    assert (done.exit_code, path.read_text()) == (2, text)  # the user's engine may be in it


def test_designs_in_single_precision_are_in_single_precision():
    """Measured: errors of RK4 between 2e-7 and 2e-5 rad, of a few hundred steps."""
    motions = list(load())[:10]
    (design,) = (each for each in designs(4, single=True) if each.name == "RK4, quaternion, rates, single")
    errors = programs.errors(motions, programs.sizes(motions), design.run(motions, 10))[:, 0]
    assert (errors > 3e-8).all()
    assert (errors < 1e-4).all()
