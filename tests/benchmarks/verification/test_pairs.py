"""Pairs of descriptions: right programs and methods move both equally, and each planted difference is found and reduced.

The planted engines are `reduced` with one fault.
"""

import ast
import json
import re
import shlex
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import conservative as cv
from conservative import registry
from conservative.attitude import from_quaternion, rotation_about
from conservative.benchmarks.verification.finding import Verdict
from conservative.benchmarks.verification.pairs import runner as runs
from conservative.benchmarks.verification.pairs import verify
from conservative.benchmarks.verification.pairs.pairs import PAIRS, TURNED, WRAPPED, to_principal
from conservative.benchmarks.verification.pairs.runner import Digits, EngineRunner, Runner, find_digits, runner_of
from conservative.benchmarks.verification.pairs.script import FOLDER, MARK, script_name, script_of
from conservative.benchmarks.verification.pairs.verify import (
    BODIES,
    BODY,
    VERDICTS,
    Engine,
    Relation,
    difference,
    select_pairs,
    verify_pairs,
)
from conservative.errors import BadInput
from conservative.programs import Program
from conservative.references.environments.catalogue import __getattr__ as adapter
from conservative.references.environments.programs import program_class
from conservative.references.worker.client import EngineCrashed
from conservative.reports.cli.main import main

from .right_programs import right_programs

BY_NAME = {pair.name: pair for pair in PAIRS}
SLOW = ("exact", "reduced", "taylor", "heyoka")
METHODS = ("mujoco:RK4", *(pytest.param(name, marks=pytest.mark.slow) for name in SLOW))
FIRST = ("midpoint, quaternion, world momentum", "RK4, quaternion, rates, single")
PROGRAMS = [pytest.param(name, marks=() if name in FIRST else pytest.mark.slow) for name in right_programs()]
VARIANTS = {pair.variant for pair in PAIRS} - {"", "quaternion", "zero"}


def conservative(*arguments):
    return CliRunner(env={"COLUMNS": "200"}).invoke(main, [str(argument) for argument in arguments])


def program(tmp_path, *words):
    """Return the method of a program."""
    line = shlex.join(map(str, words))
    return program_class(Program("trial", tmp_path / "conservative.toml", line))()


SIX_DIGITS = "mujoco", "file loaded and saved"
"""MuJoCo writes XML files with six digits: `test_mujoco_saves_six_digits`."""


def check_right(method, least):
    """Check that no pair differs, and that the differences leave a margin."""
    found = [each for each in verify_pairs(method) if (method.family, each.pair) != SIX_DIGITS]
    assert [(each.case, each.detail) for each in found if each.verdict in (Verdict.WRONG, Verdict.UNDECIDED)] == []
    assert sum(each.verdict is Verdict.RIGHT for each in found) >= least
    assert max(each.factor for each in found if each.relation is Relation.EQUAL) < 0.5  # measured at most 0.09


@pytest.mark.parametrize("name", METHODS)
def test_methods_that_are_right(name):
    check_right(registry.method(name), 18)  # measured 20 to 69


@pytest.mark.parametrize("name", PROGRAMS)
def test_programs_that_are_right(name, tmp_path):
    """Case 42 and the other designs: those with a step that is not invariant have "the same limit"."""
    check_right(program(tmp_path, sys.executable, Path(__file__).with_name("right_programs.py"), name), 32)  # all that run


@pytest.mark.skipif(not shutil.which("gcc"), reason="needs gcc")
@pytest.mark.parametrize("option", ["-DDOUBLE", "-DSINGLE"])
def test_our_guide_s_program_is_right(option, tmp_path):
    """It differed in 19 of 35 pairs: 18 had NaN moments, and one a moment of 0."""
    source = Path(cv.__file__).parents[1] / "references/for_engine_authors/program.c"
    subprocess.run(["gcc", "-O2", option, source, "-o", tmp_path / "program", "-lm"], check=True)
    check_right(program(tmp_path, tmp_path / "program"), 32)


