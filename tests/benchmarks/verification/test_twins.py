"""Twins: two descriptions of one motion move equally in what is right, and each planted difference is found and reduced.

The planted engines are `reduced` with one fault. No fault may be found in methods that are right.
"""

import json
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner
from conservative.benchmarks.studies.twins import select_pairs
from conservative.benchmarks.verification.pairs.differences import BODIES, BODY, NEEDLE, Engine, Twins, difference, twins_of
from conservative.benchmarks.verification.pairs.machine import EngineMachine, Machine, machine_of
from conservative.reports.sections.twins import changes

from conservative import registry
from conservative.attitude import from_quaternion, to_quaternion
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies import studies
from conservative.benchmarks.studies.selection import methods as select_methods
from conservative.benchmarks.verification.pairs import differences as compare
from conservative.benchmarks.verification.pairs.pairs import PAIRS
from conservative.benchmarks.verification.pairs.script import FOLDER, MARK, script_name, script_of
from conservative.errors import BadInput
from conservative.outcome import OutcomeKind
from conservative.references.environments.catalogue import __getattr__ as adapter
from conservative.reports.cli.main import main

from ...environments import PATIENCE

BY_NAME = {pair.name: pair for pair in PAIRS}
RIGHT = ("exact", "reduced", "mujoco:RK4")
SLOW = ("heyoka", "taylor", "lie_variational")
"""Others were tried once: see the page of results."""
WAYS = {pair.way for pair in PAIRS} - {"", "quaternion", "zero"}


@pytest.fixture(autouse=True)
def on_an_idle_machine(monkeypatch):
    """No body is left out because the machine is busy."""
    monkeypatch.setattr(compare, "LONGEST", PATIENCE)


def conservative(*arguments):
    return CliRunner(env={"COLUMNS": "200"}).invoke(main, [str(argument) for argument in arguments])


@pytest.mark.parametrize("name", [*RIGHT, *(pytest.param(name, marks=pytest.mark.slow) for name in SLOW)])
def test_nothing_is_found_in_what_is_right(name):
    results = list(twins_of(registry.method(name)))
    assert [each for each in results if each.wrong] == []
    assert sum(each.outcome in ("same bits", "equal") for each in results) >= 18  # measured 20 to 65
    assert max(each.factor for each in results if each.outcome == "equal") < 1  # measured at most 0.63


def test_every_pair_has_a_body_and_every_way_of_an_adapter_a_pair():
    """A pair or a way without the other would never be tried."""
    assert {body for pair in PAIRS for body in pair.bodies} == set(BODIES)
    told = {way for name in registry.list_engines() for way in adapter(name).data.ways}
    assert told <= WAYS
    assert WAYS - told == {"accelerator"}
    assert len(PAIRS) == len(BY_NAME) >= 20


def test_maps_between_twins_are_those_of_the_exact_solution():
    """A wrong map would call an engine wrong that is right; the exact solution is independent of all adapters."""
    engine = Engine(machine_of(registry.method("exact")))
    _, samples, _ = engine.first(BODY)
    for pair in PAIRS:
        for size in pair.sizes or (None,) if pair.way in ("", "frame") and not pair.run else ():
            scale = () if size is None else (size,)
            twin = pair.twin(BODY, *scale)
            assert difference(samples, pair.back(engine.machine.model(twin)(), *scale)) < 5e-15, pair.name  # measured 7e-16


class Planted(Machine):
    """`reduced` with a fault: `change` gives another description."""

    def __init__(self, change=lambda one: one, ways=("frame", "zero"), batch=0.0, memory=0.0):
        super().__init__(registry.method("reduced"))
        self.change, self.ways, self.batch, self.memory, self.runs = change, ways, batch, memory, 0

    def has(self, way):
        return way in self.ways

    def model(self, one):
        run = super().model(self.change(one))

        def samples():
            self.runs += 1
            R, w = run()
            return R, w + self.memory * self.runs

        return samples

    def many(self, bodies, number):
        R, w = super().many(bodies, number)
        return R, w + self.batch * number


def small_moments_count_as_zero(one):
    """As in LAMMPS until 2020: the body does not turn."""
    return one if one.inertia.max() > 2.1e-6 else replace(one, w0=0 * one.w0, inertia=BODY.inertia)


def inertia_in_other_axes(one):
    """The products of inertia are ignored."""
    return replace(one, inertia=np.diag(np.diag(one.inertia)))


def rates_are_limited(one):
    return replace(one, w0=one.w0 * min(1.0, 200.0 / np.linalg.norm(one.w0)))


def gravity_along_another_axis(one):
    """A constant disturbs the attitude that is not turned with the world."""
    return replace(one, w0=one.w0 + 1e-6 * one.R0[0])


def a_rate_without_moment_is_erased(one):
    kept = np.diag(one.inertia) > 0
    return replace(one, w0=one.w0 * kept, inertia=one.inertia + np.diag(np.where(kept, 0, 1e-3)))


