"""Write README.md, conservative/entrants.md and the generated parts of other pages.

These are tables of times, tables of what the code declares, and counts of CSV files.
The motions in the tests of references/motions are generated, too.

    python .ci/readme                 # write them
    python .ci/readme --check         # exit with 1 if one of them is not current
    python .ci/readme --from FOLDER   # first replace rows of measured.csv and the picture, from folders of studies
    python .ci/readme --chosen        # first measure the drifts of chosen methods
    python .ci/readme --price         # first measure runs in new processes

CONTRIBUTING.md has the commands that make the folders. What is not measured again keeps its rows.
"""

from __future__ import annotations

import argparse
import csv
import sys
from pathlib import Path

import accused
import counted
import declared
import measured
from pages import ROOT, fill, names, read_csv

PICTURE = Path("reports", "pictures", "time_against_error.svg")
PACKAGES = ("conservative", "references", "benchmarks", "reports", ".github")


def commands() -> str:
    """Return the commands that measure again, as lines of code."""
    import rows

    return "\n" + "".join(f"    {command} --out ../measured/{name}\n" for name, command in rows.COMMANDS.items()) + "\n"


PARTS = {**measured.TABLES, **declared.TABLES, **counted.TABLES, **accused.TABLES, "commands that measure": commands}


def read_pages(root: Path) -> dict[Path, str]:
    """Return the texts of README.md, of the pages of the packages, and of the tests of motions below a folder."""
    pages = [root / "README.md", *(page for package in PACKAGES for page in (root / package).rglob("*.md"))]
    pages += [root / "references" / "motions" / name for name in declared.MOTION_TESTS]
    return {page: page.read_text(encoding="utf-8") for page in pages}


def measure_again(folder: Path | None, chosen: bool, price: bool) -> None:
    """Replace rows of measured.csv, and the picture."""
    import rows

    new = list(rows.rows_of(folder)) if folder else []
    if chosen:
        new += rows.chosen_rows()
    if price:
        import price as program

        new += program.price_rows()
    every = rows.replaced(read_csv(measured.ROWS), new)
    with measured.ROWS.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, rows.COLUMNS, restval="", lineterminator="\n")
        writer.writeheader()
        writer.writerows(every)
    if folder and (folder / "report").is_dir():
        rows.draw(folder / "report", ROOT / PICTURE)


def main(root: Path = ROOT) -> None:
    """Write or check the pages below a folder."""
    parser = argparse.ArgumentParser(
        prog="python .ci/readme", description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--check", action="store_true", help="write nothing; exit with 1 if a page is not current")
    parser.add_argument("--from", type=Path, dest="folder", metavar="FOLDER", help="folders of studies and of a report")
    parser.add_argument("--chosen", action="store_true", help="measure the drifts of the methods that are chosen")
    parser.add_argument("--price", action="store_true", help="measure runs in new processes")
    options = parser.parse_args()
    if options.folder or options.chosen or options.price:
        measure_again(options.folder, options.chosen, options.price)
    pages = read_pages(root)
    new = {page: fill(text, PARTS) for page, text in pages.items()} | {
        root / page: measured.render_page(page) for page in measured.PAGES
    }
    new |= {page: declared.embed_motions(page.name, text) for page, text in pages.items() if page.name in declared.MOTION_TESTS}
    changed = [page for page in pages if new[page] != pages[page]]
    missing = {*PARTS} - {name for text in pages.values() for name in names(text)}
    if options.check and (changed or missing):
        stale = [f"{page.relative_to(root).as_posix()} is not current" for page in changed]
        sys.exit(f"{'; '.join([*stale, *(f'no page has the part {name!r}' for name in missing)])}. Run: python .ci/readme")
    for page in changed:
        page.write_text(new[page], encoding="utf-8")


if __name__ == "__main__":
    main()
