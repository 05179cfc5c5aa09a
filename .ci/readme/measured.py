"""README.md and the tables of times, from measured.csv and README.md.j2, which are beside this file."""

from __future__ import annotations

import math
from pathlib import Path

import jinja2
from pages import read_csv, table

from conservative.reports.document.cells import angle, bound, tolerance

HERE = Path(__file__).resolve().parent
ROWS = HERE / "measured.csv"
PICTURE, CHOSEN, BODIES, TYPED, MANY = "picture", "chosen method", "random bodies", "typed tolerance", "many bodies"
"""Names or scenes of rows that belong to one part of measured.csv."""
RATIO, GENERAL = "heyoka's time over ours", "our general integrators"
KEPT = (("brick_flip", "energy"), ("brick_flip", "momentum"), ("lagrange_top", "energy"), ("lagrange_top", "vertical momentum"))
"""Quantities that the map of the paper conserves."""
SHOWN = ("1e-3", "1e-6", "1e-9", "1e-12")
"""Errors and tolerances that pages show; measured.csv has all decades."""
Values = dict[tuple[str, str, str], float]
"""Values by scene, name and quantity."""


def read_values() -> tuple[Values, dict[str, str], str]:
    """Return the values, the versions by name, and the last date of README's times."""
    rows = read_csv(ROWS)
    dates = [row["date"] for row in rows if RATIO in row["quantity"] and row["name"] not in (TYPED, MANY)]
    return (
        {(row["scene"], row["name"], row["quantity"]): float(row["value"]) for row in rows},
        {row["name"]: row["version"] for row in rows if row["version"]},
        max(dates),
    )


def interval(values: Values, *place: str) -> list[float]:
    """Return the ratio of a place and the ends of its interval."""
    return [values[*place, f"{RATIO}{end}"] for end in ("", ", low", ", high")]


def render_readme() -> str:
    """Return the text of README.md."""
    values, versions, date = read_values()
    environment = jinja2.Environment(keep_trailing_newline=True, undefined=jinja2.StrictUndefined)
    environment.filters |= {"two_digits": two_digits, "small": small, "angle": angle, "bound": bound, "ratio": ratio_text}
    return environment.from_string((HERE / "README.md.j2").read_text(encoding="utf-8")).render(
        value=lambda *key: values[key],
        interval=lambda *place: interval(values, *place),
        ratios=sorted(interval(values, *key[:2]) for key in values if key[1:] == (BODIES, RATIO)),
        typed=sorted(interval(values, *key[:2]) for key in values if key[1:] == (TYPED, RATIO) and "all" not in key[0]),
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


def count_unreached(values: Values) -> int:
    """Return in how many cases neither side reaches the error: those that are neither won nor lost nor open."""
    cases, *others = (int(values["all fields", BODIES, f"cases{which}"]) for which in ("", " won", " open", " lost"))
    return cases - sum(others)


def render_bodies() -> str:
    """Return heyoka's time over ours on random bodies, a row for each error and a column for each field."""
    values, *_ = read_values()
    fields = list(dict.fromkeys(place.split(" ")[0] for place, *key in values if key == [BODIES, RATIO]))
    lines = [
        [error, *(ratio_text(interval(values, f"{field} {float(error):g} rad", BODIES)) for field in fields)] for error in SHOWN
    ]
    return table(["error, rad", *(field.replace("_", " ") for field in fields)], lines)


def render_typed() -> str:
    """Return heyoka's time over ours at the same typed tolerance over all fields, and the errors of both sides."""
    values, *_ = read_values()
    lines = []
    for typed in SHOWN:
        place = f"all fields {float(typed):g}", TYPED
        single = " to ".join(f"{values[*place, f'{RATIO}, {end}']:#.3g}" for end in ("smallest", "largest"))
        errors = (
            " to ".join(bound(values[*place, f"{side}, {each} error"], 1) for each in ("median", "largest"))
            for side in ("ours", "heyoka")
        )
        lines.append([typed, ratio_text(interval(values, *place)), single, *errors])
    return table(["tolerance", "all fields", "single bodies", "our error, rad", "heyoka's error, rad"], lines)


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


TABLES = {BODIES: render_bodies, TYPED: render_typed, MANY: render_many, "range of ratios": render_range}
"""Tables of times by the name of their mark."""
