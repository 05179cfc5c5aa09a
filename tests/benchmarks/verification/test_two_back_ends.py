"""Two back ends: the wrong one is named with its mistake, right ones are not accused, and settings are swept."""

import ast
import copy
import json
import runpy
import shlex
import sys
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from click.testing import CliRunner

import conservative as cv
from conservative.benchmarks.verification import BackEnd, parity
from conservative.benchmarks.verification.back_ends import find
from conservative.benchmarks.verification.motions.motion import load
from conservative.benchmarks.verification.motions.own import motion_of
from conservative.benchmarks.verification.sweep import Limit, Series, measured_order, sentences
from conservative.errors import BadInput, MissingEngine
from conservative.number_text import number, rounded_up
from conservative.references.worker.client import close_workers
from conservative.reports.cli.main import main

from ...pages import ROOT
from ...sampling import sampled
from . import planted_pairs, right_programs, wrong_programs

FEW = ("brick_flip", "golden_0", "products", "world_tensor", "half_turn", "golden_9", "stale_rates")
"""Free motions, of which three or more show a mistake."""
PAIRS = planted_pairs.pairs()
SMALL = ["brick_flip"]


@pytest.fixture(autouse=True)
def home(tmp_path, monkeypatch):
    for name in ("CONFIG", "CACHE"):
        monkeypatch.setenv(f"XDG_{name}_HOME", str(tmp_path / name))
    yield
    close_workers()


def midpoint(R0, w0, inertia, dt, n, gyroscopic=1.0, substeps=1, axes="body"):
    """Midpoint steps of the rates; the attitude turns by the rates in the middle of the step."""
    R, w, h = [R0], [w0], dt / substeps

    def change(w):
        return np.linalg.solve(inertia, gyroscopic * np.cross(inertia @ w, w))

    for _ in range(n):
        Q, v = R[-1], w[-1]
        for _ in range(substeps):
            middle = v + h / 2 * change(v)
            Q, v = Q @ turn(h * middle), v + h * change(middle)
        R.append(Q)
        w.append(v)
    R, w = np.array(R), np.array(w)
    return R, np.einsum("nij,nj->ni", R, w) if axes == "world" else w


def euler(R0, w0, inertia, dt, n):
    """Euler steps of the rates and of the attitude, order 1."""
    R, w = [R0], [w0]
    for _ in range(n):
        R.append(R[-1] @ turn(dt * w[-1]))
        w.append(w[-1] + dt * np.linalg.solve(inertia, np.cross(inertia @ w[-1], w[-1])))
    return np.array(R), np.array(w)


def turn(v):
    angle = np.linalg.norm(v)
    x, y, z = v / angle
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


without = partial(midpoint, gyroscopic=0.0)


def verdicts(found):
    return str(found.details.first.verdict), str(found.details.second.verdict)


def keys(verification):
    return {cause.key for finding in verification.findings for cause in finding.causes}


KEPT = ("one: damping 0.02", "one: inertia in world axes", "same: no gyroscopic term")
"""Pairs of the default run beside the sample: a small error, products of inertia, and both wrong by one mistake."""


@pytest.mark.parametrize("name", sampled(PAIRS, 6, keep=KEPT))
def test_planted_pairs(name):
    """Of 60 pairs, 40 with one wrong, 10 with both wrong and 10 with both right, none is judged wrongly."""
    a, b, *planted = PAIRS[name]
    found = parity(planted_pairs.back_end(a, "a"), planted_pairs.back_end(copy.copy(b), "b"))
    assert verdicts(found) == tuple("wrong" if key else "right" for key in planted), found.sentence
    for key, side in zip(planted, (found.details.first, found.details.second), strict=True):
        assert not key or key in keys(side) or key == "explicit Euler", found.sentence  # an order has no mistake


def test_the_planted_pairs_are_sixty():
    kinds = [name.partition(":")[0] for name in PAIRS]
    assert {kind: kinds.count(kind) for kind in kinds} == {"one": 40, "both": 7, "same": 3, "right": 10}