class Noted(Runner):
    """Bodies with constant rates, which depend on the description, so that pairs are reduced; it keeps all requests."""

    def __init__(self, requests, fault):
        super().__init__(registry.method("reduced"))
        self.requests, self.fault = requests, fault

    def has(self, variant):
        return True

    def unsupported(self, one):
        return None

    def apart(self, one):
        return self.model(one)()

    def model(self, one):
        self.requests.append(one.numbers)
        fault, n = self.fault * np.sin(one.R0[0, 0] + one.inertia.max() + one.dt + len(one.variant)), one.grid.n_samples
        return lambda: (np.tile(one.R0, (n, 1, 1)), np.tile(one.w0 * (1 + fault), (n, 1)))

    def many(self, bodies, number):
        self.requests += [body.numbers for body in bodies]
        return self.model(bodies[number])()


def check_request(given):
    """Check numbers of a request as PROTOCOL.md describes them."""
    J, arm, free = np.asarray(given["inertia_com"]), given["com"], given["free"]
    scale, description = np.abs(J).max(), given.get("description", "")
    assert all(np.isfinite(value).all() for value in given.values() if not isinstance(value, str))
    assert given["mass"] > 0
    assert given["dt"] > 0
    assert given["steps"][0] == 0
    assert given["steps"][-1] == given["n_steps"] >= 1
    np.testing.assert_allclose(np.linalg.norm(given["q0"]), 1, rtol=1e-14)
    np.testing.assert_allclose(from_quaternion(given["q0"]), given["R0"], atol=4e-15)
    np.testing.assert_allclose(given["R0"] @ given["R0"].T, np.eye(3), atol=4e-15)
    np.testing.assert_allclose(given["w0_W"], given["R0"] @ given["w0"], rtol=1e-12)
    np.testing.assert_allclose(given["x0"], given["R0"] @ arm, rtol=1e-12)
    np.testing.assert_allclose(given["v0"], np.cross(given["w0_W"], given["x0"]), rtol=1e-12)
    axes = from_quaternion(given["q_com"])
    np.testing.assert_allclose(axes @ np.diag(given["moments_com"]) @ axes.T, J, atol=1e-14 * scale)
    if description != "zero":
        assert min(given["moments"]) > 0
        assert max(given["moments_com"]) <= (1 + 1e-12) * sum(given["moments_com"]) / 2
    if description not in ("offset",):
        assert ("p_WB0" in given) == ("v_WB0" in given) == (free and arm.any())
    if not free:
        J = J + given["mass"] * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    elif description != "offset":
        assert not arm.any()
        assert given["gravity"] == 0
    about = np.diag(np.diag(J)) if description in TURNED else J
    np.testing.assert_allclose(np.diag(given["moments"]), about, atol=1e-9 * np.abs(J).max())


def test_requests_are_as_protocol_md_promises(monkeypatch):
    """Of every pair and body, all trials of a reduction, and of bodies with any centre and axes."""
    requests, random = [], np.random.default_rng(3)
    for fault, names in ((0.0, ()), (1e-3, ("turned world", "length x 10^k"))):
        monkeypatch.setattr(verify, "runner_of", lambda method, fault=fault: Noted(requests, fault))
        found = [each.verdict for each in verify_pairs(registry.method("reduced"), names)]
        assert found.count(Verdict.WRONG) == (4 if fault else 0)
    for _ in range(10):
        R, com = rotation_about(random.normal(size=3), random.uniform(0, 3)), random.normal(size=3)
        one = replace(BODY, inertia=R @ BODY.inertia @ R.T, com=com, gravity=random.uniform(1, 9))
        one, _ = to_principal(one)
        requests += [pair.second(one, *pair.scales[:1]).numbers for pair in PAIRS if "top" in pair.bodies]
    for request in requests:
        check_request(request)
    assert len(requests) > 1000


def test_every_pair_has_a_body_and_every_description_of_an_adapter_a_pair():
    """A pair or a description without the other would never be tried, and a relation without a verdict never shown."""
    assert {body for pair in PAIRS for body in pair.bodies} == set(BODIES)
    declared = {description for name in registry.list_engines() for description in adapter(name).data.descriptions}
    assert declared <= VARIANTS
    assert VARIANTS - declared == {"accelerator"}
    assert len(PAIRS) == len(BY_NAME) >= 20
    assert set(VERDICTS) == set(Relation)


