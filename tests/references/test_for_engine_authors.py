"""rigid_step.h, the step for authors of engines: golden vectors, drifts over many steps, its fallback, and its page."""

import csv
import math
import re
import shlex
import shutil
import subprocess
from pathlib import Path

import mpmath
import numpy as np
import pytest

import conservative as cv
from conservative.attitude import angle_between, from_quaternion
from conservative.programs import Program
from conservative.references.environments.programs import program_class

from ..environments import PATIENCE

FOLDER = Path(cv.__file__).parents[1] / "references" / "for_engine_authors"
GOLDEN = FOLDER / "golden.csv"
WARNINGS = ("-O2", "-Wall", "-Wextra", "-Wconversion", "-pedantic", "-Werror", f"-I{FOLDER}")
pytestmark = pytest.mark.skipif(not shutil.which("gcc"), reason="needs gcc")

DRIVER = r"""
#include <stdio.h>
#include <math.h>
#include "rigid_step.h"
static double energy(const double *J, const double *m, const double *q, const double *L) {
  double up[3] = {2 * (q[1] * q[3] - q[0] * q[2]), 2 * (q[2] * q[3] + q[0] * q[1]), 1 - 2 * (q[1] * q[1] + q[2] * q[2])}, e = 0;
  for (int i = 0; i < 3; i++) e += L[i] * L[i] / J[i] / 2 + m[i] * up[i];
  return e;
}
/* Read moments, moment of the weight, step, q, L and number of steps. Print parts, q, L and change of energy. */
int main(void) {
  double x[15];
  long n, i;
  while (scanf("%lf %lf %lf %lf %lf %lf %lf %lf %lf %lf %lf %lf %lf %lf %ld", x, x + 1, x + 2, x + 3, x + 4, x + 5, x + 6,
               x + 7, x + 8, x + 9, x + 10, x + 11, x + 12, x + 13, &n) == 15) {
    NAME(_body) body = {{(REAL)x[0], (REAL)x[1], (REAL)x[2]}, {(REAL)x[3], (REAL)x[4], (REAL)x[5]}};
    NAME(_state) s = {{(REAL)x[7], (REAL)x[8], (REAL)x[9], (REAL)x[10]}, {(REAL)x[11], (REAL)x[12], (REAL)x[13]}};
    double start = energy(x, x + 3, x + 7, x + 11), change = 0;
    int parts = 0;
    for (i = 0; i < n; i++) {
      parts = NAME(_step)(&body, (REAL)x[6], &s);
      double q[4] = {s.q[0], s.q[1], s.q[2], s.q[3]}, L[3] = {s.L[0], s.L[1], s.L[2]};
      change = fmax(change, fabs(energy(x, x + 3, q, L) - start));
    }
    printf("%d %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g\n", parts, s.q[0], s.q[1], s.q[2], s.q[3], s.L[0], s.L[1],
           s.L[2], change);
  }
  return 0;
}
"""


@pytest.fixture(scope="module")
def build(tmp_path_factory):
    """Return a function that compiles text in C, or in C++, and returns the program."""
    folder = tmp_path_factory.mktemp("programs")

    def compile_text(text, *options, language="c"):
        standard = ("-std=c99",) if language == "c" else ("-std=c++17",)
        program = folder / f"program_{len(list(folder.iterdir()))}"
        compiler = "gcc" if language == "c" else "g++"
        command = [compiler, *standard, *WARNINGS, *options, "-x", language, "-", "-o", program, "-lm"]
        subprocess.run(command, input=text, text=True, check=True)
        return program

    return compile_text


