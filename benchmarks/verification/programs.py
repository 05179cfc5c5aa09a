"""Verification of programs, engines and methods, which integrate motions.

Each exact motion is a recording of the subject: its samples are compared with the exact solution, at |w| h = 0.01 rad. An error
within the tolerance of the declared order is right. An error near the tolerance is checked again with half the step: it is
right if it falls as the declared order says. The mistakes that explain the motions that fail are found by the search for
recordings.

Programs and engines are given bodies in principal axes, so their motions are compared in these axes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from conservative.attitude import Array, angle_between, to_quaternion
from conservative.errors import IntegrationFailed, Unsupported
from conservative.grid import Grid
from conservative.method import Method
from conservative.number_text import number
from conservative.programs import Program
from conservative.references.environments.adapter import AdapterMethod
from conservative.references.environments.engine_method import EngineMethod
from conservative.references.environments.programs import UnusableProgram, program_class
from conservative.references.worker.client import EngineTimeout, time_limit
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from ..studies.selection import bits_of
from . import protocol
from .compare import Compared, compare_answers, take_rows
from .explain import PROGRAM_KINDS, diagnose
from .explanation import HALF, OWN_ERROR, Explanation
from .finding import Cause, Finding, MotionFinding, Settings, Verdict, Verification, uncapitalised
from .mistakes import BY_KEY
from .motions.files import of_seed, tolerance
from .motions.motion import Motion, load
from .motions.programs import ANGLES, ORDERS, PARTS

PATIENCE = 30.0
"""Time in s that a program may take to start, and for each answer. A program that takes longer does not answer."""
ROWS = 40
"""Largest number of samples of a motion, for the search."""
NEAR = 3.0
"""Largest error, in tolerances, that is right if it falls with the step as the declared order says."""
FEW = 3
"""Smallest number of motions that a mistake must explain. If fewer fail, an error that falls with the step is the method's."""
HANGS = 2
"""Number of motions without an answer, after which the others are not run."""
SLOPE = 0.5
"""Largest difference between the order and the exponent with which an error falls."""
FINE = PARTS[-1]
"""Steps in 0.1 rad at the smallest step of the motions."""
LADDER = (1, 2, 5, 10)
"""Steps in 0.1 rad at which the order is measured."""
GENERIC = 5
"""Largest number of motions that the order is measured on: free bodies with three different moments."""
RESOLVED = {"f64": 1e-11, "f32": 1e-4}
"""Smallest errors, rad, that show an order, above round-off in each precision."""
ASYMPTOTIC = 0.3
"""Largest error, rad, that shows an order: larger ones do not fall with a power of the step."""
ROUNDS = 5
"""Largest number of motions that are searched for mistakes."""
CANDIDATES = 6
"""Largest number of mistakes that explain one motion and are applied to the others."""
REFITS = 4
"""Largest number of motions that make the numbers of a mistake more precise."""
CLEAR = 2.0
"""The search begins with the motion whose error is nearest to 10^`CLEAR` tolerances: clear, but small enough for fits."""
ALIKE, ROUNDED = 3.0, 1e-9
"""Mistakes explain equally well if they leave shares within this factor; smaller shares are rounding."""
LEAST = 0.1
"""Smallest share of the failing motions that are searched after a first mistake: in few motions another one can look alike."""
TURN, TURNS = "fast_turn", (2.0, 2.5)
"""A motion with constant rates, and turns in a step, rad, that show whether the turn is limited. Engines limit it to pi / 4, as
installed, or to pi / 2."""
EQUAL = 1e-6
"""Largest relative difference of two turns that are the same limit. Two steps of any method differ by far more."""


@dataclass(frozen=True, eq=False)
class Samples:
    """Samples at times t (n,), s: attitudes (n, 3, 3) and rates (n, 3), rad/s, body axes. One of the two can be None.

    `failure` is the reason if samples are missing.
    """

    t: Array
    R_WB: Array | None
    w_WB_B: Array | None
    failure: IntegrationFailed | None = None