def test_maps_between_descriptions_are_those_of_the_exact_solution():
    """A wrong map would call an engine wrong that is right; the exact solution is independent of all adapters."""
    engine = Engine(runner_of(registry.method("exact")))
    samples = engine.first(BODY).samples
    for pair in PAIRS:
        for scale in pair.scales or (None,) if pair.variant in ("", "frame") and not pair.run else ():
            scales = () if scale is None else (scale,)
            second = pair.second(BODY, *scales)
            assert difference(samples, pair.back(engine.runner.model(second)(), *scales)) < 5e-15, pair.name  # measured 7e-16


class Planted(Runner):
    """`reduced` with a fault: `change` gives another description, and `crash` says which of them end the engine."""

    def __init__(self, change=lambda one: one, variants=("frame", "zero"), batch=0.0, memory=0.0, crash=lambda one: False):
        super().__init__(registry.method("reduced"))
        self.change, self.variants, self.batch, self.memory, self.crash = change, variants, batch, memory, crash
        self.runs = 0

    def has(self, variant):
        return variant in self.variants

    def model(self, one):
        if self.crash(one):
            raise EngineCrashed("segmentation fault")
        run = super().model(self.change(one))

        def samples():
            self.runs += 1
            R, w = run()
            return R, w + self.memory * self.runs

        return samples

    def many(self, bodies, number):
        R, w = super().many(bodies, number)
        return R, w + self.batch * number


def verify_planted(monkeypatch, runner, *names):
    """Return the findings on a planted engine, by case."""
    monkeypatch.setattr(verify, "runner_of", lambda method: runner)
    return {pair.case: pair for pair in verify_pairs(registry.method("reduced"), names)}


def small_moments_count_as_zero(one):
    """As in LAMMPS until 2020: the body does not turn."""
    return one if one.inertia.max() > 2.1e-6 else replace(one, w0=0 * one.w0, inertia=BODY.inertia)


def inertia_in_other_axes(one):
    """The products of inertia are ignored."""
    return replace(one, inertia=np.diag(np.diag(one.inertia)))


def rates_are_limited(one):
    return replace(one, w0=one.w0 * min(1.0, 200.0 / np.linalg.norm(one.w0)))


def gravity_along_another_axis(one, size=1e-6):
    """A constant disturbs the attitude that is not turned with the world."""
    return replace(one, w0=one.w0 + size * one.R0[0])


def a_rate_without_moment_is_erased(one):
    kept = np.diag(one.inertia) > 0
    return replace(one, w0=one.w0 * kept, inertia=one.inertia + np.diag(np.where(kept, 0, 1e-3)))


PLANTED = {  # fault: (runner, pairs that have to differ, words)
    "small moments": (
        lambda: Planted(small_moments_count_as_zero),
        {"length x 2^k", "mass x 10^k"},
        "below moments of 1e-06",
    ),
    "products of inertia": (lambda: Planted(inertia_in_other_axes), {"another body frame"}, ""),
    "limited rates": (lambda: Planted(rates_are_limited), {"time x 2^k", "time x 10^k"}, "above 2e+02 rad/s"),
    "an axis of the world": (lambda: Planted(gravity_along_another_axis), {"turned world"}, ""),
    "a moment of 0": (
        lambda: Planted(a_rate_without_moment_is_erased),
        {"moment of 0 about the axis of rotation"},
        "not turned",
    ),
    "bodies of a batch": (lambda: Planted(batch=1e-6), {"body 3 of 7"}, ""),
    "memory": (lambda: Planted(memory=1e-15), {"run again"}, ""),
}


ALSO = {
    "memory": {"another body frame", "turned world", "time x 10^k"},
    "an axis of the world": {"time x 10^k"},  # the disturbance has a unit
}
"""Pairs in which a fault may show as well."""


