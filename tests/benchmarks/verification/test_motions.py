"""Motions as files: every digit by a second solution, tolerances, and the tests of references/motions in each language."""

import csv
import json
import math
import re
import subprocess
from itertools import product

import mpmath
import numpy as np
import pytest
from click.testing import CliRunner
from scipy.spatial.transform import Rotation

import conservative as cv
from conservative.attitude import angle_between, from_quaternion
from conservative.benchmarks.measures.measurement import frame
from conservative.benchmarks.studies import studies
from conservative.benchmarks.studies.selection import Missing
from conservative.benchmarks.studies.study import Study
from conservative.benchmarks.verification.motions import files, programs
from conservative.benchmarks.verification.motions.motion import SAMPLE, load
from conservative.benchmarks.verification.solution import Equations
from conservative.grid import Grid
from conservative.potentials.turning import Turning
from conservative.references import precise
from conservative.references.collocation import collocate
from conservative.reports.cli.main import main
from conservative.reports.rows.names import with_names
from conservative.reports.sections.motions import section

from ..generic_study import Broken
from .motions_engines.methods import METHODS
from .motions_engines.run import LANGUAGES, MOTIONS, missing, run

CATALOGUE = {motion.name: motion for motion in load()}
FILES = {name: json.loads((MOTIONS / f"{name}.json").read_text()) for name in CATALOGUE}
slow = pytest.mark.slow


def test_files_and_their_sizes():
    sizes = {path.name: path.stat().st_size for path in MOTIONS.iterdir() if path.suffix in (".json", ".csv")}
    assert sizes.keys() == {f"{name}.{kind}" for name in CATALOGUE for kind in ("json", "csv")}
    assert len(CATALOGUE) == 48
    assert sum(sizes.values()) < 600_000
    assert max(sizes.values()) <= 20_000


@pytest.mark.parametrize("name", CATALOGUE)
def test_files_are_the_solution_to_the_last_digit(name):
    """CSV and JSON have the same numbers, and these are what the solution gives now."""
    motion, kept = CATALOGUE[name], FILES[name]
    for key in SAMPLE:
        np.testing.assert_array_equal(np.array(kept[key]), motion.exact[key][1:])
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


SOME = ["tiny", "torque_strong", "damped", "rotor_turned", "half_turn", "golden_4"]


@pytest.fixture(scope="module")
def measured():
    motions = [CATALOGUE[name] for name in SOME]
    return [files.describe(motion, each) for motion, each in zip(motions, programs.measure(motions), strict=True)]


def test_tolerances_and_factors_are_measured_again(measured):
    for each in measured:
        for key in ("scale", "tolerance", "single", "catches"):
            assert each[key] == FILES[each["name"]][key]


@slow
def test_the_command_writes_the_files_again(tmp_path):
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


@pytest.mark.parametrize("order", programs.ORDERS)
def test_methods_have_their_order(order):
    """Errors fall by 10^order from |w| h = 0.1 to 0.01. Measured: exponents within 0.13 of the order."""
    motions = [CATALOGUE["world_tensor"], CATALOGUE["heavy"], CATALOGUE["damped_and_driven"]]
    scale, f = programs._scales(motions), programs.Slope([Equations(motion.scene) for motion in motions])
    assert len(programs.OF_ORDER[order]) >= 4
    for name, step in programs.OF_ORDER[order].items():
        coarse, fine = (programs._errors(motions, scale, f, step, parts, programs.Mistake("")) for parts in (1, 10))
        assert np.abs(np.log10(coarse / fine)[:, :2].max(axis=1) - order).max() <= 0.2, name


def test_every_mistake_is_caught_by_a_factor_of_ten():
    best = dict.fromkeys(programs.MISTAKES, 0.0)
    for kept in FILES.values():
        for each in kept["catches"]:
            best[each["mistake"]] = max(best[each["mistake"]], each["factor"]["2"])
    assert len(best) >= 20
    assert min(best.values()) >= 10, min(best, key=best.get)  # measured: 260, of stale rates


def test_order_one_allows_what_order_two_does_not():
    """A program that declares order 1 passes with stale rates."""
    for kept in FILES.values():
        for each in kept["catches"]:
            if each["mistake"] in ("stale rates", "attitude by normalisation"):
                assert each["factor"]["1"] < 1 < each["factor"]["2"]


def names(lines):
    return [line.partition("with: ")[2] or "unknown" for line in lines[:-1]]


