"""README.md, the page of our entrants and the tables of times, from measured.csv and the templates beside this file."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import jinja2
import numpy as np
from pages import read_csv, table

import conservative as cv
from conservative import registry
from conservative.reports.document.cells import DASH, angle, bound, tolerance
from conservative.scene import Scene

HERE = Path(__file__).resolve().parent
ROWS = HERE / "measured.csv"
PICTURE, CHOSEN, BODIES, TYPED, MANY = "picture", "chosen method", "random bodies", "typed tolerance", "many bodies"
"""Names or scenes of rows that belong to one part of measured.csv."""
SINGLE = "single bodies"
CALLS = "time of a call, "
"""Beginning of the names of rows about what a call adds to a compiled loop; the kind of the call follows."""
RATIO, GENERAL = "heyoka's time over ours", "our general integrators"
SCENES = {
    "brick_flip": "brick, free rotation",
    "lagrange_top": "top, steady precession",
    "nutating_top": "top, nutating",
}
"""Scenes of README's table, and what they are."""
LABELS = {
    "MuJoCo, Euler": "MuJoCo {}, Euler",
    "MuJoCo": "MuJoCo {}, RK4",
    "Pinocchio": "Pinocchio {}, RK4",
    "SciPy": "SciPy {}, DOP853",
    "heyoka": "heyoka {}",
    "reduced": "Krenk & Nielsen: `Reduced`",
    "ours": "`Taylor(order=12)`",
    "closed form": "closed form: `{}`",
}
"""Methods of README's table: a name with its version, or with the class of the closed form of the scene."""
LOOPS = ", compiled loops"
"""End of the names of rows about compiled loops alone. If there are none, rows without it are about compiled loops, too."""
FIELDS = {
    "gravity": "gravity",
    "spring": "a spring",
    "attraction": "a point attraction",
    "gradient": "a turning gravity gradient, as of a satellite",
    "fixed_gradient": "a fixed gravity gradient",
}
"""Fields of random bodies, and what they are."""
PAGES = {"README.md": "README.md.j2", "conservative/entrants.md": "entrants.md.j2"}
"""Pages that are made from templates."""
KEPT = (("brick_flip", "energy"), ("brick_flip", "momentum"), ("lagrange_top", "energy"), ("lagrange_top", "vertical momentum"))
"""Quantities that the map of the paper conserves."""
SHOWN = ("1e-3", "1e-6", "1e-9", "1e-12")
"""Errors and tolerances that pages show; measured.csv has all decades."""
CLOSED_FORMS = (cv.MoserVeselov(), cv.Lame())
Values = dict[tuple[str, str, str], float]
"""Values by scene, name and quantity."""


def read_values() -> tuple[Values, dict[str, str], str]:
    """Return the values, the versions by name, and the dates of README's times: one, or the first and the last one."""
    rows = read_csv(ROWS)
    others = (TYPED, TYPED + LOOPS, MANY)
    dates = [row["date"] for row in rows if RATIO in row["quantity"] and row["name"] not in others]
    return (
        {(row["scene"], row["name"], row["quantity"]): float(row["value"]) for row in rows},
        {row["name"]: row["version"] for row in rows if row["version"]},
        " to ".join(sorted({min(dates), max(dates)})),
    )


def interval(values: Values, *place: str) -> list[float]:
    """Return the ratio of a place and the ends of its interval."""
    return [values[*place, f"{RATIO}{end}"] for end in ("", ", low", ", high")]


