"""The rows of measured.csv and the picture, from the folders of a report and of studies."""

from __future__ import annotations

import datetime
import math
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pandas as pd

from conservative import registry
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.speed_ratio import Ratios, SpeedRatio, cheapest, costs
from conservative.errors import AccuracyNotReached
from conservative.integration.one import integrate
from conservative.invariants import sizes
from conservative.reports.document.cells import tolerance
from conservative.reports.rows.names import MethodClass, of_classes, with_names
from conservative.reports.rows.points import points
from conservative.reports.sections import many_bodies
from conservative.reports.sections.random_bodies import ANY, ratios
from conservative.reports.sections.scene_ratios import each_step

COLUMNS = ("scene", "name", "quantity", "value", "unit", "method", "version", "command", "date")
CLOSED_FORMS = {"brick_flip": "moser_veselov", "lagrange_top": "lame"}
GENERAL = "taylor:order=12"
"""Our integrator for any body in README's table."""
ENGINES = {"heyoka": "heyoka", "SciPy": "scipy:loop=compiled", "MuJoCo": "mujoco", "Pinocchio": "pinocchio"}
"""The methods of the drifts and errors; times are those of the fastest setting of a family."""
FAMILIES = {name: method.partition(":")[0] for name, method in ENGINES.items()}
ERROR = 1e-6
"""Attitude error at which times are compared, rad."""
ACCURACY = (
    "conservative study paper --scenes brick_flip,lagrange_top"
    " --methods reduced,taylor,moser_veselov,lame,heyoka,scipy,mujoco,pinocchio"
)
MOVING = {
    **{"MuJoCo, default": "mujoco:integrator=Euler", "MuJoCo, RK4": "mujoco", "PyBullet": "pybullet"},
    "reduced": "reduced",
}
"""The motions of README's first picture, and the most accurate setting of an engine in it."""
PICTURE = "conservative study motion --scenes brick_flip --methods mujoco,pybullet,reduced"
METHODS = "--methods taylor,projected,moser_veselov,lame,heyoka,scipy,mujoco,pinocchio"
TIMES = (
    f"conservative study work_precision --scenes brick_flip,lagrange_top,asymmetric_top {METHODS}",
    "conservative study work_precision"
    " --scenes brick_flip:t_end=24,brick_flip:t_end=96,lagrange_top:t_end=2,lagrange_top:t_end=8"
    " --methods taylor,projected,moser_veselov,lame,heyoka",
)
"""All sides on three motions, and the fastest ones on longer motions of the same bodies."""
SEED = 1004
"""Of the random bodies; fixed before the run, and never used before."""
RANDOM = f"conservative study random --bodies 20 --seed {SEED} --methods gauss,projected,taylor,heyoka"
EACH_STEP = (
    f"conservative study each_step --scenes brick_flip:t_end=24,lagrange_top:t_end=20,asymmetric_top:t_end=100 {METHODS}"
)
MANY = "conservative study throughput --methods taylor,heyoka,mujoco --sizes 1024"
OURS = {"our general integrators": MethodClass.GENERAL, "our closed forms": MethodClass.SOLUTION}
OTHERS = {**FAMILIES, "CyRK": "cyrk"}
EACH = ("the scene's steps, all stored", "without the conversion of an engine's states", "the scene's steps, final state only")
"""The rows of `each_step` in the table of three scenes, in the order of `EachStep.runs`."""
PICTURED = ("reduced", GENERAL, "lame", "heyoka:frame=lean", "mujoco", "pinocchio", "scipy:loop=compiled")


def accuracy_rows(accuracy: Path) -> Iterator[dict[str, Any]]:
    """Yield drifts and errors on the paper's two scenes at the scene's step, as dictionaries with the keys `COLUMNS`."""
    table = _read(accuracy / "study.csv")
    common = {"command": ACCURACY, "date": _date(accuracy / "study.csv")}
    for scene, closed in CLOSED_FORMS.items():
        here = table[table["scene"] == scene]
        here = here[here["dt"] == here["dt"].max()]
        for name, method in {"ours": GENERAL, "closed form": closed, **ENGINES, "reduced": "reduced"}.items():
            yield from (common | {"scene": scene, "name": name} | row for row in _run_rows(here[here["method"] == method]))


def picture_rows(motion: Path) -> Iterator[dict[str, Any]]:
    """Yield drifts and errors of the methods of README's first picture, and of MuJoCo's other setting."""
    table = _read(motion / "study.csv")
    common = {"scene": "picture", "command": PICTURE, "date": _date(motion / "study.csv")}
    for name, method in MOVING.items():
        run = table[table["method"] == method]
        yield from (common | {"name": name} | row for row in _run_rows(run))
        facts = {"version": run["version"].iloc[0], "method": method, "quantity": "step", "unit": "s"}
        yield common | {"name": name, **facts, "value": run["dt"].iloc[0]}


