"""The tests of references/motions in each language, with right and wrong engines: all files and the embedded motions."""

import importlib.util
import json
import re
from itertools import product

import numpy as np
import pytest

from conservative.benchmarks.verification.motions import one_file, programs
from conservative.benchmarks.verification.motions.motion import load
from conservative.benchmarks.verification.motions.signatures import names as mistake_names

from ...sampling import sampled
from .motions_engines.methods import METHODS
from .motions_engines.run import LANGUAGES, MOTIONS, Engine, missing, run
from .wrong_programs import wrong_programs

FILES = {motion.name: json.loads((MOTIONS / f"{motion.name}.json").read_text()) for motion in load()}
SMALL = {each["name"]: each for each in one_file.small_set(list(FILES.values()))}
WRONG = wrong_programs()
slow = pytest.mark.slow


def needs(language):
    return pytest.param(language, marks=[pytest.mark.skipif(bool(missing(language)), reason=str(missing(language)))])


RK2 = Engine(METHODS["explicit midpoint"][1], 2)
EVERY = [needs(language) for language in LANGUAGES]
EXPLAINS = re.compile(r'"(.+)" explains (\d+) of them')


def summary(lines):
    """Return the number of failing motions, the mistakes of the summary with their numbers of motions, and its other lines."""
    (at,) = (i for i, line in enumerate(lines) if line.endswith("motions failed"))
    explained = [EXPLAINS.fullmatch(line) for line in lines[at + 1 :]]
    return (
        int(lines[at].partition(" ")[0]),
        {each[1]: int(each[2]) for each in explained if each},
        [
            line
            for line, each in zip(lines[at + 1 :], explained, strict=True)
            if not each and not line.startswith(("Known and accepted", "What now"))
        ],
    )


# The embedded motions


@pytest.mark.parametrize("language", one_file.LANGUAGES)
def test_embedded_motions_are_current(language):
    """`python .ci/readme` writes them."""
    text = (MOTIONS / one_file.LANGUAGES[language]).read_text()
    assert one_file.fill(language, text, list(SMALL.values())) == text
    assert one_file.one_file(language, list(SMALL.values())) == text


def test_small_set_catches_every_mistake_that_all_motions_catch():
    """Measured: by a factor of 10 of the tolerance or more, as all motions do; all but those of a field by a free body, too."""
    every, few = (
        {name for each in some.values() for name in one_file._caught(each, one_file.CLEAR)} for some in (FILES, SMALL)
    )
    assert few == every
    assert {*mistake_names()} - every == {
        "no reaction of the motor",
        "sign of the reaction of the motor",
    }  # no motion has a motor
    free = [
        {name for each in some.values() if not each["features"] for name in one_file._caught(each, 10)}
        for some in (FILES, SMALL)
    ]
    assert free[0] == free[1]
    assert len(SMALL) == 12
    assert sum(not each["features"] for each in SMALL.values()) == 8


def test_small_set_of_other_motions():
    """Motions that catch nothing new are left out; a set that is small already is complete."""
    few = [FILES[name] for name in ("separatrix", "orbit")]
    assert one_file.small_set(few) == few
    assert len(one_file.small_set([*FILES.values()], number=1)) == 10  # as many as all mistakes and bands need


SIZES = {"c": 40_000, "csharp": 35_500, "javascript": 31_500, "python": 32_000, "rust": 38_000}
"""Largest sizes of the files, in bytes, of which the motions have 14,000."""


def test_sizes():
    for language, name in one_file.LANGUAGES.items():
        assert (MOTIONS / name).stat().st_size <= SIZES[language], name