@pytest.mark.parametrize("fault", PLANTED)
def test_planted_differences_are_found_and_reduced(fault, monkeypatch):
    runner, pairs, words = PLANTED[fault]
    names = {*pairs, "run again", "turned world", "another body frame", "length x 2^k", "time x 10^k"}
    found = verify_planted(monkeypatch, runner(), *names)
    wrong = {each.pair: each for each in reversed(found.values()) if each.verdict is Verdict.WRONG}
    assert pairs <= set(wrong)
    assert set(wrong) - pairs <= ALSO.get(fault, set())
    first = wrong[sorted(pairs)[0]]
    assert first.factor > 1
    assert first.first.n_steps <= 2
    assert first.request["n_steps"] == first.first.n_steps
    assert words in f"{first.threshold} {first.detail}"


class TwoSchemes(Planted):
    """Half the step for a body whose axes are not principal."""

    def model(self, one):
        if np.count_nonzero(one.inertia) == 3:
            return super().model(one)
        return super().model(replace(one, dt=one.dt / 2, n_steps=2 * one.n_steps, every=2 * one.every))


def test_differences_that_are_no_fault(monkeypatch):
    """A difference that falls with the step, and one far below the error of the step, as of an iteration with a tolerance."""
    found = verify_planted(monkeypatch, TwoSchemes(), "another body frame")["body: another body frame"]
    assert (found.relation, found.verdict) == (Relation.SAME_LIMIT, Verdict.RIGHT)
    assert 1e-6 < found.error < 1e-2  # measured 3e-5
    tiny = Planted(lambda one: gravity_along_another_axis(one, 1e-9))
    found = verify_planted(monkeypatch, tiny, "turned world")["body: turned world"]
    assert (found.relation, found.verdict, found.by) == (Relation.NEGLIGIBLE, Verdict.RIGHT, "order")


def _rounded(one, digits):
    """The body of a file with few digits, which has moments, and their axes as a quaternion, as MuJoCo writes them."""
    cut = np.vectorize(lambda value: float(f"{value:.{digits}g}"))
    q = cut(one.numbers["q_com"])
    axes = from_quaternion(q / np.linalg.norm(q))
    return replace(one, mass=cut(one.mass), com=cut(one.com), inertia=axes @ np.diag(cut(one.numbers["moments_com"])) @ axes.T)


def _changed(variant, change):
    """Return a planted engine with a mistake in one of the variants of descriptions by a file."""
    return Planted(lambda one: change(one) if one.variant == variant else one, ("frame", "zero", *WRAPPED))


OF_FILES = {  # fault: (variant, the body that the engine has, the mistake, bodies whose motion does not show it)
    "six digits": ("rewritten", lambda one: _rounded(one, 6), "saved digits", ()),
    "ten digits": ("rewritten", lambda one: _rounded(one, 10), "saved digits", ()),
    "axes": (
        "rewritten",
        lambda one: replace(one, inertia=np.diag(one.numbers["moments_com"])),
        "inertial frame not turned",
        (),
    ),
    "inertia as before": (
        "mass",
        lambda one: replace(one, inertia=2 * one.inertia),
        "inertia of the former mass",
        ("body",),
    ),
    "size": (
        "scaled",
        lambda one: replace(one, inertia=one.inertia / 4),
        "inertia of the former size",
        ("body",),
    ),
}
"""A factor of the whole inertia does not change the motion of a free body."""


@pytest.mark.parametrize("fault", OF_FILES)
def test_mistakes_of_engines_that_change_a_file_are_named(fault, monkeypatch):
    variant, change, mistake, unseen = OF_FILES[fault]
    monkeypatch.setattr(verify, "BODIES", {name: BODIES[name] for name in ("body", "top")})
    found = verify_planted(monkeypatch, _changed(variant, change), *WRAPPED.values())
    pair = WRAPPED[variant]
    wrong = {each.body for each in found.values() if each.verdict is Verdict.WRONG}
    assert {each.pair for each in found.values() if each.verdict is Verdict.WRONG} == {pair}
    assert wrong == {"body", "top"} - {*unseen}
    for body in wrong:
        causes = {cause.key: cause for cause in found[f"{body}: {pair}"].causes}
        assert mistake in causes, (body, causes)
        assert causes[mistake].left < 1e-3 * causes[mistake].of  # measured at most 2e-4, of ten digits
    named = found[f"top: {pair}"]
    assert named.mistake == mistake
    if mistake == "saved digits":
        assert named.causes[0].numbers["digits"] == {"six digits": 6, "ten digits": 10}[fault]


