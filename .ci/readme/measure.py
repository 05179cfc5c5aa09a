"""The rows of measured.csv and the picture, from a report, a study of times and a study of random bodies."""

from __future__ import annotations

import datetime
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pandas as pd

from conservative.benchmarks.contest import Contest, Ratios, cheapest, costs
from conservative.reports.rows.names import with_names
from conservative.reports.rows.points import points
from conservative.reports.sections.random_bodies import ANY, ratios

COLUMNS = ("scene", "name", "quantity", "value", "unit", "method", "version", "command", "date")
CLOSED_FORMS = {"brick_flip": "moser_veselov", "lagrange_top": "lame"}
GENERAL = "taylor:order=12"
"""Our integrator for any body in README's table."""
ENGINES = {"heyoka": "heyoka", "SciPy": "scipy", "MuJoCo": "mujoco", "Pinocchio": "pinocchio"}
ERROR = 1e-6
"""Attitude error at which times are compared, rad."""
TIMES = (
    "conservative study work_precision --scenes brick_flip,lagrange_top"
    " --methods taylor,moser_veselov,lame,heyoka,scipy,mujoco,pinocchio"
)
RANDOM = "conservative study random --bodies 20 --seed 1002 --methods gauss,projected,taylor,heyoka"
PICTURED = ("reduced", GENERAL, "lame", "heyoka:frame=lean", "mujoco", "pinocchio", "scipy")


def scene_rows(report: Path, times: Path) -> Iterator[dict[str, Any]]:
    """Yield the rows of the paper's two scenes, as dictionaries with the keys `COLUMNS`."""
    table, timed = _read(report / "measurements.csv"), points(with_names(_read(times / "study.csv")))
    for scene in CLOSED_FORMS:
        for row in _run_rows(table[table["scene"] == scene], scene):
            yield row | {"command": "conservative report", "date": _date(report / "measurements.csv")}
        for row in _time_rows(timed[timed["scene"] == scene], scene):
            yield row | {"command": TIMES, "date": _date(times / "study.csv")}


def random_rows(random: Path) -> Iterator[dict[str, Any]]:
    """Yield the rows of random bodies, as dictionaries with the keys `COLUMNS`."""
    bodies = _read(random / "study.csv")
    common = {"command": RANDOM, "date": _date(random / "study.csv")}
    yield from (common | row for row in _random(bodies))


def _run_rows(table: pd.DataFrame, scene: str) -> Iterator[dict[str, Any]]:
    """Yield drift and error of one run at the scene's own step: of each row of README's table, and of `Reduced`."""
    paper = table[(table["study"] == "paper") & (table["dt"] == table[table["study"] == "paper"]["dt"].max())]
    for name, method in {"ours": GENERAL, "closed form": CLOSED_FORMS[scene], **ENGINES, "reduced": "reduced"}.items():
        run = paper[paper["method"] == method]
        common = {"scene": scene, "name": name, "version": run["version"].iloc[0], "method": method}
        yield common | {"quantity": "drift", "unit": "1", "value": run[run["measure"] == "drift max"]["value"].max()}
        yield common | {"quantity": "error", "unit": "rad", "value": _error(run)}


def _time_rows(timed: pd.DataFrame, scene: str) -> Iterator[dict[str, Any]]:
    """Yield the time of the fastest setting of each family that reaches `ERROR`, and heyoka's time over ours."""
    reached, common = costs(timed, [ERROR]), {"scene": scene, "version": ""}
    families = {"ours": GENERAL.partition(":")[0], "closed form": CLOSED_FORMS[scene], **ENGINES}
    fastest = {name: cheapest(reached[reached["family"] == family]) for name, family in families.items()}
    for name, each in fastest.items():
        time, method = (1e6 * each.time, each.name) if each else (math.inf, "")
        yield common | {"name": name, "quantity": "time", "unit": "us per s", "value": time, "method": method}
    for name in ("ours", "closed form"):
        yield from _ratio_rows(common | {"name": name}, Contest(scene, ERROR, fastest[name], fastest["heyoka"]))


def _ratio_rows(place: dict[str, Any], each: Contest | Ratios) -> Iterator[dict[str, Any]]:
    """Yield heyoka's time over ours and the ends of its interval."""
    for quantity, value in zip(("", ", low", ", high"), (each.ratio, *each.interval), strict=True):
        yield place | {"quantity": f"heyoka's time over ours{quantity}", "value": value, "unit": "1", "method": ""}


def _error(run: pd.DataFrame) -> float:
    return float(run[run["measure"] == "attitude error max"]["value"].iloc[0])


def _random(table: pd.DataFrame) -> Iterator[dict[str, Any]]:
    """Yield heyoka's time over ours with its interval per field and error, and the cases that are won, open and lost.

    A case is a body at an error. The ratio is the geometric mean over the bodies on which both sides reach the error.
    """
    common = {"name": "random bodies", "unit": "1", "method": "", "version": ""}
    found = [each for each in ratios(with_names(table)) if each.engine == ANY]
    for each in found:
        yield from _ratio_rows(common | {"scene": f"{each.field} {each.error:g} rad"}, each)
    every = Ratios(tuple(contest for each in found for contest in each.contests))
    counts = {"cases": len(every.contests), "cases won": every.won, "cases open": every.open, "cases lost": every.lost}
    for quantity, count in ({"bodies in each field": len(found[0].contests)} | counts).items():
        yield common | {"scene": "all fields", "quantity": quantity, "value": count}


def _read(path: Path) -> pd.DataFrame:
    texts = dict.fromkeys(("version", "setting", "series_setting", "quantity", "reason", "detail"), "string")
    return pd.read_csv(path, dtype=texts).fillna(dict.fromkeys(texts, ""))


def _date(path: Path) -> str:
    return datetime.date.fromtimestamp(path.stat().st_mtime).isoformat()


def draw(report: Path, picture: Path) -> None:
    """Draw time against error on the Lagrange top, for a few methods of a report; `picture` ends in .svg."""
    from conservative.reports.charts import figures
    from conservative.reports.report import save_picture
    from conservative.reports.rows.names import MethodClass
    from conservative.reports.rows.points import front

    table = _read(report / "measurements.csv")
    few = points(with_names(table[(table["scene"] == "lagrange_top") & table["series"].isin(PICTURED)]))
    best = front(few[few["class"] != MethodClass.SOLUTION])
    save_picture(figures.work_precision(few, best, "lagrange_top"), picture, png=False)