SENTENCES = {
    "one is wrong": (midpoint, without, "without is wrong: the gyroscopic term is missing"),
    "the other one is wrong": (without, midpoint, "without is wrong: the gyroscopic term is missing"),
    "both are right": (midpoint, "no_squish", "both are right and differ by at most "),
    "different mistakes": (without, partial(midpoint, axes="world"), "both are wrong by different mistakes. a: "),
    "the same mistake": (without, partial(without, substeps=2), "they agree with each other ("),
}


@pytest.mark.parametrize("name", SENTENCES)
def test_the_first_sentence_says_which_is_wrong(name):
    a, b, start = SENTENCES[name]
    names = ("without" if one is without and name.endswith("wrong") else letter for one, letter in ((a, "a"), (b, "b")))
    ends = [one if isinstance(one, str) else BackEnd(one, label) for one, label in zip((a, b), names, strict=True)]
    found = parity(*ends, motions=FEW, only=["motions", "parity"])
    assert found.reason.startswith(start), found.reason
    assert ("wrong by the same mistake: the gyroscopic term is missing" in found.reason) == (name == "the same mistake")
    right = name == "both are right"
    assert found.verdict == ("right" if right else "wrong")
    between = [finding.verdict for finding in found.findings if finding.check == "parity"]
    assert len(between) == len(FEW)
    assert ("wrong" in between) == (name not in ("both are right", "the same mistake"))


def test_world_rates_are_an_option_of_a_back_end():
    """The same rates in world axes are right if they are declared, measured 2e-15, and named if they are not."""
    world = partial(midpoint, axes="world")
    right = parity(BackEnd(midpoint, "a"), BackEnd(world, "b", rates="world"), motions=SMALL, only="motions")
    assert right.verdict == "right"
    assert right.details.difference.error[0] < 1e-12
    wrong = parity(BackEnd(midpoint, "a"), BackEnd(world, "b"), motions=FEW, only="motions")
    assert keys(wrong.details.second) == {"world rates"}


@pytest.mark.parametrize("part", ["R", "w", "(R, None)", "(None, w)"])
def test_a_back_end_may_return_attitudes_or_rates_alone(part):
    def some(*given):
        R, w = midpoint(*given)
        return {"R": R, "w": w, "(R, None)": (R, None), "(None, w)": (None, w)}[part]

    for gyroscopic, verdict in ((1.0, "right"), (0.0, "wrong")):
        found = parity(partial(midpoint, gyroscopic=gyroscopic), some, motions=FEW)
        assert verdicts(found) == (verdict, "right"), found.sentence
        missing = "rates" if "R" in part else "attitudes"
        assert any(f"it returns no {missing}" in note for note in found.notes)
    other = parity(lambda *given: midpoint(*given)[0], lambda *given: midpoint(*given)[1], motions=SMALL)
    assert [row.between.detail for row in other.details.table] == ["one has attitudes, the other one rates"]
    assert "not compared with each other" in other.reason


def test_order_and_precision_are_measured():
    motions = [motion for motion in load() if motion.name in FEW]
    rk4 = right_programs.right_programs()["RK4, quaternion, rates, never normalised"]
    of_order_4 = partial(planted_pairs.simulate, rk4)
    for function, order in ((euler, 1), (midpoint, 2), (without, None), (of_order_4, 4)):
        assert measured_order(find(function, "a"), motions).order == order
    single = parity(midpoint, lambda *given: tuple(x.astype(np.float32) for x in midpoint(*given)), motions=FEW)
    assert verdicts(single) == ("right", "right")
    assert any("single precision" in note for note in single.notes)


SMALL_MOTIONS = [motion for motion in load() if motion.name in SMALL]


def failing_later():
    calls = iter(range(10**6))

    def fail(*given):
        if next(calls):
            raise RuntimeError("lost")
        return midpoint(*given)

    return fail


def not_a_number(*given, rows=slice(None)):
    R, w = midpoint(*given)
    R[rows], w[rows] = np.nan, np.nan
    return R, w