@pytest.fixture(scope="module")
def step(build):
    """Return a function from rows of numbers, each of `DRIVER`, to its results, in double or float."""
    drivers = {
        "f64": build(DRIVER, "-DREAL=double", "-DNAME(x)=rs##x"),
        "f32": build(DRIVER, "-DREAL=float", "-DNAME(x)=rsf##x", language="c++"),
    }

    def take(rows, precision="f64"):
        text = "\n".join(" ".join(map(repr, map(float, row[:14]))) + f" {int(row[14])}" for row in rows)
        done = subprocess.run([drivers[precision]], input=text, text=True, check=True, capture_output=True, timeout=PATIENCE)
        return np.array([line.split() for line in done.stdout.splitlines()], dtype=float)

    return take


def solve(row):
    """Return q and L after one step in 40 digits, from the map in world axes with the mean rate as unknown."""
    with mpmath.workdps(40):
        J, moment, (h,), q0, L0 = (list(map(mpmath.mpf, part)) for part in np.split(np.asarray(row[:14]), [3, 6, 7, 11]))
        vector = mpmath.matrix

        def hat(v):
            return vector([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])

        w, *v = q0
        V, one = hat(v), mpmath.eye(3)
        norm = w * w + sum(x * x for x in v)
        Q0 = one + 2 * (w * V + V * V) / norm

        def end(*rate):
            turn = h / 2 * hat(rate)
            Q1 = Q0 * mpmath.inverse(one - turn) * (one + turn)
            mean = (Q0 + Q1) / 2 * vector(moment)
            return Q1, Q1.T * (Q0 * vector(L0) + h * vector([-mean[1], mean[0], 0]))

        def defect(*rate):
            L1 = end(*rate)[1]
            return [J[i] * rate[i] - (L0[i] + L1[i]) / 2 for i in range(3)]

        rate = mpmath.findroot(defect, [L / j for L, j in zip(L0, J, strict=True)], tol=1e-60)
        Q1, L1 = end(*rate)
        return np.array(Q1.tolist(), dtype=float), np.array(list(L1), dtype=float)


def draw():
    """Return 50 rows of `DRIVER`: bodies of all sizes, a third of them free, in single steps of up to 0.6 rad."""
    random, rows = np.random.default_rng(20261123), []
    for i in range(50):
        size, a, b = 10 ** random.uniform(-3, 3), *random.uniform(0.1, 1, 2)
        J = size * np.array([a, b, random.uniform(abs(a - b), a + b)])
        rate = random.normal(size=3) * 10 ** random.uniform(-1, 2)
        h = random.uniform(0.01, 0.6) / np.linalg.norm(rate)
        moment = random.normal(size=3) * (0.0 if i % 3 == 0 else 1.0) * size * (rate @ rate)
        q = random.normal(size=4)
        rows.append([*J, *moment, h, *(q / np.linalg.norm(q)), *(J * rate), 1])
    return rows


