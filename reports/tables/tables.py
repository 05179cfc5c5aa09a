"""Tables of the measurements: one row a method, texts ready to be read."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence

import pandas as pd

from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.measures.measurement import outcome_of
from conservative.benchmarks.studies.studies import HARD
from conservative.outcome import OutcomeKind

from ..labels import shown
from . import orders, work_precision

Table = tuple[Sequence[str], Sequence[Sequence[str]]]
"""Header and rows."""

UNIT = "reduced"
"""The method whose step the others' are counted in."""


def number(value: float, digits: int = 2) -> str:
    """Return a number to `digits` significant digits, a dash for nan."""
    if math.isnan(value):
        return "–"
    plain = value == 0 or 0.01 <= abs(value) < 1e4
    return f"{value:.{digits}g}" if plain else f"{value:.{digits - 1}e}"


def keyed(table: pd.DataFrame) -> pd.DataFrame:
    """Return the table with the quantity in front of the measure: `energy drift max`."""
    return table.assign(measure=(table["quantity"] + " " + table["measure"]).str.lstrip())


def endings(table: pd.DataFrame) -> list[str]:
    """Return in words how the run of each row ended."""
    return [str(outcome_of(record)) for _, record in table.iterrows()]


def drift_samples(samples: pd.DataFrame) -> pd.DataFrame:
    """Return the lines of the long runs: columns scene, series, t, invariant, drift."""
    rows = _named(samples[samples["study"] == "long_runs"])
    return rows.rename(columns={"name": "series", "quantity": "invariant", "value": "drift"})


def _named(rows: pd.DataFrame) -> pd.DataFrame:
    return rows.assign(name=[shown(method, label) for method, label in zip(rows["method"], rows["label"], strict=True)])


def _wide(table: pd.DataFrame, study: str, scene: str) -> pd.DataFrame:
    """Return the values of a study at the scene's step, a row a method and a column a measure; ours first, as in the table."""
    rows = table[(table["study"] == study) & (table["scene"] == scene) & (table["method"] != "truth")]
    rows = _named(rows[rows["dt"] == rows.groupby("method")["dt"].transform("max")])
    return keyed(rows).pivot_table(index="name", columns="measure", values="value", sort=False)


def drift(table: pd.DataFrame, scene: str) -> Table:
    """Return the drift of every invariant, its slope over time where there is one, and orthonormality, at the scene's step."""
    values = _wide(table, "paper", scene)
    invariants = [name.removesuffix(" drift max") for name in values.columns if name.endswith(" drift max")]
    header = ["method", *(f"{name}{part}" for name in invariants for part in ("", ", 1/s")), "orthonormality"]
    body = [[name, *_drift_cells(row, invariants), _cell(row, "orthonormality max")] for name, row in _rows(values)]
    return header, body


def _drift_cells(row: pd.Series[float], invariants: Iterable[str]) -> list[str]:
    cells = []
    for name in invariants:
        slope, error = row.get(f"{name} drift slope", math.nan), row.get(f"{name} drift slope stderr", math.nan)
        cells += [_cell(row, f"{name} drift max"), f"{number(slope)} ± {number(error, 1)}"]
    return cells


def _rows(values: pd.DataFrame) -> list[tuple[str, pd.Series[float]]]:
    return [(str(name), row) for name, row in values.iterrows()]


def _cell(row: pd.Series[float], measure: str) -> str:
    return number(row.get(measure, math.nan))


def accuracy(table: pd.DataFrame, scene: str) -> Table:
    """Return errors of attitude and rates at the paper's steps: the scene's own, a half and a quarter of it."""
    rows = _named(table[(table["study"] == "paper") & (table["scene"] == scene) & (table["method"] != "truth")])
    measures = ("attitude error max", "attitude error final", "rate error max")
    rows = rows[rows["measure"].isin(measures)]
    steps = sorted(rows["dt"].unique(), reverse=True)
    wide = rows.pivot_table(index="name", columns=["measure", "dt"], values="value", sort=False)
    units = {"attitude error max": "rad", "attitude error final": "rad", "rate error max": "relative"}
    header = ["method", *(f"{name}, {units[name]}, dt {step:g}" for name in measures for step in steps)]
    keys = [(name, step) for name in measures for step in steps]
    return header, [[name, *(number(row.get(key, math.nan)) for key in keys)] for name, row in _rows(wide)]


def order(table: pd.DataFrame, scene: str) -> Table:
    """Return observed orders of attitude and rates with standard error, and the window of steps that the attitude's fit saw."""
    header = ["method", "order, attitude", "order, rates", "fit window, s", "points", "floor, rad"]
    attitude, rates = (_fits(table, scene, measure) for measure in (orders.ERROR, orders.RATES))
    texts = {fit["series"]: fit["text"] for fit in rates}
    return header, [
        [str(fit["series"]), str(fit["text"]), str(texts.get(fit["series"], "–")), *_window(fit)] for fit in attitude
    ]


def _fits(table: pd.DataFrame, scene: str, measure: str) -> list[pd.Series[float]]:
    found = orders.errors(table, measure)
    fits = orders.fits(found[found["scene"] == scene])
    return [fit for _, fit in fits.iterrows()]


