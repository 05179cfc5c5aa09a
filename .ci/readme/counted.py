"""Tables that count the rows of CSV files: what others published, bodies that engines load, and where mistakes are named."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable

from pages import ROOT, read_csv, table

FIGURES, SOURCES = (ROOT / "tests" / "data" / f"published_{name}.csv" for name in ("figures", "sources"))
BODIES = ROOT / "references" / "model_files" / "measured.csv"
MISTAKES = ROOT / "reports" / "documentation" / "mistakes.csv"
BRICK = ROOT / "references" / "engines" / "brick.csv"
WRAPPED = ROOT / "benchmarks" / "verification" / "pairs" / "wrapped.csv"
LOST = 1.0
"""Attitude errors, rad, above which the attitude is lost."""
LATE = 10
"""Programs that print all digits of a double print their round-off too: figures that differ from here on are counted apart."""


def count(title: str, columns: tuple[str, ...], cells: Iterable[tuple[str, str]]) -> str:
    """Return a table that counts pairs of a row and a column, and nothing for 0."""
    numbers: dict[str, Counter[str]] = {}
    for row, column in cells:
        for each in (row, "all"):
            numbers.setdefault(each, Counter())[column] += 1
    numbers["all"] = numbers.pop("all")
    lines = [[row, *(str(line[column] or "") for column in columns)] for row, line in numbers.items()]
    return table([title, *columns], lines)


def figures() -> str:
    """Return a row for each source of published figures."""
    sources = {row["source"]: f"[{row['title']}]({row['link']})" if row["link"] else row["title"] for row in read_csv(SOURCES)}
    late = lambda row: row["result"] == "differs" and int(row["digit"] or 0) >= LATE  # noqa: E731
    cells = ((sources[row["source"]], "round-off" if late(row) else row["result"]) for row in read_csv(FIGURES))
    return count("source", ("agrees", "round-off", "differs", "not measured"), cells)


def bodies() -> str:
    """Return a row for each engine that loads model files."""
    cells = ((f"{row['engine']} {row['version']}", row["verdict"]) for row in read_csv(BODIES))
    return count("engine", ("right", "wrong", "undecided"), cells)


def mistakes() -> str:
    """Return a row for each kind of subject in which mistakes were planted."""
    answers = ("named", "with others", "another is named", "not named", "cannot be seen")
    cells = [(door, cell) for row in read_csv(MISTAKES) for door, cell in row.items() if door != "mistake"]
    short = ((door, cell if cell in answers else answers[2] if cell.startswith("as ") else answers[4]) for door, cell in cells)
    return count("subject", answers, short)


def brick() -> str:
    """Return a sentence on the engines whose errors on the paper's brick are stored."""
    rows = read_csv(BRICK)
    installed = [float(row["error, rad"]) for row in rows if row["error, rad"]]
    lost = sum(error > LOST for error in installed)
    what = "the largest attitude error, the largest relative energy drift and the observed order"
    return (
        f"[brick.csv](engines/brick.csv) has {what}\n"
        f"of {len(rows)} engines with their best settings, and of {len(installed)} as installed. "
        f"As installed, {lost} of these {len(installed)} lose the attitude (more than 1 rad).\n"
    )


def wrapped() -> str:
    """Return a row for each engine and pair of a file that it saves, sets or scales."""
    rows = [(*row["case"].split(": "), row) for row in read_csv(WRAPPED)]
    groups = dict.fromkeys((row["subject"], pair) for _, pair, row in rows if row["error"] not in ("", "nan"))
    lines = list[list[str]]()
    for subject, pair in groups:
        some = [row for _, name, row in rows if (row["subject"], name) == (subject, pair)]
        verdicts = Counter(row["verdict"] for row in some)
        worst = max((row for row in some if row["error"] != "nan"), key=lambda row: float(row["error"]) / float(row["allowed"]))
        named = dict.fromkeys(row["mistakes"] for row in some if row["mistakes"])
        mistakes = [mistake for mistake in named if ";" not in mistake] or [*named]
        body = worst["case"].partition(":")[0]
        counts = ", ".join(f"{count} {verdict}" for verdict, count in verdicts.items())
        lines.append(
            [subject, pair, counts, body, *(f"{float(worst[n]):.2g}" for n in ("error", "allowed")), "; ".join(mistakes)]
        )
    return table(["engine", "pair", "bodies", "worst body", "error, rad", "allowed, rad", "mistakes"], lines)


TABLES: dict[str, Callable[[], str]] = {
    "published figures": figures,
    "loaded bodies": bodies,
    "named mistakes": mistakes,
    "engines on the brick": brick,
    "wrapped files": wrapped,
}
"""Tables by the name of their mark."""
