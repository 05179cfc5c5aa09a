"""Motions as files: every digit by a second solution, tolerances, and signatures. `test_rotation_tests.py` runs the tests."""

import csv
import hashlib
import json
import math
from itertools import product

import mpmath
import numpy as np
import pytest
from click.testing import CliRunner

from conservative.attitude import angle_between, from_quaternion
from conservative.benchmarks.verification.motions import files, programs
from conservative.benchmarks.verification.motions.integrators import ATTITUDES, VARIABLES, designs
from conservative.benchmarks.verification.motions.motion import SAMPLE, load
from conservative.benchmarks.verification.motions.signatures import names as mistake_names
from conservative.benchmarks.verification.motions.signatures import signatures
from conservative.grid import Grid
from conservative.potentials.turning import Turning
from conservative.references import precise
from conservative.references.collocation import collocate
from conservative.reports.cli.main import main

from ...sampling import sampled
from .motions_engines.run import MOTIONS
from .right_programs import right_programs

CATALOGUE = {motion.name: motion for motion in load()}
FILES = {name: json.loads((MOTIONS / f"{name}.json").read_text()) for name in CATALOGUE}
RIGHT = right_programs()
slow = pytest.mark.slow


def test_files_and_their_sizes():
    sizes = {path.name: path.stat().st_size for path in MOTIONS.iterdir() if path.suffix in (".json", ".csv")}
    assert sizes.keys() == {f"{name}.{kind}" for name in CATALOGUE for kind in ("json", "csv")}
    assert len(CATALOGUE) == 48
    assert sum(sizes.values()) < 600_000
    assert max(sizes.values()) <= 20_000


DIGEST = "1e0ccb3e1eaff44ba48d7261018ef3659f96d8ed9be9e759000b02ac2a68c09f"


def test_no_file_has_changed():
    """A file that is written again on purpose changes the digest, and is derived again by `pytest --all`."""
    text = "".join(
        (MOTIONS / name).read_text() for name in sorted(f"{name}.{kind}" for name in CATALOGUE for kind in ("json", "csv"))
    )
    assert hashlib.sha256(text.encode()).hexdigest() == DIGEST


def without_noise(values):
    """Return numbers, with 0 for noise below 1e-50 of the largest: a momentum of `brick_flip` is 0, and -1e-60 in its file."""
    values = np.array(values)
    return np.where(np.abs(values) < 1e-50 * np.abs(values).max(), 0.0, values)


@pytest.mark.parametrize("name", sampled(CATALOGUE, 2, keep=["golden_9", "rotor_turned"]))
def test_files_are_the_solution_to_the_last_digit(name):
    """CSV and JSON have the same numbers, and these are what the solution gives now. The tests below are of other solutions."""
    motion, kept = CATALOGUE[name], FILES[name]
    for key in SAMPLE:
        np.testing.assert_array_equal(without_noise(kept[key]), without_noise(motion.exact[key][1:]))
    assert (MOTIONS / f"{name}.csv").read_text() == files.as_csv(kept)
    rows = list(csv.reader((MOTIONS / f"{name}.csv").read_text().splitlines()))
    numbers = [[float(x) for x in row[1:]] for row in rows if row[0] == "sample"]
    np.testing.assert_array_equal(np.array(numbers)[:, 10:14], kept["quaternion_wxyz"])
    np.testing.assert_array_equal(np.array(numbers)[:, 21:], kept["momentum_W"])


@pytest.mark.parametrize("name", [name for name, motion in CATALOGUE.items() if not motion.scene.loaded])
def test_digits_by_heyoka_in_256_bits(name):
    """heyoka's Taylor integrator shares no code with the solution. Measured: no digit differs."""
    pytest.importorskip("heyoka")
    motion = CATALOGUE[name]
    scene, kept = motion.scene, FILES[name]
    with mpmath.workprec(300):
        exact = mpmath.mpf  # products of parameters are not rounded to double
        values = [exact(x) for x in motion.rotor_momentum_B or (0, 0, 0)]
        if motion.weight:
            values += [exact(motion.weight) * exact(x) for x in motion.com_B]
        if motion.orbit:
            field = scene.potential
            assert isinstance(field, Turning)
            inertia = np.ravel(motion.inertia_B).tolist()
            values += [motion.orbit, 0, 0, 1, 3 * exact(motion.orbit) ** 2, *inertia, 1, 0, 0]
        form = precise.find_field(scene.potential)
        solve = precise._solver(motion.inertia_B, motion.quaternion, list(map(float, motion.rates)), form, values, 256)
    _, _, reals = solve(precise._reals([0.0, *motion.t], 256), None)
    found = np.array([[float(x) for x in row] for row in reals])[1:]
    np.testing.assert_array_equal(found[:, :4], kept["quaternion_wxyz"])
    np.testing.assert_array_equal(found[:, 4:], kept["w_WB_B"])


