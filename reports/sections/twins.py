"""Twins: which pairs an engine moves equally, how others differ, and what a maintainer can run."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np
import pandas as pd

from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies.study import Progress
from conservative.benchmarks.studies.twins import STUDY, compare_methods
from conservative.benchmarks.verification.pairs.differences import Twins
from conservative.benchmarks.verification.pairs.pairs import PAIRS, Pair
from conservative.benchmarks.verification.pairs.script import script_of
from conservative.method import Method
from conservative.outcome import OutcomeKind

from ..document.cells import DASH, bound, number
from ..document.model import Check, Document, Emphasis, Item, Items, Paragraph, Row, Section, Table, filled
from ..rows.names import of_measure, of_study

TERMS = (
    "A pair is a body and a second description of it. Their motions have to be equal: bit for bit where the arithmetic is the "
    "same, otherwise up to what rounding explains, which is measured by starts that differ by a rounding unit. "
    "“Same limit” means that the difference goes away with the step: the engine has two schemes for one body."
)
"""Explanation of the section."""
SHORT = {"not available": DASH, "unsupported": DASH}
"""Outcomes in tables."""


NONE = "No pair could be compared: no body of the pairs is supported."
HEAD = ["engine", "pair", "moments, kg m²", "mass, kg", "centre, m; g, m/s²", "rates, rad/s", "steps, s", "factor", "command"]


def build(results: Sequence[tuple[Method, Twins]], made: Mapping[str, str]) -> Document:
    """Return the document of `compare_methods`: the outcome of each pair, and what repeats those that differ."""
    engines = list(dict.fromkeys(method.label for method, _ in results))
    of_engine = {label: [twins for method, twins in results if method.label == label] for label in engines}
    wrong = [(method, twins) for method, twins in results if twins.wrong]
    ran = [twins for _, twins in results if SHORT.get(twins.outcome) != DASH]
    named = f"{len(engines)} engines" if len(engines) > 1 else engines[0]
    kinds = ("same bits", "equal", "same limit", "differs", "lost", "refused", "crashed", "not available")
    counts = [[label, *(str(sum(one.outcome == kind for one in some)) for kind in kinds)] for label, some in of_engine.items()]
    groups = _grouped(wrong)
    firsts = [(some[0][0].label, twins, _reduced(twins)) for some in groups for _, twins in some[:1] if twins.first]
    reduced = [[label, twins.pair, *cells, command(twins)] for label, twins, cells in firsts]
    other = {f"{method.label}: {one.pair}": one.detail for method, one in results if one.outcome in ("refused", "same limit")}
    brief = filled(
        Paragraph(f"{len(wrong)} of {len(ran)} pairs differ in {named}." if ran else NONE, Emphasis.LEAD),
        Items([Item(_sentence(some[0][1]), _names(some), True) for some in groups]),
        Table(["engine", *kinds], counts, "Pairs by outcome"),
        Table(HEAD, reduced, "Pairs that differ, reduced: the first of each group") if reduced else None,
    )
    return Document(
        "conservative twins",
        f"Twins: {', '.join(engines)}",
        [
            *brief,
            *(_table(label, some) for label, some in of_engine.items()),
            *filled(Items([Item(text, what) for what, text in other.items()])),
            Paragraph(TERMS),
        ],
        brief=brief,
        data={
            "made": dict(made),
            "passed": not wrong and bool(ran),
            "results": [{**_plain(twins), "script": script_of(method, twins)} for method, twins in results],
        },
        checks=[
            Check(method.label, f"{twins.body}: {twins.pair}", failure=_sentence(twins) if twins.wrong else "")
            for method, twins in results
            if SHORT.get(twins.outcome) != DASH
        ],
        failures=[f"{method.label}, {one.body}, {one.pair}: {_sentence(one)}" for method, one in wrong] or [NONE] * (not ran),
    )


def _grouped(wrong: Sequence[tuple[Method, Twins]]) -> list[list[tuple[Method, Twins]]]:
    """Return the pairs of one engine and body that differ in the same way, together."""
    groups: dict[tuple[str, str, str], list[tuple[Method, Twins]]] = {}
    for method, twins in wrong:
        kind = twins.detail if twins.size is None else twins.pair.partition(" x ")[0]
        groups.setdefault((method.label, twins.body, kind), []).append((method, twins))
    return list(groups.values())


def _names(some: Sequence[tuple[Method, Twins]]) -> str:
    pairs = ", ".join(dict.fromkeys(twins.pair for _, twins in some))
    return f"{some[0][0].label}: {some[0][1].body}, {pairs}"


def command(twins: Twins) -> str:
    """Return the command that repeats a pair."""
    return f"conservative twins {twins.engine} --pairs {shlex.quote(twins.pair)}"


def _table(label: str, results: Sequence[Twins]) -> Table:
    bodies = list(dict.fromkeys(twins.body for twins in results))
    cells = {(twins.pair, twins.body): _cell(twins) for twins in results}
    pairs = dict.fromkeys(twins.pair for twins in results)
    rows = [[pair, *(cells.get((pair, body), "") for body in bodies)] for pair in pairs]
    return Table(["pair", *bodies], [row for row in rows if any(cell not in ("", DASH) for cell in row[1:])], label)


def _cell(twins: Twins) -> str:
    if twins.outcome == "differs":
        return "DIFFERS" if np.isinf(twins.factor) else f"DIFFERS {number(twins.factor)} x"
    return SHORT.get(twins.outcome, twins.outcome)


def _sentence(twins: Twins) -> str:
    size = f"{number(twins.factor)} times what rounding explains" if np.isfinite(twins.factor) else ""
    if not twins.allowed and np.isfinite(twins.difference):
        size = f"{bound(twins.difference)} apart, where the same bits are expected"
    return "; ".join(filter(None, (twins.threshold, size, twins.detail))) or twins.outcome


def _reduced(twins: Twins) -> list[str]:
    one = twins.first
    assert one is not None
    moments, com, rates = (", ".join(map(number, values)) for values in (np.diag(one.inertia), one.com, one.w0))
    field = f"{com}; {number(one.gravity)}" if one.gravity else DASH
    size = number(twins.size) if twins.size else DASH
    return [moments, number(one.mass), field, rates, f"{one.n_steps} x {number(one.dt)}", size]


def _plain(twins: Twins) -> dict[str, object]:
    names = ("engine", "body", "pair", "outcome", "difference", "allowed", "detail", "threshold", "size")
    numbers = {name: value for name, value in (twins.first.numbers if twins.first else {}).items() if np.any(value)}
    first = {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in numbers.items()}
    return {**{name: getattr(twins, name) for name in names}, "first": first or None}


def changes(versions: Sequence[tuple[str, Sequence[Method]]], progress: Progress, pairs: Sequence[Pair] = PAIRS) -> list[str]:
    """Return a sentence for each pair that began or ceased to differ from one version of an engine to the next.

    `versions` are names and their methods, one for each setting, in the same order.
    """
    methods = [method for _, some in versions for method in some]
    found = {(method.name, twins.body, twins.pair): twins for method, twins in compare_methods(methods, progress, pairs)}
    bodies = dict.fromkeys((body, pair) for _, body, pair in found)
    told = []
    for (before, old), (after, new) in pairwise(versions):
        for was, now in zip(old, new, strict=True):
            for key in bodies:
                first, then = found[was.name, *key], found[now.name, *key]
                if first.wrong != then.wrong:
                    words = _sentence(then) if then.wrong else then.outcome
                    told.append(f"{now.setting() or 'default'}: {', '.join(key)}, {before} → {after}: {words}")
    return told


def section(table: pd.DataFrame, samples: pd.DataFrame) -> Section:
    """Return the section of a report from named rows of the study (see `names.with_names`)."""
    rows, body = of_measure(of_study(table, STUDY.name), Measure.ALLOWED), list[Row]()
    for name, group in rows.groupby("name", sort=False):
        ran = group[group["outcome"] == OutcomeKind.OK]
        failed = ran[ran["value"] > 1]
        crashed = int((group["outcome"] == OutcomeKind.CRASHED).sum())
        which = ", ".join(dict.fromkeys(failed["way"]))
        body.append([str(name), str(len(ran) - len(failed)), str(len(failed)), str(crashed), which or DASH])
    header = ["engine", "equal", "different", "crashed", "pairs that differ"]
    return Section("Twins", [Paragraph(TERMS), Table(header, body, "Pairs of descriptions")], "twins")