PLANTED = {  # fault: (machine, pairs that have to differ, words)
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
    "bodies of a batch": (lambda: Planted(batch=1e-9), {"body 3 of 7", "body 40 of 64"}, ""),
    "memory": (lambda: Planted(memory=1e-15), {"run again"}, ""),
}


ALSO = {
    "small moments": {"length x 2^k", "mass x 10^k"},
    "memory": {"another body frame", "turned world", "time x 10^k"},
    "an axis of the world": {"time x 10^k"},  # the disturbance has a unit
}
"""Pairs in which a fault may show as well."""


@pytest.mark.parametrize("fault", PLANTED)
def test_planted_differences_are_found_and_reduced(fault, monkeypatch):
    machine, pairs, words = PLANTED[fault]
    monkeypatch.setattr(compare, "machine_of", lambda method: machine())
    method = registry.method("reduced")
    others = ("run again", "turned world", "another body frame", "length x 2^k", "time x 10^k")
    chosen = [pair for pair in PAIRS if pair.name in {*pairs, *others}]
    wrong = {each.pair: each for each in twins_of(method, pairs=chosen) if each.wrong}
    assert pairs <= set(wrong)
    assert set(wrong) - pairs <= ALSO.get(fault, set())
    found = wrong[sorted(pairs)[0]]
    assert found.factor > 1
    assert found.first.n_steps <= 2
    assert words in f"{found.threshold} {found.detail}"


def test_two_schemes_of_one_body_are_no_fault():
    """A difference that falls with the step is said to: the twin is integrated with steps half as long."""

    class TwoSchemes(Planted):
        def model(self, one):
            if np.count_nonzero(one.inertia) == 3:
                return super().model(one)
            return super().model(replace(one, dt=one.dt / 2, n_steps=2 * one.n_steps, every=2 * one.every))

    engine = Engine(TwoSchemes())
    found = compare.compare(engine, "two", "body", BY_NAME["another body frame"], BODY)
    assert (found.outcome, found.wrong) == ("same limit", False)
    assert 1e-6 < found.difference < 1e-2  # measured 3e-5


def test_an_engine_that_refuses_is_not_wrong():
    machine = EngineMachine(registry.method("mujoco:RK4"))
    with machine.closing():
        found = compare.compare(
            Engine(machine), "mujoco", "rod about its axis", PAIRS[_place("moment of 0")], BODIES["rod about its axis"]
        )
    assert found.outcome == "refused"
    assert not found.wrong
    assert "mjMINVAL" in found.detail


def _place(start):
    return next(place for place, pair in enumerate(PAIRS) if pair.name.startswith(start))


def test_numbers_of_a_description_are_one_body():
    """The moments, axes and tensors that different adapters read belong together, in axes that are not principal too."""
    for pair in (BY_NAME["another body frame"], BY_NAME["offset frame"], BY_NAME["mirrored"]):
        one = pair.twin(NEEDLE)
        given = one.numbers
        axes = from_quaternion(given["q_com"])
        np.testing.assert_allclose(axes @ np.diag(given["moments_com"]) @ axes.T, given["inertia_com"], atol=1e-19)  # 3e-20
        np.testing.assert_allclose(from_quaternion(given["q0"]), given["R0"], atol=1e-15)
        np.testing.assert_allclose(given["R0"] @ given["w0"], given["w0_W"], rtol=1e-14)
        assert to_quaternion(given["R0"]) @ given["q0"] == pytest.approx(1)


def test_command_says_what_differs_and_fails():
    """MuJoCo 4 stabilises the gyroscopic torque of a free joint, and not that of three slides and a ball."""
    pairs = "other joints,turned world"
    found = conservative("twins", "mujoco:implicitfast", "--pairs", pairs, "--json")
    results = {(each["body"], each["pair"]): each for each in json.loads(found.stdout)["results"]}
    assert found.exit_code == 1
    assert results["needle", "other joints"]["outcome"] == "differs"
    assert results["body", "turned world"]["outcome"] == "equal"
    assert results["body", "other joints"]["outcome"] == "same limit"
    fine = conservative("twins", "mujoco:RK4", "--pairs", pairs)
    assert fine.exit_code == 0
    assert "0 of 6 pairs differ" in fine.stdout


@pytest.mark.parametrize("name", [pair.name for pair in PAIRS if pair.sizes])
def test_a_script_has_the_size_that_differs(name):
    method, pair, texts = registry.method("mujoco:RK4"), next(each for each in PAIRS if each.name == name), set()
    for size in (2.0**-20, 2.0**-7, 2.0**9):
        text = script_of(method, Twins(method.name, "brick", name, "differs", first=BODY, size=size))
        twin = pair.twin(BODY, size)
        assert f'timestep="{twin.dt!r}"' in text
        assert f'mass="{twin.mass!r}"' in text
        assert all(repr(each) in text for each in [*twin.numbers["com"].tolist(), *twin.numbers["w0"].tolist()])
        texts.add(text)
    assert len(texts) == 3


