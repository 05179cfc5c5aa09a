"""What tables are made of: numbers as text, and cells with a grade."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

from conservative.benchmarks.measures.errors import CONSERVED as CONSERVED
from conservative.benchmarks.measures.errors import SMALL as SMALL
from conservative.outcome import Outcome, OutcomeKind

from ..document.model import Cell as Cell
from ..document.model import Grade as Grade
from ..document.model import Row as Row
from ..document.model import Table as Table

DASH = "–"


_ABSENT = (OutcomeKind.UNSUPPORTED, OutcomeKind.MISSING, OutcomeKind.SKIPPED)
_DURING_A_RUN = (OutcomeKind.NOT_CONVERGED, OutcomeKind.WRONG_BRANCH, OutcomeKind.DIVERGED, OutcomeKind.NOT_CONSERVED)


def number(value: float, digits: int = 2) -> str:
    """Return a number to `digits` significant digits, a dash for nan."""
    if math.isnan(value):
        return DASH
    plain = value == 0 or 0.01 <= abs(value) < 1e6
    return f"{float(f'{value:.{digits}g}'):,g}" if plain else _power(f"{value:.{digits - 1}e}")


def tolerance(value: float) -> str:
    """Return an error that something is compared at, such as a decade: `1e-3`."""
    return _power(f"{value:.0e}")


def factor(ratio: float, digits: int = 2) -> str:
    """Return how many times as much something is, as people write it: `2.0`, `220`, `1,200`; a dash for nan."""
    if math.isnan(ratio):
        return DASH
    rounded = float(f"{ratio:.{digits}g}")
    decimals = digits - 1 - math.floor(math.log10(rounded)) if rounded > 0 else 0
    return f"{rounded:,.{max(decimals, 0)}f}"


def _power(text: str) -> str:
    """Return a number with a short exponent: `1e-3` for `1e-03`."""
    mantissa, _, exponent = text.partition("e")
    return f"{mantissa}e{int(exponent)}" if exponent else text


def grade_drift(value: float) -> Cell:
    """Return a drift with a symbol that is not its colour alone."""
    if math.isnan(value):
        return Cell(DASH, Grade.NONE)
    symbol, grade = ("✓", Grade.GOOD) if value <= CONSERVED else ("≈", Grade.FAIR) if value <= SMALL else ("✗", Grade.BAD)
    return Cell(f"{symbol} {number(value)}", grade)


def outcome_text(outcome: Outcome) -> str:
    """Return an outcome as a table shows it: when and why for what happens during a run, otherwise the kind alone."""
    return str(outcome) if outcome.kind in _DURING_A_RUN else outcome.kind.value


def finite_or_none(value: float) -> float | None:
    """Return the value, None where JSON has no number for it."""
    return value if math.isfinite(value) else None


def outcome_record(outcome: Outcome) -> dict[str, Any]:
    """Return the fields of an outcome for JSON."""
    residual = None if outcome.residual is None else finite_or_none(outcome.residual)
    return asdict(outcome) | {"kind": outcome.kind.value, "residual": residual}


def outcome_cell(outcome: Outcome) -> Cell:
    """Return how a run ended, with a symbol."""
    if outcome.ok:
        return Cell("✓ done", Grade.GOOD)
    absent = outcome.kind in _ABSENT
    return Cell(f"{DASH if absent else '✗'} {outcome_text(outcome)}", Grade.NONE if absent else Grade.BAD)
