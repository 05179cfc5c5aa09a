"""The findings of a study: tidy rows (`Measurement`), and quantities over time (`Samples`). Every field is a column."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np

from conservative.attitude import Array
from conservative.method import Role
from conservative.outcome import OK, Outcome, OutcomeKind

from .measure import Measure

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, kw_only=True, eq=False)
class Subject:
    """The scene, the method and the step that a row is about.

    Attributes
    ----------
    study, scene
        Names of the study and of the scene; the scene is empty for a row without one.
    field, seed, body
        Field or kind of a random body, its seed and its index; "" and None for any other scene.
    method
        Registered name with settings, such as `mujoco:integrator=RK4`; `conservative.registry.method` reads it back. Empty if
        the row belongs to no single method.
    label
        The same with version, such as `mujoco==4.0.0/RK4`.
    family, engine, version, setting
        Parts of the name: `mujoco@4.0.0`, `mujoco`, `4.0.0`, `RK4`. Our methods have neither engine nor version.
    role
        Ours, engine or truth.
    series, series_setting
        Name and setting of a line in a chart: the method's without its tolerance.
    dt
        Step, s, or distance of samples of an adaptive method; NaN if the row belongs to no single step.
    """

    study: str
    scene: str
    field: str = ""
    seed: int | None = None
    body: int | None = None
    method: str
    label: str
    family: str = ""
    engine: str = ""
    version: str = ""
    setting: str = ""
    role: Role
    series: str
    series_setting: str = ""
    dt: float


@dataclass(frozen=True, kw_only=True)
class Measurement(Subject):
    """One measured value.

    Attributes
    ----------
    bodies, way
        Number of bodies of a batch, and how they ran, such as "one at a time"; None and "" for a single body.
    process
        Number of the process that measured a time, if there are several (see `measures.processes`); otherwise None.
    quantity
        Invariant of a drift, or statistic of an error over many bodies; otherwise empty.
    measure, value
        Measure, and value in its unit; NaN if it could not be measured.
    outcome
        Outcome of the run, or the reason why it was not made.
    detail
        Further information; may be empty.
    """

    bodies: int | None = None
    way: str = ""
    process: int | None = None
    quantity: str = ""
    measure: Measure
    value: float
    outcome: Outcome = OK
    detail: str = ""


@dataclass(frozen=True, kw_only=True, eq=False)
class Samples(Subject):
    """A quantity over time in one run: times t (n,), s, and values (n,), in the unit that the study documents."""

    quantity: str
    t: Array
    value: Array


_SUBJECT = tuple(field.name for field in fields(Subject))
_OUTCOME = ("outcome", "reason", "step", "time", "residual")
COLUMNS = (*_SUBJECT, "bodies", "way", "process", "quantity", "measure", "value", "unit", *_OUTCOME, "detail")
"""Columns of the table of measurements, in order."""
SAMPLE_COLUMNS = (*_SUBJECT, "quantity", "t", "value")
"""Columns of the table of samples, in order."""
_NUMBERS = frozenset({"seed", "body", "dt", "bodies", "process", "value", "step", "time", "residual", "t"})
_COUNTS = ("seed", "body", "bodies", "process")


def flat(row: Measurement) -> dict[str, str | float]:
    """Return a row as text and numbers by column: enums as their texts, the outcome as its fields, NaN for None."""
    outcome = row.outcome
    record: dict[str, Any] = {name: getattr(row, name, None) for name in COLUMNS} | {
        "measure": row.measure.text,
        "unit": row.measure.unit,
        "outcome": outcome.kind.value,
        "reason": outcome.reason,
        "role": row.role.value,
        **{name: getattr(outcome, name) for name in ("step", "time", "residual")},
    }
    return {name: math.nan if value is None else value for name, value in record.items()}


def from_flat(record: Mapping[str, Any]) -> Measurement:
    """Return the row of a record from `flat`; raise `KeyError` or `ValueError` for anything else."""
    values = {field.name: record[field.name] for field in fields(Measurement)} | {
        "role": Role(record["role"]),
        "measure": Measure.from_text(record["measure"]),
        "outcome": outcome_of(record),
    }
    return Measurement(**values | {name: _count(record[name]) for name in _COUNTS})


def flat_samples(samples: Samples) -> dict[str, Any]:
    """Return samples as a record for JSON."""
    return vars(samples) | {"role": samples.role.value, "t": samples.t.tolist(), "value": samples.value.tolist()}


def samples_from_flat(record: Mapping[str, Any]) -> Samples:
    """Return the samples of a record from `flat_samples`; raise `KeyError` or `ValueError` for anything else."""
    t, value = (np.array(record[name], dtype=float) for name in ("t", "value"))
    values = {field.name: record[field.name] for field in fields(Samples)}
    return Samples(**values | {"role": Role(record["role"]), "t": t, "value": value})


def outcome_of(record: Mapping[str, Any] | pd.Series[Any]) -> Outcome:
    """Return the outcome of a record, or of a row of the table."""
    time, residual = (None if math.isnan(record[name]) else float(record[name]) for name in ("time", "residual"))
    return Outcome(OutcomeKind(record["outcome"]), record["reason"], _count(record["step"]), time, residual)


def _count(value: float) -> int | None:
    return None if math.isnan(value) else int(value)


def frame(rows: Iterable[Measurement]) -> pd.DataFrame:
    """Return the rows as a table with the columns `COLUMNS`, text as `string` and numbers as `float64`."""
    import pandas as pd  # here, so that the command line answers --help without it

    return _typed(pd.DataFrame([flat(row) for row in rows], columns=list(COLUMNS)))


def samples_frame(lines: Iterable[Samples]) -> pd.DataFrame:
    """Return a table with a row for each sample and the columns `SAMPLE_COLUMNS`, typed as in `frame`."""
    import pandas as pd

    table = pd.DataFrame([flat_samples(line) for line in lines], columns=list(SAMPLE_COLUMNS))
    return _typed(table.explode(["t", "value"], ignore_index=True))


def _typed(table: pd.DataFrame) -> pd.DataFrame:
    return table.astype({name: "float64" if name in _NUMBERS else "string" for name in table.columns})