def chosen_rows() -> Iterator[dict[str, Any]]:
    """Yield the largest drift on each registered scene, of the method that `integrate(scene, error=1e-6)` chooses."""
    common = {"name": "chosen method", "quantity": "largest drift", "unit": "1", "version": ""}
    common |= {"command": "python .ci/readme --chosen", "date": datetime.datetime.now(datetime.UTC).date().isoformat()}
    for name in registry.list_scenes():
        method, drift = chosen_drift(name)
        yield common | {"scene": name, "method": method, "value": drift}


def chosen_drift(name: str) -> tuple[str, float]:
    """Return the method that is chosen for a scene, and the largest drift of its invariants."""
    scene = registry.scene(name)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AccuracyNotReached)  # of a separatrix, whose rounding alone exceeds the error
        run = integrate(scene, error=ERROR)
    assert run.choice is not None
    return run.choice.method.name, max(float(sizes(run.drift(each)).max()) for each in scene.invariants)


def time_rows(folders: list[Path]) -> Iterator[dict[str, Any]]:
    """Yield the times of every side, and heyoka's over ours: those of README's scenes, then those of the table of three scenes.

    Folders of the same command are runs at different times; intervals are over the processes of all of them.
    """
    timed = points(with_names(_read_runs(folders)))
    when = {"date": max(_date(folder / "study.csv") for folder in folders)}
    for scene in CLOSED_FORMS:
        yield from (row | when | {"command": " and ".join(TIMES)} for row in _time_rows(timed, scene))
    for scene in timed["scene"].unique():
        longer = ":" in scene
        reached = costs(timed[timed["scene"] == scene], [ERROR] if longer else [1e-3, ERROR, 1e-9])
        for error, each in reached.groupby("error", sort=False):
            place = f"{_with_duration(scene)}, {tolerance(error)}"
            yield from (row | when | {"command": TIMES[longer]} for row in _side_rows(place, error, each))


def random_rows(random: Path) -> Iterator[dict[str, Any]]:
    """Yield the rows of random bodies, as dictionaries with the keys `COLUMNS`."""
    bodies = _read(random / "study.csv")
    common = {"command": RANDOM, "date": _date(random / "study.csv")}
    yield from (common | row for row in _random(bodies))


def each_step_rows(each: Path) -> Iterator[dict[str, Any]]:
    """Yield the times of every side on three scenes with every step stored, and heyoka's over ours."""
    table = with_names(_read(each / "study.csv"))
    loops = table.loc[table["measure"] == Measure.TIME_OWN_LOOP.text, "family"].unique()
    common = {"command": EACH_STEP, "date": _date(each / "study.csv")}
    for scene in table["scene"].unique():
        for what, reached in zip(EACH, each_step(table, scene).runs.values(), strict=True):
            shown = loops if what == EACH[1] else None
            place = f"{_with_duration(scene)}, {tolerance(ERROR)}, {what}"
            yield from (common | row for row in _side_rows(place, ERROR, reached, shown))


def _with_duration(scene: str) -> str:
    """Return the name of a scene without its parameters and with its duration, such as `brick_flip 24 s`."""
    return f"{scene.partition(':')[0]} {registry.scene(scene).t_end:.3g} s"


def _side_rows(place: str, error: float, reached: pd.DataFrame, shown: Any = None) -> Iterator[dict[str, Any]]:
    """Yield the times of all sides, or of the families `shown` only, and heyoka's time over our general integrators'."""
    fastest = {name: cheapest(of_classes(reached, kind)) for name, kind in OURS.items()}
    fastest |= {name: cheapest(reached[reached["family"] == family]) for name, family in OTHERS.items()}
    for name, each in fastest.items():
        known = each if shown is None or OTHERS.get(name) in shown else None
        time, method = (1e6 * known.time, known.name) if known else (math.inf, "")
        common = {"scene": place, "name": name, "version": "", "method": method}
        yield common | {"quantity": "time", "unit": "us per s", "value": time}
    general, *_ = OURS
    common = {"scene": place, "name": general, "version": ""}
    yield from _ratio_rows(common, SpeedRatio(place, error, fastest[general], fastest["heyoka"]))


def many_rows(throughput: Path) -> Iterator[dict[str, Any]]:
    """Yield heyoka's time over ours for many bodies at once."""
    rows = many_bodies.lines(with_names(_read(throughput / "study.csv")))
    for group, engine, statistic, _, speed_ratio in many_bodies.speed_ratios(rows, many_bodies.body_costs(rows)):
        if group == MethodClass.GENERAL and engine == "heyoka":
            place = f"{speed_ratio.scene.replace('_', ' ')}, {statistic}, {tolerance(speed_ratio.error)} rad"
            common = {"scene": place, "name": "many bodies", "version": "", "command": MANY}
            yield from (common | {"date": _date(throughput / "study.csv")} | row for row in _ratio_rows({}, speed_ratio))