def test_an_engine_that_changes_files_as_it_should_is_right(monkeypatch):
    found = verify_planted(monkeypatch, _changed("", lambda one: one), *WRAPPED.values())
    assert [each.verdict for each in found.values()] == [Verdict.RIGHT] * 12


def test_mujoco_saves_six_digits(tmp_path, monkeypatch):
    """Its script shows it with MuJoCo alone; `mj_setTotalmass` and a scaled mesh are right."""
    monkeypatch.setattr(verify, "BODIES", {"top": BODIES["top"]})
    found = {each.case: each for each in verify_pairs(registry.method("mujoco:RK4"), [*WRAPPED.values()])}
    saved = found["top: file loaded and saved"]
    assert saved.mistake == "saved digits"
    assert saved.causes[0].numbers["digits"] == 6
    assert 1e-8 < saved.error < 1e-5  # measured 6.9e-7
    assert saved.causes[0].left < 1e-12  # measured 1.9e-15
    assert {each.pair for each in found.values() if each.verdict is not Verdict.RIGHT} == {saved.pair}
    (tmp_path / "script.py").write_text(saved.script)
    run = [sys.executable, "-I", tmp_path / "script.py"]
    subprocess.run(run, capture_output=True, text=True, check=True, cwd=tmp_path)
    written = re.search('quat="([^"]*)"', (tmp_path / "saved.xml").read_text())[1]
    assert max(len(number.lstrip("-0.")) for number in written.split()) == 6


def test_a_crash_is_wrong_where_the_first_description_runs(monkeypatch):
    found = verify_planted(monkeypatch, Planted(crash=lambda one: one.inertia.max() < 1e-5), "mass x 2^k", "turned world")
    assert found["body: mass x 2^k"].relation is Relation.CRASHES
    assert found["body: turned world"].verdict is Verdict.RIGHT
    found = verify_planted(monkeypatch, Planted(crash=lambda one: not one.gravity), "turned world")
    assert found["body: turned world"].relation is Relation.NOT_RUN
    assert "segmentation fault" in found["body: turned world"].detail
    assert found["top: turned world"].verdict is Verdict.RIGHT


class Unstable(Planted):
    """The energy grows, and a turned world is lost first."""

    def model(self, one):
        run, wild = super().model(one), 1e3 if not np.array_equal(one.R0, BODY.R0) else self.gain

        def samples():
            R, w = run()
            return R, w * np.linspace(1.0, wild, len(w))[:, None]

        return samples


@pytest.mark.parametrize(("gain", "relation"), [(1.0, Relation.DIFFERS), (1.5, Relation.LOST)])
def test_a_second_motion_that_is_lost_shows_nothing_if_the_first_gains_energy(monkeypatch, gain, relation):
    runner = Unstable()
    runner.gain = gain
    assert verify_planted(monkeypatch, runner, "turned world")["body: turned world"].relation is relation


@pytest.mark.parametrize(("rounding", "relation"), [(10.0, Relation.EQUAL), (1e14, Relation.ROUNDED)])
def test_equal_motions_show_nothing_where_round_off_may_lose_the_attitude(monkeypatch, rounding, relation):
    monkeypatch.setattr(verify, "ROUNDING", rounding)
    found = verify_planted(monkeypatch, Planted(), "turned world")["body: turned world"]
    assert (found.relation, found.verdict) == (relation, VERDICTS[relation])
    assert (found.allowed > 1) == (found.verdict is Verdict.NOT_TESTED)  # measured 1e-9 or less, and 80 or more


def test_a_moment_of_0_is_not_tested_where_it_is_not_supported(tmp_path):
    """Our own core refuses it, and PROTOCOL.md promises moments above 0 to programs that do not declare it."""
    name = "moment of 0 about the axis of rotation"
    path = Path(__file__).with_name("right_programs.py")
    for method in (
        registry.method("reduced"),
        program(tmp_path, sys.executable, path, FIRST[0]),
        registry.method("mujoco:RK4"),
    ):
        (found,) = verify_pairs(method, [name])
        assert found.verdict is Verdict.NOT_TESTED
        assert found.detail
    assert found.relation is Relation.REFUSED
    assert "mjMINVAL" in found.detail


