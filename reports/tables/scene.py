"""Tables of one scene: one row a method, texts ready to be read."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

import pandas as pd

from conservative.benchmarks.measures.measure import Measure
from conservative.deferred_imports import DEFAULT_METHOD

from .cells import Row, Table, number
from .rows import of_measure, of_study


def _wide(table: pd.DataFrame, study: str, scene: str) -> pd.DataFrame:
    """Return the values of a study at the scene's step: a row a method, ours first, and a column (measure, quantity)."""
    rows = of_study(table, study, scene)
    rows = rows[rows["dt"] == rows.groupby("method")["dt"].transform("max")]
    return rows.pivot_table(index="name", columns=["measure", "quantity"], values="value", sort=False)


def _lines(values: pd.DataFrame) -> list[tuple[str, pd.Series[float]]]:
    return [(str(name), row) for name, row in values.iterrows()]


def _ranked(values: pd.DataFrame, *columns: tuple[str, object]) -> list[tuple[str, pd.Series[float]]]:
    """Return the lines by columns, the smallest first, those without it last: ours and the engines' among each other."""

    def rank(line: tuple[str, pd.Series[float]]) -> list[tuple[bool, float]]:
        numbers = (float(line[1].get(column, math.nan)) for column in columns)
        return [(math.isnan(number), number) for number in numbers]

    return sorted(_lines(values), key=rank)


def _value(row: pd.Series[float], measure: Measure, quantity: str = "") -> float:
    return float(row.get((measure.text, quantity), math.nan))


def drift(table: pd.DataFrame, scene: str) -> Table:
    """Return the drift of every invariant, its slope over time where there is one, and orthonormality, at the scene's step."""
    values = _wide(table, "paper", scene)
    invariants = [column[1] for column in values.columns if column[0] == Measure.DRIFT_MAX.text]
    header = ["method", *(f"{name}{part}" for name in invariants for part in ("", ", 1/s")), "orthonormality"]
    return header, [
        [name, *_drift_cells(row, invariants), number(_value(row, Measure.ORTHONORMALITY))] for name, row in _lines(values)
    ]


def _drift_cells(row: pd.Series[float], invariants: Iterable[str]) -> Iterator[str]:
    for name in invariants:
        slope, error = _value(row, Measure.DRIFT_SLOPE, name), _value(row, Measure.DRIFT_SLOPE_STDERR, name)
        yield number(_value(row, Measure.DRIFT_MAX, name))
        yield f"{number(slope)} ± {number(error, 1)}"


_ERRORS = ((Measure.ATTITUDE_MAX, "rad"), (Measure.ATTITUDE_FINAL, "rad"), (Measure.RATES_MAX, "relative"))


def accuracy(table: pd.DataFrame, scene: str) -> Table:
    """Return errors of attitude and rates at the paper's steps: the scene's own, a half and a quarter of it."""
    rows = of_study(table, "paper", scene)
    rows = rows[rows["measure"].isin([measure.text for measure, _ in _ERRORS])]
    steps = sorted(rows["dt"].unique(), reverse=True)
    wide = rows.pivot_table(index="name", columns=["measure", "dt"], values="value", sort=False)
    header = ["method", *(f"{measure}, {unit}, dt {step:g}" for measure, unit in _ERRORS for step in steps)]
    keys = [(measure.text, step) for measure, _ in _ERRORS for step in steps]
    return header, [[name, *(number(row.get(key, math.nan)) for key in keys)] for name, row in _ranked(wide, *keys)]


def order(attitude: pd.DataFrame, rates: pd.DataFrame) -> Table:
    """Return observed orders of attitude and rates, from `orders.fits`, and the window of steps that the attitude's fit saw."""
    header = ["method", "order, attitude", "order, rates", "fit window, s", "points", "floor, rad"]
    of_rates = dict(zip(rates["name"], rates["text"], strict=True))
    lines = [fit for _, fit in attitude.iterrows()]
    return header, [[str(fit["name"]), str(fit["text"]), str(of_rates.get(fit["name"], "–")), *_window(fit)] for fit in lines]


def _window(fit: pd.Series[float]) -> list[str]:
    if fit["reason"]:
        return [str(fit["reason"]), "–", number(fit["floor"])]
    return [f"{fit['coarse']:.3g} to {fit['fine']:.3g}", str(int(fit["points"])), number(fit["floor"])]


_TIMES = (
    (Measure.TIME_PER_STEP, 1e9, "step, ns, min"),
    (Measure.TIME_PER_STEP_MEDIAN, 1e9, "median"),
    (Measure.TIME, 1e6, "simulated second, µs, min"),
    (Measure.TIME_MEDIAN, 1e6, "median"),
    (Measure.PREPARE, 1e3, "prepare, ms"),
    (Measure.FIRST_CALL, 1e3, "first call, ms"),
)


def time(table: pd.DataFrame, scene: str) -> Table:
    """Return wall times at the scene's step: minimum and median of interleaved rounds, how many, and what is paid once."""
    values = _wide(table, "speed", scene)
    rows = of_measure(of_study(table, "speed", scene), Measure.TIME)
    details = rows.set_index("name")["detail"]
    header = ["method", f"steps of {DEFAULT_METHOD}", *(title for _, _, title in _TIMES), "timed"]
    lines = _ranked(values, (Measure.TIME.text, ""))
    unit = next((_value(row, Measure.TIME_PER_STEP) for name, row in lines if name == DEFAULT_METHOD), math.nan)
    return header, [[name, *_times(row, unit), str(details.get(name, ""))] for name, row in lines]


def _times(row: pd.Series[float], unit: float) -> Row:
    steps = number(_value(row, Measure.TIME_PER_STEP) / unit, 3)
    return [steps, *(number(_value(row, measure) * scale, 3) for measure, scale, _ in _TIMES)]


_ONCE = ((Measure.PREPARE, 1e3), (Measure.FIRST_CALL, 1e3), (Measure.TIME, 1e6))


def costs_paid_once(table: pd.DataFrame, scene: str) -> Table:
    """Return what a method costs before its first step: conversion, with compiled code at hand, and the first call."""
    values = _wide(table, "speed", scene)
    lines = _ranked(values, (Measure.PREPARE.text, ""))
    body = [[name, *(number(_value(row, measure) * scale, 3) for measure, scale in _ONCE)] for name, row in lines]
    return ["method", "prepare, ms", "first call, ms", "simulated second, µs"], body