def write_golden():
    """Write golden.csv: after a change of `draw`, python -c "from test_for_engine_authors import *; write_golden()"."""
    names = [f"{name}{i}" for name in ("J", "moment") for i in (1, 2, 3)]
    names += ["h", *(f"q{i}" for i in range(4)), *(f"L{i}" for i in (1, 2, 3))]
    names += [f"R{i}{j} after" for i in (1, 2, 3) for j in (1, 2, 3)] + [f"L{i} after" for i in (1, 2, 3)]
    rows = [[*row[:14], *np.ravel(R), *L] for row in draw() for R, L in [solve(row)]]
    with GOLDEN.open("w", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([names, *([repr(float(x)) for x in row] for row in rows)])


def read_golden():
    """Return inputs (50, 14), attitudes (50, 3, 3) and momenta (50, 3) of golden.csv."""
    table = np.loadtxt(GOLDEN, delimiter=",", skiprows=1)
    return table[:, :14], table[:, 14:23].reshape(-1, 3, 3), table[:, 23:]


def test_golden_vectors_are_the_map():
    """Every tenth vector is solved again in 40 digits, in other variables than those of the header."""
    rows, R, L = read_golden()
    assert len(rows) == 50
    for i in range(0, 50, 10):
        R1, L1 = solve(rows[i])
        assert np.abs(R1 - R[i]).max() <= 1e-16
        assert np.abs(L1 - L[i]).max() <= 1e-16 * np.linalg.norm(L[i])


@pytest.mark.parametrize(("precision", "bound"), [("f64", 4e-15), ("f32", 2e-6)])
def test_golden_vectors_are_met(step, precision, bound):
    rows, R, L = read_golden()
    found = step([[*row, 1] for row in rows], precision)
    assert (found[:, 0] == 1).all()
    assert np.abs(from_quaternion(found[:, 1:5]) - R).max() <= bound
    assert (np.abs(found[:, 5:8] - L).max(axis=1) / np.linalg.norm(L, axis=1)).max() <= bound


BRICK = [13, 5, 10, 0, 0, 0, 0.01, 1, 0, 0, 0, 0, 0.25, 100]
TOP = [1.2, 2.1, 2.6, 0.3, -1.1, 2.4, 0.05, 0.5, 0.5, -0.5, 0.5, 1, -2, 3]


@pytest.mark.parametrize("row", [pytest.param(BRICK, id="brick"), pytest.param(TOP, id="top")])
@pytest.mark.parametrize(
    ("precision", "steps", "bound"),
    [
        ("f64", 100_000, 3e-13),  # measured 2.5e-14 and 3e-14
        ("f32", 100_000, 1e-4),  # 2.1e-5 and 1.8e-5
        pytest.param("f64", 1_000_000, 1e-12, marks=pytest.mark.slow),  # 1.1e-13 and 6e-14
        pytest.param("f32", 1_000_000, 3e-4, marks=pytest.mark.slow),  # 6e-5 and 7e-5
    ],
)
def test_many_steps_conserve_energy(step, row, precision, steps, bound):
    """Relative to kinetic energy plus moment of the weight."""
    (found,) = step([[*row, steps]], precision)
    scale = sum(L * L / J for L, J in zip(row[11:], row[:3], strict=True)) / 2 + np.linalg.norm(row[3:6])
    assert found[8] <= bound * scale


def test_steps_that_are_too_long_end(step):
    """The map has no solution that is continuous in the step: parts, then one explicit step, which conserves the momentum."""
    lengths = [0.3, 5.0, 500.0, 1e30]
    found = step([[*BRICK[:6], h, *BRICK[7:], 1] for h in lengths])
    assert found[0, 0] == 1
    assert 1 < found[1, 0] <= 64
    assert (found[2:, 0] == 0).all()
    momenta = np.einsum("nij,nj->ni", from_quaternion(found[:, 1:5]), found[:, 5:8])
    np.testing.assert_allclose(momenta, np.tile([0.0, 0.25, 100.0], (4, 1)), atol=2e-12)
    assert found[:2, 8].max() <= 1e-12 * 500


def draw_extreme(precision, seed, n=500):
    """Return rows of `DRIVER` with moments over all exponents of the precision, subnormal ones too, and random rates.

    The rates make steps of 1e-3 to 10 rad, and every third body is free. Numbers are rounded to the precision.
    """
    random, info = np.random.default_rng(seed), np.finfo(np.float64 if precision == "f64" else np.float32)
    lowest, rows = math.log10(float(info.smallest_subnormal)) + 3, []
    while len(rows) < n:
        size, h = 10 ** random.uniform(lowest, math.log10(float(info.max)) - 1), 10 ** random.uniform(-4, 2)
        a, b = random.uniform(0.1, 1, 2)
        J = size * np.array([a, b, random.uniform(abs(a - b), a + b)])
        rate = random.normal(size=3) * 10 ** random.uniform(-3, 1) / h
        q = random.normal(size=4)
        with np.errstate(all="ignore"):
            moment = random.normal(size=3) * (len(rows) % 3 > 0) * size * (rate @ rate) * 10 ** random.uniform(-2, 1)
            row = np.array([*J, *moment, h, *(q / np.linalg.norm(q)), *(J * rate)]).astype(info.dtype).astype(float)
        if np.isfinite(row).all() and (row[:3] > 0).all():
            rows.append([*row, 1])
    return np.array(rows)


def measure_step(row, found):
    """Return the changes of energy and, for a free body, of the world momentum in a step, relative to their sizes."""
    with mpmath.workdps(40):
        J, m = list(map(mpmath.mpf, row[:3])), list(map(mpmath.mpf, row[3:6]))
        ends = []
        for numbers in (row[7:14], found[1:8]):
            w, x, y, z, *L = map(mpmath.mpf, numbers)
            norm, L = w * w + x * x + y * y + z * z, mpmath.matrix(L)
            R = mpmath.matrix([
                [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
            ]) / norm  # fmt: skip
            kinetic = sum(L[i] ** 2 / J[i] for i in range(3)) / 2
            ends.append((kinetic + sum(m[i] * R[2, i] for i in range(3)), kinetic, R * L))
        (E0, T0, l0), (E1, _, l1) = ends
        size = mpmath.sqrt(sum(x * x for x in m))
        return float(abs(E1 - E0) / (T0 + size)), float(mpmath.norm(l1 - l0) / mpmath.norm(l0)) if size == 0 else 0.0


@pytest.mark.parametrize(("precision", "bound", "share"), [("f64", 1e-14, 0.9), ("f32", 5e-6, 0.8)])
def test_moments_over_all_exponents(step, precision, bound, share):
    """A step conserves or returns 0, and even then leaves a state of numbers.

    Measured with four seeds of 4,000 steps: 2.9e-15 in double, 2.1e-6 in float; 95 and 85 % of the steps are taken.
    """
    rows = draw_extreme(precision, 20261127)
    found = step(rows, precision)
    taken = found[:, 0] > 0
    assert np.isfinite(found[:, 1:8]).all()
    assert max(max(measure_step(*each)) for each in zip(rows[taken], found[taken], strict=True)) <= bound
    assert taken.mean() > share


def test_a_step_of_no_time_changes_nothing(step):
    for precision in ("f64", "f32"):
        (found,) = step([[*TOP[:6], 0, *TOP[7:], 3]], precision)
        np.testing.assert_array_equal(found[:8], [1, *TOP[7:]])


def test_bodies_at_rest_stay_and_nan_ends(step):
    rest, broken, tiny = ([*BRICK[:11], x, x, x, 3] for x in (0.0, np.nan, 1e-30))
    for precision in ("f64", "f32"):
        found = step([rest, broken, tiny], precision)
        np.testing.assert_array_equal(found[0, 1:8], [1, 0, 0, 0, 0, 0, 0])
        assert found[1, 0] == 0
        assert np.isfinite(found[2]).all()


@pytest.mark.parametrize(("options", "bound"), [((), 1e-13), (("-DSINGLE",), 5e-5)], ids=["double", "float"])
def test_the_program_is_the_paper_s_integrator(build, options, bound, tmp_path):
    """It equals `Reduced` to round-off on turned frames, in free motion and in gravity."""
    program = shlex.quote(str(build((FOLDER / "program.c").read_text(), *options)))
    engine = program_class(Program("rigid_step", tmp_path / "conservative.toml", program))()
    for name in ("random_body:field=gravity,seed=3,index=1", "brick_flip:t_end=2"):
        scene = cv.registry.scene(name)
        ours, theirs = (cv.integrate(scene, scene.dt, method) for method in ("reduced", engine))
        assert angle_between(ours.R_WB, theirs.R_WB).max() <= bound  # measured: 3e-15 and 9e-6


def test_code_on_the_page_compiles(build):
    blocks = re.findall(r"```c\n(.*?)```", (FOLDER / "README.md").read_text(), re.DOTALL)
    assert len(blocks) == 2
    for block in blocks:
        for language in ("c", "c++"):
            text = f'#include "rigid_step.h"\n{block}\nint main(void) {{ return 0; }}\n'
            build(text, "-Wno-unused-function", language=language)
