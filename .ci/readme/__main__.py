"""Write README.md from README.md.j2 and measured.csv, which lie beside this file, and the tables of benchmarks/README.md.

    python .ci/readme                    # write both
    python .ci/readme --check            # exit with 1 if one of them is not current
    python .ci/readme --measured REPORT TIMES [RANDOM] --scenes TIMES EACH_STEP --many FOLDER --price

The last form first replaces rows of measured.csv, from the folders of a report and of studies, and the picture. Options can be
left out; the rows of others stay. CONTRIBUTING.md has the commands that make the folders.
"""

from __future__ import annotations

import argparse
import csv
import math
import sys
from pathlib import Path

import jinja2

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
BENCHMARKS, MARK = ROOT / "benchmarks" / "README.md", "<!-- of measured.csv: python .ci/readme -->\n"
"""The page with the other tables, and the line before and after each."""
README, PICTURE = ROOT / "README.md", ROOT / "reports" / "pictures" / "time_against_error.svg"
ROWS = HERE / "measured.csv"
REPORT, BODIES, SCENES, MANY, PRICE = "report", "random bodies", "three scenes", "many bodies", "price"
"""Parts of measured.csv, in its order."""
RATIO, GENERAL = "heyoka's time over ours", "our general integrators"
VARIANTS = {"MuJoCo": "RK4", "Pinocchio": "RK4", "SciPy": "DOP853"}


def read_rows() -> list[dict[str, str]]:
    """Return the rows of measured.csv."""
    with ROWS.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def part_of(row: dict[str, str]) -> str:
    """Return the part to which a row belongs."""
    known = [each for each in (row["name"], row["scene"]) if each in (BODIES, MANY, PRICE)]
    return known[0] if known else SCENES if "," in row["scene"] else REPORT


def read_values() -> tuple[dict[tuple[str, str, str], float], dict[str, str], str]:
    """Return the values by scene, name and quantity, the versions by name, and the last date of README's rows."""
    rows = read_rows()
    values = {(row["scene"], row["name"], row["quantity"]): float(row["value"]) for row in rows}
    dates = [row["date"] for row in rows if part_of(row) in (REPORT, BODIES)]
    return values, {row["name"]: row["version"] for row in rows if row["version"]}, max(dates)


def interval(values: dict[tuple[str, str, str], float], *place: str) -> list[float]:
    """Return the ratio of a place and the ends of its interval."""
    return [values[*place, f"{RATIO}{end}"] for end in ("", ", low", ", high")]


def render() -> str:
    """Return the text of README.md."""
    values, versions, date = read_values()
    environment = jinja2.Environment(keep_trailing_newline=True, undefined=jinja2.StrictUndefined)
    environment.filters |= {"two_digits": two_digits, "small": small, "ratio": ratio_text}
    return environment.from_string((HERE / "README.md.j2").read_text(encoding="utf-8")).render(
        value=lambda *key: values[key],
        interval=lambda *place: interval(values, *place),
        ratios=sorted(interval(values, *key[:2]) for key in values if key[1:] == (BODIES, RATIO)),
        count=lambda quantity: int(values["all fields", BODIES, quantity]),
        version=versions,
        date=date,
    )


def render_table() -> str:
    """Return heyoka's time over ours on random bodies, a row for each error and a column for each field, and the counts."""
    values, *_ = read_values()
    places = [place.split(" ")[:2] for place, *key in values if key == [BODIES, RATIO]]
    fields, errors = (list(dict.fromkeys(each)) for each in zip(*places, strict=True))
    head = [["error, rad", *(field.replace("_", " ") for field in fields)], ["---"] * (len(fields) + 1)]
    cells = [[ratio_text(interval(values, f"{field} {error} rad", BODIES)) for field in fields] for error in errors]
    lines = [*head, *([f"{float(error):.0e}".replace("e-0", "e-"), *row] for error, row in zip(errors, cells, strict=True))]
    cases, won, undecided, lost = (
        int(values["all fields", BODIES, f"cases{which}"]) for which in ("", " won", " open", " lost")
    )
    counts = f"\nOf these {cases} cases, a body at an error, ours won {won} and lost {lost}; {undecided} are open.\n"
    return as_markdown(lines) + counts + origin(BODIES) + "\n"


def render_scenes() -> str:
    """Return the times of all sides on three scenes, a row for each error and kind of run, the fastest in bold."""
    values, versions, _ = read_values()
    places = list(dict.fromkeys(place for place, name, _ in values if name == GENERAL))
    timed = [key[1] for key, value in values.items() if key[0] in places and key[2] == "time" and math.isfinite(value)]
    sides = list(dict.fromkeys(timed))
    titles = [" ".join([each, *([versions[each]] if each in versions else [])]) for each in sides]
    titles = [f"{title}, {VARIANTS[each]}" if each in VARIANTS else title for each, title in zip(sides, titles, strict=True)]
    lines = [["scene", "error, rad", *titles, "heyoka / general"], ["---"] * (len(sides) + 3)]
    before = ""
    for place in places:
        scene, _, what = place.partition(", ")
        times = [values.get((place, side, "time"), math.inf) for side in sides]
        cells = [two_digits(time) for time in times]
        if math.isfinite(times[0]):  # all sides
            fastest = times.index(min(times))
            cells[fastest] = f"**{cells[fastest]}**"
        lines.append([scene if scene != before else "", what, *cells, ratio_text(interval(values, place, GENERAL))])
        before = scene
    return as_markdown(lines) + f"\n{origin(SCENES)}\n"


