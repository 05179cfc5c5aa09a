"""What tables are made of: numbers as text, and cells with a grade."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields, is_dataclass
from enum import Enum, StrEnum
from typing import Any

from conservative.benchmarks.measures.drift_class import CONSERVED as CONSERVED
from conservative.benchmarks.measures.drift_class import SMALL as SMALL
from conservative.outcome import Outcome, OutcomeKind

DASH = "–"


class Grade(StrEnum):
    """How good a cell is, which the page shows by symbol, word and colour."""

    GOOD = "good"
    FAIR = "fair"
    BAD = "bad"
    NONE = "none"


@dataclass(frozen=True)
class Cell:
    """A cell with a grade."""

    text: str
    grade: Grade

    def __str__(self) -> str:
        return self.text


Row = Sequence[str | Cell]
Table = tuple[Sequence[str], Sequence[Row]]
"""Header and rows."""

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
    """Return a number with an exponent without what nobody writes: `1e-3` for `1e-03`."""
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


def plain(value: Any) -> Any:
    """Return a value for JSON: dataclasses as dictionaries, enums as their values, NaN and infinite numbers as null."""
    if is_dataclass(value):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, Mapping):
        return {name: plain(each) for name, each in value.items()}
    if isinstance(value, list | tuple):
        return [plain(each) for each in value]
    if isinstance(value, Enum):
        return value.value
    return finite_or_none(value) if isinstance(value, float) else value


def outcome_record(outcome: Outcome) -> dict[str, Any]:
    """Return the fields of an outcome as JSON has them."""
    residual = None if outcome.residual is None else finite_or_none(outcome.residual)
    return asdict(outcome) | {"kind": outcome.kind.value, "residual": residual}


def outcome_cell(outcome: Outcome) -> Cell:
    """Return how a run ended, with a symbol."""
    if outcome.ok:
        return Cell("✓ done", Grade.GOOD)
    absent = outcome.kind in _ABSENT
    return Cell(f"{DASH if absent else '✗'} {outcome_text(outcome)}", Grade.NONE if absent else Grade.BAD)


def markdown(table: Table) -> str:
    """Return a table in Markdown; cells are not padded, as no reader of the page would see that."""
    header, body = table
    lines = [header, ["---", *["---:"] * (len(header) - 1)], *body]
    return "\n".join("| " + " | ".join(str(cell).replace("|", "\\|") for cell in line) + " |" for line in lines)