@pytest.mark.parametrize("function", [not_a_number, partial(not_a_number, rows=slice(-3, None)), failing_later()])
def test_an_order_of_runs_that_fail_is_not_measured(function):
    measured = measured_order(find(function, "a"), SMALL_MOTIONS)
    assert measured.order is None
    assert "no two of its runs" in measured.reason


def test_an_order_below_single_precision_is_not_measured():
    rk4 = partial(planted_pairs.simulate, right_programs.right_programs()["RK4, quaternion, rates, never normalised"])
    single = replace(find(lambda *given: tuple(x.astype(np.float32) for x in rk4(*given)), "a"), single=True)
    measured = measured_order(single, SMALL_MOTIONS)
    assert measured.order is None
    assert "less than" in measured.reason


def test_right_ones_on_motions_that_cannot_show_a_mistake_have_a_note():
    """brick_flip has no products of inertia, so that a function without them is right there."""

    def diagonal(R0, w0, inertia, dt, n):
        return midpoint(R0, w0, np.diag(np.diag(inertia)), dt, n)

    found = parity(midpoint, diagonal, motions=SMALL, only=["motions", "parity"])
    assert verdicts(found) == ("right", "right")
    assert any("the products of inertia are dropped" in note for note in found.notes)
    assert not any("the gyroscopic term is missing" in note for note in found.notes)
    found = parity(midpoint, BackEnd(midpoint, "again", rates="body", order=2), motions=[*SMALL, "products"], only="motions")
    assert verdicts(found) == ("right", "right")
    assert not any("the products of inertia are dropped" in note for note in found.notes)


def test_progress_advances_with_the_motions():
    """Each motion of each back end is a piece."""
    shares = []
    parity(midpoint, euler, motions=["brick_flip", "golden_0"], tell=lambda share, what: shares.append(share))
    assert shares == sorted(shares)
    assert len({share for share in shares if share < 0.4}) >= 2
    assert shares[-1] <= 1


def test_the_sweep_says_who_converges_to_what():
    """Measured orders: 1.99 and 1.01. Euler steps agree with midpoint steps to 1e-3 rad at 1/8 of the first step."""
    found = parity(euler, midpoint, motions=SMALL)
    sweep = found.details.sweep
    assert (sweep.first.limit, sweep.second.limit) == (Limit.EXACT, Limit.EXACT)
    assert sweep.first.order.slope == pytest.approx(1, abs=0.1)
    assert sweep.second.order.slope == pytest.approx(2, abs=0.1)
    assert sweep.steps.agree(1e-3) is not None
    assert sweep.steps.agree(1e-6) is None
    texts = sentences("a", "b", sweep)
    assert [text.partition(" with order ")[0] for text in texts[:2]] == [
        "a converges to the exact motion",
        "b converges to the exact motion",
    ]
    both = parity(without, partial(without, substeps=2), motions=SMALL).details.sweep
    assert (both.first.limit, both.second.limit) == (Limit.OTHER, Limit.OTHER)
    assert any(text.startswith("both converge to each other") for text in sentences("a", "b", both))


def test_a_lower_order_than_declared_is_wrong():
    found = parity(BackEnd(euler, "a", order=2), BackEnd(midpoint, "b", order=2), motions=SMALL, only="order")
    assert verdicts(found) == ("wrong", "right")
    assert "order 2 was declared" in found.reason


def test_settings_are_swept():
    """Substeps of the first step halve the error of order 2 by four; measured 2.0e-5 to 3.2e-7 rad."""
    substeps = BackEnd(midpoint, "a", settings={"substeps": (1, 2, 4, 8)})
    series = parity(substeps, "no_squish", motions=SMALL, only="order").details.sweep.series
    (swept,) = (one for one in series if one.setting == "substeps")
    ratios = [a / b for a, b in zip(swept.first, swept.first[1:], strict=False)]
    assert ratios == pytest.approx([4, 4, 4], rel=0.1)
    assert len(set(swept.second)) == 1
    tolerances = parity("scipy", "no_squish", motions=SMALL, only="order").details.sweep.series
    assert {one.setting for one in tolerances} == {"step", "rtol"}


