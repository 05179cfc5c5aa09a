"""The tidy row that every study yields, and the table of them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from conservative.method import Role
from conservative.outcome import OK, Outcome, OutcomeKind

from .measure import Measure

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, kw_only=True)
class Measurement:
    """One measured value.

    Attributes
    ----------
    study, scene
        Names of the study and of the scene; the scene is empty if the row belongs to none.
    method
        Registered name with settings, such as `mujoco:integrator=RK4`; `conservative.registry.method` reads it back. Empty for
        what belongs to no one method.
    label
        The same with version, such as `mujoco==4.0.0/RK4`.
    family, version, setting
        The parts of what a method is called: `mujoco`, `4.0.0`, `RK4`; no version of ours. Empty for what is no method.
    role
        Which side the method is on.
    series
        Name of a line in a chart: the method without its tolerance.
    series_setting
        The setting without the tolerance.
    dt
        Step, s, or distance of samples of an adaptive method; NaN if the row belongs to no single step.
    quantity
        Name of the invariant that a drift is of; else empty.
    measure, value
        Measure, and value in its unit; NaN if it could not be measured.
    outcome
        How the run ended, or why there was none.
    detail
        Further information; may be empty.
    """

    study: str
    scene: str
    method: str
    label: str
    family: str = ""
    version: str = ""
    setting: str = ""
    role: Role
    series: str
    series_setting: str = ""
    dt: float
    quantity: str = ""
    measure: Measure
    value: float
    outcome: Outcome = OK
    detail: str = ""


COLUMNS = (
    *("study", "scene", "method", "label", "family", "version", "setting", "role", "series", "series_setting"),
    *("dt", "quantity", "measure", "value", "unit"),
    *("outcome", "reason", "step", "time", "residual", "detail"),
)
"""Columns of the table, in order."""
_NUMBERS = frozenset({"dt", "value", "step", "time", "residual"})
_AS_THEY_ARE = (
    *("study", "scene", "method", "label", "family", "version", "setting", "series", "series_setting"),
    *("dt", "quantity", "value", "detail"),
)


def flat(row: Measurement) -> dict[str, str | float]:
    """Return a row as text and numbers by column: enums as their texts, the outcome as its fields, nan where it has none."""
    outcome = row.outcome
    found = {
        **{name: getattr(row, name) for name in _AS_THEY_ARE},
        "role": row.role.value,
        "measure": row.measure.text,
        "unit": row.measure.unit,
        "outcome": outcome.kind.value,
        "reason": outcome.reason,
        **{name: _number(getattr(outcome, name)) for name in ("step", "time", "residual")},
    }
    return {name: found[name] for name in COLUMNS}


def from_flat(record: Mapping[str, Any]) -> Measurement:
    """Return the row of a record from `flat`; raise `KeyError` or `ValueError` for anything else."""
    return Measurement(
        **{name: record[name] for name in _AS_THEY_ARE},
        role=Role(record["role"]),
        measure=Measure.from_text(record["measure"]),
        outcome=outcome_of(record),
    )


def outcome_of(record: Mapping[str, Any] | pd.Series[Any]) -> Outcome:
    """Return the outcome of a record, or of a row of the table."""
    step, time, residual = (None if math.isnan(record[name]) else float(record[name]) for name in ("step", "time", "residual"))
    kind = OutcomeKind(record["outcome"])
    return Outcome(kind, record["reason"], None if step is None else int(step), time, residual)


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)


def frame(rows: Iterable[Measurement]) -> pd.DataFrame:
    """Return the rows as a table: columns as `COLUMNS` has them, text as `string`, numbers as `float64`."""
    import pandas as pd  # here, so that the command line answers --help without it

    table = pd.DataFrame([flat(row) for row in rows], columns=list(COLUMNS))
    return table.astype({name: "float64" if name in _NUMBERS else "string" for name in COLUMNS})
