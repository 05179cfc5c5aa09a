"""`conservative verify` of files with a planted mistake, or none, whose answers are decided before it runs.

No right file is called wrong, no wrong file right, and no name is false. Of the mistakes that a file determines 99 of 100 are
named. `pytest` verifies the files of `QUICK`, `pytest --all` more, and `pytest --attack` the 1,000 of the page
`reports/documentation/planted_files.md`, whose rates have to be in the intervals of the page. An interrupted attack goes on
where it was, unless the code has changed. By hand:

    python -m tests.attack.planted results.jsonl 10000 11000 --page
"""

import hashlib
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from conservative.benchmarks import verification

from ..sampling import sampled
from .effort import SEED, count
from .planted import files, mistakes, motion, run, tables, worlds
from .planted.layouts import LAYOUTS

PUBLISHED = range(10_000, 11_000)
"""Seeds of the page, which nobody saw before the last changes of the verification."""
QUICK = (2, 7, 13, 15, 17, 21, 25, 29, 30, 45, 53, 63, 67, 75, 89, 92, 96, 113, 116, 135, 142, 149, 154, 157, 163)
"""Seeds of quick files of many kinds."""
SEVERE = (
    "right files called wrong",
    "wrong files called right",
    "false names, of the answers with a name",
    "no answer, or a crash",
)


@pytest.mark.parametrize("seed", QUICK)
def test_files_with_and_without_a_mistake_are_judged_as_was_decided(seed, tmp_path):
    row = run.outcome(seed, tmp_path)
    assert not row["complaint"], run.line_of(row)


def _attacked(cache):
    """Return the rows of the published seeds, or of others; they outlive an interrupted attack of the same code."""
    sources = sorted(
        path for root in (Path(verification.__file__).parent, Path(tables.__file__).parent) for path in root.rglob("*.py")
    )
    code = hashlib.sha256(b"".join(path.read_bytes() for path in sources)).hexdigest()[:12]
    first = PUBLISHED.start if SEED == 1 else 1_000_000 * SEED
    return run.run_all(Path(cache.mkdir("planted")) / f"{code}.jsonl", range(first, first + count(len(PUBLISHED))))


@pytest.mark.attack
def test_rates_of_errors_are_those_of_the_page(request):
    rows = _attacked(request.config.cache)
    _, page = tables.read_page(tables.PAGE.read_text(encoding="utf-8"))
    now, complaints = tables.rates(rows), "\n".join(run.line_of(row) for row in rows if row["complaint"])
    for name, (found, of) in now.items():
        low, high = tables.interval(*page[name])
        assert found <= page[name][0] or name not in SEVERE, complaints
        assert not of or low <= found / of <= high, f"{name}: {found} of {of}; the page has {page[name]}\n{complaints}"


def test_the_page_is_of_this_generator():
    digest, rates = tables.read_page(tables.PAGE.read_text(encoding="utf-8"))
    assert digest == tables.generator(), "python -m tests.attack.planted results.jsonl 10000 11000 --page"
    assert rates.keys() == tables.rates([]).keys()
    assert max(of for _, of in rates.values()) == len(PUBLISHED)


def test_digest_of_the_generator_ignores_comments_and_not_code(tmp_path, monkeypatch):
    before = tables.generator()
    for name in tables.GENERATOR:
        (tmp_path / f"{name}.py").write_text((tables.HERE / f"{name}.py").read_text(encoding="utf-8") + "\n# a comment\n")
    monkeypatch.setattr(tables, "HERE", tmp_path)
    assert tables.generator() == before
    (tmp_path / "decide.py").write_text(
        (tmp_path / "decide.py").read_text(encoding="utf-8").replace("WRONG, ", "WRONG, ", 1) + "\nx = 1\n"
    )
    assert tables.generator() != before


def test_every_mistake_layout_and_noise_is_planted():
    chosen = [files.choose(worlds.Draw(seed)) for seed in PUBLISHED]
    names = {name for names, _ in files.MISTAKES.values() for name in names}
    assert {name for _, name in chosen} >= names - {"rates in radians"}
    assert sum(kind == "right" for kind, _ in chosen) >= 400
    assert len(names) > 90
    assert len(LAYOUTS) > 30


