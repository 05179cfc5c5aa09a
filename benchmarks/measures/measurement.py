"""The tidy row that every study yields, and the table of them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import astuple, dataclass, fields
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Measurement:
    """One measured value.

    Attributes
    ----------
    study, scene
        Names of the study that made the row and of the scene.
    method
        Registered name with settings, such as `mujoco:integrator=RK4`; `conservative.registry.method` reads it back.
    label
        The same with version, such as `mujoco==4.0.0/RK4`.
    role
        "ours", "engine" or "truth".
    dt
        Step, s, or distance of samples of an adaptive method; nan for what belongs to no single step.
    measure, value, unit
        What was measured, such as `energy drift max`, and how much of it; nan where nothing could be measured.
    status
        "ok", "missing", "unsupported", or what failed and when.
    detail
        What a reader may want beside the value; may be empty.
    """

    study: str
    scene: str
    method: str
    label: str
    role: str
    dt: float
    measure: str
    value: float
    unit: str
    status: str
    detail: str = ""


COLUMNS = tuple(field.name for field in fields(Measurement))
_NUMBERS = frozenset({"dt", "value"})


def frame(rows: Iterable[Measurement]) -> pd.DataFrame:
    """Return the rows as a table: columns in the order of `Measurement`, text as `string`, numbers as `float64`."""
    import pandas as pd  # here, so that the command line answers --help without it

    table = pd.DataFrame([astuple(row) for row in rows], columns=list(COLUMNS))
    return table.astype({name: "float64" if name in _NUMBERS else "string" for name in COLUMNS})
