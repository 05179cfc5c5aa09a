"""The rows of measured.csv and README's picture, from the folders of studies and of a report."""

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
from conservative.benchmarks.speed_ratio import Cheapest, Ratios, SpeedRatio, cheapest, costs
from conservative.benchmarks.studies.random import TIMES
from conservative.errors import AccuracyNotReached
from conservative.integration.one import integrate
from conservative.invariants import sizes
from conservative.method import Role
from conservative.outcome import OutcomeKind
from conservative.reports.document.cells import tolerance
from conservative.reports.rows import lines
from conservative.reports.rows.names import MethodClass, of_classes, with_names
from conservative.reports.rows.points import front, points
from conservative.reports.sections import many_bodies
from conservative.reports.sections.hard_cases import USABLE
from conservative.reports.sections.random_bodies import ANY, pooled, ratios, typed_points, typed_ratios
from conservative.reports.sections.scene_ratios import each_step

COLUMNS = ("scene", "name", "quantity", "value", "unit", "method", "version", "command", "date")
CLOSED_FORMS = {"brick_flip": "moser_veselov", "lagrange_top": "lame", "nutating_top": "lame"}
"""README's scenes, and our closed form of each."""
GENERAL = "taylor:order=12"
"""Our integrator for any body in README's table."""
ENGINES = {"heyoka": "heyoka", "SciPy": "scipy:loop=compiled", "MuJoCo": "mujoco", "Pinocchio": "pinocchio"}
"""The methods of the drifts and errors; times are those of the fastest setting of a family."""
EULER = "MuJoCo, Euler"
"""MuJoCo's default integrator."""
SINGLE = {"reduced": "reduced", EULER: "mujoco:integrator=Euler"}
"""Methods whose own times are shown, not those of the fastest setting of a family."""
FAMILIES = {name: method.partition(":")[0] for name, method in ENGINES.items()}
ERROR = 1e-6
"""Attitude error at which times are compared, rad."""
MOVING = {
    "MuJoCo, default": "mujoco:integrator=Euler",
    "MuJoCo, RK4": "mujoco",
    "reduced": "reduced",
}
"""The motions of README's picture."""
SEED = 1005
"""Seed of the random bodies, fixed before the run and never used before."""
METHODS = "--methods taylor,projected,moser_veselov,lame,heyoka,scipy,mujoco,pinocchio"
LONGER = "brick_flip:t_end=24,brick_flip:t_end=96,lagrange_top:t_end=2,lagrange_top:t_end=8"
COMMANDS = {
    "accuracy": f"conservative study paper --scenes {','.join(CLOSED_FORMS)}"
    " --methods reduced,taylor,moser_veselov,lame,heyoka,scipy,mujoco,pinocchio",
    "orders": f"conservative study convergence --scenes {','.join(CLOSED_FORMS)} --methods reduced,taylor,mujoco,pinocchio",
    "moving": "conservative study motion --scenes brick_flip --methods mujoco,reduced",
    "report": "conservative report",
    "times": f"conservative study work_precision --scenes {','.join(CLOSED_FORMS)},asymmetric_top {METHODS},reduced",
    "longer": f"conservative study work_precision --scenes {LONGER} --methods taylor,projected,moser_veselov,lame,heyoka",
    "random": f"conservative study random --bodies 20 --seed {SEED} --methods gauss,projected,taylor,heyoka",
    "each_step": "conservative study each_step"
    f" --scenes brick_flip:t_end=24,lagrange_top:t_end=20,asymmetric_top:t_end=100 {METHODS}",
    "many": "conservative study throughput --methods taylor,heyoka,mujoco --sizes 1024",
}
"""The command that fills each folder."""
EACH = ("the scene's steps, all stored", "without the conversion of an engine's states", "the scene's steps, final state only")
"""The kinds of runs of `each_step`, in the order of `EachStep.runs`."""
PICTURED = ("reduced", GENERAL, "lame", "heyoka:frame=lean", "mujoco", "pinocchio", "scipy:loop=compiled")
LOOPS = ", compiled loops"
"""End of the names of rows about random bodies with the times of compiled loops alone."""
Row = dict[str, Any]
"""A row of measured.csv: a dictionary with some of the keys `COLUMNS`."""


