"""Each sentence of README.md and of the page of our entrants with a number, or about what is conserved, has a row.

It is measured, or computed here.
"""

import importlib
import re
from importlib import metadata

import numpy as np
import pytest
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet

import conservative as cv
from conservative import registry
from conservative.benchmarks import speed_ratio
from conservative.benchmarks.measures.errors import count_turns_over
from conservative.benchmarks.studies import random

from .pages import FENCE, INDENTED, ROOT

NUMBER = re.compile(r"(?<![\w.-])\d[\d,]*(?:\.\d+)?(?:e-?\d+)?(?!\w)")
TELLING = re.compile(r"\d|\bconserve[sd]?\b|\bdrifts?\b")
PAGES = ("README.md", "conservative/entrants.md")
BRICK, TOP, NUTATING = map(registry.scene, ("brick_flip", "lagrange_top", "nutating_top"))


@pytest.fixture(autouse=True)
def _beside(monkeypatch):
    """The files of the program import each other by their names."""
    monkeypatch.syspath_prepend(ROOT / ".ci" / "readme")


def sentences():
    """Return the sentences of both pages."""
    return [sentence for page in PAGES for sentence in sentences_of(page)]


def sentences_of(page):
    """Return the sentences of a page without its code, tables, headings and the targets of its links."""
    text = INDENTED.sub("", FENCE.sub("", (ROOT / page).read_text(encoding="utf-8")))
    text = re.sub(r"\]\([^)]*\)", "]", re.sub(r"^[|#].*$", "", text, flags=re.MULTILINE))
    found = []
    for paragraph in re.split(r"\n\s*\n|\n(?=\* )", text):
        found += re.split(r"(?<=[.:])\s+(?=[A-Z`*\[!])", " ".join(paragraph.replace("**", "").split()))
    return [re.sub(r"`[^`]*`", lambda code: code[0] if "e-" in code[0] else "`x`", each) for each in found]


def told(sentence):
    """Return the numbers of a sentence."""
    return [float(each.replace(",", "")) for each in NUMBER.findall(sentence)]


class Rows:
    """The rows of measured.csv."""

    def __init__(self):
        self.program = importlib.import_module("measured")
        self.measure = importlib.import_module("rows")
        self.value, self.version, self.date = self.program.read_values()

    def ratios(self, *place):
        return [Near(each) for each in self.program.interval(self.value, *place)]

    def slower(self, *place):
        """The ratio of our time to heyoka's, with its ends."""
        mean, low, high = self.program.interval(self.value, *place)
        return [Near(1 / mean), Near(1 / high), Near(1 / low)]

    def loses(self, *place):
        """Whether heyoka is faster. A place that is not measured loses nothing."""
        return self.value.get((*place, f"{self.program.RATIO}, high"), np.inf) < 1

    def bodies(self, quantity):
        return self.value["all fields", self.program.BODIES, quantity]

    def of(self, name, what=""):
        """The values of a name and a quantity, by place."""
        ratio = self.program.RATIO + what
        return {place: value for (place, *key), value in self.value.items() if key == [name, ratio]}


class Near(float):
    """A time or a ratio, which is rounded to two digits."""

    def allows(self, shown):
        return abs(shown - self) <= 0.06 * self


class Up(float):
    """An error or a drift, which is rounded up to two digits or to a power of ten."""

    def allows(self, shown):
        return self <= shown <= 1.1 * self or (self <= shown <= 10 * self and np.log10(shown).is_integer())


def installed(name, extras, found):
    """Return the sizes, bytes, of the packages that a package with some extras needs, without those that are not here."""
    for text in metadata.distribution(name).requires or ():
        needed = Requirement(text)
        if needed.marker and not any(needed.marker.evaluate({"extra": each}) for each in extras or {""}):
            continue
        if (key := (needed.name.lower(), *sorted(needed.extras))) not in found:
            files = metadata.distribution(needed.name).files or ()
            found[key] = sum(file.size or 0 for file in files)
            installed(needed.name, needed.extras, found)
    return found


