"""The tables of engines: every setting, and each engine as installed beside its best."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import groupby

from conservative.benchmarks.studies.engines_at_one_step import AS_INSTALLED
from conservative.benchmarks.studies.engines_over_steps import WORSE
from conservative.outcome import Outcome, OutcomeKind

from .cells import DASH, SMALL, Cell, Grade, Row, Table, grade_drift, number, outcome_cell
from .engine_rows import ERROR, USABLE, Drift, EngineRow

AT_ITS_BEST = "at its best"
BOTH = "both"
ABSENT = (OutcomeKind.UNSUPPORTED, OutcomeKind.MISSING)
FAR_FROM_ORDER = 0.5
"""How far an order may be below the claimed one without being marked."""

TERMS = (
    (
        "taken",
        "as installed: nothing set but the step, – where its user has to choose a setting or no defaults are stated; at its "
        "best: the smallest error of all settings in this table.",
    ),
    ("bits", "of the engine's numbers: 64 double precision, 32 single."),
    ("error", "largest angle between attitude and truth over the run; of what chooses its steps, with its tolerance."),
    (
        "order",
        "fit of log(error) over log(step), in brackets the order that is expected of the integrator; ✗ where it is lower. "
        f"Impulse-based engines in single precision get {WORSE}: an order is not a number there.",
    ),
    ("energy drift, world momentum drift", "largest over the run, relative; gained or lost: at the end of the run."),
    ("turns over", "how often a free body turns over, of how often the exact motion does: the quality of the motion."),
    ("longest step", f"the longest measured one with which the error stays within {USABLE:g} rad; – where there is none."),
    ("µs a step", "wall time at the step of the scene, the fastest of interleaved rounds, taken inside the engine's process."),
    (
        f"µs per s at {ERROR:g} rad",
        "wall time of a simulated second at this error, interpolated log-log between two measured steps or tolerances; – where "
        "no measured run gets there.",
    ),
)
"""What the columns say, in words."""


def every_setting(rows: Sequence[EngineRow], dt: str) -> Table:
    """Return all that was measured on a scene whose step is `dt`, s: a row a setting; one for an engine that cannot do it."""
    header = [
        "engine==version/setting",
        "taken",
        "bits",
        f"error at dt {dt}, rad",
        "order (expected)",
        "energy drift",
        "world momentum drift",
        "turns over",
        "longest step, s",
        "µs a step",
        f"µs per s at {ERROR:g} rad",
        "run",
    ]
    there = [[row.label, *_cells(row)] for row in rows if row.outcome.kind not in ABSENT]
    return header, [*there, *_absent([row for row in rows if row.outcome.kind in ABSENT], len(header))]


def _cells(row: EngineRow) -> list[str | Cell]:
    return [
        taken(row),
        _integer(row.bits),
        number(row.error),
        order(row),
        drift(row.energy),
        drift(row.momentum),
        turns(row),
        number(row.longest_step),
        number(row.step_time * 1e6, 3),
        number(row.second_time * 1e6, 3),
        outcome_cell(row.outcome) if row.outcome.ok else _with_reason(row),
    ]


def _with_reason(row: EngineRow) -> Cell:
    """Return how a run ended, with the reason, which tables elsewhere leave to one another."""
    cell = outcome_cell(row.outcome)
    reason = row.outcome.reason
    return Cell(cell.text if not reason or reason in cell.text else f"{cell.text}: {reason}", cell.grade)


def _absent(rows: Sequence[EngineRow], columns: int) -> list[Row]:
    """Return a row for each engine and reason why it does not take a scene; of several settings only their number is named."""

    def key(row: EngineRow) -> tuple[str, str]:
        return row.engine, row.outcome.reason

    found: list[Row] = []
    for (engine, _), group in groupby(sorted(rows, key=key), key):
        members = list(group)
        label = members[0].label if len(members) == 1 else f"{engine}, {len(members)} settings"
        found.append([label, *[DASH] * (columns - 2), _with_reason(members[0])])
    return found


def taken(row: EngineRow) -> str:
    """Return how an engine is taken in a row: as installed, at its best, both or neither."""
    if row.as_installed and row.best:
        return BOTH
    return AS_INSTALLED if row.as_installed else AT_ITS_BEST if row.best else ""


def order(row: EngineRow) -> str | Cell:
    """Return the order that was seen, marked where it is below the expected one, in brackets, or that there is none."""
    if math.isnan(row.expected_order):
        return DASH
    expected = f"({row.expected_order:.0f})"
    if row.no_order == WORSE:
        return Cell(f"{DASH} none {expected}: {WORSE}", Grade.BAD)
    if math.isnan(row.order):
        return f"{DASH} not seen {expected}"
    text = f"{row.order:.2f} ± {row.order_stderr:.2f} {expected}"
    return Cell(f"✗ {text}", Grade.BAD) if row.order < row.expected_order - FAR_FROM_ORDER else text


def drift(value: Drift) -> Cell:
    """Return a graded drift, with its direction where it is more than small."""
    cell = grade_drift(value.size)
    return Cell(f"{cell.text} {value.direction}".rstrip(), cell.grade) if value.size > SMALL else cell


def turns(row: EngineRow) -> str | Cell:
    """Return how often the body turned over, of how often it does."""
    if math.isnan(row.turns) or math.isnan(row.true_turns):
        return DASH
    right = row.turns == row.true_turns
    return Cell(f"{'✓' if right else '✗'} {row.turns:.0f} of {row.true_turns:.0f}", Grade.GOOD if right else Grade.BAD)


def _integer(value: float) -> str:
    return DASH if math.isnan(value) else f"{value:.0f}"


def beside(rows: Sequence[EngineRow]) -> Table:
    """Return each engine as installed beside its best setting: a row an engine, those with the best first."""
    parts = ("setting", "attitude error, rad", "energy drift", "turns over")
    header = ["engine", "bits", *(f"{text}: {part}" for text in (AS_INSTALLED, AT_ITS_BEST) for part in parts)]
    engines = dict.fromkeys(row.engine for row in rows if row.best)
    return header, [_pair(engine, [row for row in rows if row.engine == engine]) for engine in engines]


def _pair(engine: str, rows: Sequence[EngineRow]) -> Row:
    best = next(row for row in rows if row.best)
    installed = next((row for row in rows if row.as_installed), None)
    return [engine, _integer(best.bits), *(_short(installed) if installed else [DASH] * 4), *_short(best)]


def _short(row: EngineRow) -> list[str | Cell]:
    if math.isnan(row.error):
        return [row.setting, outcome_cell(Outcome(row.outcome.kind)), DASH, DASH]
    return [row.setting, number(row.error), drift(row.energy), turns(row)]


def versions(locks: Iterable[tuple[str, str, int]], beside_us: Iterable[str]) -> Table:
    """Return version, Python and number of packages of each environment, then the engines beside us."""
    apart = [[name, "in an environment of its own", python, str(count)] for name, python, count in locks]
    return ["engine", "runs", "Python", "packages"], [*apart, *([name, "beside us", "ours", DASH] for name in beside_us)]