def rows_of(folder: Path) -> Iterator[Row]:
    """Yield the rows of all studies in a folder, each in folders that begin with a name of `COMMANDS`."""
    for names, make in MAKERS.items():
        if paths := [path for name in names for path in sorted(folder.glob(f"{name}*/study.csv"))]:
            when = datetime.date.fromtimestamp(max(path.stat().st_mtime for path in paths)).isoformat()
            yield from ({"command": command_of(*names), "date": when} | row for row in make(read_runs(paths)))


def command_of(*names: str) -> str:
    """Return the commands of folders as a row has them."""
    return " and ".join(COMMANDS[name] for name in names)


def replaced(old: list[dict[str, str]], new: list[Row]) -> list[Row]:
    """Return rows in which new ones replace those of the same command, of the same place, or of an earlier seed."""
    places, commands = {key_of(row) for row in new}, {row["command"] for row in new}
    order = [command_of(*names) for names in MAKERS]
    studies = {study_of(command) for command in commands}
    kept = [
        row
        for row in old
        if row["command"] not in commands
        and key_of(row) not in places
        and (row["command"] in order or study_of(row["command"]) not in studies or "--seed" not in row["command"])
    ]
    return sorted([*kept, *new], key=lambda row: order.index(row["command"]) if row["command"] in order else len(order))


def study_of(command: str) -> str:
    """Return the command without its options, such as `conservative study random`."""
    return command.partition(" --")[0]


def key_of(row: Row) -> tuple[str, str, str]:
    """Return scene, name and quantity of a row."""
    return row["scene"], row["name"], row["quantity"]


def read_runs(paths: list[Path]) -> pd.DataFrame:
    """Return the rows of several runs of a study at different times: the errors of the first one, and the processes of all."""
    tables = [read(path) for path in paths]
    tables = [each.assign(process=each["process"].fillna(0) + 100 * number) for number, each in enumerate(tables)]
    every = pd.concat(tables, ignore_index=True)
    again = every.duplicated(["scene", "method", "dt", "measure", "quantity"]) & (every["measure"] != Measure.TIME.text)
    return every[~again].reset_index(drop=True) if len(tables) > 1 else tables[0]


def read(path: Path) -> pd.DataFrame:
    """Return the rows of a study or a report."""
    names = ("field", "method", "label", "family", "engine", "version", "setting", "role", "series", "series_setting", "way")
    texts = dict.fromkeys((*names, "quantity", "reason", "detail"), "string")
    return pd.read_csv(path, dtype=texts).fillna(dict.fromkeys(texts, ""))


def methods_on(scene: str) -> dict[str, str]:
    """Return the methods of README's table on a scene, by the names of their rows."""
    return {"ours": GENERAL, "closed form": CLOSED_FORMS[scene], **ENGINES, **SINGLE}


def accuracy_rows(table: pd.DataFrame) -> Iterator[Row]:
    """Yield drifts and errors on README's scenes at the scene's step."""
    for scene in CLOSED_FORMS:
        here = table[table["scene"] == scene]
        here = here[here["dt"] == here["dt"].max()]
        for name, method in methods_on(scene).items():
            yield from ({"scene": scene, "name": name} | row for row in run_rows(here[here["method"] == method]))


def order_rows(table: pd.DataFrame) -> Iterator[Row]:
    """Yield the observed orders on README's scenes, if the fit is certain and an error of the method is small."""
    for scene in CLOSED_FORMS:
        here = table[table["scene"] == scene]
        orders = lines.orders(here)
        smallest = here[here["measure"] == Measure.ATTITUDE_MAX.text].groupby("method")["value"].min()
        for name, method in methods_on(scene).items():
            if not math.isnan(order := orders.get(method, math.nan)) and smallest[method] < USABLE:
                yield {"scene": scene, "name": name, "quantity": "order", "value": order, "unit": "1", "method": method}


def moving_rows(table: pd.DataFrame) -> Iterator[Row]:
    """Yield drifts, errors and steps of the motions of README's picture."""
    for name, method in MOVING.items():
        run, place = table[table["method"] == method], {"scene": "picture", "name": name}
        yield from (place | row for row in run_rows(run))
        about = {"version": run["version"].iloc[0], "method": method, "quantity": "step", "unit": "s"}
        yield place | about | {"value": run["dt"].iloc[0]}