def chosen(rows):
    drifts = [value for (_, name, _), value in rows.value.items() if name == rows.program.CHOSEN]
    assert len(drifts) == len(registry.list_scenes())
    return [Up(max(drifts)), len(drifts)]


def moving(rows, *names):
    """Return the errors of motions of the picture. Energy and momentum drift, except those of the paper's map."""
    for name in rows.measure.MOVING:
        drifts = [rows.value["picture", name, f"drift of {each}"] for each in ("energy", "momentum")]
        assert max(drifts) < 1e-15 if name == "reduced" else min(drifts) > 1e-12  # measured 7e-16, and 5e-11 or more
    return [Up(rows.value["picture", name, "error"]) for name in names]


def steps(rows):
    """Return the steps of the picture, ms: those of users."""
    assert registry.method("mujoco:Euler").method_info.usual_dt == rows.value["picture", "MuJoCo, default", "step"]
    assert BRICK.dt == rows.value["picture", "reduced", "step"]
    return [Near(1e3 * rows.value["picture", name, "step"]) for name in ("MuJoCo, default", "reduced")]


def conserved(rows):
    kept = [rows.value[scene, "reduced", f"drift of {name}"] for scene, name in rows.program.KEPT]
    return Up(max(kept))


def turned(rows):
    exact = cv.integrate(BRICK, dt=0.01, method=registry.method("exact"))
    assert count_turns_over(exact) == 2
    return [BRICK.t_end]


def python(rows):
    allowed = SpecifierSet(metadata.metadata("conservative-rotation")["Requires-Python"])
    assert [minor for minor in range(30) if allowed.contains(f"3.{minor}")] == [11, 12, 13, 14]
    extras = {"report", "engines", "environments"}
    size = sum({key[0]: size for key, size in installed("conservative-rotation", extras, {}).items()}.values())
    assert 1e9 < size < 1.6e9  # measured 1.25e9 with Python 3.11, and 1.47e9 on the disk with compiled files
    return [3.11, 3.14, 1.5]


def tolerances(rows):
    return [registry.method("heyoka").tol, registry.method("scipy:loop=compiled").rtol]


def of_bodies(rows):
    errors = sorted({float(place.split()[1]) for place in rows.of(rows.program.BODIES)}, reverse=True)
    fields = {place.split()[0] for place in rows.of(rows.program.BODIES)}
    assert (len(errors), len(fields)) == (11, 5)
    assert "12 rad" in random.__doc__
    return [12, rows.bodies("bodies in each field"), errors[0], errors[-1]]


def cases(rows):
    lost = rows.bodies("cases lost")
    return [*([lost] if lost else []), rows.bodies("cases")]


def never_lost(rows):
    """With no loss among n bodies, a share p of losses has a probability of (1 - p)^n: 5 % at the upper bound of p."""
    bodies = 5 * rows.bodies("bodies in each field")
    assert rows.bodies("cases lost") == 0
    return [bodies, 95, Near(100 * (1 - 0.05 ** (1 / bodies)))]


def ends(rows, name):
    """Return the smallest and the largest ratio of a part, with their intervals."""
    every = sorted(rows.program.interval(rows.value, place, name) for place in rows.of(name) if "all" not in place)
    return [Near(each) for ratio in (every[0], every[-1]) for each in ratio]


def typed(rows):
    name = rows.program.TYPED
    tolerances = sorted({float(each.split()[-1]) for each in rows.of(name)})
    single = [min(rows.of(name, ", smallest").values()), max(rows.of(name, ", largest").values())]
    bodies = rows.program.same_tolerance(rows.value).bodies
    return [tolerances[-1], tolerances[0], *ends(rows, name), bodies, *map(Near, single)]


def same(rows):
    """Return the tolerances, the ratios of the fields in which `Taylor` is faster, and its ratio on the worst body."""
    found = rows.program.same_tolerance(rows.value)
    return [1e-3, 1e-12, *map(Near, found.means), found.bodies, Near(found.worst)]


def lost_in(field):
    def check(rows):
        found = rows.program.same_tolerance(rows.value)
        return [*map(Near, dict(found.lost)[rows.program.FIELDS[field]])]

    return check


