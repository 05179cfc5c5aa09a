"""Blocks on pairs of descriptions: which pairs move equally, how others differ, and what a maintainer can run."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Sequence

import numpy as np

from conservative.benchmarks.verification.finding import Finding, Verdict
from conservative.benchmarks.verification.pairs.verify import PairFinding, Relation

from ..document.cells import DASH, number
from ..document.model import Block, Cell, Grade, Item, Items, Paragraph, Row, Table, filled

TERMS = (
    "A pair is two descriptions of one motion of a body. Both motions have to be equal: bit for bit where the arithmetic is "
    "the same, otherwise up to rounding, which is measured by starts that differ by a rounding unit. “Same limit” means that "
    "the difference goes away with the step: the engine has two schemes for one body."
)
"""Explanation of the tables."""
SCRIPTS = "With `--scripts FOLDER`, the command writes the pairs that differ as scripts in the engine's own language."
NOT_RUN = (Relation.NOT_AVAILABLE, Relation.UNSUPPORTED, Relation.NOT_RUN)
"""Relations that tables show as a dash."""
GRADES = {Verdict.RIGHT: Grade.GOOD, Verdict.WRONG: Grade.BAD, Verdict.UNDECIDED: Grade.FAIR, Verdict.NOT_TESTED: Grade.NONE}
HEAD = ["engine", "pair", "moments, kg m²", "mass, kg", "centre, m; g, m/s²", "rates, rad/s", "steps, s", "factor", "command"]


def pair_blocks(findings: Iterable[Finding]) -> list[Block]:
    """Return the pairs that differ, their reduced descriptions and scripts, and a table by pair and body for each engine."""
    some = [finding for finding in findings if isinstance(finding, PairFinding)]
    engines = dict.fromkeys(finding.subject for finding in some)
    groups = _grouped([finding for finding in some if finding.verdict is Verdict.WRONG])
    reduced = [_reduced(group[0]) for group in groups]
    other = {
        f"{finding.subject}: {finding.case}": finding.detail for finding in some if finding.relation not in (*NOT_RUN, *PLAIN)
    }
    return filled(
        Items([Item(_words(group[0]), _names(group), True) for group in groups]),
        Table(HEAD, reduced, "Pairs that differ, reduced: the first of each group"),
        *(_table(engine, [finding for finding in some if finding.subject == engine]) for engine in engines),
        Items([Item(text, what) for what, text in other.items()]),
        Paragraph(SCRIPTS) if any(finding.script for finding in some) else None,
        Paragraph(TERMS) if some else None,
    )


PLAIN = (Relation.SAME_BITS, Relation.EQUAL, Relation.DIFFERS, Relation.CRASHES)
"""Relations that the tables explain."""


def _words(finding: PairFinding) -> str:
    """Return the mistakes that explain a pair that differs, and how it differs."""
    causes = [f"{cause.sentence} (leaves {number(cause.left)} of {number(cause.of)} rad)" for cause in finding.causes]
    return "; ".join(filter(None, (". Or: ".join(causes), finding.detail)))


def _grouped(wrong: Sequence[PairFinding]) -> list[list[PairFinding]]:
    """Return the pairs of one engine and body that differ in the same way, together."""
    groups: dict[tuple[str, str, str], list[PairFinding]] = {}
    for finding in wrong:
        kind = finding.detail if finding.scale is None else finding.quantity
        groups.setdefault((finding.subject, finding.body, kind), []).append(finding)
    return list(groups.values())


def _names(group: Sequence[PairFinding]) -> str:
    return f"{group[0].subject}: {group[0].body}, {', '.join(dict.fromkeys(finding.pair for finding in group))}"


def command(finding: PairFinding) -> str:
    """Return the command that repeats a pair."""
    return f"conservative verify {shlex.quote(finding.subject)} --only pairs --pairs {shlex.quote(finding.pair)}"


def _table(engine: str, findings: Sequence[PairFinding]) -> Table:
    bodies = list(dict.fromkeys(finding.body for finding in findings))
    cells = {(finding.pair, finding.body): _cell(finding) for finding in findings}
    rows = list[Row]()
    for pair in dict.fromkeys(finding.pair for finding in findings):
        row = [cells.get((pair, body), Cell("")) for body in bodies]
        if any(str(cell) not in ("", DASH) for cell in row):
            rows.append([pair, *row])
    return Table(["pair", *bodies], rows, engine)


def _cell(finding: PairFinding) -> Cell:
    if finding.relation in NOT_RUN:
        return Cell(DASH)
    times = f" {number(finding.factor)} x" if finding.verdict is Verdict.WRONG and np.isfinite(finding.factor) else ""
    return Cell(f"{finding.relation}{times}", GRADES[finding.verdict])


def _reduced(finding: PairFinding) -> list[str]:
    body = finding.first
    assert body is not None  # a pair that differs has both descriptions
    moments, com, rates = (", ".join(map(number, values)) for values in (np.diag(body.inertia), body.com, body.w0))
    field = f"{com}; {number(body.gravity)}" if body.gravity else DASH
    scale = number(finding.scale) if finding.scale else DASH
    steps = f"{body.n_steps} x {number(body.dt)}"
    return [finding.subject, finding.pair, moments, number(body.mass), field, rates, steps, scale, command(finding)]