def infinite(row: Any) -> float:
    """Return the value of a row, infinite if its run diverged."""
    return math.inf if row["outcome"] == OutcomeKind.DIVERGED else float(row["value"])


def run_rows(run: pd.DataFrame) -> Iterator[Row]:
    """Yield the drift of each invariant, and the error, of one run."""
    common = {"version": run["version"].iloc[0], "method": run["method"].iloc[0]}
    for _, drift in run[run["measure"] == Measure.DRIFT_MAX.text].iterrows():
        yield common | {"quantity": f"drift of {drift['quantity']}", "unit": "1", "value": infinite(drift)}
    error = infinite(run[run["measure"] == Measure.ATTITUDE_MAX.text].iloc[0])
    yield common | {"quantity": "error", "unit": "rad", "value": error}


def chosen_rows() -> Iterator[Row]:
    """Yield the largest drift on each registered scene, of the method that `integrate(scene, error=1e-6)` chooses."""
    common = {"name": "chosen method", "quantity": "largest drift", "unit": "1", "command": "python .ci/readme --chosen"}
    for name in registry.list_scenes():
        method, drift = chosen_drift(name)
        yield common | {"scene": name, "method": method, "value": drift, "date": datetime.date.today().isoformat()}


def chosen_drift(name: str) -> tuple[str, float]:
    """Return the method that is chosen for a scene, and the largest drift of its invariants."""
    scene = registry.scene(name)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AccuracyNotReached)  # of a separatrix, whose rounding alone exceeds the error
        run = integrate(scene, error=ERROR)
    assert run.choice is not None
    return run.choice.method.name, max(float(sizes(run.drift(invariant)).max()) for invariant in scene.invariants)


def time_rows(table: pd.DataFrame) -> Iterator[Row]:
    """Yield the times of README's scenes and of the table of three scenes, and heyoka's times over ours."""
    timed = points(with_names(table))
    for scene in CLOSED_FORMS:
        if scene in set(timed["scene"]):
            yield from readme_rows(timed, scene)
    yield from scene_rows(timed)


def scene_rows(timed: pd.DataFrame) -> Iterator[Row]:
    """Yield heyoka's time over ours on each scene: at three errors, or at one for longer motions."""
    for scene in timed["scene"].unique():
        reached = costs(timed[timed["scene"] == scene], [ERROR] if ":" in scene else [1e-3, ERROR, 1e-9])
        for error, each in reached.groupby("error", sort=False):
            yield from general_rows(scene, tolerance(error), error, each)


def readme_rows(timed: pd.DataFrame, scene: str) -> Iterator[Row]:
    """Yield the time of the fastest setting of each family that reaches `ERROR`, and heyoka's time over ours.

    The time is that of the scene's own duration; the ratio is the geometric mean over all durations.
    """
    reached, common = costs(timed, [ERROR]), {"scene": scene}
    families = {"ours": GENERAL.partition(":")[0], "closed form": CLOSED_FORMS[scene], **FAMILIES}

    def fastest(duration: str, family: str) -> Any:
        return cheapest(reached[(reached["scene"] == duration) & (reached["family"] == family)])

    for name, family in families.items():
        yield common | {"name": name} | time_of(fastest(scene, family))
    own = costs(timed[(timed["scene"] == scene) & timed["method"].isin(SINGLE.values())], [ERROR], ["method"])
    for name, method in SINGLE.items():
        yield common | {"name": name} | time_of(cheapest(own[own["method"] == method].assign(name=method)))
    durations = [each for each in reached["scene"].unique() if each.partition(":")[0] == scene]
    for name in ("ours", "closed form"):
        speed_ratios = [SpeedRatio(each, ERROR, fastest(each, families[name]), fastest(each, "heyoka")) for each in durations]
        yield from (common | {"name": name} | row for row in ratio_rows(Ratios(tuple(speed_ratios))))


def each_step_rows(table: pd.DataFrame) -> Iterator[Row]:
    """Yield heyoka's time over ours on three scenes with every step stored."""
    table = with_names(table)
    for scene in table["scene"].unique():
        for what, reached in zip(EACH, each_step(table, scene).runs.values(), strict=True):
            yield from general_rows(scene, f"{tolerance(ERROR)}, {what}", ERROR, reached)