def render_page(page: str = "README.md") -> str:
    """Return the text of one of `PAGES`."""
    values, versions, date = read_values()
    environment = jinja2.Environment(keep_trailing_newline=True, undefined=jinja2.StrictUndefined)
    environment.filters |= {"two_digits": two_digits, "small": small, "angle": angle, "bound": bound, "ratio": ratio_text}
    environment.filters |= {"numbers": numbers}
    return environment.from_string((HERE / PAGES[page]).read_text(encoding="utf-8")).render(
        results=scene_table(values, versions),
        same=same_tolerance(values),
        lame=slower_on_tops(values),
        measured=lambda *key: key in values,
        value=lambda *key: values[key],
        interval=lambda *place: interval(values, *place),
        ratios=sorted(interval(values, *key[:2]) for key in values if key[1:] == (BODIES, RATIO)),
        typed=sorted(interval(values, *key[:2]) for key in values if key[1:] == (TYPED, RATIO) and "all" not in key[0]),
        typed_count=lambda quantity: int(values["all fields", TYPED, quantity]),
        typed_single=[
            pick(value for key, value in values.items() if key[1:] == (TYPED, f"{RATIO}, {end}"))
            for pick, end in ((min, "smallest"), (max, "largest"))
        ],
        count=lambda quantity: int(values["all fields", BODIES, quantity]),
        unreached=count_unreached(values),
        bodies=lambda quantity: values["all fields", BODIES, quantity],
        many=[value for key, value in values.items() if key[1:] == (MANY, RATIO) and key[0].startswith("one body, median")],
        slower=[place for place, *key in values if key == [GENERAL, f"{RATIO}, high"] and values[place, *key] < 1],
        moving=lambda *key: values[PICTURE, *key],
        kept=lambda name: max(values[scene, name, f"drift of {invariant}"] for scene, invariant in KEPT),
        power=power,
        chosen=[value for key, value in values.items() if key[1] == CHOSEN],
        version=versions,
        date=date,
    )


@dataclass(frozen=True)
class SameTolerance:
    """How fast `Taylor` is at the same tolerance as heyoka.

    Attributes
    ----------
    called, bodies
        Whether calls are timed that deliver attitude and rates on both sides, not compiled code alone; bodies in each field.
    won, means, worst
        The fields in which `Taylor` is faster at all tolerances, with the smallest and the largest ratio of a field, and the
        smallest ratio of a body.
    lost
        The other fields, each with the smallest and the largest ratio of our time to heyoka's.
    """

    called: bool
    bodies: int
    won: str
    means: list[float]
    worst: float
    lost: list[tuple[str, list[float]]]


def same_tolerance(values: Values) -> SameTolerance:
    """Return the comparison of calls at the same tolerance, or of compiled code if calls were not measured."""
    called = any(key[1:] == (TYPED + LOOPS, RATIO) for key in values)
    bodies = int(values.get(("all fields", TYPED, "bodies"), 50)) // len(FIELDS)
    means: dict[str, list[float]] = {field: [] for field in FIELDS}
    worst: dict[str, list[float]] = {field: [] for field in FIELDS}
    for (place, *key), value in values.items():
        for found, quantity in ((means, RATIO), (worst, f"{RATIO}, smallest")):
            if key == [TYPED, quantity] and (field := place.split()[0]) in FIELDS:
                found[field].append(value)
    won = [field for field in FIELDS if min(means[field]) > 1]
    every = [mean for field in won for mean in means[field]]
    lost = [(what, [1 / max(means[field]), 1 / min(means[field])]) for field, what in FIELDS.items() if field not in won]
    names = [FIELDS[field] for field in won]
    won_in = " and ".join(filter(None, (", ".join(names[:-1]), *names[-1:])))
    return SameTolerance(called, bodies, won_in, [min(every), max(every)], min(min(worst[field]) for field in won), lost)


def slower_on_tops(values: Values) -> list[tuple[str, list[float]]]:
    """Return the tops on which heyoka is faster than our closed form, with the ratio and the ends of its interval."""
    found = []
    for scene, name in (("lagrange_top", "steady"), ("nutating_top", "nutating")):
        if (scene, "closed form", RATIO) in values and (ratio := interval(values, scene, "closed form"))[2] < 1:
            found.append((name, ratio))
    return found


def scene_table(values: Values, versions: dict[str, str]) -> str:
    """Return README's table: a group of rows for each scene, the smallest attitude error first."""
    lines = []
    for name, what in SCENES.items():
        scene = registry.scene(name)
        angle_of_step = two_digits(float(np.linalg.norm(scene.w_WB_B0)) * scene.dt)
        end, step = two_digits(scene.t_end), f"{scene.dt:g} s ({angle_of_step} rad)"
        lines.append([f"**{what}**, {end} s, steps of {step}", *[""] * 6])
        entrants = sorted(LABELS, key=lambda entrant: values[name, entrant, "error"])
        lines += [_entrant_row(values, versions, scene, entrant) for entrant in entrants]
    return table(["", "energy", "momentum", "axial momentum", "error, rad", "order", "time, µs"], lines)


