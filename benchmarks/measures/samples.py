"""Samples of a quantity over time, which a study yields besides its rows."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from conservative.attitude import Array
from conservative.method import Role

if TYPE_CHECKING:
    import pandas as pd

COLUMNS = (
    *("study", "scene", "method", "label", "family", "version", "setting", "role", "series", "series_setting"),
    *("dt", "quantity", "t", "value"),
)
"""Columns of the table, in order."""
_NUMBERS = frozenset({"dt", "t", "value"})
_WHO = COLUMNS[:-2]


@dataclass(frozen=True, kw_only=True, eq=False)
class Samples:
    """A quantity over time in one run.

    Attributes
    ----------
    study, scene, method, label, family, version, setting, role, series, series_setting, dt
        As a `Measurement` has them.
    quantity
        Name of the quantity, such as `energy`; the study documents its unit.
    t, value
        Times (n,), s, and values (n,).
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
    quantity: str
    t: Array
    value: Array


def flat(samples: Samples) -> dict[str, Any]:
    """Return samples as a record for JSON."""
    who = {name: getattr(samples, name) for name in _WHO}
    return {**who, "role": samples.role.value, "t": samples.t.tolist(), "value": samples.value.tolist()}


def from_flat(record: Mapping[str, Any]) -> Samples:
    """Return the samples of a record from `flat`; raise `KeyError` or `ValueError` for anything else."""
    who = {name: record[name] for name in _WHO}
    t, value = (np.array(record[name], dtype=float) for name in ("t", "value"))
    return Samples(**{**who, "role": Role(record["role"])}, t=t, value=value)


def frame(lines: Iterable[Samples]) -> pd.DataFrame:
    """Return a table with a row for each sample: columns as `COLUMNS` has them, text as `string`, numbers as `float64`."""
    import pandas as pd  # here, so that the command line answers --help without it

    parts = [pd.DataFrame(flat(line), columns=list(COLUMNS)) for line in lines]
    table = pd.concat(parts, ignore_index=True) if parts else pd.DataFrame(columns=list(COLUMNS))
    return table.astype({name: "float64" if name in _NUMBERS else "string" for name in COLUMNS})