def once(rows):
    assert importlib.import_module("price").TOL == 1e-9
    first = [rows.value["price", side, "first run of another body"] for side in ("conservative", "heyoka")]
    return [Near(1e3 * first[1]), 1e-6, Near(1e3 * first[0])]


def fastest_on(scene, durations):
    def check(rows):
        found = map(float, re.findall(rf"{scene}:t_end=(\d+)", rows.measure.LONGER))
        assert [registry.scene(scene).t_end, *found] == pytest.approx(durations, rel=0.01)
        sides = [(scene, name) for name in ("ours", "closed form")]
        return [*durations, *(each for side in sides for each in (rows.ratios, rows.slower)[rows.loses(*side)](*side))]

    return check


def accurate(scene):
    return lambda rows: [Up(rows.value[scene, name, "error"]) for name in ("heyoka", "ours")]


def slower_place(rows):
    (place,) = [place for place, high in rows.of(rows.program.GENERAL, ", high").items() if high < 1]
    return [*rows.ratios(place, rows.program.GENERAL), 20, 1e-6]


def faster_place(rows):
    ratio, *_, duration, error = slower_place(rows)
    return [Near(1 / ratio), duration, error]


def price(*quantities):
    def check(rows):
        return [Near(scale * rows.value["price", side, name]) for side, name, scale in quantities]

    return check


def many(rows):
    errors = [1e-3, 1e-9]
    ratios = [rows.value[f"one body, median, {error} rad", rows.program.MANY, rows.program.RATIO] for error in ("1e-3", "1e-9")]
    return [Near(ratios[0]), errors[0], Near(ratios[1]), errors[1]]


def cited(rows):
    assert "COMPDYN 2013" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    return [2013]


