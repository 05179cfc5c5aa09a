"""README.md and the tables of times, from measured.csv and README.md.j2, which are beside this file."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import jinja2
from marks import table

from conservative.reports.document.cells import angle, bound, tolerance

HERE = Path(__file__).resolve().parent
ROWS = HERE / "measured.csv"
ACCURACY, TIMES, BODIES, TYPED, SCENES = "accuracy", "times", "random bodies", "typed tolerance", "three scenes"
PICTURE, CHOSEN = "picture", "chosen method"
EACH_STEP, MANY, PRICE, CALLS = "each step", "many bodies", "price", "call"
"""Parts of measured.csv, in its order: times are those of README and of the table of three scenes without the scenes' steps."""
STEPS = ", the scene's steps", ", without the conversion"
RATIO, GENERAL, CLOSED = "heyoka's time over ours", "our general integrators", "our closed forms"
KEPT = [
    (scene, invariant)
    for scene, momentum in (("brick_flip", "momentum"), ("lagrange_top", "vertical momentum"))
    for invariant in ("energy", momentum)
]
"""Quantities that the map of the paper conserves."""
VARIANTS = {"MuJoCo": "RK4", "Pinocchio": "RK4"}


def read_rows() -> list[dict[str, str]]:
    """Return the rows of measured.csv."""
    with ROWS.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def part_of(row: dict[str, str]) -> str:
    """Return the part to which a row belongs."""
    known = [each for each in (row["name"], row["scene"]) if each in (BODIES, TYPED, MANY, PRICE, CALLS, PICTURE, CHOSEN)]
    if known:
        return known[0]
    if "," in row["scene"]:
        return EACH_STEP if any(each in row["scene"] for each in STEPS) else TIMES
    return ACCURACY if row["quantity"] == "error" or row["quantity"].startswith("drift of ") else TIMES


def read_values() -> tuple[dict[tuple[str, str, str], float], dict[str, str], str]:
    """Return the values by scene, name and quantity, the versions by name, and the last date of README's times."""
    rows = read_rows()
    values = {(row["scene"], row["name"], row["quantity"]): float(row["value"]) for row in rows}
    dates = [row["date"] for row in rows if part_of(row) in (TIMES, BODIES)]
    return values, {row["name"]: row["version"] for row in rows if row["version"]}, max(dates)


def interval(values: dict[tuple[str, str, str], float], *place: str) -> list[float]:
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


def render_bodies() -> str:
    """Return heyoka's time over ours on random bodies, a row for each error and a column for each field, and the counts."""
    values, *_ = read_values()
    places = [place.split(" ")[:2] for place, *key in values if key == [BODIES, RATIO]]
    fields, errors = (list(dict.fromkeys(each)) for each in zip(*places, strict=True))
    head = ["error, rad", *(field.replace("_", " ") for field in fields)]
    cells = [[ratio_text(interval(values, f"{field} {error} rad", BODIES)) for field in fields] for error in errors]
    lines = [[f"{float(error):.0e}".replace("e-0", "e-"), *row] for error, row in zip(errors, cells, strict=True)]
    cases, won, undecided, lost = (
        int(values["all fields", BODIES, f"cases{which}"]) for which in ("", " won", " open", " lost")
    )
    counts = f"\nOf these {cases} cases, a body at an error, ours won {won} and lost {lost}; {undecided} are open"
    unreached = count_unreached(values)
    counts += f", and in {unreached} neither side reaches the error.\n" if unreached else ".\n"
    return table(head, lines) + counts + origin(BODIES) + "\n"


def count_unreached(values: dict[tuple[str, str, str], float]) -> int:
    """Return in how many cases neither side reaches the error: those that are neither won nor lost nor open."""
    cases, *others = (int(values["all fields", BODIES, f"cases{which}"]) for which in ("", " won", " open", " lost"))
    return cases - sum(others)


def render_typed() -> str:
    """Return heyoka's time over ours at the same typed tolerance, a row for each, and the errors of both sides."""
    values, *_ = read_values()
    places = [place.rsplit(" ", 1) for place, *key in values if key == [TYPED, RATIO]]
    fields, tolerances = (list(dict.fromkeys(each)) for each in zip(*places, strict=True))
    lines = []
    for typed in tolerances:
        ratios = [ratio_text(interval(values, f"{field} {typed}", TYPED)) for field in fields]
        every = f"all fields {typed}", TYPED
        single = [f"{values[*every, f'{RATIO}, {end}']:#.3g}" for end in ("smallest", "largest")]
        errors = [
            " to ".join(bound(values[*every, f"{side}, {name} error"], 1) for name in ("median", "largest"))
            for side in ("ours", "heyoka")
        ]
        lines.append([f"{float(typed):.0e}".replace("e-0", "e-"), *ratios, " to ".join(single), *errors])
    head = ["tolerance", *(field.replace("_", " ") for field in fields), "single bodies"]
    return table([*head, "our error, rad", "heyoka's error, rad"], lines) + f"\n{origin(TYPED)}\n"


