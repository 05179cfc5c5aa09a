"""How the runs of many bodies ended, as columns of numbers and texts, and back. Source: our own layout."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from inspect import signature
from typing import Any

import numpy as np

from ..errors import Diverged, IntegrationFailed, InvalidResult, NotConserved, NotConverged, NotRun, WrongBranch
from ..outcome import Outcome, OutcomeKind

KINDS = tuple(str(kind) for kind in OutcomeKind)
"""Texts of the kinds of outcomes: the number of a kind is its place here."""
NOT_DONE = 255
"""Number of no kind: of bodies that have not been run."""
COLUMNS: Mapping[str, tuple[str, Any]] = {
    "step": ("int64", -1),
    "time": ("float64", np.nan),
    "residual": ("float64", np.nan),
    "drift": ("float64", np.nan),
    "bound": ("float64", np.nan),
    "quantity": ("string", ""),
    "reason": ("string", ""),
}
"""What is known of failures: the attributes of the exceptions, their types, and what stands there where they have none."""
_CLASSES: Mapping[OutcomeKind, type[IntegrationFailed]] = {
    OutcomeKind.NOT_CONVERGED: NotConverged,
    OutcomeKind.WRONG_BRANCH: WrongBranch,
    OutcomeKind.DIVERGED: Diverged,
    OutcomeKind.NOT_CONSERVED: NotConserved,
    OutcomeKind.INVALID: InvalidResult,
    OutcomeKind.UNSUPPORTED: NotRun,
}


def list_kinds(n: int, failures: Mapping[int, IntegrationFailed]) -> Any:
    """Return the numbers (n,) of the kinds of outcomes of n bodies, of which some failed."""
    found = np.full(n, KINDS.index(OutcomeKind.OK), dtype=np.uint8)
    for i, failure in failures.items():
        found[i] = KINDS.index(failure.outcome.kind)
    return found


def list_columns(n: int, failures: Mapping[int, IntegrationFailed]) -> dict[str, Any]:
    """Return the `COLUMNS` (n,) of n bodies, of which some failed."""
    found = {name: np.full(n, blank, object if kind == "string" else kind) for name, (kind, blank) in COLUMNS.items()}
    for i, failure in failures.items():
        for name, value in (vars(failure.outcome) | vars(failure)).items():
            if name in COLUMNS and value is not None:
                found[name][i] = value
    return found


def read_failures(kinds: Any, names: Sequence[str], label: str, column: Callable[[str], Any]) -> dict[int, IntegrationFailed]:
    """Return what ended runs early, by the numbers of the bodies.

    Parameters
    ----------
    kinds, names
        Numbers (n,) of the kinds of outcomes, and the texts of the kinds by their numbers, which may be another version's.
    label
        Of the method.
    column
        Returns the column (n,) of a name out of `COLUMNS`; not called where no body failed.
    """
    failed = np.flatnonzero(kinds != names.index(OutcomeKind.OK)).tolist()
    columns = {name: column(name) for name in COLUMNS} if failed else {}
    rows = ({name: _none_if_blank(name, values[i]) for name, values in columns.items()} for i in failed)
    return {i: make_failure(OutcomeKind(names[kinds[i]]), row | {"label": label}) for i, row in zip(failed, rows, strict=True)}


def _none_if_blank(name: str, value: Any) -> Any:
    kind, blank = COLUMNS[name]
    if kind == "string":
        return str(value)
    return None if value == blank or np.isnan(value) else value.item()


def make_failure(kind: OutcomeKind, row: Mapping[str, Any]) -> IntegrationFailed:
    """Return the exception with the attributes of a row; a plain one of other people's kinds."""
    wanted = signature(_CLASSES[kind]).parameters if kind in _CLASSES else {}
    values = {name: row[name] for name in wanted}
    if wanted and None not in values.values():
        return _CLASSES[kind](**values)
    outcome = Outcome(kind, row["reason"], row["step"], row["time"], row["residual"])
    failure = IntegrationFailed(str(outcome))
    failure.outcome = outcome
    return failure