FIRST = "first run of another body"
CLAIMS = {
    # README
    r"\* the drift of energy and momentum": lambda rows: [],
    "In a clone, with Python": python,
    "In 6 s the attitude error of MuJoCo's Euler": lambda rows: [BRICK.t_end, *moving(rows, "MuJoCo, default")],
    "The error of MuJoCo's RK4 stays within": lambda rows: moving(rows, "MuJoCo, RK4"),
    "The error of Krenk and Nielsen's integrator stays within": lambda rows: moving(rows, "reduced"),
    "A brick that turns over twice": turned,
    r"MuJoCo's default integrator and its RK4 \(": steps,
    "Largest relative drifts": tolerances,
    r"\*Time\* is the wall time": lambda rows: [rows.measure.ERROR],
    "`x` conserves the brick's energy": lambda rows: [conserved(rows), Up(rows.value["brick_flip", "reduced", "error"])],
    "MuJoCo's RK4 drifts by": lambda rows: [
        Up(rows.value["brick_flip", "MuJoCo", each]) for each in ("drift of momentum", "error")
    ],
    "At the same tolerance": same,
    r"\* In gravity, heyoka is": lost_in("gravity"),
    r"\* In a spring, heyoka is": lost_in("spring"),
    r"\* In a point attraction, heyoka is": lost_in("attraction"),
    r"\* In a turning gravity gradient, as of a satellite, heyoka is": lost_in("gradient"),
    r"\* In a fixed gravity gradient, heyoka is": lost_in("fixed_gradient"),
    r"\* heyoka is faster than `x`: ": lambda rows: [
        rows.slower(scene, "closed form")[0] for scene in ("lagrange_top", "nutating_top") if rows.loses(scene, "closed form")
    ],
    r"\* heyoka is [\d.]+ times as fast as our general": faster_place,
    r"\* heyoka is cheaper for a single run": once,
    # both
    "Measured on": lambda rows: [float(day[:4]) for day in rows.date.split(" to ")],
    "Nielsen, ": cited,
    # entrants
    r"\* `x` is the integrator of Krenk and Nielsen": lambda rows: [cv.Reduced().order],
    "`integrate.*` chooses a method": lambda rows: [rows.measure.ERROR],
    "On each of the .* registered scenes": lambda rows: chosen(rows)[::-1],
    r"\* At the same tolerance": typed,
    r"\* At the same error": lambda rows: ends(rows, rows.program.BODIES),
    "The factors are geometric means for motions of": of_bodies,
    "Our closed forms do not solve these": cases,
    r"These are \d+ bodies": never_lost,
    "Single bodies differ from the mean": lambda rows: [
        Near(rows.bodies("smallest ratio")),
        Near(rows.bodies("largest ratio")),
    ],
    r"\* Motions that our closed forms solve": fastest_on("brick_flip", [6, 24, 96]),
    r"On the steady top \(": fastest_on("lagrange_top", [0.63, 2, 8]),
    r"On the nutating top \(": fastest_on("nutating_top", [2]),
    r"\* Many initial states of one body": many,
    "At the steps of .* `x` conserves": lambda rows: [
        conserved(rows),
        Up(100 * rows.value["lagrange_top", "reduced", "drift of axial momentum"]),
    ],
    "Its attitude error is": lambda rows: [
        *(Up(rows.value[each, "reduced", "error"]) for each in ("brick_flip", "lagrange_top")),
        cv.Reduced().order,
    ],
    "Parentheses contain intervals": lambda rows: [100 * speed_ratio.CONFIDENCE],
    "They hold for this machine": lambda rows: [10, 20],  # measured by a reader
    r"\* heyoka is more accurate than `x` on the brick": accurate("brick_flip"),
    r"\* heyoka is more accurate than `x` on the steady top": accurate("lagrange_top"),
    r"\* heyoka is more accurate than `x` on the nutating top": accurate("nutating_top"),
    r"\* heyoka is [\d.]+ \(.*\) times as fast as `x` on the steady top": lambda rows: [
        *rows.slower("lagrange_top", "closed form"),
        0.63,
        2,
        8,
    ],
    r"\* heyoka is [\d.]+ \(.*\) times as fast as `x` on the nutating top": lambda rows: [
        *rows.slower("nutating_top", "closed form"),
        2,
    ],
    r"\* heyoka takes .* of the time of our general integrators": slower_place,
    r"\* A single call for a new body": lambda rows: [1e-6, *price(("heyoka", FIRST, 1e3))(rows), 1e-9],
    "`integrate.*` takes": lambda rows: [1e-6, *price(("conservative", FIRST, 1e3))(rows)],
    r"\* One run in a new process": lambda rows: [
        *price(("heyoka", "one run", 1))(rows),
        1e-6,
        *price(("conservative", "one run", 1))(rows),
    ],
}
"""A row for each sentence, by its beginning: a function of the rows of measured.csv that returns its numbers in order."""


def named(sentence):
    """Return the rows of a sentence."""
    return [row for beginning, row in CLAIMS.items() if re.match(beginning, sentence)]


def telling():
    return [sentence for sentence in sentences() if TELLING.search(sentence)]


def test_each_sentence_with_a_number_or_about_conservation_has_a_row():
    assert [each for each in telling() if len(named(each)) != 1] == []
    assert len(telling()) > 30


@pytest.mark.parametrize("sentence", ["It conserves energy.", "It takes 3 ms.", "Its energy drifts."])
def test_a_sentence_without_a_row_is_found(sentence):
    assert TELLING.search(sentence)
    assert named(sentence) == []


@pytest.mark.parametrize("sentence", telling(), ids=lambda sentence: sentence[:40])
def test_the_numbers_of_a_sentence_are_those_of_its_row(sentence):
    (row,) = named(sentence)
    expected, shown = row(Rows()), told(sentence)
    assert len(shown) == len(expected), (shown, expected)
    assert all(
        want.allows(number) if isinstance(want, Near | Up) else number == pytest.approx(want, rel=1e-12)
        for number, want in zip(shown, expected, strict=True)
    ), (shown, expected)


@pytest.mark.parametrize(
    "sentence",
    [
        "The error of Krenk and Nielsen's integrator stays within 0.05 rad, and it conserves both.]",
        "In 6 s the attitude error of MuJoCo's Euler reaches 0.6 rad, and it drifts in energy and momentum.",
    ],
)
def test_a_number_that_is_rounded_down_is_found(sentence):
    with pytest.raises(AssertionError):
        test_the_numbers_of_a_sentence_are_those_of_its_row(sentence)


