"""Write README.md from README.md.j2 and measured.csv, which lie beside this file, and a table of benchmarks/README.md.

    python .ci/readme                    # write both
    python .ci/readme --check            # exit with 1 if one of them is not current
    python .ci/readme --measured REPORT TIMES [RANDOM]

The last form first replaces measured.csv and the picture, from the folders of a report, a study of times and a study of random
bodies. Without RANDOM the rows of random bodies stay. CONTRIBUTING.md has the commands that make them.
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
"""The page with the table of random bodies, and the line before and after it."""
README, PICTURE = ROOT / "README.md", ROOT / "reports" / "pictures" / "time_against_error.svg"
ROWS = HERE / "measured.csv"
BODIES, RATIO = "random bodies", "heyoka's time over ours"


def read_values() -> tuple[dict[tuple[str, str, str], float], dict[str, str], str]:
    """Return the values by scene, name and quantity, the versions by name, and the last date."""
    with ROWS.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    values = {(row["scene"], row["name"], row["quantity"]): float(row["value"]) for row in rows}
    return values, {row["name"]: row["version"] for row in rows if row["version"]}, max(row["date"] for row in rows)


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
    return "".join(f"| {' | '.join(line)} |\n" for line in lines) + counts


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
    options = parser.parse_args()
    if options.measured:
        import measure  # beside this file; it needs the package

        report, times, *random = options.measured
        with ROWS.open(encoding="utf-8", newline="") as file:
            bodies = [row for row in csv.DictReader(file) if row["command"].startswith("conservative study random")]
        new = [*measure.scene_rows(report, times), *(measure.random_rows(*random) if random else bodies)]
        with ROWS.open("w", encoding="utf-8", newline="") as file:
            writer = csv.DictWriter(file, measure.COLUMNS, lineterminator="\n")
            writer.writeheader()
            writer.writerows(new)
        measure.draw(report, PICTURE)
    before, _, after = (page := BENCHMARKS.read_text(encoding="utf-8")).split(MARK)
    new = {README: render(), BENCHMARKS: MARK.join((before, render_table(), after))}
    if options.check and [new[README], new[BENCHMARKS]] != [README.read_text(encoding="utf-8"), page]:
        sys.exit("README.md or benchmarks/README.md differs from measured.csv and the template. Run: python .ci/readme")
    if not options.check:
        for path, text in new.items():
            path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