def needs(language):
    return pytest.param(language, marks=[pytest.mark.skipif(bool(missing(language)), reason=str(missing(language)))])


RK2 = METHODS["explicit midpoint"][1]
ALL = [needs(language) for language in LANGUAGES]


@pytest.mark.parametrize("language", ALL)
def test_right_program_passes(language, tmp_path):
    assert run(language, tmp_path, "", RK2, 2) == ["0 of 48 motions failed"]


@pytest.mark.parametrize("language", ALL)
def test_missing_term_is_named(language, tmp_path):
    """Only motions whose rates are constant pass: a ball, and turns about a principal axis."""
    lines = run(language, tmp_path, "no gyroscopic term", RK2, 2)
    assert lines[-1] == "44 of 48 motions failed"
    assert names(lines).count("no gyroscopic term") >= 40
    assert re.search(
        r"\w+: (attitude|rates|energy|momentum) error [\d.e+-]+, tolerance [\d.e+-]+; ", lines[0].replace(".csv", "")
    )


def planted(language):
    """C runs all mistakes; the other languages do with --all."""
    return [pytest.param(language, mistake, marks=[] if language == "C" else [slow]) for mistake in programs.MISTAKES]


AMBIGUOUS = {"attitude by normalisation": "stale rates"}
"""Mistakes whose errors are those of another one."""


@pytest.mark.parametrize(("language", "mistake"), [each for language in LANGUAGES for each in planted(language)])
def test_planted_mistakes_fail_and_are_named(language, mistake, tmp_path):
    """No other mistake is named more often."""
    if missing(language):
        pytest.skip(missing(language))
    lines = run(language, tmp_path, mistake, RK2, 2)
    assert len(lines) > 1
    found = [AMBIGUOUS.get(name, name) for name in names(lines)]
    assert found.count(AMBIGUOUS.get(mistake, mistake)) >= max(1, max(map(found.count, set(found) - {"unknown"})))


def all_methods(language):
    """C runs all methods; the other languages run two in double precision with --all, and the rest with --attack."""
    for method, (single, precision) in product(METHODS, ((False, "double"), (True, "float"))):
        usual = not single and method in ("RK 3/8", "Gauss 4")
        marks = [] if language == "C" else [slow if usual else pytest.mark.attack]
        yield pytest.param(language, method, single, marks=marks, id=f"{language}-{method}-{precision}")


@pytest.mark.parametrize(("language", "method", "single"), [each for language in LANGUAGES for each in all_methods(language)])
def test_right_programs_pass(language, method, single, tmp_path):
    """Explicit and implicit methods that are not among those of the tolerances, in double and single precision."""
    if missing(language):
        pytest.skip(missing(language))
    order, numbers = METHODS[method]
    for angle in programs.ANGLES if language == "C" else (0.01,):
        assert run(language, tmp_path, "", numbers, order, angle, single) == ["0 of 48 motions failed"], angle


@pytest.mark.skipif(bool(missing("C#")), reason=str(missing("C#")))
def test_c_sharp_is_built_and_run(tmp_path):
    """As it is: the body stands still, so that every motion fails."""
    subprocess.run(["mcs", "-out:test.exe", MOTIONS / "Test.cs"], check=True, cwd=tmp_path)
    done = subprocess.run(["mono", "test.exe", *sorted(MOTIONS.glob("*.csv"))], cwd=tmp_path, text=True, capture_output=True)
    assert done.stdout.splitlines()[-1] == "48 of 48 motions failed"


def test_every_tolerance_is_above_round_off():
    for kept in FILES.values():
        for each in kept["tolerance"]:
            assert min(each[name] for name in programs.QUANTITIES) >= programs.LEAST[each["order"]]
            assert all(math.isfinite(each[name]) for name in programs.QUANTITIES)


def test_an_engine_that_does_nothing_fails():
    """The files as they are: `simulate` returns the start."""
    R0 = np.array([kept["R_WB0"] for kept in FILES.values()])
    ends = np.array([kept["R_WB"][-1] for kept in FILES.values()])
    assert angle_between(R0, ends).min() >= 10 * max(each["tolerance"][5]["attitude"] for each in FILES.values())


