"""Write README.md from README.md.j2 and measured.csv, which lie beside this file.

    python .ci/readme                    # write README.md
    python .ci/readme --check            # exit with 1 if README.md is not current
    python .ci/readme --measured REPORT [RANDOM]

The last form first replaces measured.csv and the picture, from the folders of a report and of a study of random bodies. Without
RANDOM the rows of random bodies stay.
CONTRIBUTING.md has the commands that make them.
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
README, PICTURE = ROOT / "README.md", ROOT / "reports" / "pictures" / "time_against_error.svg"
ROWS = HERE / "measured.csv"
RATIO = "heyoka's time over ours"


def render() -> str:
    """Return the text of README.md."""
    with ROWS.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    values = {(row["scene"], row["name"], row["quantity"]): float(row["value"]) for row in rows}
    environment = jinja2.Environment(keep_trailing_newline=True, undefined=jinja2.StrictUndefined)
    environment.filters |= {"two_digits": two_digits, "small": small}
    return environment.from_string((HERE / "README.md.j2").read_text(encoding="utf-8")).render(
        value=lambda *key: values[key],
        times=lambda scene, fast, slow: two_digits(values[scene, slow, "time"] / values[scene, fast, "time"]),
        ratios=sorted((value, place) for (place, _, quantity), value in values.items() if quantity == RATIO),
        interval=lambda place: [values.get((place, "random bodies", f"{RATIO}, {end}"), math.nan) for end in ("low", "high")],
        count=lambda quantity: int(values["all fields", "random bodies", quantity]),
        version={row["name"]: row["version"] for row in rows},
        date=max(row["date"] for row in rows),
    )


def two_digits(value: float) -> str:
    """Return a number to two digits, `21,000` or `0.037`, as times of two reports differ in the third; a dash for inf."""
    return f"{float(f'{value:.2g}'):,g}" if math.isfinite(value) else "–"


def small(value: float) -> str:
    """Return an error or a drift to one digit; below 1e-15 it is round-off."""
    return "< 1e-15" if value < 1e-15 else f"{value:.0e}".replace("e-0", "e-") if value < 0.01 else f"{value:.1g}"


def main() -> None:
    """Write or check README.md."""
    parser = argparse.ArgumentParser(
        prog="python .ci/readme", description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--check", action="store_true", help="write nothing; exit with 1 if README.md is not current")
    parser.add_argument(
        "--measured", nargs="+", type=Path, metavar="FOLDER", help="REPORT [RANDOM]: folders of new measurements"
    )
    options = parser.parse_args()
    if options.measured:
        import measure  # beside this file; it needs the package

        report, *random = options.measured
        with ROWS.open(encoding="utf-8", newline="") as file:
            bodies = [row for row in csv.DictReader(file) if row["command"].startswith("conservative study random")]
        new = [*measure.scene_rows(report), *(measure.random_rows(*random) if random else bodies)]
        with ROWS.open("w", encoding="utf-8", newline="") as file:
            writer = csv.DictWriter(file, measure.COLUMNS, lineterminator="\n")
            writer.writeheader()
            writer.writerows(new)
        measure.draw(report, PICTURE)
    text = render()
    if options.check and text != README.read_text(encoding="utf-8"):
        sys.exit("README.md differs from its template and measured.csv. Run: python .ci/readme")
    if not options.check:
        README.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