def test_settings_agree_from_the_coarsest_value_on():
    series = Series("step", "", (4, 2, 1), (0.0,) * 3, (0.0,) * 3, (1e-4, 1e-2, 1e-5))
    assert (series.agree(1e-3), series.agree(0.1), series.agree(1e-6)) == (1, 4, None)


def test_a_body_of_the_user_is_one_more_motion():
    scene = cv.scenes.brick_flip()
    found = parity(midpoint, without, motions=(), body=scene)
    (row,) = found.details.table
    assert row.motion == found.details.sweep.motion == found.details.curves.motion == "body brick_flip"
    assert verdicts(found) == ("right", "wrong")
    motion = motion_of(scene)
    assert motion.t[-1] * 10 <= 10.5  # 10 rad/s
    assert np.allclose(motion.scene.body.inertia, scene.body.inertia)
    named = parity(midpoint, without, motions=(), body="brick_flip", only="motions")
    assert named.details.table[0].first.error == row.first.error


def test_a_body_with_a_weight_goes_to_engines_alone():
    found = parity("no_squish", "projected", motions=(), body="lagrange_top", only="motions")
    assert verdicts(found) == ("right", "right")
    function = parity(midpoint, "no_squish", motions=SMALL, body="lagrange_top", only="motions")
    assert "a free body, without uniform gravity" in function.details.table[0].first.detail


def fails(*given):
    raise ZeroDivisionError("no mass")


def fails_later(R0, w0, inertia, dt, n):
    if np.allclose(inertia, np.diag([13, 5, 10])):
        return midpoint(R0, w0, inertia, dt, n)
    raise ZeroDivisionError("no mass")


def of(change):
    return lambda *given: change(*midpoint(*given))


BAD = {
    "raises": (fails, "raised ZeroDivisionError: no mass in the motion brick_flip"),
    "n samples": (of(lambda R, w: (R[1:], w[1:])), "R of shape (10, 3, 3) for n = 10; expected 11 of them"),
    "quaternions": (of(lambda R, w: (np.zeros((len(w), 4)), w)), "from_quat(q, scalar_first=True)"),
    "one state": (of(lambda R, w: (R[-1], w[-1])), "R of shape (3, 3) for n = 10"),
    "nothing": (lambda *given: None, "got None; expected (R, w)"),
    "neither": (lambda *given: (None, None), "got (None, None); expected (R, w)"),
    "a dictionary": (of(lambda R, w: {"R": R}), "expected (R, w)"),
    "three parts": (of(lambda R, w: (R, w, w)), "expected (R, w)"),
    "texts": (lambda *given: ("R", "w"), "got 'R'; expected (R, w)"),
    "other arguments": (lambda scene: scene, "raised TypeError"),
    "world rates alone": (BackEnd(of(lambda R, w: w), "b", rates="world"), "rates in world axes without attitudes"),
    "a number": (3, "b: got 3; expected a function simulate(R0, w0, inertia, dt, n)"),
    "a class": (Series, "expected a function simulate(R0, w0, inertia, dt, n)"),
    "the same": (midpoint, "got the first back end again"),
    "a file": (__file__, "expected an engine, a method or a program"),
    "a name": ("no such engine", "expected a file that exists, the name of an engine"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_back_ends_are_refused_by_name(name):
    bad, message = BAD[name]
    with pytest.raises(BadInput) as refused:
        parity(midpoint, bad, motions=SMALL)
    assert message in str(refused.value)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"motions": ["none"]}, "motions: got 'none'; expected names of motions: brick_flip"),
        ({"motions": ()}, "motions: got no motion"),
        ({"only": "pairs"}, "only: got 'pairs'; expected checks of two back ends: motions, order, parity"),
        ({"seed": -1}, "seed: got -1"),
        ({"seed": 1, "known": "known.txt"}, "seed: got 1 and known errors"),
        ({"body": "no_such_scene"}, "no_such_scene"),
        ({"body": "stable_satellite"}, "expected a free body, a rotor, uniform gravity"),
    ],
)
def test_bad_options_are_refused_by_name(options, message):
    with pytest.raises(BadInput) as refused:
        parity(midpoint, "no_squish", **options)
    assert message in str(refused.value)