def _run_rows(run: pd.DataFrame) -> Iterator[dict[str, Any]]:
    """Yield the drift of each invariant, and the error, of one run."""
    common = {"version": run["version"].iloc[0], "method": run["method"].iloc[0]}
    for _, drift in run[run["measure"] == Measure.DRIFT_MAX.text].iterrows():
        yield common | {"quantity": f"drift of {drift['quantity']}", "unit": "1", "value": drift["value"]}
    error = run[run["measure"] == Measure.ATTITUDE_MAX.text]["value"].iloc[0]
    yield common | {"quantity": "error", "unit": "rad", "value": error}


def _time_rows(timed: pd.DataFrame, scene: str) -> Iterator[dict[str, Any]]:
    """Yield the time of the fastest setting of each family that reaches `ERROR`, and heyoka's time over ours.

    The time is that of the scene's own duration; the ratio is the geometric mean over all durations.
    """
    reached, common = costs(timed, [ERROR]), {"scene": scene, "version": ""}
    families = {"ours": GENERAL.partition(":")[0], "closed form": CLOSED_FORMS[scene], **FAMILIES}

    def fastest(duration: str, family: str) -> Any:
        return cheapest(reached[(reached["scene"] == duration) & (reached["family"] == family)])

    for name, family in families.items():
        each = fastest(scene, family)
        time, method = (1e6 * each.time, each.name) if each else (math.inf, "")
        yield common | {"name": name, "quantity": "time", "unit": "us per s", "value": time, "method": method}
    durations = [each for each in reached["scene"].unique() if each.partition(":")[0] == scene]
    for name in ("ours", "closed form"):
        speed_ratios = [SpeedRatio(each, ERROR, fastest(each, families[name]), fastest(each, "heyoka")) for each in durations]
        yield from _ratio_rows(common | {"name": name}, Ratios(tuple(speed_ratios)))


def _ratio_rows(place: dict[str, Any], each: SpeedRatio | Ratios) -> Iterator[dict[str, Any]]:
    """Yield heyoka's time over ours and the ends of its interval."""
    for quantity, value in zip(("", ", low", ", high"), (each.ratio, *each.interval), strict=True):
        yield place | {"quantity": f"heyoka's time over ours{quantity}", "value": value, "unit": "1", "method": ""}


def _random(table: pd.DataFrame) -> Iterator[dict[str, Any]]:
    """Yield heyoka's time over ours with its interval per field and error, and the cases that are won, open and lost.

    A case is a body at an error. The ratio is the geometric mean over the bodies on which both sides reach the error.
    """
    common = {"name": "random bodies", "unit": "1", "method": "", "version": ""}
    found = [each for each in ratios(with_names(table)) if each.engine == ANY]
    for each in found:
        yield from _ratio_rows(common | {"scene": f"{each.field} {each.error:g} rad"}, each)
    every = Ratios(tuple(speed_ratio for each in found for speed_ratio in each.speed_ratios))
    counts = {"cases": len(every.speed_ratios), "cases won": every.won, "cases open": every.open, "cases lost": every.lost}
    counts |= {"bodies in each field": len(found[0].speed_ratios)}
    extremes = {"smallest ratio": min(each.worst for each in found), "largest ratio": max(each.best for each in found)}
    for quantity, count in (counts | extremes).items():
        yield common | {"scene": "all fields", "quantity": quantity, "value": count}


def _read_runs(folders: list[Path]) -> pd.DataFrame:
    """Return the rows of several runs of studies: the errors of the first one, and the processes of all."""
    tables = [_read(folder / "study.csv") for folder in folders]
    tables = [each.assign(process=each["process"].fillna(0) + 100 * number) for number, each in enumerate(tables)]
    every, timed = pd.concat(tables, ignore_index=True), Measure.TIME.text
    again = every.duplicated(["scene", "method", "dt", "measure", "quantity"]) & (every["measure"] != timed)
    return every[~again].reset_index(drop=True)


def _read(path: Path) -> pd.DataFrame:
    names = ("field", "method", "label", "family", "engine", "version", "setting", "role", "series", "series_setting", "way")
    texts = dict.fromkeys((*names, "quantity", "reason", "detail"), "string")
    return pd.read_csv(path, dtype=texts).fillna(dict.fromkeys(texts, ""))


def _date(path: Path) -> str:
    return datetime.date.fromtimestamp(path.stat().st_mtime).isoformat()


def draw(report: Path, picture: Path) -> None:
    """Draw time against error on the Lagrange top, for a few methods of a report; `picture` ends in .svg."""
    from conservative.reports.charts import figures
    from conservative.reports.charts.style import svg_text
    from conservative.reports.rows.names import MethodClass
    from conservative.reports.rows.points import front

    table = _read(report / "measurements.csv")
    few = points(with_names(table[(table["scene"] == "lagrange_top") & table["series"].isin(PICTURED)]))
    best = front(few[few["class"] != MethodClass.SOLUTION])
    picture.write_text(svg_text(figures.work_precision(few, best, "lagrange_top")), encoding="utf-8")