def _window(fit: pd.Series[float]) -> list[str]:
    if fit["reason"]:
        return [str(fit["reason"]), "–", number(fit["floor"])]
    return [f"{fit['coarse']:.3g} to {fit['fine']:.3g}", str(int(fit["points"])), number(fit["floor"])]


_TIMES = (
    ("time per step", 1e9, "step, ns, min"),
    ("time per step median", 1e9, "median"),
    ("time per simulated second", 1e6, "simulated second, µs, min"),
    ("time per simulated second median", 1e6, "median"),
    ("prepare time", 1e3, "prepare, ms"),
    ("first call time", 1e3, "first call, ms"),
)


def time(table: pd.DataFrame, scene: str) -> Table:
    """Return wall times at the scene's step: minimum and median of interleaved rounds, how many, and what is paid once."""
    values = _wide(table, "speed", scene)
    rows = _named(table[(table["study"] == "speed") & (table["scene"] == scene) & (table["measure"] == work_precision.TIME)])
    details = rows.set_index("name")["detail"]
    header = ["method", f"steps of {UNIT}", *(title for _, _, title in _TIMES), "timed"]
    unit = values["time per step"].get(UNIT, math.nan) if len(values) else math.nan
    body = []
    for name, row in _rows(values):
        cells = [number(row.get(measure, math.nan) * scale, 3) for measure, scale, _ in _TIMES]
        body.append([name, number(row.get("time per step", math.nan) / unit, 3), *cells, str(details[name])])
    return header, body


def contests(found: list[work_precision.Contest]) -> Table:
    """Return the cheapest of ours and of the engines at each decade of error, and how many times faster ours is."""
    header = ["error, rad", "cheapest of ours", "µs per s", "cheapest engine", "µs per s", "ratio (above 1: ours is faster)"]
    return header, [[f"{c.error:.0e}", *_cost(c.ours), *_cost(c.theirs), number(c.ratio, 3)] for c in found]


def _cost(cost: work_precision.Cost | None) -> tuple[str, str]:
    return (cost.series, number(cost.time * 1e6, 3)) if cost else ("none gets there", "–")


def positions(table: pd.DataFrame) -> Table:
    """Return errors of the top's centre of mass after one period: of x1, and the distance."""
    header = ["dt, s", "t, s", "error of x1, m", "distance, m"]
    wanted = [measure.text for measure in (Measure.PERIOD, Measure.PERIOD_X1, Measure.PERIOD_DISTANCE)]
    rows = table[table["study"] == "paper_figures"].pivot_table(index="dt", columns="measure", values="value", sort=False)
    return header, [[f"{dt:g}", f"{t:g}", f"{x1:.4f}", f"{gap:.4f}"] for dt, (t, x1, gap) in rows[wanted].iterrows()]


def failures(table: pd.DataFrame) -> Table:
    """Return the runs that did not reach their end or that the study did not wait for."""
    elsewhere = table["study"].isin(HARD)  # with a matrix of their own
    fine = [OutcomeKind.OK, OutcomeKind.UNSUPPORTED, OutcomeKind.MISSING, OutcomeKind.NO_ORDER]
    rows = _named(table[~table["outcome"].isin(fine) & ~elsewhere])
    rows = rows.assign(status=endings(rows))
    body = [
        [*map(str, key), ", ".join(members["study"].unique()), _steps(members)]
        for key, members in rows.groupby(["scene", "name", "status"], sort=False)
    ]
    return ["scene", "method", "status", "studies", "at steps, s"], body


def _steps(members: pd.DataFrame) -> str:
    steps = sorted(members["dt"].dropna().unique(), reverse=True)
    return ", ".join(f"{step:.3g}" for step in steps) or "–"


def unsupported(table: pd.DataFrame) -> Table:
    """Return what cannot be done, or is not installed, and why: a row a reason, with all methods that have it."""
    here = table["outcome"].isin([OutcomeKind.UNSUPPORTED, OutcomeKind.MISSING]) & ~table["study"].isin([*HARD, "import_time"])
    rows = _named(table[here])
    rows = rows.assign(kind=[_DIGITS.sub("…", reason) for reason in rows["reason"]])
    body = [
        [*map(str, key[:2]), str(members["reason"].iloc[0]), ", ".join(members["name"].unique())]
        for key, members in rows.groupby(["scene", "outcome", "kind"], sort=False)
    ]
    return ["scene", "status", "why (numbers: of the first)", "methods"], body


_DIGITS = re.compile(r"\d[\d.e+-]*")


def truths(table: pd.DataFrame) -> Table:
    """Return how well the two independent truths agree, for each scene and step."""
    rows = table[table["measure"] == work_precision.AGREEMENT]
    body = [[row["scene"], f"{row['dt']:g}", row["label"], number(row["value"])] for _, row in rows.iterrows()]
    return ["scene", "dt, s", "truths", "largest angle between them, rad"], body


def markdown(table: Table) -> str:
    """Return a table in Markdown; cells are not padded, as no reader of the page would see that."""
    header, body = table
    lines = [header, ["---", *["---:"] * (len(header) - 1)], *body]
    return "\n".join("| " + " | ".join(str(cell).replace("|", "\\|") for cell in line) + " |" for line in lines)