@pytest.mark.parametrize(
    ("options", "argument"),
    [
        ({"order": 5}, "order"),
        ({"order": True}, "order"),
        ({"rates": "local"}, "rates"),
        ({"precision": "half"}, "precision"),
        ({"settings": {"substeps": 3}}, "settings"),
        ({"settings": ["substeps"]}, "settings"),
        ({"name": "two\nlines"}, "name"),
        ({"simulate": "mujoco"}, "simulate"),
    ],
)
def test_bad_options_of_a_back_end_are_refused_by_name(options, argument):
    with pytest.raises(BadInput) as refused:
        BackEnd(**{"simulate": midpoint, **options})
    assert refused.value.argument == argument


def test_one_name_twice_and_a_missing_engine_are_refused():
    with pytest.raises(BadInput, match="the first back end again"):
        parity("no_squish", "no_squish")
    with pytest.raises(BadInput, match="the first back end again"):
        parity("mujoco", "mujoco:RK4")  # its default setting
    with pytest.raises(MissingEngine):
        parity("no_squish", "exudyn@1.0.0")


def test_a_function_that_fails_later_or_is_not_finite_is_wrong():
    found = parity(midpoint, fails_later, motions=["brick_flip", "products"], only=["motions", "parity"])
    assert verdicts(found) == ("right", "wrong")
    assert "the run ended early: crashed (ZeroDivisionError: no mass)" in found.sentence
    assert [row.between.verdict for row in found.details.table] == ["right", "not tested"]
    nan = parity(midpoint, of(lambda R, w: (R * np.nan, w)), motions=SMALL)
    assert "samples are not finite" in nan.sentence


def test_a_body_that_a_function_does_not_support_is_not_tested():
    def principal(R0, w0, inertia, dt, n):
        if np.abs(inertia - np.diag(np.diag(inertia))).max() > 0:
            raise NotImplementedError("principal axes only")
        return midpoint(R0, w0, inertia, dt, n)

    found = parity(midpoint, principal, motions=["brick_flip", "products"])
    assert verdicts(found) == ("right", "right")
    assert [row.second.verdict for row in found.details.table] == ["right", "not tested"]
    assert "principal axes only" in found.details.table[1].second.detail
    first = parity(midpoint, principal, motions=["products", "brick_flip"])
    assert [row.second.verdict for row in first.details.table] == ["not tested", "right"]
    none = parity(midpoint, principal, motions=["products"])
    assert verdicts(none) == ("right", "not tested")
    assert "not compared with each other" in none.reason or "is not tested" in none.reason


def test_a_program_that_does_not_run_is_wrong(tmp_path):
    file = tmp_path / "silent.py"
    file.write_text("")
    found = parity(shlex.join([sys.executable, str(file)]), midpoint, motions=SMALL)
    assert verdicts(found) == ("wrong", "right")
    assert "silent.py is wrong: " in found.reason


def test_fresh_motions_and_engines():
    """MuJoCo and Pinocchio with Runge and Kutta's steps; measured 2e-11 rad apart."""
    found = parity("mujoco:RK4", "pinocchio", seed=7, only=["motions", "parity"])
    assert found.verdict == "right"
    assert found.details.difference.error[0] < 1e-9


def test_engines_get_principal_axes_and_are_compared_in_body_axes():
    """Bodies with products of inertia; measured 4.7e-7 rad apart, and 1.8 rad in different axes."""
    found = parity(midpoint, "mujoco:RK4", motions=["products", "world_tensor"])
    assert verdicts(found) == ("right", "right")
    assert found.details.difference.error[0] < 1e-5
    assert found.details.sweep.steps.between[-1] < 1e-5