def render_scenes() -> str:
    """Return the times of all sides on three scenes, a row for each error and kind of run.

    The fastest is in bold. Closed forms solve few motions and are a class of their own, so they are not compared.
    """
    values, versions, _ = read_values()
    places = list(dict.fromkeys(place for place, name, _ in values if name == GENERAL))
    order = list(dict.fromkeys(place.partition(" ")[0] for place in places))
    places.sort(key=lambda place: order.index(place.partition(" ")[0]))
    timed = [key[1] for key, value in values.items() if key[0] in places and key[2] == "time" and math.isfinite(value)]
    sides = list(dict.fromkeys(timed))
    titles = [" ".join([each, *([versions[each]] if each in versions else [])]) for each in sides]
    titles = [f"{title}, {VARIANTS[each]}" if each in VARIANTS else title for each, title in zip(sides, titles, strict=True)]
    lines: list[list[str]] = []
    before = ""
    for place in places:
        scene, _, what = place.partition(", ")
        times = [values.get((place, side, "time"), math.inf) for side in sides]
        cells = [two_digits(time) for time in times]
        if math.isfinite(times[0]):  # all sides
            fastest = times.index(min(time for time, side in zip(times, sides, strict=True) if side != CLOSED))
            cells[fastest] = f"**{cells[fastest]}**"
        lines.append([scene if scene != before else "", what, *cells, ratio_text(interval(values, place, GENERAL))])
        before = scene
    return table(["scene", "error, rad", *titles, "heyoka / general"], lines) + f"\n{origin(TIMES, EACH_STEP)}\n"


def render_many() -> str:
    """Return heyoka's time over ours for many bodies, a row for each kind and statistic and a column for each error."""
    values, *_ = read_values()
    places = [tuple(place.split(", ")) for place, *key in values if key == [MANY, RATIO]]
    errors = list(dict.fromkeys(error for *_, error in places))
    lines, before = [], ""
    for kind, statistic in dict.fromkeys(place[:2] for place in places):
        ratios = [ratio_text(interval(values, f"{kind}, {statistic}, {error}", MANY), 2) for error in errors]
        lines.append([kind if kind != before else "", statistic.replace("95 %", "95th percentile"), *ratios])
        before = kind
    return table(["bodies", "errors", *errors], lines) + f"\n{origin(MANY)}\n"


def render_price() -> str:
    """Return the rows of the table of prices, one for each side, with the lowest values in bold."""
    rows, (_, versions, _) = [row for row in read_rows() if part_of(row) == PRICE], read_values()
    quantities = {row["quantity"]: row["unit"] for row in rows}
    value = {(row["name"], row["quantity"]): float(row["value"]) for row in rows}
    sides = list(dict.fromkeys(row["name"] for row in rows))
    lines = []
    for side in sides:
        line = [f"{side} {versions[side]}" if side in versions else side]
        for name, unit in quantities.items():
            text = bound(value[side, name]) if unit == "rad" else f"{value[side, name]:#.2g}".removesuffix(".")
            least = unit != "rad" and value[side, name] == min(value[each, name] for each in sides)
            line.append(f"**{text}**" if least else text)
        lines.append(line)
    header = ["side", *(f"{name}, {unit}" for name, unit in quantities.items())]
    return table(header, lines) + f"\n{origin(PRICE)}\n"


def render_calls() -> str:
    """Return the times of a timed call and of the shortest script, and their ratio, a row for each engine."""
    rows = [row for row in read_rows() if part_of(row) == CALLS]
    quantities = list(dict.fromkeys(row["quantity"] for row in rows))
    lines: dict[str, list[str]] = {}
    for row in rows:
        lines.setdefault(row["name"], [row["name"]]).append(f"{float(row['value']):#.3g}".removesuffix("."))
    header = ["engine", *(name if name == "ratio" else f"{name}, µs" for name in quantities)]
    return table(header, list(lines.values())) + f"\n{origin(CALLS)}\n"


def origin(*parts: str) -> str:
    """Return the date and the commands of parts as a sentence."""
    rows = [row for row in read_rows() if part_of(row) in parts]
    each = dict.fromkeys(command for row in rows for command in row["command"].split(" and "))
    commands = " and ".join(f"`{command}`" for command in each)
    return f"Measured on {max(row['date'] for row in rows)} by {commands}."


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
    values, *_ = read_values()
    ratios = sorted(value for (_, *key), value in values.items() if key == [BODIES, RATIO])
    bodies, cases = (int(values["all fields", BODIES, quantity]) for quantity in ("bodies in each field", "cases"))
    fields = len({place.split(" ")[0] for place, *key in values if key == [BODIES, RATIO]})
    return (
        f"On {fields * bodies} such bodies in {fields} fields, at {cases // (fields * bodies)} errors from 1e-2 to 1e-12 rad,\n"
        "the fastest method of this package is, in the geometric mean, between\n"
        f"{ratios[0]:.1f} and {ratios[-1]:.1f} times as fast as the fastest setting of heyoka,\n"
        "which is the fastest other solver that we know.\n"
    )


TABLES = {
    **{BODIES: render_bodies, TYPED: render_typed, SCENES: render_scenes, MANY: render_many, PRICE: render_price},
    **{"calls": render_calls, "range of ratios": render_range},
}
"""Tables of times by the name of their mark."""