Solve = Callable[[Scene, Grid], Trajectory | Samples]
"""Integrates a scene. It raises `Unsupported` or `IntegrationFailed`; its samples need not be plausible."""


@dataclass(frozen=True, eq=False)
class Ran:
    """A motion that was run with a step, s: its samples, and errors and tolerances (2,) of attitude, rad, and rates."""

    motion: Motion
    case: Compared
    error: Array
    allowed: Array
    step: float
    ended: str = ""
    hangs: bool = False

    @property
    def ratio(self) -> float:
        """The largest error over its tolerance."""
        return float((self.error / self.allowed).max())


def solver(method: Method) -> Solve:
    """Return the function that runs a method without the check of its result, which would refuse wrong samples."""
    return lambda scene, grid: method.prepare(scene, grid)()


def in_principal_axes(motion: Motion) -> Motion:
    """Return the motion of the same body in its principal axes."""
    body = motion.scene.body
    C = body.R_BP
    if np.array_equal(C, np.eye(3)):
        return motion

    def turned(vector: Sequence[float] | None) -> Any:
        return None if vector is None else (np.array(vector) @ C).tolist()

    return replace(
        motion,
        inertia=[*body.moments.tolist(), 0.0, 0.0, 0.0],
        quaternion=to_quaternion(motion.scene.R_WB0 @ C).tolist(),
        rates=turned(motion.rates),
        rotor_momentum_B=turned(motion.rotor_momentum_B),
        torque_B=turned(motion.torque_B),
        com_B=turned(motion.com_B),
        damping=None if motion.damping is None else (C.T @ np.array(motion.damping) @ C).tolist(),
    )


