"""The rows of measured.csv and the picture, from a report and from a study of random bodies."""

from __future__ import annotations

import datetime
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pandas as pd

from conservative.benchmarks.contest import Ratios, cost
from conservative.reports.rows.names import with_names
from conservative.reports.sections.random_bodies import ANY, ratios

COLUMNS = ("scene", "name", "quantity", "value", "unit", "method", "version", "command", "date")
CLOSED_FORMS = {"brick_flip": "moser_veselov", "lagrange_top": "lame"}
GENERAL = "taylor:order=12"
"""Our integrator for any body in README's table."""
ENGINES = {"heyoka": "heyoka", "SciPy": "scipy", "MuJoCo": "mujoco", "Pinocchio": "pinocchio"}
ERROR = 1e-6
"""Attitude error at which times are compared, rad."""
RANDOM = "conservative study random --bodies 20 --seed 1002 --methods gauss,projected,taylor,heyoka"
PICTURED = ("reduced", GENERAL, "lame", "heyoka:frame=lean", "mujoco", "pinocchio", "scipy")


def scene_rows(report: Path) -> Iterator[dict[str, Any]]:
    """Yield the rows of the paper's two scenes, as dictionaries with the keys `COLUMNS`."""
    table = _read(report / "measurements.csv")
    common = {"command": "conservative report", "date": _date(report / "measurements.csv")}
    yield from (common | row for scene in CLOSED_FORMS for row in _scene(table[table["scene"] == scene], scene))


def random_rows(random: Path) -> Iterator[dict[str, Any]]:
    """Yield the rows of random bodies, as dictionaries with the keys `COLUMNS`."""
    bodies = _read(random / "study.csv")
    common = {"command": RANDOM, "date": _date(random / "study.csv")}
    yield from (common | row for row in _random(bodies))


def _scene(table: pd.DataFrame, scene: str) -> Iterator[dict[str, Any]]:
    """Yield drift, error and time of each row of README's table, and the error of the paper's integrator.

    Drift and error are those of one run at the scene's own step. The time is that of the fastest setting of the
    same family that reaches `ERROR`.
    """
    paper = table[(table["study"] == "paper") & (table["dt"] == table[table["study"] == "paper"]["dt"].max())]
    timed = table[table["study"] == "work_precision"]
    for name, method in {"ours": GENERAL, "closed form": CLOSED_FORMS[scene], **ENGINES}.items():
        run = paper[paper["method"] == method]
        common = {"scene": scene, "name": name, "version": run["version"].iloc[0], "method": method}
        yield common | {"quantity": "drift", "unit": "1", "value": run[run["measure"] == "drift max"]["value"].max()}
        yield common | {"quantity": "error", "unit": "rad", "value": _error(run)}
        time, setting = fastest(timed[timed["family"] == run["family"].iloc[0]], ERROR)
        yield common | {"quantity": "time", "unit": "us per s", "value": 1e6 * time, "method": setting}
    common = {"scene": scene, "name": "reduced", "method": "reduced", "version": ""}
    yield common | {"quantity": "error", "unit": "rad", "value": _error(paper[paper["method"] == "reduced"])}


def _error(run: pd.DataFrame) -> float:
    return float(run[run["measure"] == "attitude error max"]["value"].iloc[0])


def _random(table: pd.DataFrame) -> Iterator[dict[str, Any]]:
    """Yield heyoka's time over ours with its interval per field and error, and the cases that are won, open and lost.

    A case is a body at an error. The ratio is the geometric mean over the bodies on which both sides reach the error.
    """
    common = {"name": "random bodies", "unit": "1", "method": "", "version": ""}
    found = [each for each in ratios(with_names(table)) if each.engine == ANY]
    for each in found:
        place = common | {"scene": f"{each.field} {each.error:g} rad"}
        for quantity, value in zip(("", ", low", ", high"), (each.ratio, *each.interval), strict=True):
            yield place | {"quantity": f"heyoka's time over ours{quantity}", "value": value}
    every = Ratios(tuple(contest for each in found for contest in each.contests))
    counts = {"cases": len(every.contests), "cases won": every.won, "cases open": every.open, "cases lost": every.lost}
    for quantity, count in ({"bodies in each field": len(found[0].contests)} | counts).items():
        yield common | {"scene": "all fields", "quantity": quantity, "value": count}


def fastest(rows: pd.DataFrame, error: float) -> tuple[float, str]:
    """Return the time, s per simulated second, of the fastest series of settings at an error, and its name; else inf and ''."""
    measures = ["attitude error max", "time per simulated second"]
    kept = rows[rows["measure"].isin(measures) & (rows["outcome"] == "ok")]
    # Several processes may have measured the time: the geometric mean counts.
    points = kept.groupby(["series", "method", "dt", "measure"], sort=False)["value"].agg(_geometric_mean)
    points = points.unstack(sort=False).reindex(columns=measures)
    points = points.dropna(subset=measures[0])
    found = [(cost(*(line[name].tolist() for name in measures), error), name) for name, line in points.groupby("series")]
    return min((entry for entry in found if not math.isnan(entry[0])), default=(math.inf, ""))


def _geometric_mean(values: pd.Series) -> float:
    return float(values.iloc[0]) if len(values) == 1 else math.exp(sum(map(math.log, values)) / len(values))


def _read(path: Path) -> pd.DataFrame:
    texts = dict.fromkeys(("version", "setting", "series_setting", "quantity", "reason", "detail"), "string")
    return pd.read_csv(path, dtype=texts).fillna(dict.fromkeys(texts, ""))


def _date(path: Path) -> str:
    return datetime.date.fromtimestamp(path.stat().st_mtime).isoformat()


def draw(report: Path, picture: Path) -> None:
    """Draw time against error on the Lagrange top, for a few methods of a report; `picture` ends in .svg."""
    from conservative.reports.charts import figures
    from conservative.reports.report import save_picture
    from conservative.reports.rows.names import with_names, without_solutions
    from conservative.reports.rows.points import front
    from conservative.reports.rows.points import points as points_of

    table = _read(report / "measurements.csv")
    few = table[(table["scene"] == "lagrange_top") & table["series"].isin(PICTURED)]
    points = points_of(with_names(few))
    save_picture(figures.work_precision(points, front(without_solutions(points)), "lagrange_top"), picture, png=False)