def _entrant_row(values: Values, versions: dict[str, str], scene: Scene, name: str) -> list[str]:
    """Return drifts, error, order and time of a method on a scene."""
    closed = next(type(method).__name__ for method in CLOSED_FORMS if method.unsupported(scene) is None)
    label = LABELS[name].format(closed if name == "closed form" else versions.get(name, ""))
    drifts = [values[scene.name, name, f"drift of {invariant.name}"] for invariant in scene.invariants]
    error, order = values[scene.name, name, "error"], values.get((scene.name, name, "order"), math.nan)
    shown = [small(drift) if math.isfinite(drift) else DASH for drift in drifts]
    time = values.get((scene.name, name, "time"))
    return [
        label,
        *[*shown, DASH][:3],
        angle(error) if math.isfinite(error) else "diverges",
        DASH if math.isnan(order) else f"{order:.1f}",
        "not timed" if time is None else two_digits(time),
    ]


def count_unreached(values: Values) -> int:
    """Return in how many cases neither side reaches the error: those that are neither won nor lost nor open."""
    cases, *others = (int(values["all fields", BODIES, f"cases{which}"]) for which in ("", " won", " open", " lost"))
    return cases - sum(others)


def fields_of(values: Values, name: str) -> list[str]:
    """Return the fields of the random bodies, in the order of measured.csv."""
    return list(dict.fromkeys(place.split(" ")[0] for place, *key in values if key == [name, RATIO] and "all" not in place))


def ratio_at(values: Values, *place: str) -> str:
    """Return a ratio with its interval; a dash if it is not measured."""
    return ratio_text(interval(values, *place)) if (*place, RATIO) in values else "–"


def range_text(values: Values, place: str, name: str) -> str:
    """Return the smallest and the largest ratio on single bodies; a dash if they are not measured."""
    ends = [values.get((place, name, f"{end} ratio"), math.nan) for end in ("smallest", "largest")]
    return "–" if math.isnan(ends[0]) else " to ".join(f"{end:#.3g}" for end in ends)


def render_bodies(name: str = BODIES) -> str:
    """Return heyoka's time over ours on random bodies, a row for each error and a column for each field."""
    values, *_ = read_values()
    fields = fields_of(values, name)
    lines = [[error, *(ratio_at(values, f"{field} {float(error):g} rad", name) for field in fields)] for error in SHOWN]
    lines.append([SINGLE, *(range_text(values, field, name) for field in fields)])
    return table(["error, rad", *(field.replace("_", " ") for field in fields)], lines)


def render_typed(name: str = TYPED) -> str:
    """Return heyoka's time over ours at the same typed tolerance, a row for each tolerance and a column for each field."""
    values, *_ = read_values()
    fields = fields_of(values, name)
    lines = [[typed, *(ratio_at(values, f"{field} {float(typed):g}", name) for field in fields)] for typed in SHOWN]
    lines.append([SINGLE, *(range_text(values, field, name) for field in fields)])
    return table(["tolerance", *(field.replace("_", " ") for field in fields)], lines)


def render_typed_errors() -> str:
    """Return the errors of both sides at the same typed tolerance, and heyoka's time over ours over all fields."""
    values, *_ = read_values()
    lines = []
    for typed in SHOWN:
        place = f"all fields {float(typed):g}", TYPED
        errors = (
            " to ".join(bound(values[*place, f"{side}, {each} error"], 1) for each in ("median", "largest"))
            for side in ("ours", "heyoka")
        )
        lines.append([typed, ratio_at(values, *place), *errors])
    return table(["tolerance", "all fields", "our error, rad", "heyoka's error, rad"], lines)


def render_cases() -> str:
    """Return the cases by outcome, a row for each comparison, and the largest share of bodies with a lost case."""
    values, *_ = read_values()
    lines = []
    for name, text in CASES.items():
        got = {quantity: value for (place, *key, quantity), value in values.items() if [place, *key] == ["all fields", name]}
        numbers = [f"{got[quantity]:,.0f}" if quantity in got else "–" for quantity in COUNTED]
        share = got.get("largest share of bodies with a lost case", math.nan)
        lines.append([text, *numbers, "–" if math.isnan(share) else f"{100 * share:.2g} %"])
    header = ["comparison", "bodies", "cases", "ours faster", "undecided", "heyoka faster", "bodies with a lost case, at most"]
    return table(header, lines)