@pytest.mark.skipif(bool(missing("C++")), reason="needs g++")
def test_the_engine_on_the_page(tmp_path):
    """Explicit Euler steps of a diagonal inertia: bodies in principal axes pass, the others fail with this mistake."""
    (code,) = re.findall(r"```cpp\n(.*?)```", (MOTIONS / "README.md").read_text(), re.DOTALL)
    text = re.sub(
        r"^std::vector<State> simulate.*?^}\n", lambda _: code, (MOTIONS / "test.cpp").read_text(), flags=re.DOTALL | re.M
    )
    text = text.replace("ORDER = 2", "ORDER = 1").replace('HAS = "rotor,torque,damping,fixed point,orbit"', 'HAS = ""')
    (tmp_path / "test.cpp").write_text(text)
    subprocess.run(LANGUAGES["C++"][2], check=True, cwd=tmp_path)
    files_of = sorted(str(path) for path in MOTIONS.glob("*.csv"))
    lines = subprocess.run(["./a.out", *files_of], cwd=tmp_path, text=True, capture_output=True).stdout.splitlines()
    told = [line for line in lines[:-1] if "skipped" not in line]
    tilted = {name for name, kept in FILES.items() if not kept["needs"] and np.count_nonzero(kept["inertia_B"]) > 3}
    assert {line.partition(".csv")[0].rpartition("/")[2] for line in told} == tilted
    assert all(line.endswith("with: no products of inertia") for line in told)


def test_the_study_reports_failures_and_refuses_other_scenes():
    """Methods that integrate pass; those that break are reported by their outcome."""
    own = tuple(CATALOGUE[name].scene for name in ("separatrix", "rod"))
    engines = cv.Reduced(), Broken("raises"), Missing("mujoco", error=cv.MissingEngine("MuJoCo", "mujoco"))
    found = {(row.scene, row.method): row for row in studies.rows(Study("motions", own, engines, skip_missing=True))}
    assert len(found) == 6
    assert all(0 < row.value < 1 and row.outcome.ok for (_, method), row in found.items() if method == "reduced")
    kinds = {row.outcome.kind.value for (_, method), row in found.items() if method != "reduced"}
    assert kinds == {"crashed", "missing"}
    seen = []
    with pytest.raises(cv.BadInput, match="scenes: got 'brick_flip'"):
        list(
            studies.findings(Study("motions", (cv.registry.scene("brick_flip"),), engines[:1]), lambda *call: seen.append(call))
        )
    (_, table) = section(with_names(frame(found.values())), None).blocks
    assert [row[1:5] for row in table.rows] == [["2 of 2", "0", "0", "–"], ["0 of 0", "2", "0", "–"], ["0 of 0", "2", "0", "–"]]


HELD_OUT = ("reduced", "rattle", "lie_variational", "gauss", "splitting:order=2", "taylor:order=8", "textbook:spiers", "scipy")


@pytest.mark.parametrize("names_of", [[*SOME, "rod", "nearly_prolate", "very_slow"], pytest.param(list(CATALOGUE), marks=slow)])
def test_methods_that_no_tolerance_was_measured_with_pass(names_of):
    """Measured: at most 0.52 of a tolerance, over all motions and 67 settings."""
    study = Study("motions", tuple(CATALOGUE[name].scene for name in names_of), tuple(map(cv.registry.method, HELD_OUT)))
    found = [row for row in studies.rows(study) if row.outcome.ok]
    assert len(found) >= 4 * len(names_of)
    assert max(row.value for row in found) <= 0.7


def test_verdicts_of_the_study():
    """A right trajectory passes, one with constant rates is explained."""
    kept = FILES["separatrix"]
    R, w = np.array(kept["R_WB"]), np.array(kept["w_WB_B"])
    assert files.verdict(kept, 4, 0.01, False, R, w)[0] < 1e-4
    wrong = cv.integrate(without_term := CATALOGUE["separatrix"].scene, dt=kept["t"][0] / 40, method="taylor")
    assert files.verdict(kept, 4, 0.01, False, wrong.R_WB[40::40], wrong.w_WB_B[40::40])[0] < 1
    turns = Rotation.from_rotvec(np.outer(kept["t"], kept["w_WB_B0"])).as_matrix()
    ratio, mistake = files.verdict(kept, 2, 0.01, True, without_term.R_WB0 @ turns, np.tile(kept["w_WB_B0"], (5, 1)))
    assert (ratio > 10, mistake) == (True, "no gyroscopic term")
    assert files.verdict(kept, 2, 0.01, False, R, w * 0.7)[1] == ""
