"""Published figures: the data file, the verdicts, what is measured, and that a wrong figure is found."""

import contextlib
from dataclasses import replace

import numpy as np
import pytest

import conservative as cv
from conservative.benchmarks.published import evaluate, quantities
from conservative.benchmarks.published.evaluate import Verdict
from conservative.benchmarks.published.figure import Figure, Relation, Source, read
from conservative.benchmarks.published.quantities import QUANTITIES, Runs

FIGURES = read()
SOURCE = Source("here", "somebody", "https://example.org", "page 1")
SPIN = cv.Scene("spin", cv.RigidBody((2, 2, 1)), np.eye(3), (0, 0, 1), np.pi / 2)


def figure(**changes):
    return Figure("energy", SOURCE, "energy", "any", ("0.5",), SPIN, dt=0.1, quantity="energy", **changes)


def verdict(which, engines=("none",)):
    (found,) = evaluate.evaluate([which], engines)
    return found.verdict


def test_there_are_figures_enough_each_with_its_source():
    assert len(FIGURES) >= 25
    for each in FIGURES:
        source = each.source
        assert source.citation, each.name
        assert source.place, each.name
        assert source.url.startswith("https://"), each.name
        assert each.values, each.name
        assert each.allowed > 0, each.name
        assert each.cannot or each.quantity in QUANTITIES, each.name


@pytest.mark.parametrize("name", sorted({name for each in FIGURES for name in (each.method, each.other)} - {"", "truth"}))
def test_every_method_is_a_setting_of_its_engine(name):
    family = name.partition(":")[0].partition("@")[0]
    if family not in {*cv.registry.list_engines(), *cv.registry.list_methods()}:
        pytest.skip(f"there is no adapter for {family}")
    with contextlib.suppress(cv.MissingEngine):
        cv.registry.method(name)


def test_every_quantity_is_of_a_figure():
    assert set(QUANTITIES) == {each.quantity for each in FIGURES if each.quantity}


ENTRY = """
[source.here]
citation = "somebody"
url = "https://example.org"
place = "page 1"
[motion.spin]
moments = [2.0, 2.0, 1.0]
rates = [0.0, 0.0, 1.0]
t_end = 1.0
[[figure]]
name = "energy"
source = "here"
motion = "spin"
what = "energy"
setting = "any"
dt = 0.1
quantity = "energy"
printed = "0.5"
"""
BREACHES = {
    'source = "here"': ('source = "there"', "source 'there'"),
    'motion = "spin"': ('motion = "fall"', "motion 'fall'"),
    'quantity = "energy"': ('quantity = "colour"', "a quantity that there is"),
    'printed = "0.5"': ("printed = 0.5", "as texts"),
    'setting = "any"': ("", "all fields that have no default"),
    "t_end = 1.0": ("", "without 't_end'"),
    "rates = [0.0, 0.0, 1.0]": ("rates = [0.0, 0.0, 1.0]\ncolour = 1", "with colour"),
    'what = "energy"': ('what = "energy"\ncolour = "red"', "with colour"),
    'place = "page 1"': ('place = ""', "a source with a citation"),
    'url = "https://example.org"': ('url = "a book"', "an address"),
    "dt = 0.1": ('dt = 0.1\nrelation = "like"', "relation 'like'"),
    "[[figure]]": ("[[figure", "a TOML file"),
}


def test_a_data_file_is_read(tmp_path):
    path = tmp_path / "figures.toml"
    path.write_text(ENTRY)
    (found,) = read(path)
    assert verdict(found) is Verdict.REPRODUCED


@pytest.mark.parametrize("line", BREACHES)
def test_a_data_file_that_cannot_be_used_is_refused(line, tmp_path):
    other, message = BREACHES[line]
    path = tmp_path / "figures.toml"
    path.write_text(ENTRY.replace(line, other))
    with pytest.raises(cv.BadInput, match="figures") as caught:
        read(path)
    assert message in str(caught.value)