def general_rows(scene: str, what: str, error: float, reached: pd.DataFrame) -> Iterator[Row]:
    """Yield heyoka's time over our general integrators' in one kind of run, with the duration of the motion in its name."""
    place = f"{scene.partition(':')[0]} {registry.scene(scene).t_end:.3g} s, {what}"
    sides = cheapest(of_classes(reached, MethodClass.GENERAL)), cheapest(reached[reached["family"] == "heyoka"])
    common = {"scene": place, "name": "our general integrators"}
    yield from (common | row for row in ratio_rows(SpeedRatio(place, error, *sides)))


def time_of(side: Cheapest | None) -> Row:
    """Return the time of a side, infinite if it does not reach the error."""
    time, method = (1e6 * side.time, side.name) if side else (math.inf, "")
    return {"quantity": "time", "unit": "us per s", "value": time, "method": method}


ENDS = ("", ", low", ", high")
"""Ends of the quantities of a ratio and of its interval."""


def ratio_rows(ratio: SpeedRatio | Ratios) -> Iterator[Row]:
    """Yield heyoka's time over ours and the ends of its interval."""
    for end, value in zip(ENDS, (ratio.ratio, *ratio.interval), strict=True):
        yield {"quantity": f"heyoka's time over ours{end}", "value": value, "unit": "1"}


def many_rows(table: pd.DataFrame) -> Iterator[Row]:
    """Yield heyoka's time over ours for many bodies at once."""
    rows = many_bodies.lines(with_names(table))
    for group, engine, statistic, _, speed_ratio in many_bodies.speed_ratios(rows, many_bodies.body_costs(rows)):
        if group == MethodClass.GENERAL and engine == "heyoka":
            place = f"{speed_ratio.scene.replace('_', ' ')}, {statistic}, {tolerance(speed_ratio.error)} rad"
            yield from ({"scene": place, "name": "many bodies"} | row for row in ratio_rows(speed_ratio))


def random_rows(table: pd.DataFrame) -> Iterator[Row]:
    """Yield the rows of random bodies: at equal errors, at equal tolerances, and what a call adds to a compiled loop.

    Rows whose names end in `LOOPS` are about the compiled loops alone.
    """
    for time, end in zip(TIMES, ("", LOOPS), strict=True):
        yield from body_rows(table, time, f"random bodies{end}")
        yield from typed_rows(table, time, f"typed tolerance{end}")
    yield from call_rows(table)


def body_rows(table: pd.DataFrame, time: Measure = TIMES[0], name: str = "random bodies") -> Iterator[Row]:
    """Yield heyoka's time over ours with its interval per field and error, and the cases that are won, open and lost.

    A case is a body at an error. The ratio is the geometric mean over the bodies on which both sides reach the error.
    """
    common = {"name": name, "unit": "1"}
    found = [ratio for ratio in ratios(with_names(table), time) if ratio.engine == ANY]
    for each in found:
        yield from (common | {"scene": f"{each.field} {each.error:g} rad"} | row for row in ratio_rows(each))
    yield from (common | row for row in summary_rows([(each.field, each) for each in found]))
    yield common | {"scene": "all fields", "quantity": "bodies in each field", "value": len(found[0].speed_ratios)}


def summary_rows(parts: list[tuple[str, Ratios]]) -> Iterator[Row]:
    """Yield for each field, and for all fields, the mean and extreme ratios, the cases by outcome and the bound of losses."""
    fields = list(dict.fromkeys(field for field, _ in parts))
    for place, members in [*((field, [field]) for field in fields), ("all fields", fields)]:
        every = pooled(part for field, part in parts if field in members)
        counts = {"cases": len(every.speed_ratios), "cases won": every.won, "cases open": every.open, "cases lost": every.lost}
        shares = {"bodies": every.scenes, "largest share of bodies with a lost case": every.share_lost}
        ends = {f"mean ratio{end}": value for end, value in zip(ENDS, (every.ratio, *every.interval), strict=True)}
        extremes = {"smallest ratio": every.worst, "largest ratio": every.best}
        for quantity, value in (counts | shares | ends | extremes).items():
            yield {"scene": place, "quantity": quantity, "value": value}


