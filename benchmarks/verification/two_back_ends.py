"""Two back ends of one product: which of them is wrong, by which mistake, and from which settings on they agree.

Both are verified with the exact motions, as `programs` verifies one. Their difference alone cannot tell which is wrong.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field, replace
from itertools import chain, count
from typing import Any

import numpy as np

from conservative import registry
from conservative.attitude import angle_between
from conservative.check import describe
from conservative.errors import BadInput, Unsupported
from conservative.grid import Grid
from conservative.references.environments.programs import UnusableProgram
from conservative.references.worker.client import time_limit
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from . import known as known_errors
from . import protocol
from .back_ends import AnyBackEnd, Raised, Runnable, find, is_single, same
from .finding import Finding, Verdict, Verification, join_verdicts, uncapitalised
from .mistakes.equations import EQUATIONS, EquationsMistake
from .mistakes.scenes import SCENES, SceneMistake
from .motions.motion import Motion
from .motions.own import motion_of
from .programs import (
    GENERIC,
    PATIENCE,
    UNKNOWN,
    Answers,
    Named,
    Ran,
    Samples,
    is_generic,
    judge_motions,
    motions_of,
    run_motions,
    summary,
)
from .solution import States
from .sweep import Convergence, Limit, Sweep, apart, choose, in_body_axes, measured_order, sentence, sweep
from .trials import compose
from .verify import Kind, Tell, require_motions
from .which import UNITS, Difference, Side, which

CHECKS = ("motions", "order", "parity")
"""Checks of two back ends: the exact motions of each, the convergence of each in a sweep of steps, and their difference."""
KIND = "back ends"
"""`Verification.kind` of two back ends."""
SWEPT = 4
"""Pieces of work of a usual sweep: the steps and a setting of both back ends."""
LISTED = 3
"""Motions that a sentence names."""
SLOPE = 0.5
"""Largest difference between the declared order and the measured one."""


@dataclass(frozen=True, eq=False)
class Curves:
    """Errors of two back ends and the difference between them at times t (n,), s, of a motion, in a unit, rad or relative."""

    motion: str
    unit: str
    t: tuple[float, ...]
    first: tuple[float, ...]
    second: tuple[float, ...]
    between: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class Row:
    """A motion in the table: its name, and the findings on both back ends and on their difference; None if not run."""

    motion: str
    first: Finding | None
    second: Finding | None
    between: Finding | None


@dataclass(frozen=True, eq=False)
class Parity:
    """The result for two back ends.

    Attributes
    ----------
    first, second
        The verification of each.
    difference
        The largest difference between them, relative to what is allowed.
    table
        The motions x (first, second, first against second).
    sweep
        The sweep of settings; None if there is no motion that both run, or it was left out.
    curves
        Errors over time; None if there is no motion that both run.
    """

    first: Verification = field(repr=False)  # JSON has their findings already
    second: Verification = field(repr=False)
    difference: Difference
    table: tuple[Row, ...] = field(repr=False)
    sweep: Sweep | None
    curves: Curves | None

    def rows(self) -> Iterator[dict[str, Any]]:
        """Yield errors over time: dictionaries of t, s, quantity and value."""
        if self.curves is None:
            return
        names = f"error of {self.first.subject}", f"error of {self.second.subject}", "difference between them"
        for name, values in zip(names, (self.curves.first, self.curves.second, self.curves.between), strict=True):
            for t, value in zip(self.curves.t, values, strict=True):
                yield {"t": t, "quantity": f"{name}, {self.curves.unit}", "value": value}


@dataclass(frozen=True, eq=False)
class Judged:
    """A back end after its motions: its answers, the findings, the mistakes, and sentences on long steps.

    `answers` is None for a program that does not run.
    """

    found: Runnable
    answers: Answers | None
    findings: list[Finding]
    named: list[Named]
    limits: list[str]
    notes: tuple[str, ...] = ()

    @property
    def ran(self) -> dict[str, Ran]:
        """The motions that it ran, by name."""
        return {} if self.answers is None else {run.motion.name: run for run in self.answers.ran}


def parity(
    a: AnyBackEnd,
    b: AnyBackEnd,
    *,
    motions: Sequence[str] | None = None,
    body: str | os.PathLike[str] | Scene | None = None,
    only: str | Sequence[str] = (),
    seed: int | None = None,
    record: str | os.PathLike[str] | None = None,
    known: str | os.PathLike[str] | None = None,
    tell: Tell = lambda share, what: None,
) -> Verification:
    """Verify two back ends of one product: which one is wrong, by which mistake, and from which settings on do they agree?

    For example:

        def simulate(R0, w0, inertia, dt, n):  # a free body; returns attitudes (n + 1, 3, 3) and rates (n + 1, 3)
            ...

        result = cv.verification.parity(simulate, "mujoco:RK4", body="my_body.toml")
        print(result.sentence)

    Parameters
    ----------
    a, b
        Python functions (see `BackEnd`), methods, or names of engines, methods or programs. A name without settings is the
        default setting. Functions get free bodies only.
    motions
        Names of exact motions, by default all. An empty list runs only the motion of `body`.
    body
        Scene, its name or its file. Its first 10 rad are one more motion, which the sweep of settings uses.
    only
        Names of checks: "motions", "order" (the sweep of settings) or "parity". By default all.
    seed
        The fresh motions of this seed instead of the published ones.
    record, known
        File of known errors to write, or to compare with, as in `verify`.
    tell
        Called with the share of the work that is done and the next piece of it.

    Returns
    -------
    Verification
        Of the kind "back ends". Its sentence says which one is wrong. It has the findings on both and on their difference, and
        `Parity` as details.

    Raises
    ------
    BadInput
        Both back ends are the same, one of them is something else or returns something else than a back end, a name is unknown,
        or a function raises an exception in the first motion.
    MissingEngine
        An engine is not installed.
    """
    if same(a, b):
        raise BadInput("b", f"the first back end again ({describe(b)})", "another back end, version or setting")
    checks = [only] if isinstance(only, str) else list(only)
    for name in checks:
        if name not in CHECKS:
            raise BadInput("only", describe(name), f"checks of two back ends: {', '.join(CHECKS)}")
    require_motions(seed, (), record or known)
    chosen = _choose_motions(motions, seed)
    if body is not None:
        chosen = [motion_of(body if isinstance(body, Scene) else registry.scene(os.fspath(body))), *chosen]
    if not chosen:
        raise BadInput("motions", "no motion", "names of motions, or a body")
    with known_errors.comparing(record, known, checks) as compare:
        (result,) = compare([_parity(_find_both(a, b), chosen, checks or CHECKS, tell, _left_out(chosen, seed))])
        return result


def _left_out(chosen: Sequence[Motion], seed: int | None) -> list[Motion]:
    """Return the motions of the catalogue, or of a seed, that are not run."""
    names = {motion.name for motion in chosen}
    return [motion for motion in motions_of(seed) if motion.name not in names]


def _choose_motions(names: Sequence[str] | None, seed: int | None) -> list[Motion]:
    listed = [names] if isinstance(names, str) else names
    if listed is not None and not len(listed):
        return []
    every = list(motions_of(seed))
    if listed is None:
        return every
    by_name = {motion.name: motion for motion in every}
    for name in listed:
        if name not in by_name:
            raise BadInput("motions", describe(name), f"names of motions: {', '.join(by_name)}")
    return [by_name[name] for name in dict.fromkeys(listed)]


def _find_both(a: AnyBackEnd, b: AnyBackEnd) -> list[Runnable | tuple[str, UnusableProgram]]:
    """Return both back ends with different names; the name and the failure of a program that does not start."""
    found = list[Runnable | tuple[str, UnusableProgram]]()
    for subject, letter in ((a, "a"), (b, "b")):
        try:
            with time_limit(PATIENCE):  # programs start here, engines do not
                found.append(find(subject, letter))
        except UnusableProgram as failure:
            found.append((str(subject), failure))
    first, second = (side.name if isinstance(side, Runnable) else side[0] for side in found)
    if first != second:
        return found
    if all(isinstance(side, Runnable) and side.kind != "function" for side in found):
        raise BadInput("b", f"the first back end again ({second!r})", "another back end, version or setting")
    return [
        replace(side, name=f"{side.name} ({letter})") if isinstance(side, Runnable) else (f"{side[0]} ({letter})", side[1])
        for side, letter in zip(found, "ab", strict=True)
    ]


def _parity(
    sides: Sequence[Runnable | tuple[str, UnusableProgram]],
    motions: Sequence[Motion],
    checks: Sequence[str],
    tell: Tell,
    left_out: Sequence[Motion],
) -> Verification:
    judged = list[Judged]()
    for k, side in enumerate(sides):
        with patience(side):
            judged.append(_judge(side, motions, _advancing(tell, 0.4 * k, 0.4, len(motions))))
    names = [one.found.name for one in judged]
    together = f"{names[0]} and {names[1]}"
    rows, difference, curves = _compare(judged, motions, together)
    result = None
    if "order" in checks and (motion := choose(motions, lambda motion: all(_ran(one, motion) for one in judged))):
        with patience(*sides):
            result = sweep(judged[0].found, judged[1].found, motion, _advancing(tell, 0.8, 0.2, SWEPT))
        for one, convergence in zip(judged, (result.first, result.second), strict=True):
            one.findings.append(_order_finding(one.found, convergence, result.unit))
    made = [_verification(one, checks) for one in judged]
    between = [row.between for row in rows if row.between is not None]
    findings = [*made[0].findings, *made[1].findings, *(between if "parity" in checks else ())]
    sides_of = [_side(one, verification) for one, verification in zip(judged, made, strict=True)]
    a, b = _same_mistake(judged, sides_of)
    check = (
        f"they agree with each other ({difference.size}), and both are wrong. {a.subject}: {a.reason}. {b.subject}: {b.reason}"
    )
    notes = [f"{one.found.name}: {note}" for one in judged for note in one.notes]
    if (a.verdict, b.verdict) == (Verdict.RIGHT, Verdict.RIGHT) and (hidden := _hidden(judged, left_out)):
        notes.append(f"the motions that were run cannot show these mistakes, other exact motions can: {'; '.join(hidden)}")
    details = Parity(made[0], made[1], difference, tuple(rows), result, curves)
    reason = which(a, b, difference, check=check)
    if not {"motions", "order"} & set(checks) and all(one.answers is not None for one in judged):
        apart = difference.missing or f"they differ by at most {difference.size}"
        reason = f"{apart}; neither is compared with the exact motion, because parity is the only check"
    if result is not None and (a.verdict, b.verdict) == (Verdict.RIGHT, Verdict.RIGHT):
        reason += _orders(names, result)
    return Verification(together, KIND, findings, reason, notes, details)


def _hidden(judged: Sequence[Judged], left_out: Sequence[Motion]) -> list[str]:
    """Return the sentences of the mistakes that no run of a back end shows, and that a motion that was left out may show.

    Mistakes without fitted numbers in a free body and its equations are tried on each run.
    """
    hidden = list[str]()
    for mistake in chain[SceneMistake | EquationsMistake](SCENES, EQUATIONS):
        change = mistake.change if isinstance(mistake, SceneMistake) else mistake.build
        if mistake.numbers or not any(
            change(motion.scene) is not None
            for motion in left_out
            if all(one.found.unsupported(motion.scene) is None for one in judged)
        ):
            continue
        if not all(any(_shows(mistake, run) for run in one.ran.values()) for one in judged):
            hidden.append(uncapitalised(mistake.sentence))
    return hidden


def _shows(mistake: SceneMistake | EquationsMistake, run: Ran) -> bool:
    """Return whether a mistake would be seen in a run."""
    motion = compose(mistake).build(run.case)
    if motion is None:
        return False
    R, w = run.case.evaluate(motion, np.zeros((1, 6)))
    return bool(not np.isfinite(w).all() or (run.case.apart((R[0], w[0]), run.case.exact) > run.allowed).any())


def _advancing(tell: Tell, begin: float, width: float, pieces: int) -> Callable[[str], object]:
    """Return the function that tells the next of so many pieces of work, or a few more, in a part of the whole work.

    The part begins at one share of the whole, and has a width.
    """
    told = count()
    return lambda what: tell(begin + width * min(1.0, next(told) / pieces), what)


def _orders(names: Sequence[str], result: Sweep) -> str:
    """Return which of two right back ends has which order, if the orders differ."""
    orders = [side.order.slope for side in (result.first, result.second)]
    if not abs(orders[0] - orders[1]) > SLOPE:  # False for nan
        return ""
    return "; " + ", ".join(f"{name} has order {order:.2f}" for name, order in zip(names, orders, strict=True))


def patience(*sides: Runnable | tuple[str, UnusableProgram]) -> AbstractContextManager[None]:
    """Return a limit of the time of each answer if a side is a program, as in `verify_program`."""
    of_program = any(isinstance(side, Runnable) and side.kind == Kind.PROGRAM for side in sides)
    return time_limit(PATIENCE) if of_program else nullcontext()


def _ran(judged: Judged, motion: Motion) -> bool:
    run = judged.ran.get(motion.name)
    return run is not None and not run.ended


def _judge(side: Runnable | tuple[str, UnusableProgram], motions: Sequence[Motion], tell: Callable[[str], object]) -> Judged:
    """Return a back end after its motions. Raise `BadInput` for a function that raises an exception in the first one."""
    if not isinstance(side, Runnable):
        name, failure = side
        nothing: Any = None
        lost = Runnable(name, "program", nothing, None, False, False, lambda scene: "")
        return Judged(lost, None, [protocol.unusable(name, failure)], [], [])
    name, notes = side.name, list[str]()
    if side.kind == "function":
        side, notes = _measure(side, motions, tell)
    answers = run_motions(
        side.solve,
        side.order,
        side.single,
        side.principal,
        side.unsupported,
        lambda what: tell(f"{name}: {what}"),
        motions=motions,
    )
    findings, named, limits, _ = judge_motions(name, answers)
    for quantity, k in (("attitudes", 0), ("rates", 1)):
        if answers.ran and all(run.case.data[k] is None for run in answers.ran):
            notes.append(f"it returns no {quantity}, which are not compared")
    return Judged(side, answers, findings, named, limits, tuple(notes))


def _measure(side: Runnable, motions: Sequence[Motion], tell: Callable[[str], object]) -> tuple[Runnable, list[str]]:
    """Return a function with its precision and order, which are measured if they are not declared, and notes on them."""
    able, answer = list[Motion](), None
    for motion in motions:
        if side.unsupported(motion.scene) is not None:
            continue
        able.append(motion)
        if answer is None:
            tell(f"{side.name}: {motion.name}")
            answer = _first_answer(side, motion)
    if answer is None:
        return side, []
    notes = list[str]()
    if side.measures_precision and is_single(answer):
        side = replace(side, single=True)
        notes.append("its numbers have single precision")
    if side.measures_order:
        tell(f"{side.name}: order")
        free = [motion for motion in able if is_generic(motion)] or able
        longest = sorted(free, key=lambda motion: -motion.steps * motion.samples)[:GENERIC]
        measured = measured_order(side, longest)
        side = replace(side, order=measured.order)
        notes.append(measured.reason or f"its order is {side.order}, measured without the exact motion")
    return side, notes


def _first_answer(side: Runnable, motion: Motion) -> Samples | Trajectory | None:
    """Return the answer of a function for the beginning of a motion, None if it does not support the body."""
    try:
        return side.solve(motion.scene, Grid(motion.step / 10, 10, 1))
    except Unsupported:
        return None
    except Raised as raised:
        allowed = "a function that returns the motion of every free body, or raises NotImplementedError"
        raise BadInput(side.name, f"{raised} in the motion {motion.name}", allowed) from raised.error


def _compare(judged: Sequence[Judged], motions: Sequence[Motion], subject: str) -> tuple[list[Row], Difference, Curves | None]:
    """Return the table, the largest difference, and errors over time in the motion that shows most."""
    by_case = [{finding.case: finding for finding in one.findings if finding.check == "motions"} for one in judged]
    rows, shown, missing = list[Row](), list[tuple[Motion, Difference, Curves]](), "no motion that both of them run"
    for motion in motions:
        first, second = (one.ran.get(motion.name) for one in judged)
        finding = None
        if first is None or second is None or first.ended or second.ended:
            if first is not None or second is not None:
                finding = Finding(subject, "parity", motion.name, Verdict.NOT_TESTED, detail="one of them does not run it")
        elif compared := _difference(motion, first, second):
            difference, k = compared[0], compared[0].worse
            verdict = Verdict.RIGHT if difference.agrees else Verdict.WRONG
            sizes = difference.error[k], difference.allowed[k], UNITS[k]
            finding = Finding(subject, "parity", motion.name, verdict, *sizes, by="order")
            shown.append((motion, *compared))
        else:
            missing = "one has attitudes, the other one rates"
            finding = Finding(subject, "parity", motion.name, Verdict.NOT_TESTED, detail=missing)
        rows.append(Row(motion.name, by_case[0].get(motion.name), by_case[1].get(motion.name), finding))
    if not shown:
        return rows, Difference(missing=missing), None
    most = max(shown, key=lambda each: (each[0].own, _ratio(each[1])))
    return rows, _largest([difference for _, difference, _ in shown]), most[2]


def _ratio(difference: Difference) -> float:
    return difference.error[difference.worse] / difference.allowed[difference.worse]


def _largest(differences: Sequence[Difference]) -> Difference:
    """Return the difference that is largest beside the allowed one, or if all are allowed, the largest one, of attitudes."""
    worst = max(differences, key=_ratio)
    turned = [difference for difference in differences if not math.isnan(difference.error[0])]
    if not worst.agrees or not turned:
        return worst
    largest = max(turned, key=lambda difference: difference.error[0])
    return replace(largest, error=(largest.error[0], math.nan))


def _difference(motion: Motion, first: Ran, second: Ran) -> tuple[Difference, Curves] | None:
    """Return the difference between two runs of a motion, and errors over time; None if they share no quantity."""
    data: list[States] = [in_body_axes(run.case.data, motion, run.motion) for run in (first, second)]
    scale, t = first.case.scale, first.case.t
    error = apart(data[0], data[1], scale)
    if all(math.isnan(x) for x in error):
        return None
    allowed = first.allowed + second.allowed
    difference = Difference(error, (float(allowed[0]), float(allowed[1])), rows=len(t), common=True, case=motion.name)
    k = difference.worse
    a, b = (side[k] for side in data)
    assert a is not None  # otherwise the error is nan
    assert b is not None
    between = angle_between(a, b) if k == 0 else np.linalg.norm(a - b, axis=1) / scale
    columns = (tuple(map(float, values)) for values in (t, first.case.error[k], second.case.error[k], between))
    return replace(difference, time=float(t[int(np.argmax(between))])), Curves(motion.name, UNITS[k], *columns)


def _order_finding(found: Runnable, convergence: Convergence, unit: str) -> Finding:
    """Return the finding on the convergence of a back end in the sweep."""
    order, declared = convergence.order, None if found.measures_order else found.order
    slow = declared is not None and not found.single and order.slope < declared - SLOPE  # False for nan
    elsewhere = convergence.limit in (Limit.OTHER, Limit.NOTHING)
    verdict = Verdict.WRONG if elsewhere or slow else Verdict.RIGHT
    text = sentence("it", convergence, unit) + f", and order {declared} was declared" * (slow and not elsewhere)
    return Finding(
        found.name,
        "order",
        "",
        Verdict.NOT_TESTED if convergence.limit is Limit.UNKNOWN else verdict,
        order.slope,
        math.nan if declared is None else float(declared),
        "",
        "declared",
        detail=text,
    )


def _verification(one: Judged, checks: Sequence[str]) -> Verification:
    """Return the verification of one back end by the checks."""
    kept = [finding for finding in one.findings if finding.check in (*checks, "protocol")]
    if one.answers is None:
        return Verification(one.found.name, one.found.kind, kept, one.findings[0].detail)
    some = [finding for finding in kept if finding.check != "order"]
    reasons = [summary(some, *((one.named, one.limits) if "motions" in checks else ([], [])))]
    wrong = [finding for finding in kept if finding.verdict is Verdict.WRONG]
    if unknown := [finding.case for finding in wrong if finding.check == "motions" and not (finding.causes or finding.detail)]:
        more = f" and {len(unknown) - LISTED} more" if len(unknown) > LISTED else ""
        reasons.insert(0, f"{UNKNOWN} in {', '.join(unknown[:LISTED])}{more}")
    if not one.named:
        reasons = [finding.detail for finding in wrong if finding.check == "order"] + reasons
    return Verification(one.found.name, one.found.kind, kept, "; ".join(filter(None, reasons)), one.notes)


def _side(one: Judged, verification: Verification) -> Side:
    verdict = join_verdicts(finding.verdict for finding in verification.findings)
    explanations = one.named[0].explanations if one.named else ()
    keys = " or ".join(sorted(explanation.cause.key for explanation in explanations))
    sentences = " or ".join(uncapitalised(explanation.cause.sentence) for explanation in explanations)
    return Side(one.found.name, verdict, verification.reason, keys, sentences)


def _same_mistake(judged: Sequence[Judged], sides: Sequence[Side]) -> list[Side]:
    """Return both sides, with one mistake of both if they share one of several that explain their motions equally well."""
    of = [
        {explanation.cause.key: explanation.cause.sentence for explanation in one.named[0].explanations} if one.named else {}
        for one in judged
    ]
    shared = sorted(set(of[0]) & set(of[1]))
    if not shared:
        return list(sides)
    return [
        replace(side, mistake=shared[0], sentence=uncapitalised(known[shared[0]]))
        for side, known in zip(sides, of, strict=True)
    ]