def test_a_name_is_not_given_twice(tmp_path):
    path = tmp_path / "figures.toml"
    path.write_text(ENTRY + ENTRY[ENTRY.index("[[figure]]") :])
    with pytest.raises(cv.BadInput, match="twice"):
        read(path)


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({}, Verdict.REPRODUCED),
        ({"printed": ("0.6",)}, Verdict.REPRODUCED),  # a unit of the last digit
        ({"printed": ("0.60",)}, Verdict.UNEXPLAINED),
        ({"printed": ("0.60",), "tolerance": 0.2}, Verdict.REPRODUCED),
        ({"printed": ("0.60",), "explanation": "a misprint"}, Verdict.EXPLAINED),
        ({"explanation": "a misprint"}, Verdict.NEEDLESS),
        ({"printed": ("0.4",), "relation": Relation.BELOW}, Verdict.UNEXPLAINED),
        ({"printed": ("0.6",), "relation": Relation.BELOW}, Verdict.REPRODUCED),
        ({"printed": ("0.6",), "relation": Relation.ABOVE}, Verdict.UNEXPLAINED),
        ({"printed": ("0.5", "0.5")}, Verdict.UNEXPLAINED),
        ({"cannot": "it is of a whale"}, Verdict.CANNOT),
    ],
)
def test_a_verdict_is_of_what_is_measured_and_printed(changes, expected):
    (found,) = evaluate.evaluate([replace(figure(), **changes)], ("none",))
    assert found.verdict is expected
    assert evaluate.passed([found]) is (expected not in (Verdict.UNEXPLAINED, Verdict.NEEDLESS))


def test_what_cannot_be_done_says_why(no_engines):
    for method, reason in {
        "exudyn:RK44": "exudyn is not installed: conservative engines install exudyn",
        "mujoco@3.7.0:RK4": "mujoco==3.7.0 is not installed: conservative engines install mujoco==3.7.0",
        "hammer:RK4": "there is no adapter for hammer",
    }.items():
        (found,) = evaluate.evaluate([figure(method=method)])
        assert (found.verdict, found.reason) == (Verdict.CANNOT, reason)


@pytest.fixture
def no_engines(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))


@pytest.mark.parametrize("method", ["convected", "moser_veselov:2"])
def test_a_run_that_fails_cannot_be_done(method):
    fast = cv.Scene("fast", cv.RigidBody((1, 2, 3)), np.eye(3), (10, 10, 10), 10.0)
    (found,) = evaluate.evaluate([replace(figure(), motion=fast, dt=5.0, method=method)])
    assert found.verdict is Verdict.CANNOT
    assert found.reason


def test_quantities_of_a_quarter_turn():
    runs = Runs(SPIN, None, np.pi / 200)
    half = np.sqrt(0.5)
    expected = {
        "quaternion": (half, 0, 0, half),
        "modified_rodrigues": (0, 0, np.tan(np.pi / 8)),
        "spin": (0,),
        "turn_of_a_step": (0.9,),
        "energy": (0.5,),
        "energy_ratio": (1,),
        "largest_energy_ratio": (1,),
        **dict.fromkeys(("energy_drift", "momentum_length_drift", "momentum_drift", "momentum_change"), (0,)),
        **dict.fromkeys(("relative_momentum_change", "element_error", "world_rate_error", "attitude_error"), (0,)),
    }
    for name, values in expected.items():
        np.testing.assert_allclose(QUANTITIES[name](runs), values, atol=1e-13, err_msg=name)


def test_quantities_of_a_method_of_second_order():
    brick = cv.Scene("brick", cv.RigidBody((13, 5, 10)), np.eye(3), (0.3, 0.5, 1), 1.0)
    runs = Runs(brick, cv.registry.method("reduced"), 0.05, cv.registry.method("reduced"))
    assert quantities.order_of_attitude(runs) == pytest.approx([2], abs=0.01)
    assert quantities.order_of_rates(runs) == pytest.approx([2], abs=0.01)
    assert quantities.halving_ratio(runs) == pytest.approx([4], abs=0.1)
    assert quantities.rates_against_other(runs) == pytest.approx([1])
    assert quantities.attitude_error(runs) > 1e-6


def test_the_figures_that_need_no_engine_are_reproduced_or_explained():
    found = list(evaluate.evaluate(FIGURES, ("none",)))
    assert evaluate.passed(found)
    done = [each for each in found if each.verdict is not Verdict.CANNOT]
    assert len(done) >= 15
    for each in done:
        wrong = replace(each.figure, printed=tuple(f"{1.01 * float(number):.17g}" for number in each.figure.printed))
        if each.verdict is Verdict.REPRODUCED and each.figure.relation is Relation.EQUALS and not each.figure.tolerance:
            judged = evaluate.judge(wrong, each.label, np.array(each.measured), "")
            assert judged.verdict is Verdict.UNEXPLAINED, each.figure.name


@pytest.mark.parametrize(
    ("engine", "source"),
    [pytest.param(*pair, marks=pytest.mark.engine(pair[0])) for pair in [("bsk", "basilisk"), ("drake", "drake")]],
)
def test_figures_of_an_engine_are_reproduced_with_it(engine, source):
    found = list(evaluate.evaluate(evaluate.select_figures(FIGURES, [source]), [engine]))
    assert {each.verdict for each in found} == {Verdict.REPRODUCED}