CASES = {
    BODIES: "same error, a user's call",
    BODIES + LOOPS: "same error, compiled loops",
    TYPED: "same tolerance, a user's call",
    TYPED + LOOPS: "same tolerance, compiled loops",
}
"""Comparisons on random bodies by the names of their rows."""
COUNTED = ("bodies", "cases", "cases won", "cases open", "cases lost")


def render_calls() -> str:
    """Return the time of a compiled loop and what a call adds to it, a row for each field."""
    values, *_ = read_values()
    kinds = ("Taylor, fixed steps", "Taylor, tolerance", "heyoka")
    fields = list(dict.fromkeys(place for place, name, _ in values if name.startswith(CALLS)))
    header = ["field", *(f"{kind}: loop, µs | {kind}: added, µs" for kind in kinds)]
    lines = [
        [
            field.replace("_", " "),
            *(f"{values[field, f'{CALLS}{kind}', each]:.2g}" for kind in kinds for each in ("loop", "added")),
        ]
        for field in fields
    ]
    return table(" | ".join(header).split(" | "), lines)


def render_price() -> str:
    """Return the times of single runs of both sides, ms."""
    values, *_ = read_values()
    lines = [
        [text, *(two_digits(1e3 * values.get(("price", side, quantity), math.inf)) for side in ("conservative", "heyoka"))]
        for quantity, text in PRICES.items()
    ]
    return table(["run to 1e-6 rad, ms", "`integrate(scene, error=1e-6)`", "heyoka, tolerance 1e-9"], lines)


PRICES = {
    "one run": "first one of a new process, with imports",
    "first run of another body": "new body",
    "next run of the same body": "the same body again",
}
"""Rows of the table of single runs, by their quantities."""


def render_many() -> str:
    """Return heyoka's time over ours for many bodies, a row for each kind and statistic and a column for each error."""
    values, *_ = read_values()
    places = [tuple(place.split(", ")) for place, *key in values if key == [MANY, RATIO]]
    errors = list(dict.fromkeys(error for *_, error in places))
    lines = [
        [*row, *(ratio_text(interval(values, f"{', '.join(row)}, {error}", MANY), 2) for error in errors)]
        for row in dict.fromkeys(place[:2] for place in places)
    ]
    return table(["bodies", "errors", *errors], lines)


def ratio_text(ratio: list[float], digits: int = 3) -> str:
    """Return a ratio with its interval, such as `2.67 (2.59 to 2.75)`."""
    mean, low, high = (f"{each:#.{digits}g}".removesuffix(".") for each in ratio)
    return f"{mean} ({low} to {high})"


def numbers(values: list[float]) -> str:
    """Return numbers to two digits, such as `1.7 to 2.6`."""
    return " to ".join(f"{value:#.2g}".removesuffix(".") for value in values)


def two_digits(value: float) -> str:
    """Return a number to two digits, `21,000` or `0.037`, as times of two reports differ in the third; a dash for inf."""
    return f"{float(f'{value:.2g}'):,g}" if math.isfinite(value) else "–"


def small(value: float) -> str:
    """Return a drift, rounded up; below 1e-15 it is round-off."""
    return "< 1e-15" if value < 1e-15 else bound(value)


def power(value: float) -> str:
    """Return the smallest power of ten that is not below a value."""
    return tolerance(10.0 ** math.ceil(math.log10(value)))


def render_range() -> str:
    """Return the lowest and the highest ratio on random bodies as a sentence of the paper."""
    ratios = sorted(value for (_, *key), value in read_values()[0].items() if key == [BODIES, RATIO])
    return (
        f"The fastest method of this package is, in the geometric mean, between {ratios[0]:.1f} and {ratios[-1]:.1f} times\n"
        "as fast as the fastest setting of heyoka, which is the fastest other solver that we know.\n"
    )


TABLES = {
    BODIES: render_bodies,
    f"{BODIES} compiled": partial(render_bodies, BODIES + LOOPS),
    "cases of random bodies": render_cases,
    TYPED: render_typed,
    f"{TYPED} compiled": partial(render_typed, TYPED + LOOPS),
    f"{TYPED} errors": render_typed_errors,
    MANY: render_many,
    "time of a call": render_calls,
    "price of a run": render_price,
    "range of ratios": render_range,
}
"""Tables of times by the name of their mark."""