@pytest.mark.parametrize("name", CATALOGUE)
def test_digits_by_collocation(name):
    """Collocation in extended precision, for torque and damping too. Measured: 4.5e-16 (matrices), 2e-16, 4e-16 and 3e-16."""
    motion, kept = CATALOGUE[name], FILES[name]
    found = collocate(motion.scene, Grid(motion.steps * motion.step, motion.samples), 8)
    R, w = found.R_WB[1:], found.w_WB_B[1:]
    L = w @ np.array(motion.inertia_B)
    energy = (w * L).sum(axis=1) / 2 + (motion.scene.potential.energy(R) if motion.weight else 0)
    momentum = np.einsum("nij,nj->ni", R, L + np.array(motion.rotor_momentum_B or [0, 0, 0]))
    assert np.abs(R - kept["R_WB"]).max() <= 1e-15
    for key, value in (("w_WB_B", w), ("energy", energy), ("momentum_W", momentum)):
        size = np.abs(kept[key]).max() if key != "energy" else kept["scale"]["energy"] + np.abs(kept["energy"]).max()
        assert np.abs(value - kept[key]).max() <= 1e-15 * size


@pytest.mark.parametrize("name", CATALOGUE)
def test_what_a_sample_says_agrees(name):
    """The quaternion is that of the matrix, and continuous; world rates are the turned body rates."""
    kept = FILES[name]
    R, q = np.array([kept["R_WB0"], *kept["R_WB"]]), np.array([kept["quaternion_wxyz0"], *kept["quaternion_wxyz"]])
    assert np.abs(from_quaternion(q) - R).max() <= 4e-16
    assert (np.sum(q[1:] * q[:-1], axis=1) > 0).all()
    assert np.abs(np.einsum("nij,nj->ni", R[1:], kept["w_WB_B"]) - kept["w_WB_W"]).max() <= 1e-15 * kept["scale"]["rates"]
    assert np.linalg.eigvalsh(kept["inertia_B"])[2] <= np.trace(kept["inertia_B"]) / 2  # the body exists
    if "weight" in kept:  # also about its centre of mass
        c, mass = np.array(kept["com_B"]), kept["weight"] / -kept["gravity_W"][2]
        own = np.linalg.eigvalsh(np.array(kept["inertia_B"]) - mass * (c @ c * np.eye(3) - np.outer(c, c)))
        assert own[0] > 0
        assert own[2] <= own[0] + own[1]


def test_quaternions_pass_zero():
    starts = {name: [kept["quaternion_wxyz0"][0], *(q[0] for q in kept["quaternion_wxyz"])] for name, kept in FILES.items()}
    assert sum(min(x) < 0 < max(x) for x in starts.values()) >= 5


@slow
def test_coarse_tolerances_are_measured_again():
    """At the largest step, with all designs; the command below measures all. A tolerance is rounded up to two digits."""
    motions = [CATALOGUE[name] for name in ("rotor_turned",)]
    for motion, measured in zip(motions, programs.measure(motions, (1,)), strict=True):
        kept = FILES[motion.name]
        assert kept["single"] == pytest.approx(programs.single(motion), rel=0.05)
        for (order, angle), values in measured.tolerances.items():
            (row,) = (each for each in kept["tolerance"] if (each["order"], each["angle"]) == (order, angle))
            assert [row[name] for name in programs.QUANTITIES] == values.tolist()


ANY = ("damped", "rotor_turned", "torque_strong", "heavy", "orbit", "tiny_fast")
"""Motions in one of which each mistake has a signature."""


@pytest.mark.parametrize("name", sampled(ANY, 1, keep=["tiny_fast"]))
def test_signatures_are_computed_again(name):
    """One motion by default: a changed file changes the digest, and `--all` derives the others."""
    motions = [CATALOGUE[name]]
    for motion, found in zip(motions, signatures(motions), strict=True):
        (allowed,) = (file for file in FILES[motion.name]["tolerance"] if (file["order"], file["angle"]) == (2, 0.01))
        made = files.catches(motion, np.array([allowed[name] for name in programs.QUANTITIES]), found)
        assert [each["mistake"] for each in made] == [file["mistake"] for file in FILES[motion.name]["catches"]]
        for new, old in zip(made, FILES[motion.name]["catches"], strict=True):
            for name in programs.QUANTITIES:
                assert new[name] == pytest.approx(old[name], rel=0.05)


@slow
def test_the_command_writes_the_files_again(tmp_path):
    """It solves all motions and measures all tolerances."""
    done = CliRunner().invoke(main, ["motions", "--out", str(tmp_path)])
    assert done.exit_code == 0, done.output
    assert len(list(tmp_path.iterdir())) == 96
    for path in tmp_path.iterdir():
        assert path.read_text() == (MOTIONS / path.name).read_text(), path.name