def typed_rows(table: pd.DataFrame, time: Measure = TIMES[0], name: str = "typed tolerance") -> Iterator[Row]:
    """Yield heyoka's time over ours at the same tolerance, per field and over all, and the errors of both sides.

    A side has its fastest setting at the tolerance on each body.
    """
    named, common = with_names(table), {"name": name, "unit": "1"}
    found = typed_ratios(named, time)
    by_place = {(each.field, each.tolerance): [each] for each in found}
    for each in found:
        by_place.setdefault(("all fields", each.tolerance), []).append(each)
    for (field, typed), parts in by_place.items():
        every, place = pooled(parts), {"scene": f"{field} {typed:g}"}
        yield from (common | place | row for row in ratio_rows(every))
        for end, value in {"smallest": every.worst, "largest": every.best}.items():
            yield common | place | {"quantity": f"heyoka's time over ours, {end}", "value": value}
    yield from (common | row for row in summary_rows([(each.field, each) for each in found]))
    yield from (common | row for row in error_rows(typed_points(named, time)))


def error_rows(timed: pd.DataFrame) -> Iterator[Row]:
    """Yield the median and the largest error of the fastest setting of each side at each tolerance."""
    sides = timed.assign(side=timed["role"].map({Role.OURS.value: "ours", Role.ENGINE.value: "heyoka"}))
    fastest = sides.loc[sides.groupby(["side", "error", "scene"])["time"].idxmin()]
    for (side, typed), reached in fastest.groupby(["side", "error"])["reached"]:
        for name, value in {"median": reached.median(), "largest": reached.max()}.items():
            quantity = f"{side}, {name} error"
            yield {"scene": f"all fields {typed:g}", "unit": "rad", "quantity": quantity, "value": value}


def call_rows(table: pd.DataFrame) -> Iterator[Row]:
    """Yield the time of a compiled loop and what a user's call adds to it, us: medians over bodies and settings of a kind.

    Ours are `Taylor` with fixed steps and with a tolerance. heyoka's loop is its own call.
    """
    named = with_names(table)
    keys = ["scene", "method", "dt", "family", "series"]
    delivered, loops = (points(named, "random", time)[[*keys, "time"]] for time in TIMES)
    both = delivered.merge(loops, on=keys, suffixes=("", "_loop"))
    duration = both["scene"].map({scene: registry.scene(scene).t_end for scene in both["scene"].unique()}) * 1e6
    fields = both["scene"].map(dict(zip(named["scene"], named["field"], strict=True)))
    kinds = both["series"].map(call_kind)
    both = both.assign(
        field=fields, kind=kinds, loop=both["time_loop"] * duration, added=(both["time"] - both["time_loop"]) * duration
    )
    for (field, kind), rows in both.groupby(["field", "kind"], sort=False):
        for quantity in ("loop", "added"):
            value = rows[quantity].median()
            yield {"scene": field, "name": f"time of a call, {kind}", "quantity": quantity, "unit": "us", "value": value}


def call_kind(series: str) -> str | None:
    """Return the kind of a line in the table of the time of a call; None for a line that it does not have."""
    if series.startswith("heyoka"):
        return "heyoka"
    return {"taylor:tolerance": "Taylor, tolerance"}.get(series, "Taylor, fixed steps" if series.startswith("taylor") else None)


MAKERS = {
    ("accuracy",): accuracy_rows,
    ("orders",): order_rows,
    ("moving",): moving_rows,
    ("times", "longer"): time_rows,
    ("random",): random_rows,
    ("each_step",): each_step_rows,
    ("many",): many_rows,
}
"""The rows of folders, by their names in `COMMANDS`."""


def draw(report: Path, picture: Path) -> None:
    """Draw time against error on the Lagrange top, for a few methods of a report; `picture` ends in .svg."""
    from conservative.reports.charts import figures
    from conservative.reports.charts.style import svg_text

    table = read(report / "measurements.csv")
    few = points(with_names(table[(table["scene"] == "lagrange_top") & table["series"].isin(PICTURED)]))
    best = front(few[few["class"] != MethodClass.SOLUTION])
    picture.write_text(svg_text(figures.work_precision(few, best, "lagrange_top")), encoding="utf-8")