def program(name):
    return shlex.join([sys.executable, str(wrong_programs.__file__), name])


def invoke(*words):
    return CliRunner(env={"COLUMNS": "200"}).invoke(main, ["verify", *map(str, words)])


def test_the_command_compares_two_subjects(tmp_path):
    """A program without a gyroscopic term against an engine, with every output."""
    out = tmp_path / "out"
    done = invoke(program("no gyroscopic term"), "pinocchio", "--pairs", "--out", out, "--junit", tmp_path / "v.xml", "--json")
    assert done.exit_code == 1, done.output
    result = json.loads(done.stdout)
    assert result["verdict"] == "wrong"
    sentence = result["subjects"][0]["sentence"]
    assert sentence.startswith("wrong: ")
    assert "no gyroscopic term is wrong" in sentence.replace("'", "")
    assert "pinocchio is right" in sentence
    assert result["subjects"][0]["details"]["sweep"]["second"]["limit"] == "the exact motion"
    written = {path.name for path in out.iterdir()}
    assert written == {"verify.md", "verify.json", "verify.csv", "errors.csv", "errors.svg"}
    rows = (out / "errors.csv").read_text().splitlines()
    assert rows[0] == "t,quantity,value"
    assert sum("difference between them" in row for row in rows) >= 10
    assert "first against second" in (out / "verify.md").read_text()
    junit = (tmp_path / "v.xml").read_text()
    assert 'name="parity: brick_flip"' in junit
    assert junit.count('name="motions: brick_flip"') == 2


def test_known_errors_of_two_back_ends(tmp_path):
    known = tmp_path / "known.txt"
    recorded = parity(BackEnd(without, "a"), BackEnd(midpoint, "b"), motions=FEW, record=known)
    assert recorded.exit_code == 0
    assert "\norder," not in known.read_text()  # of which of the two?
    again = parity(BackEnd(without, "a"), BackEnd(midpoint, "b"), motions=FEW, known=known)
    assert (again.verdict, again.exit_code, again.new) == ("wrong", 0, [])
    worse = parity(BackEnd(without, "a"), BackEnd(partial(without), "b"), motions=FEW, known=known)
    assert worse.exit_code == 1
    assert {finding.subject for finding in worse.new} == {"b"}


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("no_squish", "projected", "reduced", "--pairs"), "3 subjects (no_squish, projected, reduced)"),
        (("no_squish", "--pairs"), "1 subjects (no_squish)"),
        (("no_squish", "--pairs", "projected"), "two subjects go before it: conservative verify projected OTHER --pairs"),
        (("no_squish", "no_squish", "--pairs"), "the first back end again"),
        (
            ("no_squish", "projected", "--pairs", "--scripts", "scripts"),
            "--scripts, which two subjects with --pairs do not use",
        ),
        (("no_squish", "projected", "--pairs", "--euler", "zyx"), "--euler, which two subjects with --pairs do not use"),
        (("no_squish", "projected", "--pairs", "--only", "pairs"), "checks of two back ends: motions, order, parity"),
        (("no_squish", "projected", "--picture", "a.svg"), "--picture, which none of the subjects uses"),
        (("no_squish", "projected", "--pairs", "--pairs=mass"), "--pairs without names and with names"),
    ],
)
def test_the_command_refuses_by_name(words, message):
    done = invoke(*words)
    assert done.exit_code == 2
    assert message in done.output.replace("\n", " ")


EXAMPLES = ROOT / "references" / "for_engine_authors" / "two_back_ends"
PAGE = ROOT / "reports" / "documentation" / "two_back_ends.md"


def example(name):
    """Return the names of an example."""
    return runpy.run_path(str(EXAMPLES / f"{name}.py"))


def quoted():
    """Return the sentences that the page quotes."""
    lines = PAGE.read_text(encoding="utf-8").splitlines()
    return "\n".join(line.removeprefix("> ") if line.startswith("> ") else "" for line in lines).replace("\n", " ")