def test_the_command_replaces_no_other_file(tmp_path):
    (tmp_path / "separatrix.csv").write_text("mine\n")
    done = CliRunner().invoke(main, ["motions", "--out", str(tmp_path)])
    assert (done.exit_code, (tmp_path / "separatrix.csv").read_text()) == (2, "mine\n")
    assert "--force" in done.output
    for name, mark in files.marks():
        assert mark in (MOTIONS / name).read_text()[:4096]


EVERY = [(1, 1), (1, 7), (2, 1), (2, 11), (4, 5), (4, 23)]
"""Orders, and which designs of each."""


@pytest.mark.parametrize(("order", "every"), sampled(EVERY, 1, keep=[(2, 11)]))
def test_designs_have_their_order(order, every):
    """Errors of attitudes fall by 10^order from |w| h = 0.1 to 0.01. Measured: exponents within 0.05 of the order."""
    motions = [CATALOGUE["world_tensor"], CATALOGUE["heavy"], CATALOGUE["damped_and_driven"]]
    scale, all_of = programs.sizes(motions), designs(order)
    assert {(each.attitude, each.variable) for each in all_of} == set(product(ATTITUDES, VARIABLES))
    for each in all_of[::every]:
        coarse, fine = (programs.errors(motions, scale, each.run(motions, parts)) for parts in (1, 10))
        assert np.abs(np.log10(coarse / fine)[:, 0] - order).max() <= 0.1, each.name


@slow
@pytest.mark.parametrize(("order", "single"), [(2, False), (1, True), (2, True), (4, True)])
def test_all_designs_are_right(order, single):
    """Measured: 0.5 in double precision, which is the margin; 0.53, and 0.996 of composed splitting, in single."""
    motions = list(CATALOGUE.values())
    scale = programs.sizes(motions)
    limits = np.array([
        [row[name] + single * FILES[motion]["single"] for name in programs.QUANTITIES]
        for motion in CATALOGUE for row in FILES[motion]["tolerance"] if (row["order"], row["angle"]) == (order, 0.01)
    ])  # fmt: skip
    for design in designs(order, single)[:: 1 if order < 4 else 3]:
        assert (programs.errors(motions, scale, design.run(motions, 10)) / limits).max() <= 1, design.name


@pytest.mark.parametrize("name", sampled(RIGHT, 4))
def test_right_programs_of_other_code_pass(name):
    """Plain Python, which shares no code with the designs of the tolerances. Measured: 0.5 of the tolerance at most."""
    program = RIGHT[name]
    for motion in FILES.values():
        (row,) = (each for each in motion["tolerance"] if (each["order"], each["angle"]) == (program.order, 0.01))
        R, w = program.solve(motion, motion["t"][0] / row["steps"], row["steps"])
        attitude, rates = files.tolerance(CATALOGUE[motion["name"]], program.order, program.single)
        assert angle_between(R, motion["R_WB"]).max() <= attitude, motion["name"]
        assert np.linalg.norm(w - motion["w_WB_B"], axis=1).max() <= rates * motion["scale"]["rates"], motion["name"]


def test_every_mistake_is_caught_by_a_factor_of_ten():
    best = dict.fromkeys(mistake_names(), 0.0)
    for kept in FILES.values():
        (row,) = (each for each in kept["tolerance"] if (each["order"], each["angle"]) == (2, 0.01))
        for each in kept["catches"]:
            factor = max(each[name] / row[name] for name in programs.QUANTITIES)
            best[each["mistake"]] = max(best[each["mistake"]], factor)
    unseen = {name for name, factor in best.items() if factor < 10}
    assert unseen == {"no reaction of the motor", "sign of the reaction of the motor"}  # no motion has a motor


def test_order_one_allows_what_order_two_does_not():
    """A program that declares order 1 passes with stale rates."""
    for kept in FILES.values():
        one, two = (
            next(each for each in kept["tolerance"] if (each["order"], each["angle"]) == (order, 0.01)) for order in (1, 2)
        )
        for each in kept["catches"]:
            if each["mistake"] in ("stale rates", "attitude by normalisation"):
                assert all(each[name] <= one[name] for name in programs.QUANTITIES)
                assert any(each[name] > two[name] for name in programs.QUANTITIES)


def test_every_tolerance_is_above_round_off():
    for kept in FILES.values():
        for each in kept["tolerance"]:
            assert min(each[name] for name in programs.QUANTITIES) >= programs.LEAST[each["order"]]
            assert all(math.isfinite(each[name]) for name in programs.QUANTITIES)


def test_an_engine_that_does_nothing_fails():
    """The files as they are: `simulate` returns the start."""
    R0 = np.array([kept["R_WB0"] for kept in FILES.values()])
    ends = np.array([kept["R_WB"][-1] for kept in FILES.values()])
    assert angle_between(R0, ends).min() >= 10 * max(file["tolerance"][5]["attitude"] for file in FILES.values())