def render_many() -> str:
    """Return heyoka's time over ours for many bodies, a row for each kind and statistic and a column for each error."""
    values, *_ = read_values()
    places = [tuple(place.split(", ")) for place, *key in values if key == [MANY, RATIO]]
    errors = list(dict.fromkeys(error for *_, error in places))
    lines, before = [["bodies", "errors", *errors], ["---"] * (len(errors) + 2)], ""
    for kind, statistic in dict.fromkeys(place[:2] for place in places):
        ratios = [ratio_text(interval(values, f"{kind}, {statistic}, {error}", MANY), 2) for error in errors]
        lines.append([kind if kind != before else "", statistic.replace("95 %", "95th percentile"), *ratios])
        before = kind
    return as_markdown(lines) + f"\n{origin(MANY)}\n"


def render_price() -> str:
    """Return the rows of the table of prices, one for each side, with the lowest values in bold."""
    rows, (_, versions, _) = [row for row in read_rows() if part_of(row) == PRICE], read_values()
    quantities = {row["quantity"]: row["unit"] for row in rows}
    value = {(row["name"], row["quantity"]): float(row["value"]) for row in rows}
    sides = list(dict.fromkeys(row["name"] for row in rows))
    lines = [["side", *(f"{name}, {unit}" for name, unit in quantities.items())], ["---"] * (len(quantities) + 1)]
    for side in sides:
        line = [f"{side} {versions[side]}" if side in versions else side]
        for name, unit in quantities.items():
            text = (
                f"{value[side, name]:.1e}".replace("e-0", "e-")
                if unit == "rad"
                else f"{value[side, name]:#.2g}".removesuffix(".")
            )
            least = unit != "rad" and value[side, name] == min(value[each, name] for each in sides)
            line.append(f"**{text}**" if least else text)
        lines.append(line)
    return as_markdown(lines) + f"\n{origin(PRICE)}\n"


def as_markdown(lines: list[list[str]]) -> str:
    """Return lines of cells as a table."""
    return "".join(f"| {' | '.join(line)} |\n".replace("|  |", "| |") for line in lines)


def origin(part: str) -> str:
    """Return the date and the commands of a part as a sentence."""
    rows = [row for row in read_rows() if part_of(row) == part]
    commands = " and ".join(dict.fromkeys(f"`{row['command']}`" for row in rows))
    return f"Measured on {max(row['date'] for row in rows)} by {commands}."


def ratio_text(ratio: list[float], digits: int = 3) -> str:
    """Return a ratio with its interval, such as `2.67 (2.59 to 2.75)`."""
    mean, low, high = (f"{each:#.{digits}g}".removesuffix(".") for each in ratio)
    return f"{mean} ({low} to {high})"


def two_digits(value: float) -> str:
    """Return a number to two digits, `21,000` or `0.037`, as times of two reports differ in the third; a dash for inf."""
    return f"{float(f'{value:.2g}'):,g}" if math.isfinite(value) else "–"


def small(value: float) -> str:
    """Return an error or a drift to one digit; below 1e-15 it is round-off."""
    return "< 1e-15" if value < 1e-15 else f"{value:.0e}".replace("e-0", "e-") if value < 0.01 else f"{value:.1g}"


def main() -> None:
    """Write or check the pages."""
    parser = argparse.ArgumentParser(
        prog="python .ci/readme", description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--check", action="store_true", help="write nothing; exit with 1 if a page is not current")
    parser.add_argument(
        "--measured", nargs="+", type=Path, metavar="FOLDER", help="REPORT TIMES [RANDOM]: folders of new measurements"
    )
    parser.add_argument("--scenes", nargs=2, type=Path, metavar="FOLDER", help="TIMES EACH_STEP: the table of three scenes")
    parser.add_argument("--many", type=Path, metavar="FOLDER", help="the table of many bodies")
    parser.add_argument("--price", action="store_true", help="measure the table of prices, in new processes")
    options = parser.parse_args()
    if options.measured or options.scenes or options.many or options.price:
        import measure  # beside this file, as is `price`; they need the package
        import price

        report, times, *random = options.measured or (None, None)
        made = {
            REPORT: measure.scene_rows(report, times) if report else None,
            BODIES: measure.random_rows(*random) if random else None,
            SCENES: measure.three_scenes(*options.scenes) if options.scenes else None,
            MANY: measure.many_rows(options.many) if options.many else None,
            PRICE: price.price_rows(price.measure_pairs()) if options.price else None,
        }
        old = read_rows()
        rows = [row for part, new in made.items() for row in new or [each for each in old if part_of(each) == part]]
        with ROWS.open("w", encoding="utf-8", newline="") as file:
            writer = csv.DictWriter(file, measure.COLUMNS, lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)
        if report:
            measure.draw(report, PICTURE)
    parts = (page := BENCHMARKS.read_text(encoding="utf-8")).split(MARK)
    parts[1::2] = render_table(), render_scenes(), render_many(), render_price()
    new = {README: render(), BENCHMARKS: MARK.join(parts)}
    if options.check and [new[README], new[BENCHMARKS]] != [README.read_text(encoding="utf-8"), page]:
        sys.exit("README.md or benchmarks/README.md differs from measured.csv and the template. Run: python .ci/readme")
    if not options.check:
        for path, text in new.items():
            path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
