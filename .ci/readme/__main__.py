"""Write README.md, and the generated parts of other pages: tables of times, and of what the code declares.

    python .ci/readme                    # write them
    python .ci/readme --check            # exit with 1 if one of them is not current
    python .ci/readme --accuracy FOLDER --moving FOLDER --report FOLDER --times FOLDER [FOLDER ...] --random FOLDER
        --each-step FOLDER --many FOLDER --chosen --typed --price --calls

The last form first replaces rows of measured.csv, from the folders of a report and of studies, and the picture. Options can be
left out; the rows of others stay. CONTRIBUTING.md has the commands that make the folders.
"""

from __future__ import annotations

import argparse
import csv
import sys
from pathlib import Path

import bibliography
import declared
import marks
import measured
import published
from code_map import PACKAGES, ROOT

PICTURE = Path("reports", "pictures", "time_against_error.svg")
PARTS = {**measured.TABLES, **declared.TABLES, **published.TABLES, **bibliography.TABLES}


def read_pages(root: Path) -> dict[Path, str]:
    """Return the texts of README.md and of the pages of the packages below a folder."""
    pages = [root / "README.md", *(page for room in (*PACKAGES, ".github") for page in (root / room).rglob("*.md"))]
    return {page: page.read_text(encoding="utf-8") for page in pages}


def measure_again(options: argparse.Namespace) -> None:
    """Replace rows of measured.csv, and the picture."""
    import calls
    import measure
    import price
    import typed

    made = {
        measured.ACCURACY: measure.accuracy_rows(options.accuracy) if options.accuracy else None,
        measured.PICTURE: measure.picture_rows(options.moving) if options.moving else None,
        measured.CHOSEN: measure.chosen_rows() if options.chosen else None,
        measured.TIMES: measure.time_rows(options.times) if options.times else None,
        measured.BODIES: measure.random_rows(options.random) if options.random else None,
        measured.TYPED: typed.typed_rows(measure.SEED) if options.typed else None,
        measured.EACH_STEP: measure.each_step_rows(options.each_step) if options.each_step else None,
        measured.MANY: measure.many_rows(options.many) if options.many else None,
        measured.PRICE: price.price_rows(price.measure_pairs()) if options.price else None,
        measured.CALLS: calls.call_rows(calls.measure_calls()) if options.calls else None,
    }
    old = measured.read_rows()
    rows = [row for part, new in made.items() for row in new or [each for each in old if measured.part_of(each) == part]]
    with measured.ROWS.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, measure.COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    if options.report:
        measure.draw(options.report, ROOT / PICTURE)


def main(root: Path = ROOT) -> None:
    """Write or check the pages below a folder."""
    parser = argparse.ArgumentParser(
        prog="python .ci/readme", description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--check", action="store_true", help="write nothing; exit with 1 if a page is not current")
    folders = {
        "accuracy": "drifts and errors of README",
        "moving": "drifts and errors of the moving picture of README",
        "report": "the picture of time against error of README",
        "random": "random bodies",
        "each-step": "the scene's steps, in the table of three scenes",
        "many": "the table of many bodies",
    }
    for name, about in folders.items():
        parser.add_argument(f"--{name}", type=Path, metavar="FOLDER", help=about)
    parser.add_argument(
        "--times", nargs="+", type=Path, metavar="FOLDER", help="times of README and of the table of three scenes"
    )
    parser.add_argument("--chosen", action="store_true", help="measure the drifts of the methods that are chosen")
    parser.add_argument("--typed", action="store_true", help="measure the table of typed tolerances")
    parser.add_argument("--price", action="store_true", help="measure the table of prices, in new processes")
    parser.add_argument("--calls", action="store_true", help="measure the table of calls")
    options = parser.parse_args()
    if any(value for name, value in vars(options).items() if name != "check"):
        measure_again(options)
    pages = read_pages(root)
    new = {page: marks.fill(text, PARTS) for page, text in pages.items()} | {root / "README.md": measured.render_readme()}
    changed = [page for page in pages if new[page] != pages[page]]
    missing = {*PARTS} - {name for text in pages.values() for name in marks.names(text)}
    if options.check and (changed or missing):
        stale = [f"{page.relative_to(root).as_posix()} is not current" for page in changed]
        sys.exit(f"{'; '.join([*stale, *(f'no page has the part {name!r}' for name in missing)])}. Run: python .ci/readme")
    for page in changed:
        page.write_text(new[page], encoding="utf-8")


if __name__ == "__main__":
    main()