def test_an_engine_that_hangs_is_not_tested(monkeypatch, tmp_path):
    monkeypatch.setattr(runs, "RUN_LIMIT", 0.5)
    planted = Path(__file__).parents[2] / "references" / "programs" / "planted.py"
    found = list(verify_pairs(program(tmp_path, sys.executable, planted, "rk4", "silent"), ["turned world", "mirrored"]))
    assert {each.verdict for each in found} == {Verdict.NOT_TESTED}
    assert all("had not ended" in each.detail for each in found)


def test_digits_of_answers():
    """A program that computes in single precision or writes few digits need not declare it."""
    values = np.random.default_rng(1).uniform(-1, 1, (1, 2, 7))
    assert find_digits(values) == Digits()
    assert find_digits(values.astype(np.float32).astype(float)) == Digits(single=True)
    mixed = values.copy()
    mixed[..., :4] = values[..., :4].astype(np.float32)  # rates made from a momentum
    assert find_digits(mixed) == Digits(single=True)
    assert find_digits(np.vectorize(lambda x: float(f"{x:.9g}"))(values)).significant == 9
    slow = find_digits(np.round(values, 8))
    assert slow.decimals == 8
    assert slow.resolution((np.eye(3), np.array([[1e-4, 0, 0]]))) == pytest.approx(1e-4)
    fast = (np.eye(3), np.array([[10.0, 0, 0]]))  # attitudes have no more digits than with slow rates
    assert Digits(decimals=8).resolution(fast) == pytest.approx(1e-8)


SHOWS_WAYS = """
import json, sys
for line in sys.stdin:
    request = json.loads(line)
    if request["do"] == "hello":
        print(json.dumps({"protocol": 1, "program": "x", "version": "1", "framing": "lines", "engine": {NAME: ["frame"]}}))
    else:
        print(json.dumps({"error": "ValueError", "message": f"{request.get('way')} {request.get('description')}"}))
    sys.stdout.flush()
"""


@pytest.mark.parametrize("name", ["descriptions", "ways"])
def test_both_names_of_descriptions_in_programs(tmp_path, name):
    """Programs written for the first releases answer `ways` and read `way`."""
    (tmp_path / "shows.py").write_text(SHOWS_WAYS.replace("NAME", f'"{name}"'))
    runner = EngineRunner(program(tmp_path, sys.executable, tmp_path / "shows.py"))
    with runner.closing():
        assert runner.has("frame")
        assert not runner.has("offset")
        with pytest.raises(EngineCrashed, match="frame frame"):
            runner.model(BY_NAME["another body frame"].second(BODY))()


def test_loops_of_adapters_contain_no_code_for_pairs():
    """DART asked for the description in each timed run."""
    folder = Path(cv.__file__).parents[1] / "references" / "engines"
    for path in folder.glob("*.py"):
        tree = ast.parse(path.read_text())
        loops = [each for each in ast.walk(tree) if isinstance(each, ast.FunctionDef) and each.name in TIMED]
        inside = {node.id for loop in loops for node in ast.walk(loop) if isinstance(node, ast.Name)}
        assert "description_of" not in inside, path.name


TIMED = ("run", "loop", "begin", "start", "step", "read", "call", "march", "stepped", "sample")
"""Names of functions that are timed in adapters; others run before."""