FEW = ("kovalevskaya_top", "sprung_body", "lagrange_top", "brick_flip", "tumbling_satellite", "thrown_box", "volterra_gyrostat")
"""A scene of each kind of motion, with the largest drifts of all first."""


@pytest.mark.parametrize(
    "name", [pytest.param(scene, marks=() if scene in FEW else pytest.mark.slow) for scene in registry.list_scenes()]
)
def test_the_methods_that_are_chosen_conserve(name):
    method, drift = importlib.import_module("rows").chosen_drift(name)
    (limit, _), rows = chosen(Rows()), Rows()
    assert drift <= 1e-13, method  # measured 3.1e-14 for the integral of Kovalevskaya's top, and at most 5.7e-15 elsewhere
    assert limit <= 1e-13
    assert (name, rows.program.CHOSEN, "largest drift") in rows.value


@pytest.mark.parametrize("scene", [BRICK, TOP, NUTATING], ids=lambda scene: scene.name)
def test_the_rows_of_the_papers_map_are_measured(scene):
    """It does not conserve the momentum about the axis of the top."""
    run, exact = (cv.integrate(scene, dt=scene.dt, method=registry.method(name)) for name in ("reduced", "exact"))
    rows = Rows().value
    assert run.error(exact).max() == pytest.approx(rows[scene.name, "reduced", "error"], rel=1e-6)  # measured 4e-12
    for invariant in scene.invariants:
        drift, row = (
            float(np.linalg.norm(np.atleast_2d(run.drift(invariant).T).T, axis=1).max()),
            rows[scene.name, "reduced", f"drift of {invariant.name}"],
        )
        assert drift == pytest.approx(row, rel=1e-6, abs=1e-15)


@pytest.mark.parametrize("name", ["ours", "closed form"])
@pytest.mark.parametrize("scene", [BRICK, TOP, NUTATING], ids=lambda scene: scene.name)
def test_the_rows_of_our_methods_are_measured(scene, name):
    """`Taylor`, and `MoserVeselov` on the brick and `Lame` on the top: rounding errors, as the tables show them."""
    program = importlib.import_module("measured")
    rows = {row["quantity"]: row for row in program.read_csv(program.ROWS) if (row["scene"], row["name"]) == (scene.name, name)}
    run, exact = (cv.integrate(scene, dt=scene.dt, method=registry.method(each)) for each in (rows["error"]["method"], "exact"))
    for invariant in scene.invariants:
        drift = float(np.linalg.norm(np.reshape(run.drift(invariant), (len(run), -1)), axis=1).max())
        assert drift < 2e-15  # measured 7.2e-16
        assert program.small(float(rows[f"drift of {invariant.name}"]["value"])) == "< 1e-15"
    error = run.error(exact).max()  # the closed form is the truth itself
    assert error <= 3e-14 or error == pytest.approx(float(rows["error"]["value"]), rel=0.2)  # measured 1.2e-11 of 1.2e-11


def test_the_table_has_each_method_on_each_scene_the_most_accurate_first():
    rows, text = Rows(), (ROOT / "README.md").read_text(encoding="utf-8")
    groups = re.split(r"^\| \*\*.*\n", text.partition("| --- |")[2].partition("\n\n")[0], flags=re.MULTILINE)[1:]
    assert len(groups) == len(rows.program.SCENES) == len(rows.measure.CLOSED_FORMS)
    for scene, group in zip(rows.program.SCENES, groups, strict=True):
        lines = [[cell.strip() for cell in line.split("|")[1:-1]] for line in group.splitlines()]
        errors = [float(line[4]) if line[4] != "diverges" else np.inf for line in lines]
        expected = sorted(rows.value[scene, name, "error"] for name in rows.program.LABELS)
        assert len(lines) == len(rows.program.LABELS) == len(rows.measure.methods_on(scene))
        assert all(Up(want).allows(shown) or shown == want for shown, want in zip(errors, expected, strict=True))