@pytest.mark.parametrize("expected", [0, 3, 40, 400])
def test_interval_has_the_true_share_in_95_of_100_cases(expected):
    share = expected / 1000
    drawn = np.random.default_rng(1).binomial(1000, share, size=400)
    inside = sum(low <= share <= high for low, high in (tables.interval(int(k), 1000) for k in drawn))
    assert inside / 400 > 0.93  # 0.96 to 1.0: the interval of Clopper and Pearson is wide


@pytest.mark.parametrize(
    "part",
    sampled(("gravity", "spring", "attraction", "gradient", "orbit", "wheel", "motor", "torque", "torque table", "damping"), 4),
)
def test_exact_motions_of_the_generator_solve_the_equations_of_momentum(part):
    """K = J w + h and K' = K x w + T, by SciPy's DOP853 from corner to corner."""
    drawn = (worlds.draw_world(worlds.Draw(seed)) for seed in range(1000))
    world, rate, _ = next(found for found in drawn if part in files.features(found[0]))
    J, (torque_times, torque, wheel_times, wheel) = world.J, world.tables

    def at(times, values, s):
        return np.array([np.interp(s, times, column) for column in values.T])

    def rates(s, y):
        return np.linalg.solve(J, y[4:] - at(wheel_times, wheel, s))

    def slope(s, y):
        R, w, T = Rotation.from_quat(y[[1, 2, 3, 0]]).as_matrix(), rates(s, y), at(torque_times, torque, s)
        T = R.T @ T if world.axes == "world" else T
        T = T if world.damping is None else T - world.damping @ w
        if world.field is not None:
            T = T + pull(R.T @ (np.eye(3) if world.orbit is None else turned(s)), *world.field)
        return np.append(motion.times(y[:4], np.append(0, w)) / 2, np.cross(y[4:], w) + T)

    def turned(s):
        return Rotation.from_rotvec(world.orbit[0] * s * world.orbit[1]).as_matrix()

    def pull(B, kind, size, *numbers):  # B maps axes that turn with the field to body axes
        if kind == "gradient":
            return 3 * size**2 * np.cross(B @ numbers[1], numbers[0] @ B @ numbers[1])
        if kind == "gravity":
            return np.cross(numbers[0], B @ [0, 0, -size])
        line = B @ numbers[1] - numbers[0]
        far = np.linalg.norm(line)
        return np.cross(numbers[0], (size * (1 - numbers[2] / far) if kind == "spring" else size / far**3) * line)

    t_end = 20 / rate
    y, inside = np.append(world.q0, J @ world.w0 + at(wheel_times, wheel, 0)), world.breaks[world.breaks < t_end]
    for start, end in pairwise([0.0, *inside, t_end]):
        y = solve_ivp(slope, (start, end), y, "DOP853", rtol=1e-11, atol=1e-12 * np.abs(y).max()).y[:, -1]
    found = world.solve(np.array([t_end]))[0, 4:]
    assert np.abs(found - rates(t_end, y)).max() / rate < 1e-7  # 2e-12 to 1e-9


ORDERS = {
    (mistakes.TURNED, "RK2", "Heun's", "Ralston's", "midpoint", "trapezoidal", "Adams", "Störmer"): 2,
    ("RK3",): 3,
    ("RK4",): 4,
}
"""Orders of methods of damped motions by words in their names; 1 for others. The first step of Adams' methods is Euler's."""


@pytest.mark.parametrize("name", sampled(mistakes.STEPS, 6))
def test_steps_of_the_generator_approach_the_exact_motion(name):
    world, rate, _ = worlds.draw_world(worlds.Draw(5), "damping", "any")
    gap, n = 0.4 / rate, 8
    exact = world.solve(gap * np.arange(n))
    off = [np.abs(mistakes.march(world, name, n, gap, parts) - exact)[:, :4].max() for parts in (8, 16)]
    order = next((order for words, order in ORDERS.items() if any(word in name for word in words)), 1)
    assert abs(np.log2(off[0] / off[1]) - order) < 0.1  # at most 0.05
    assert off[1] < 0.03