def test_command_shows_what_differs_and_its_script_repeats_it(tmp_path):
    """MuJoCo 4 stabilises the gyroscopic torque of a free joint, and not that of three slides and a ball.

    The script has at most 25 lines in the engine's own language and does not need this package.
    """
    arguments, written = ("--only", "pairs", "--pairs"), ("--json", "--scripts", tmp_path / "scripts")
    found = conservative("verify", "mujoco:implicitfast", *arguments, "other joints,turned world", *written)
    (subject,) = json.loads(found.stdout)["subjects"]
    findings = {each["case"]: each for each in subject["findings"]}
    lost = findings["needle: other joints"]
    assert found.exit_code == 1
    assert (lost["verdict"], lost["request"]["mass"]) == ("wrong", 1)
    assert findings["body: turned world"]["relation"] == "equal"
    assert findings["body: other joints"]["relation"] == "same limit"
    script = tmp_path / "scripts" / script_name(registry.method("mujoco:implicitfast"), "other joints")
    assert script.read_text() == lost["script"]
    assert MARK in lost["script"]
    done = subprocess.run([sys.executable, "-I", script], capture_output=True, text=True, check=True, cwd=tmp_path)
    first, second = done.stdout.splitlines()
    assert first.endswith("warnings 0")
    assert not second.endswith("warnings 0")
    script.write_text("mine")
    assert conservative("verify", "mujoco:implicitfast", *arguments, "other joints", *written).exit_code == 2
    assert script.read_text() == "mine"
    fine = conservative("verify", "mujoco:RK4", *arguments, "other joints,turned world")
    assert fine.exit_code == 0
    assert "6 of 6 pairs" in fine.stdout


@pytest.mark.parametrize("name", [pair.name for pair in PAIRS if pair.scales])
def test_a_script_has_the_scale_that_differs(name):
    method, pair, texts = registry.method("mujoco:RK4"), BY_NAME[name], set()
    for scale in (2.0**-20, 2.0**-7, 2.0**9):
        text = script_of(method, pair, BODY, scale)
        second = pair.second(BODY, scale)
        assert f'timestep="{second.dt!r}"' in text
        assert f'mass="{second.mass!r}"' in text
        assert all(repr(each) in text for each in [*second.numbers["com"].tolist(), *second.numbers["w0"].tolist()])
        texts.add(text)
    assert len(texts) == 3


@pytest.mark.parametrize("file", sorted(FOLDER.iterdir()), ids=lambda file: file.stem)
def test_scripts_are_short_and_of_an_engine(file):
    lines = len(file.read_text().splitlines()) + (12 if file.stem == "mujoco" else 0)  # its two files have six lines each
    assert lines < 25
    assert file.name.partition(".")[0] in registry.list_engines()


def test_names_of_pairs_are_checked():
    with pytest.raises(BadInput, match="turned world"):
        select_pairs(["turned"])


FOUND = {
    "mujoco@3.12.0:implicitfast": ("inertia on a fixed child", {"needle: inertia on a fixed child"}, "lost"),
    "mujoco@3.13.0:implicitfast": ("inertia on a fixed child", {"needle: inertia on a fixed child"}, "lost"),
    "rapier3d": ("moment of 0 about the axis of rotation", {"rod about its axis: moment of 0 about the axis of rotation"}, ""),
    "jolt": ("mass x 2^k", {"body: mass x 2^k", "top: mass x 2^k"}, "below moments of 3.[67]e-07 to 7.[23]e-07"),
    "dart": ("turned world", set(), ""),
    "pybullet": ("scaled", {"top: scaled"}, ""),
    "pybullet:multibody": (
        "mass set after loading",
        {f"{body}: mass set after loading" for body in ("body", "top", "thin rod")},  # the first motion of the needle is lost
        "",
    ),
    "drake": ("mass set after loading", set(), ""),
    "newton:MuJoCo_cpu_rk4": ("scaled", set(), ""),
    "drake:accuracy=1e-12": ("run again", set(), ""),
}
"""Pairs that differ in engines. DART and Drake are right: their adapters once began with other rates, and another step."""


@pytest.mark.slow
@pytest.mark.parametrize("name", [pytest.param(name, marks=pytest.mark.engine(name.partition(":")[0])) for name in FOUND])
def test_findings_about_engines(name):
    """MuJoCo's issue 3553 (in 3.14.0 no more), Rapier's issue 587, and a threshold of Jolt."""
    pair, wrong, words = FOUND[name]
    found = {each.case: each for each in verify_pairs(registry.method(name), [pair]) if each.verdict is Verdict.WRONG}
    assert set(found) == wrong
    assert all(re.search(words, each.detail) for each in found.values())