def test_embedded_numbers_are_those_of_the_files():
    """To 12 digits of attitudes and of the largest rate."""
    test = load_test()
    for m in test.read(test.MOTIONS.splitlines()):
        (from_csv,) = test.read((MOTIONS / f"{m['name']}.csv").read_text().splitlines())
        assert m["catches"].keys() == from_csv["catches"].keys()
        for name, errors in m["catches"].items():
            assert errors == from_csv["catches"][name][: len(errors)]
        assert m["tolerance"] == [row for row in from_csv["tolerance"] if row[1] == 0.01]
        for (t, q, w), (t0, q0, w0) in zip(m["samples"], from_csv["samples"], strict=True):
            assert t == pytest.approx(t0, rel=1e-14)
            assert np.abs(np.subtract(q, q0)).max() <= 1e-12
            assert np.abs(np.subtract(w, w0)).max() <= 1e-12 * m["scale"][0]
        body = ["inertia_B", "scale", "single", *one_file.BODY]
        assert {key: m.get(key) for key in body} == {key: from_csv.get(key) for key in body}


# Right engines


@pytest.mark.parametrize("language", sampled(EVERY, leave=["Python"]))
def test_right_program_passes(language, tmp_path):
    assert run(language, tmp_path, RK2) == ["0 of 48 motions failed"]
    assert run(language, tmp_path, RK2, embedded=True) == ["0 of 12 motions failed"]


def all_methods(language):
    """C runs a sample, and all methods with --all; the other languages two in double precision, and the rest with --attack."""
    cases = list(product(METHODS, (False, True)))
    for case in sampled(cases, 3, keep=[("RK4", False), ("Radau IIA", True), ("implicit Euler", False)]):
        method, single = case.values
        usual = not single and method in ("RK 3/8", "Gauss 4")
        marks = case.marks if language == "C" else [slow if usual else pytest.mark.attack]
        yield pytest.param(language, method, single, marks=marks, id=f"{language}-{method}-{'float' if single else 'double'}")


@pytest.mark.parametrize(("language", "method", "single"), [each for language in LANGUAGES for each in all_methods(language)])
def test_right_programs_pass(language, method, single, tmp_path):
    """Explicit and implicit methods that are not among those of the tolerances, in double and single precision."""
    if missing(language):
        pytest.skip(missing(language))
    order, numbers = METHODS[method]
    for angle in programs.ANGLES if language == "C" else (0.01,):
        engine = Engine(numbers, order, angle, single)
        assert run(language, tmp_path, engine) == ["0 of 48 motions failed"], angle
    assert run(language, tmp_path, engine, embedded=True) == ["0 of 12 motions failed"]


def test_right_program_above_a_tolerance_passes_with_a_note(tmp_path):
    """With two per cent of the tolerances motions are above, and all errors fall as h^2."""
    lines = run("C", tmp_path, RK2, share=0.02)
    assert summary(lines)[0] == 0
    assert len(lines) >= 10
    assert all(re.search(r" % above the tolerance, falls as h\^2\.\d: right$", line) for line in lines[:-1])


# Wrong engines


@pytest.mark.parametrize("language", sampled(EVERY, leave=["Python"]))
def test_mistake_is_named_by_the_summary(language, tmp_path):
    """Two turns about one axis pass."""
    lines = run(language, tmp_path, RK2, "wrong side")
    assert summary(lines) == (46, {"wrong side": 46}, [])
    assert re.search(
        r"\w+: (attitude|rates|energy|momentum) error [\d.]+e[+-]\d\d( rad)?, tolerance [\d.]+e-\d\d; wrong side$", lines[0]
    )
    assert summary(run(language, tmp_path, RK2, "wrong side", embedded=True)) == (12, {"wrong side": 12}, [])


@pytest.mark.parametrize(
    "language", [EVERY[0], *(pytest.param(each.values[0], marks=[*each.marks, slow]) for each in EVERY[1:])]
)
def test_lower_order_than_declared_is_measured(language, tmp_path):
    euler = Engine(METHODS["explicit Euler"][1], 2)
    failing, explained, rest = summary(run(language, tmp_path, euler))
    assert failing >= 40
    assert explained == {}
    assert rest[0] == "this program has order 1.0, 2 was declared"
    assert summary(run(language, tmp_path, euler, embedded=True))[2][0] == "this program has order 1.0, 2 was declared"