def test_script_repeats_the_difference_without_this_package(tmp_path):
    """At most 25 lines in the engine's own language: the second of two equal bodies is lost."""
    method = registry.method("mujoco:implicitfast")
    folder = tmp_path / "scripts"
    assert conservative("twins", "mujoco:implicitfast", "--pairs", "other joints", "--scripts", folder).exit_code == 1
    script = folder / script_name(method, "other joints")
    assert MARK in script.read_text()
    done = subprocess.run([sys.executable, "-I", script], capture_output=True, text=True, check=True, cwd=tmp_path)
    first, second = done.stdout.splitlines()
    assert first.endswith("warnings 0")
    assert not second.endswith("warnings 0")
    script.write_text("mine")
    assert conservative("twins", "mujoco:implicitfast", "--pairs", "other joints", "--scripts", folder).exit_code == 2
    assert script.read_text() == "mine"


@pytest.mark.parametrize("file", sorted(FOLDER.iterdir()), ids=lambda file: file.stem)
def test_scripts_are_short_and_of_an_engine(file):
    lines = len(file.read_text().splitlines()) + (12 if file.stem == "mujoco" else 0)  # its two files have six lines each
    assert lines < 25
    assert file.stem in registry.list_engines()
    assert MARK


def test_names_are_checked():
    with pytest.raises(BadInput, match="turned world"):
        select_pairs(["turned"])
    with pytest.raises(BadInput):
        select_methods(["no_engine"])
    assert [method.name for method in select_methods(["mujoco:RK4", "exact"])] == ["mujoco", "exact"]
    assert len(select_methods(["mujoco"])) == 5
    assert len(select_methods(["gauss"])) == len(registry.method("gauss").settings_for("variants")) > 1


def test_study_has_a_row_for_each_pair():
    study = studies.STUDIES["twins"].plan((registry.method("mujoco:RK4"),))
    rows = list(studies.rows(study))
    assert len(rows) == sum(len(pair.bodies) for pair in PAIRS)
    assert {row.measure for row in rows} == {Measure.ALLOWED}
    ran = [row for row in rows if row.outcome.kind is OutcomeKind.OK]
    assert len(ran) > 55
    assert max(row.value for row in ran) < 1


def test_changes_between_versions(monkeypatch):
    """A pair that began to differ is told, and no other: the second version does not turn small bodies."""
    old, new = registry.method("reduced"), registry.method("substepped")
    machines = {old: Planted(), new: Planted(small_moments_count_as_zero)}
    monkeypatch.setattr(compare, "machine_of", machines.get)
    pairs = [BY_NAME["mass x 2^k"], BY_NAME["turned world"]]
    told = changes([("1.0", [old]), ("1.1", [new])], lambda share, what: None, pairs)
    assert told
    assert all("1.0 → 1.1: below moments" in text for text in told)


@pytest.mark.slow
@pytest.mark.engine("mujoco@3.13.0")
def test_finds_the_fault_of_mujoco_with_an_inertia_on_a_child():
    """Issue 3553 of MuJoCo, in 3.13 and not in 3.14: `implicitfast` loses a needle whose inertia is on a fixed child."""
    found = list(twins_of(registry.method("mujoco@3.13.0:implicitfast"), pairs=[BY_NAME["inertia on a fixed child"]]))
    assert [each.body for each in found if each.wrong] == ["needle"]


@pytest.mark.slow
@pytest.mark.engine("rapier3d")
def test_finds_the_erased_rate_of_rapier():
    """Issue 587 of Rapier: the rate about an axis without inertia is set to 0."""
    (found,) = twins_of(registry.method("rapier3d"), pairs=[BY_NAME["moment of 0 about the axis of rotation"]])
    assert found.wrong
    assert found.first.n_steps == 1


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "pair"),
    [
        pytest.param("dart", "turned world", marks=pytest.mark.engine("dart")),
        pytest.param("drake:accuracy=1e-12", "run again", marks=pytest.mark.engine("drake")),
    ],
)
def test_adapters_start_as_they_are_told(name, pair):
    """DART's free joint has its rates in other axes; Drake goes on with its last step unless its integrator is reset."""
    assert not [each for each in twins_of(registry.method(name), pairs=[BY_NAME[pair]]) if each.wrong]


@pytest.mark.slow
@pytest.mark.engine("jolt")
def test_finds_the_threshold_of_jolt():
    (found, _) = twins_of(registry.method("jolt"), pairs=[BY_NAME["mass x 2^k"]])
    assert found.wrong
    assert found.threshold.startswith("below moments of 3.6e-07 to 7.3e-07 kg m^2")
