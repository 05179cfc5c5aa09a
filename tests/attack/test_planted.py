"""`conservative verify` of files with a planted mistake, or none, whose answers are decided before it runs.

No right file is called wrong, no wrong file right, and no name is false. Of the mistakes that a file determines 99 of 100 are
named. `pytest` verifies the files of `QUICK`, `pytest --all` more, and `pytest --attack` the 1,000 of the page
`reports/documentation/planted_files.md`, whose rates have to be in the intervals of the page. An interrupted attack goes on
where it was, unless the code has changed. By hand:

    python -m tests.attack.planted results.jsonl 21000 22000 --page
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

QUICK = (2, 7, 13, 15, 17, 21, 25, 29, 30, 45, 53, 63, 67, 75, 89, 92, 96, 113, 116, 135, 142, 149, 154, 157, 163)
"""Seeds of quick files of many kinds."""
MORE = (
    0, 1, 3, 4, 8, 9, 10, 12, 14, 16, 19, 20, 22, 23, 27, 28, 31, 37, 41, 42, 46, 47, 51, 52, 54, 55, 57, 59,
    61, 62, 65, 68, 70, 77, 78, 80, 81, 82, 85, 88, 100, 103, 104, 108, 112, 122, 136, 137, 139, 145, 150, 153, 155, 158, 161,
    178,
)  # fmt: skip
"""Seeds of one file for each other mistake and layout."""


@pytest.mark.parametrize("seed", [*QUICK, *(pytest.param(seed, marks=pytest.mark.slow) for seed in MORE)])
def test_files_with_and_without_a_mistake_are_judged_as_was_decided(seed, tmp_path):
    row = run.outcome(seed, tmp_path)
    assert not row["complaint"], run.line_of(row)


def _attacked(cache):
    """Return the rows of the published seeds, or of others; they outlive an interrupted attack of the same code."""
    sources = sorted(
        path for root in (Path(verification.__file__).parent, Path(tables.__file__).parent) for path in root.rglob("*.py")
    )
    code = hashlib.sha256(b"".join(path.read_bytes() for path in sources)).hexdigest()[:12]
    first = tables.PUBLISHED.start if SEED == 1 else 1_000_000 * SEED
    return run.run_all(Path(cache.mkdir("planted")) / f"{code}.jsonl", range(first, first + count(len(tables.PUBLISHED))))


@pytest.mark.attack
def test_rates_of_errors_are_those_of_the_page(request):
    rows = _attacked(request.config.cache)
    _, page = tables.read_page(tables.PAGE.read_text(encoding="utf-8"))
    assert max(of for _, of in page.values()) == len(tables.PUBLISHED)
    worse = tables.compare(tables.rates(rows), page)
    assert not worse, "\n".join([*worse, *(run.line_of(row) for row in rows if row["complaint"])])


def test_the_page_is_of_this_generator():
    digest, rates = tables.read_page(tables.PAGE.read_text(encoding="utf-8"))
    assert digest == tables.generator(), "python -m tests.attack.planted results.jsonl 21000 22000 --page"
    assert rates.keys() == tables.rates([]).keys()


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


ROW = {
    "seed": 7, "kind": "scene", "mistake": "damping", "expected": "wrong", "identifiable": True, "reason": "", "same": [],
    "verdict": "wrong", "named": [["damping"]], "seconds": [0.1, 1.0], "scene": "free", "layout": "TUM", "noise": "none",
    "turns": 1.0, "rows": 40, "size": 100.0,
}  # fmt: skip


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({}, ""),
        ({"named": [["damping", "RK4"]]}, "false name"),
        ({"named": [["RK4"]]}, "false name"),
        ({"named": [["RK4"]], "same": ["RK4"]}, "not named"),
        ({"named": [["RK4"]], "same": ["RK4"], "identifiable": False}, ""),
        ({"named": [["RK4"], ["damping"]]}, ""),
        ({"named": []}, "not named"),
        ({"named": [], "identifiable": False}, ""),
        ({"verdict": "right", "named": []}, "wrong called right"),
        ({"verdict": "right", "named": [], "expected": ""}, "not named"),
        ({"expected": "right", "named": [], "identifiable": False}, "right called wrong"),
        ({"verdict": "undecided", "named": []}, "undecided"),
        ({"verdict": "refused", "named": []}, "refused"),
        ({"mistake": "without the rotor", "named": [["size of the rotor"]]}, ""),
    ],
)
def test_complaints(change, complaint):
    assert run.complaint(ROW | change) == complaint


def test_a_run_goes_on_where_it_was_and_prints_complaints(tmp_path, monkeypatch, capsys):
    asked = []

    def outcome(seed, folder):
        asked.append(seed)
        return ROW | {"seed": seed, "complaint": "not named" if seed == 3 else ""}

    monkeypatch.setattr(run, "outcome", outcome)
    path = tmp_path / "results.jsonl"
    assert [row["seed"] for row in run.run(path, [1, 2])] == [1, 2]
    assert [row["seed"] for row in run.run(path, [1, 2, 3])] == [3]
    assert asked == [1, 2, 3]
    assert capsys.readouterr().out.startswith("3 | not named | free; TUM")
    assert [row["seed"] for row in run.run_all(path, [3, 2], 1)] == [3, 2]


def test_page_has_the_rates_and_worse_ones_are_found(tmp_path):
    rows = [ROW | {"seed": i, "complaint": ""} for i in range(98)]
    rows += [
        ROW | {"seed": 98, "complaint": "not named", "named": []},
        ROW | {"seed": 99, "expected": "right", "complaint": ""},
    ]
    page = tmp_path / "page.md"
    page.write_text(f"before\n{tables.BEGIN}old\n{tables.END}after\n")
    tables.write_page(page, rows)
    text = page.read_text()
    assert text.startswith("before")
    assert text.endswith("after\n")
    digest, rates = tables.read_page(text)
    assert (digest, rates) == (tables.generator(), {name: x for name, x in tables.rates(rows).items() if x[1]})
    assert rates["identifiable mistakes that are named"] == (99, 100)
    assert not tables.compare(rates, rates)
    assert len(tables.compare(rates | {"right files called wrong": (2, 1)}, rates)) == 1
    assert len(tables.compare(rates | {"identifiable mistakes that are named": (90, 100)}, rates)) == 1
    assert not tables.compare(rates | {"identifiable mistakes that are named": (98, 100)}, rates)


def test_every_mistake_layout_and_noise_is_planted():
    chosen = [files.choose(worlds.Draw(seed)) for seed in tables.PUBLISHED]
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