def planted(language):
    """C runs all mistakes; the other languages do with --all, Python and C#, where a run takes seconds, one in five."""
    for i, mistake in enumerate(PLANTED):
        few = language in ("Python", "C#") and i % 5
        yield pytest.param(language, mistake, marks=[] if language == "C" else [pytest.mark.attack if few else slow])


PLANTED = [
    "R I for R I R'", "attitude by normalisation", "axes of the torque", "damping 0.01", "damping 0.05",
    "diagonal gyroscopic term", "half a step late", "inertia in world axes", "inertia of the start",
    "no gyroscopic term + damping 0.05", "no products of inertia", "order xyzw", "rate limit 100", "reversed rates",
    "sign of the field", "sign of the gyroscopic term", "sign of the products of inertia", "sign of the rotor",
    "sign of the torque", "sleep", "smallest moments", "stale rates", "transposed", "turning of the field",
    "without the damping", "without the field", "without the rotor", "without the torque", "world rates",
]  # fmt: skip
"""Mistakes of the engines in all languages."""
ALSO = ["damping 0.02", "damping 0.1", "dead band 0.01", "factor one half", "inverted inertia", "rate limit 7"]
"""Further mistakes of the engine in C."""
ALIKE = {"attitude by normalisation": "stale rates"}
"""Mistakes whose errors are those of another one."""


@pytest.mark.parametrize("embedded", [False, True], ids=["all", "embedded"])
@pytest.mark.parametrize(
    ("language", "mistake"), [*(each for language in LANGUAGES for each in planted(language)), *(("C", each) for each in ALSO)]
)
def test_planted_mistakes_are_named_by_the_summary(language, mistake, embedded, tmp_path):
    """Measured: the mistake explains 70 % of the failing motions (stale rates) or more, most of them all."""
    if missing(language):
        pytest.skip(missing(language))
    failing, explained, _ = summary(run(language, tmp_path, RK2, mistake, embedded=embedded))
    first = next(iter(explained))
    assert ALIKE.get(first, first) == ALIKE.get(mistake, mistake)
    assert explained[first] >= 0.65 * failing > 0


@pytest.mark.parametrize("language", sampled(EVERY, leave=["Python"]))
def test_a_large_mistake_is_named_beside_another_one(language, tmp_path):
    """Measured: 7 of 8 motions of free bodies, in which no signature explains both. The other mistake shows in the next run."""
    failing, explained, _ = summary(run(language, tmp_path, RK2, "order xyzw, damping 0.05", embedded=True))
    assert next(iter(explained)) == "order xyzw"
    assert explained["order xyzw"] >= 0.65 * failing


NOT_TOLD_APART = {"no products of inertia": "diagonal gyroscopic term"}
"""Programs whose mistake the embedded motions take for another one, which is a part of it."""


@pytest.mark.parametrize("embedded", [False, True], ids=["all", "embedded"])
@pytest.mark.parametrize("name", sampled(WRONG, 2, keep=("dead band", "damping 0.02", "sleep")))
def test_wrong_programs_are_named_by_the_summary_in_python(name, embedded, monkeypatch):
    """Programs that share no code with the catalogue."""
    program, test, lines = WRONG[name], load_test(), []
    monkeypatch.setattr(test, "simulate", program.simulate)
    monkeypatch.setattr(test, "ORDER", program.order)
    monkeypatch.setattr(test, "HAS", "rotor, torque, damping, fixed point, orbit")
    test.run([] if embedded else [str(MOTIONS)], lines.append)
    failing, explained, rest = summary(lines)
    if program.key == "explicit Euler":
        assert rest[0] == "this program has order 1.0, 2 was declared"
        return
    first = next(iter(explained))
    allowed = {program.key, NOT_TOLD_APART.get(program.key) if embedded else None}
    assert re.sub(r" [\d.]+$", "", first) in allowed
    assert explained[first] >= 0.65 * failing


def load_test():
    """Return a fresh copy of test_rotation.py as a module."""
    spec = importlib.util.spec_from_file_location("copied_test", MOTIONS / "test_rotation.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