@pytest.mark.parametrize(
    ("name", "functions", "rates", "right", "mistake"),
    [
        ("environment", ("environment", "wrapper"), "body", "environment", "world rates"),
        ("unisim", ("first", "second"), "world", "first", "body rates"),
    ],
)
def test_examples_are_judged_as_the_page_says(name, functions, rates, right, mistake):
    made = example(name)
    found = parity(*(BackEnd(made[each], rates=rates) for each in functions), only=["motions", "parity"])
    assert found.reason in quoted()
    assert [side.subject for side in (found.details.first, found.details.second) if side.verdict == "right"] == [right]
    if mistake == "world rates":
        declared = parity(made[functions[0]], BackEnd(made[functions[1]], rates="world"), motions=FEW, only="motions")
        assert declared.verdict == "right"


def test_basilisk_is_judged_as_the_page_says():
    pytest.importorskip("Basilisk")
    made = example("basilisk")
    found = parity(made["hub"], made["scene"])
    assert verdicts(found) == ("right", "wrong")
    assert [finding.case for finding in found.details.second.findings if finding.verdict == "wrong"] == ["tiny_turned"]
    orders = [side.order.slope for side in (found.details.sweep.first, found.details.sweep.second)]
    assert orders == pytest.approx([4, 2], abs=0.1)


@pytest.mark.slow
def test_two_versions_are_judged_as_the_page_says(monkeypatch):
    monkeypatch.undo()  # the environments of this machine
    try:
        found = parity("mujoco@3.6.0", "mujoco@4.0.0")
    except MissingEngine as missing:
        pytest.skip(str(missing))
    assert verdicts(found) == ("wrong", "right")
    orders = [side.order.slope for side in (found.details.sweep.first, found.details.sweep.second)]
    assert orders == pytest.approx([2, 4], abs=0.1)


def test_a_back_end_is_ten_lines():
    """Most is 10 lines, docstring included. Basilisk's simulation around hub and scene takes more, once for both."""
    of = {"environment": ("environment", "wrapper", "run"), "unisim": ("first", "second", "run"), "basilisk": ("hub", "scene")}
    for file, functions in of.items():
        tree = ast.parse((EXAMPLES / f"{file}.py").read_text(encoding="utf-8"))
        nodes = {node.name: node for node in tree.body if isinstance(node, ast.FunctionDef)}
        assert all(nodes[name].end_lineno - nodes[name].lineno + 1 <= 10 for name in functions)


def test_the_sweep_of_the_page_is_measured():
    """The numbers of the page, with their two digits; those below 1e-13 rad are round-off."""
    found = parity("mujoco:RK4", "mujoco:implicitfast", motions=(), body="brick_flip")
    steps, page = found.details.sweep.steps, PAGE.read_text(encoding="utf-8")
    rows = [line.strip("| ").split(" | ") for line in page.splitlines() if line.startswith("| ") and line[2].isdigit()]
    assert len(rows) == len(steps.values)
    for row, step, *errors in zip(rows, steps.values, steps.first, steps.second, steps.between, strict=True):
        assert float(row[0]) == pytest.approx(1e3 * step, rel=0.01)
        for text, error in zip(row[1:], errors, strict=True):
            assert error < 1e-13 if "below" in text else float(text) == pytest.approx(rounded_up(error, 2), rel=0.03)
    assert f"{number(steps.agree(1e-3) * 1e3)} ms" in page
    assert steps.agree(1e-6) is None
    picture = (ROOT / "reports" / "pictures" / "two_back_ends.svg").read_text(encoding="utf-8")
    assert all(row["quantity"] in picture for row in found.details.rows())


def test_parity_alone_says_that_nothing_is_compared_with_the_exact_motion():
    found = cv.verification.parity("reduced", "taylor", motions=["golden_0"], only="parity")
    assert "neither is compared with the exact motion" in found.sentence
    assert "not tested" not in found.sentence
    assert {finding.check for finding in found.findings} == {"parity"}