def run_motion(solve: Solve, motion: Motion, allowed: Array, parts: int = FINE) -> Ran:
    """Return a motion run with `parts` steps in 0.1 rad. Raise `Unsupported`."""
    every = motion.steps * parts  # steps between two samples of the motion
    # The search works on more samples: `thin` for each of the motion's, evenly spaced, and at most `ROWS` in all.
    thin = max(n for n in range(1, every + 1) if every % n == 0 and n * motion.samples <= max(ROWS, motion.samples))
    grid = Grid(motion.step / parts, every * motion.samples, every // thin)
    scene, ended = motion.scene, ""
    answer: Trajectory | Samples
    try:
        answer = solve(scene, grid)
    except Unsupported:
        raise
    except IntegrationFailed as ended_early:
        answer = Samples(np.zeros(0), np.zeros((0, 3, 3)), np.zeros((0, 3)), ended_early)
    t, failure, data = answer.t, answer.failure, (answer.R_WB, answer.w_WB_B)
    if len(t) < grid.n_samples:
        ended = f"the run ended early: {failure.outcome if failure else 'samples are missing'}"
    elif not all(x is None or np.isfinite(x).all() for x in data):
        ended = "samples are not finite"
    case = compare_answers(scene, t[1:], take_rows(data, slice(1, None)), allowed, grid.dt)
    at = slice(thin - 1, None, thin)  # the samples of the motion
    error = np.full(2, np.inf) if ended else case.error[:, at].max(axis=1)
    return Ran(motion, case, error, allowed, grid.dt, ended, isinstance(failure, EngineTimeout))


@dataclass(frozen=True, eq=False)
class Answers:
    """The motions that a subject ran, those that it does not support with the reason, its declared order and precision."""

    solve: Solve
    ran: list[Ran]
    unsupported: dict[str, str]
    order: int | None
    single: bool

    @property
    def failing(self) -> list[Ran]:
        """The motions with an error above the tolerance."""
        return [run for run in self.ran if not run.ratio <= 1]


def motions_of(seed: int | None) -> Sequence[Motion]:
    """Return the published motions (None), or the fresh motions of a seed."""
    return load() if seed is None else of_seed(seed)


def run_motions(
    solve: Solve,
    order: int | None,
    single: bool = False,
    principal: bool = False,
    unsupported: Callable[[Scene], str | None] = lambda scene: None,
    tell: Callable[[str], object] = lambda what: None,
    seed: int | None = None,
    motions: Sequence[Motion] | None = None,
) -> Answers:
    """Run the published motions, those of a seed, or others.

    A subject that gets `principal` axes only runs them in the principal axes of their bodies. `unsupported` returns why a scene
    is not supported, None if it is.
    """
    ran, reasons = list[Ran](), dict[str, str]()
    for original in motions_of(seed) if motions is None else motions:
        tell(original.name)
        motion = in_principal_axes(original) if principal else original
        allowed = np.array(tolerance(original, order, single))
        if sum(run.hangs for run in ran) == HANGS:
            reasons[motion.name] = f"it did not answer in {HANGS} motions before"
            continue
        if reason := unsupported(motion.scene):
            reasons[motion.name] = reason
            continue
        try:
            ran.append(run_motion(solve, motion, allowed))
        except Unsupported as error:
            reasons[motion.name] = str(error)
    return Answers(solve, ran, reasons, order, single)


def _slope_if_right(answers: Answers, ran: Ran) -> float:
    """Return the exponent with which the error falls from the step to half of it; 0 if it is below the declared order."""
    with suppress(Unsupported):
        again = run_motion(answers.solve, ran.motion, ran.allowed, 2 * FINE)
        slope = float(np.log2(ran.ratio / max(again.ratio, 1e-300)))
        return slope if math.isfinite(slope) and slope >= (answers.order or 2) - SLOPE else 0.0
    return 0.0


def measure_order(answers: Answers) -> float:
    """Return the exponent with which errors of free bodies fall with the step, the median of some motions; nan if unknown.

    The slope of a motion is the slope between its two finest steps whose errors are above round-off.
    """
    slopes, floor = [], RESOLVED["f32" if answers.single else "f64"]
    free = [run for run in answers.ran if not run.motion.features and is_generic(run.motion)]
    for run in free[:GENERIC]:
        errors = [float(run_motion(answers.solve, run.motion, run.allowed, n).error[0]) for n in LADDER]
        good = [(n, error) for n, error in zip(LADDER, errors, strict=True) if floor < error < ASYMPTOTIC]
        if len(good) > 1:
            (a, first), (b, last) = good[-2:]
            slopes.append(math.log(first / last) / math.log(b / a))
    return float(np.median(slopes)) if slopes else math.nan


@dataclass(frozen=True)
class Named:
    """Mistakes that explain some failing motions equally well, and the names of these motions."""

    explanations: tuple[Explanation, ...]
    motions: tuple[str, ...]


def explain_motions(failing: Sequence[Ran], right: Sequence[Ran] = ()) -> list[Named]:
    """Return the mistakes that explain failing motions, first the one that explains most.

    A mistake is searched in one motion, with numbers that are fitted to it. It is then applied to all others with the same
    numbers, which the motions that it nearly explains make more precise. Of several mistakes the one is named that explains
    most, less the `right` motions that it would make wrong. Motions that it does not explain are searched next, up to `ROUNDS`
    of them; after a motion that nothing explains, the shortest ones.
    """
    rest = {run.motion.name: run for run in sorted(failing, key=_rank) if not run.ended}
    named: dict[tuple[tuple[str, ...], ...], Named] = {}
    searched = list(rest.values())
    for _ in range(ROUNDS):
        searched = [run for run in searched if run.motion.name in rest]
        if not searched or (named and len(rest) < LEAST * len(failing)):
            break
        run = searched.pop(0)
        tried = diagnose(run.case, kinds=PROGRAM_KINDS).tried
        simplest = sorted((e for e in tried if e.explains), key=lambda e: (e.numbers, len(e.keys), e.share))[:CANDIDATES]
        applied = [_apply(explanation, list(rest.values()), right) for explanation in simplest]
        if not applied or max(candidate.score for candidate in applied) <= 0:
            searched.sort(key=_turns)  # of several mistakes at once, fewer have begun in a shorter motion, such as sleep
            continue
        best = max(applied, key=lambda candidate: candidate.rank)
        good = [candidate for candidate in applied if (candidate.motions, candidate.rank) == (best.motions, best.rank)]
        least = min(candidate.share for candidate in good)
        equal = [candidate for candidate in good if candidate.share <= ALIKE * max(least, ROUNDED)]
        names, before = best.motions, named.get(keys := tuple(candidate.explanation.keys for candidate in equal))
        # Keep the numbers fitted first: that motion shows them best.
        explanations = before.explanations if before else tuple(candidate.explanation for candidate in equal)
        named[keys] = Named(explanations, (*(before.motions if before else ()), *names))
        for name in names:
            del rest[name]
    return sorted(named.values(), key=lambda group: -len(group.motions))


def _rank(ran: Ran) -> tuple[bool, bool, float]:
    """Return the place in the search: free bodies with three moments first, then by how clear and how small the error is."""
    return bool(ran.motion.features), not is_generic(ran.motion), abs(math.log10(ran.ratio) - CLEAR)


def _turns(ran: Ran) -> int:
    """Return the length of a motion, in steps in which it turns by about 0.1 rad."""
    return ran.motion.steps * ran.motion.samples


@dataclass(frozen=True)
class Applied:
    """A mistake that was applied to all motions: the failing ones that it explains, and the mean share of the errors it leaves.

    `score` is the number of these motions, less the right ones that it would make wrong.
    """

    explanation: Explanation
    motions: tuple[str, ...]
    score: int
    share: float

    @property
    def rank(self) -> tuple[int, int, int]:
        """The key of the order: a mistake that explains more is better, then fewer fitted numbers, then fewer mistakes."""
        return self.score, -self.explanation.numbers, -len(self.explanation.keys)


def _apply(explanation: Explanation, failing: Sequence[Ran], right: Sequence[Ran]) -> Applied:
    """Return a mistake that was found in one motion, applied to all."""
    names, shares, best, refits = list[str](), list[float](), explanation, 0
    for run in sorted(failing, key=lambda run: run.ratio):
        again = best.again(run.case)
        if again is not None and not again.explains and best.numbers and again.share < HALF and refits < REFITS:
            refined, refits = best.refit(run.case), refits + 1
            applied = None if refined is None else refined.again(run.case)
            if refined is not None and applied is not None and applied.explains:
                best, again = refined, applied
        if again is not None and again.explains:
            names.append(run.motion.name)
            shares.append(again.share)
    refuted = sum(
        (again := best.again(run.case)) is not None and bool((np.array(again.left) > OWN_ERROR * run.allowed).any())
        for run in right
    )
    return Applied(best, tuple(names), len(names) - refuted, float(np.mean(shares)) if shares else math.inf)


def is_generic(motion: Motion) -> bool:
    """Return whether the three principal moments differ by more than a thousandth of the largest."""
    moments = np.sort(motion.scene.body.moments)
    return bool((np.diff(moments) > 1e-3 * moments[-1]).all())


def motion_findings(subject: str, answers: Answers) -> tuple[list[Finding], list[Named], float]:
    """Return a finding for each motion, the mistakes, and the measured order, nan if it was not measured."""
    few = len(answers.failing) < FEW
    near = {
        run.motion.name: slope
        for run in answers.failing
        if (few or run.ratio <= NEAR) and not run.ended and (slope := _slope_if_right(answers, run))
    }
    failing = [run for run in answers.failing if run.motion.name not in near]
    named = explain_motions(failing, [run for run in answers.ran if run not in failing])
    # A mistake that explains a single motion may do so by chance.
    named = [group for group in named if len(group.motions) >= min(FEW, len(failing))]
    explained = {name: group for group in named for name in group.motions}
    # A motion that converges at the declared order, and that no known mistake explains, has a large error constant.
    rest = [run for run in failing if run.motion.name not in explained and not run.ended]
    near |= {run.motion.name: slope for run in rest if (slope := _slope_if_right(answers, run))}
    failing = [run for run in failing if run.motion.name not in near]
    order, lower = math.nan, dict[str, str]()
    if failing and len(explained) < len(failing) / 2:
        order = measure_order(answers)
        lower = _of_lower_order(answers, failing, order)
    findings = list[Finding]()
    for run in answers.ran:
        name = run.motion.name
        verdict, causes, detail = Verdict.RIGHT, tuple[Cause, ...](), ""
        if name in near:
            detail = f"{_above(run.ratio)} the tolerance, falls as h^{near[name]:.2f}"
        elif name in lower:
            detail = lower[name]
        elif run in failing:
            causes = tuple(explanation.cause for explanation in explained[name].explanations) if name in explained else ()
            verdict, detail = Verdict.WRONG, run.ended
        k = int(np.argmax(run.error / run.allowed))
        findings.append(
            MotionFinding(
                subject,
                "motions",
                name,
                verdict,
                float(run.error[k]),
                float(run.allowed[k]),
                ("rad", "of the largest rate")[k],
                "order",
                causes,
                detail,
                errors=_pair(run.error),
                tolerances=_pair(run.allowed),
            )
        )
    findings += [
        Finding(subject, "motions", name, Verdict.NOT_TESTED, detail=reason) for name, reason in answers.unsupported.items()
    ]
    return findings, named, order


def judge_motions(subject: str, answers: Answers) -> tuple[list[Finding], list[Named], list[str], float]:
    """Return the result of `motion_findings`; before the order, it has sentences on mistakes that only long steps show."""
    findings, named, order = motion_findings(subject, answers)
    limited = turn_finding(subject, answers)
    if limited is None:
        return findings, named, [], order
    return [*findings, limited], named, [uncapitalised(limited.causes[0].sentence)], order


def _pair(values: Array) -> tuple[float, float]:
    return float(values[0]), float(values[1])


def _above(ratio: float) -> str:
    return f"{100 * (ratio - 1):.0f} % above" if ratio < 2 else f"{number(ratio)} times"


def _of_lower_order(answers: Answers, failing: Sequence[Ran], order: float) -> dict[str, str]:
    """Return the failing motions that are right for a lower order than the declared one, each with that sentence."""
    lower = max(
        (candidate for candidate in ORDERS if candidate < (answers.order or 2) and abs(order - candidate) < SLOPE), default=None
    )
    if lower is None:
        return {}
    reasons = {}
    for run in failing:
        if (run.error <= tolerance(run.motion, lower, answers.single)).all():
            reasons[run.motion.name] = f"within the tolerance of order {lower}"
    return reasons


def turn_finding(subject: str, answers: Answers) -> Finding | None:
    """Return the finding on a program that limits the turn in a step, rad; None if it does not, or cannot run the motion.

    In steps of 0.01 rad no motion shows this limit, but a fast body in the step of a game does. A body that turns steadily has
    constant rates for every step, and its attitude turns further in a longer step, however large the error of the method is.
    """
    run = next((run for run in answers.ran if run.motion.name == TURN and not run.ended), None)
    if run is None:
        return None
    scene, speed = run.motion.scene, float(np.linalg.norm(run.motion.rates))
    turned, spun = np.zeros(len(TURNS)), np.zeros(len(TURNS))
    for k, turn in enumerate(TURNS):
        try:
            trajectory = answers.solve(scene, Grid(turn / speed, 1, 1))
        except (Unsupported, IntegrationFailed):
            return None
        R, w = trajectory.R_WB, trajectory.w_WB_B
        if len(trajectory.t) < 2:
            return None
        turned[k] = math.nan if R is None else float(angle_between(R[:1], R[1:2])[0])
        spun[k] = math.nan if w is None else float(np.linalg.norm(w[1])) / speed * turn
    limits = [
        float(values[0]) if abs(values[1] - values[0]) <= EQUAL * values[0] and values[0] < (1 - EQUAL) * TURNS[0] else math.nan
        for values in (turned, spun)
    ]
    # The rates show it best: single precision rounds the turn of Box3D's attitude to 44.9 degrees.
    least = next((limit for limit in reversed(limits) if limit > 0), math.nan)  # False for nan
    if math.isnan(least):
        return None
    what = "The turn of the attitude" if math.isnan(limits[1]) else "The turn"
    sentence = (
        f"{what} in a step is limited to {least:.3g} rad ({math.degrees(least):.3g} degrees): {100 * least:.3g} rad/s at 0.01 s"
    )
    cause = Cause(("rate limit",), sentence, numbers=MappingProxyType({"turn": least}), remedy=BY_KEY["rate limit"].remedy)
    errors = max(0.0, TURNS[0] - float(turned[0])), max(0.0, 1 - float(spun[0]) / TURNS[0])
    k = int(errors[1] > EQUAL)
    return MotionFinding(
        subject,
        "motions",
        f"{TURN} in long steps",
        Verdict.WRONG,
        errors[k],
        EQUAL,
        ("rad", "of the largest rate")[k],
        "constant rates",
        (cause,),
        errors=errors,
        tolerances=(EQUAL, EQUAL),
    )


def order_finding(subject: str, answers: Answers, order: float) -> Finding:
    """Return the finding on the order: an error that falls more slowly than the declared order says is wrong."""
    declared = answers.order
    if declared is None:
        return Finding(subject, "order", "", Verdict.NOT_TESTED, detail="it chooses its steps")
    if not answers.ran or math.isnan(order):
        return Finding(subject, "order", "", Verdict.NOT_TESTED, detail="no error is above rounding and falls with the step")
    detail = f"order {order:.2f}"
    if order < declared - SLOPE:
        detail = f"this program has order {order:.2f}, {declared} was declared"
        return Finding(subject, "order", "", Verdict.WRONG, order, float(declared), "", "declared", detail=detail)
    if order > declared + SLOPE:
        detail += f"; {declared} was declared, and its tolerances apply"
    return Finding(subject, "order", "", Verdict.RIGHT, order, float(declared), "", "declared", detail=detail)


def repeatability(subject: str, method: Method, answers: Answers) -> Iterator[Finding]:
    """Yield whether a second run of a model has the same bits, for the first free motion and the first other one."""
    done = set[bool]()
    for ran in answers.ran:
        if (free := not ran.motion.features) in done or ran.ended:
            continue
        done.add(free)
        run = method.prepare(ran.motion.scene, Grid(ran.step, 100, 10))
        first = run()
        R, w = first.R_WB.copy(), first.w_WB_B.copy()
        again = run()
        same = np.array_equal(R, again.R_WB) and np.array_equal(w, again.w_WB_B)
        detail = "" if same else "a second run has other samples: each run starts from the initial state"
        verdict = Verdict.RIGHT if same else Verdict.WRONG
        yield Finding(subject, "repeatability", ran.motion.name, verdict, by="bits", detail=detail)


def verify_method(
    method: Method,
    kind: str,
    checks: Sequence[str],
    pairs: Sequence[str] = (),
    tell: Callable[[float, str], object] = lambda share, what: None,
    subject: str = "",
    seed: int | None = None,
) -> Verification:
    """Verify a method or an engine by the exact motions, its order, repeatability, and pairs of descriptions.

    `pairs` are names of pairs, by default all. The motions are the published ones, or those of a seed.
    """
    subject = subject or method.name
    single = bits_of(method) == 32
    findings, named, limits, order = list[Finding](), list[Named](), list[str](), math.nan
    if {"motions", "order", "repeatability"} & set(checks):
        principal = isinstance(method, AdapterMethod)
        answers = run_motions(
            solver(method),
            method.order,
            single,
            principal,
            method.unsupported,
            lambda what: tell(0.0, f"{subject}: {what}"),
            seed,
        )
        if "motions" in checks:
            findings, named, limits, order = judge_motions(subject, answers)
        if "order" in checks and not named:
            order = measure_order(answers) if math.isnan(order) else order
            findings.append(order_finding(subject, answers, order))
        if "repeatability" in checks:
            findings += repeatability(subject, method, answers)
    if "pairs" in checks:
        from .pairs import verify_pairs

        findings += verify_pairs(method, pairs, lambda what: tell(0.5, f"{subject}: {what}"), subject)
    settings = Settings(method.order, ANGLES[-1], "single" if single else "double")
    return Verification(subject, kind, findings, summary(findings, named, limits), settings=settings)


def summary(findings: Sequence[Finding], named: Sequence[Named], limits: Sequence[str] = ()) -> str:
    """Return the reason of the verdict, with the number of cases of each check that are right.

    `limits` are sentences on what only long steps show.
    """
    parts = []
    for check in dict.fromkeys(finding.check for finding in findings):
        some = [finding for finding in findings if finding.check == check and finding.verdict is not Verdict.NOT_TESTED]
        if check == "order":
            parts += [finding.detail for finding in some]
        elif some and check in ("motions", "pairs", "repeatability"):
            right = sum(finding.verdict is Verdict.RIGHT for finding in some)
            nouns = {"repeatability": "repeated runs"}.get(check, check)
            parts.append(f"{right} of {len(some)} {nouns}{'' if right == len(some) else ' are right'}")
            if ended := [
                finding.detail
                for finding in some
                if finding.check == "motions" and finding.verdict is Verdict.WRONG and finding.detail
            ]:
                parts.append(f"in {len(ended)} {ended[0]}")
        else:
            parts += [finding.detail for finding in some if finding.verdict is Verdict.WRONG]
    failing = sum(finding.check == "motions" and finding.verdict is Verdict.WRONG for finding in findings)
    reasons = [
        f"{' or '.join(uncapitalised(explanation.cause.sentence) for explanation in group.explanations)} "
        f"(explains {len(group.motions)} of {failing} failing motions)"
        for group in named
    ]
    return "; ".join([*reasons, *limits, ", ".join(parts)])


UNKNOWN = "no known mistake explains its motion"


def verify_program(
    subject: str,
    program: Program,
    checks: Sequence[str],
    pairs: Sequence[str] = (),
    tell: Callable[[float, str], object] = lambda share, what: None,
    method: EngineMethod | None = None,
    seed: int | None = None,
) -> Verification:
    """Verify a program by PROTOCOL.md, and as `verify_method`. A program that does not answer is wrong.

    `method` is the program with one of its settings, by default with their defaults.
    """
    findings = list[Finding]()
    try:
        with time_limit(PATIENCE):
            method = method or program_class(program, PATIENCE)()
            if "protocol" in checks:
                findings += protocol.findings(subject, method)
            if any(finding.verdict is Verdict.WRONG for finding in findings):
                return Verification(
                    subject, "program", findings, "; ".join(finding.detail for finding in findings if finding.detail)
                )
            if "times" in checks:
                findings += protocol.times(subject, method)
            rest = [check for check in checks if check not in ("protocol", "times")]
            verification = verify_method(method, "program", rest, pairs, tell, subject, seed)
    except (UnusableProgram, IntegrationFailed) as failure:
        findings.append(protocol.unusable(subject, failure))
        return Verification(subject, "program", findings, findings[-1].detail)
    both = [*findings, *verification.findings]
    return replace(verification, findings=both, reason="; ".join(filter(None, [verification.reason, *(_wrong(findings))])))


def _wrong(findings: Sequence[Finding]) -> list[str]:
    return [finding.detail for finding in findings if finding.verdict is Verdict.WRONG]
