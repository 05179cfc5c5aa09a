"""Whether the twins of a body move equally in an engine, from which size on they do not, and the simplest pair that differs."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from time import perf_counter

import numpy as np

from conservative.attitude import angle_between, rotation_about
from conservative.errors import IntegrationFailed
from conservative.method import Method
from conservative.references.worker.client import EngineError

from .machine import Machine, NotAvailable, machine_of, run
from .pairs import OF_INERTIA, PAIRS, Description, Pair, Samples

BODY = Description(1.7, np.zeros(3), np.diag((2.1, 3.3, 4.2)), rotation_about((1, -1, 0.3), 1.1), np.array((0.9, -1.1, 0.7)))
TOP = replace(BODY, com=np.array((0.3, -0.2, 0.5)), gravity=2.3)
NEEDLE = replace(
    BODY,
    mass=0.12,
    inertia=np.diag((1.7231e-4, 6.58e-6, 1.7243e-4)),
    w0=np.array((21.0, 35.0, -17.0)),
    dt=0.001,
    n_steps=10_000,
    every=5000,
)
ROD = replace(BODY, inertia=np.diag((1e-3, 2e-7, 1.0001e-3)), w0=np.array((0.9, 4.0, -1.1)))
SPINNING = replace(ROD, w0=np.array((0.0, 4.0, 0.0)))
BODIES = {"body": BODY, "top": TOP, "needle": NEEDLE, "thin rod": ROD, "rod about its axis": SPINNING}
"""Motions that are not chaotic."""
PERTURBED = 4
"""Number of starts that are perturbed to measure how an error of rounding grows."""
ROUNDING = 1.0
"""Errors of rounding that a step may add, in units of that growth. Right engines differ by at most 0.77 of the sum."""
LATER = 1000.0
"""Another initial time in s, in adapters."""
LONGEST = 1.0
"""A body is left out if a run of it takes longer, s: all pairs together need eighty runs or more."""
HALVINGS = 12
"""Halvings of the interval, in powers of ten, that contains a threshold: to 1 % for an interval of nine powers."""


@dataclass(frozen=True, eq=False)
class Twins:
    """The result of one pair in one engine.

    Attributes
    ----------
    engine, body, pair
        Name of the method, and of the body and the pair.
    outcome
        "same bits", "equal", "same limit" (the difference goes away with the step: two schemes of one body), "differs",
        "refused" (with a message), "lost" (the motions of both end early), "not available", "unsupported" or "crashed".
        Only "differs" and "crashed" are faults: see `wrong`.
    difference, allowed
        Largest difference of attitudes, rad, or of rates, relative; and the largest one that rounding explains.
    detail
        Why a pair is not available; how the reduced twin moves.
    threshold
        From which size on the motions differ; "" without one.
    first, size
        The description of a pair that differs, reduced, and the factor of its twin.
    """

    engine: str
    body: str
    pair: str
    outcome: str
    difference: float = math.nan
    allowed: float = math.nan
    detail: str = ""
    threshold: str = ""
    first: Description | None = None
    size: float | None = None

    @property
    def wrong(self) -> bool:
        return self.outcome in ("differs", "crashed")

    @property
    def factor(self) -> float:
        """How many times the difference exceeds what rounding explains."""
        return self.difference / self.allowed if self.allowed else math.inf


def difference(one: Samples, other: Samples) -> float:
    """Return the largest angle between two motions, rad, or difference of rates over the largest rate; inf if not finite."""
    if len(one[0]) != len(other[0]):  # only the ends are the same times
        one, other = ((R[[0, -1]], w[[0, -1]]) for R, w in (one, other))
    scale = float(np.abs(one[1]).max()) or 1.0
    with np.errstate(all="ignore"):
        rates = np.abs(one[1] - other[1]).max() / scale
        apart = max(float(np.max(angle_between(one[0], other[0]))), float(rates))
    return apart if math.isfinite(apart) else math.inf


class Engine:
    """The runs of an engine that pairs are compared with, each made once."""

    def __init__(self, machine: Machine) -> None:
        self.machine = machine
        self._known: dict[int, tuple[Description, Callable[[], Samples], Samples, float]] = {}

    def forget(self) -> None:
        """Forget all runs: those of the next body follow."""
        self._known.clear()

    def first(self, one: Description) -> tuple[Callable[[], Samples], Samples, float]:
        """Return the model of a description, its samples, and the difference that rounding explains."""
        if id(one) not in self._known:
            for key in list(self._known)[1:]:  # the body's own, which came first, stays
                del self._known[key]
            model = self.machine.model(one)
            samples = model()
            self._known[id(one)] = one, model, samples, self.rounding(one, samples)
        return self._known[id(one)][1:]

    def rounding(self, one: Description, samples: Samples) -> float:
        """Return the largest difference of a run from its samples that errors of rounding explain."""
        random, eps = np.random.default_rng(5), self.machine.precision
        largest = eps
        for _ in range(PERTURBED):
            axis, factor, rough = random.standard_normal(3), *random.choice((-1.0, 1.0), (2, 3, 3))
            J = one.inertia * (1 + eps * (rough + rough.T) / 2)
            if one.com.any() or np.count_nonzero(J) > 3:  # what an engine computes from it has errors of its largest part
                J = J + eps * (one.mass * (one.com @ one.com) + np.abs(J).max()) * (rough + rough.T) / 2
            moved = replace(one, R0=rotation_about(axis, eps) @ one.R0, w0=one.w0 * (1 + eps * factor[0]), inertia=J)
            with suppress(IntegrationFailed):
                largest = max(largest, difference(samples, self.machine.model(moved)()))
        return ROUNDING * largest * (math.sqrt(one.n_steps) if self.machine.adaptive else one.n_steps)


@dataclass(frozen=True)
class Apart:
    """The difference of two motions, what rounding explains, and how the motion ended that an engine lost."""

    value: float
    allowed: float = 0.0
    failure: str = ""
    size: float | None = None

    @property
    def wrong(self) -> bool:
        return self.value > self.allowed


LOST = Apart(math.nan)
"""Both motions end early or gain a lot of energy, so that nothing can be compared."""
WILD = 100.0
"""Rates above so many times the largest at the start are those of a motion that is lost."""


def _kept(one: Description, samples: Samples) -> bool:
    with np.errstate(invalid="ignore"):
        bounded = np.abs(samples[1]).max() < WILD * np.abs(one.w0).max()  # False for nan
    return bool(bounded) and bool(np.isfinite(samples[0]).all())


def _apart(engine: Engine, pair: Pair, one: Description, size: float | None) -> Apart:
    scale = () if size is None else (size,)
    twin = pair.twin(one, *scale)
    model, samples, allowed = engine.first(one)
    lost = not _kept(one, samples)
    try:
        raw = run(engine.machine, one, twin, pair.run, model)
    except EngineError:
        raise
    except IntegrationFailed as failure:
        return LOST if lost else Apart(math.inf, allowed, str(failure), size)
    if pair.way == "zero" and not lost and not np.isfinite(raw[1]).all():
        raise EngineError("numbers that are not finite")
    if lost or not _kept(twin, raw):
        only = "the first motion is lost, and not that of the twin" if lost else "the motion of the twin is lost"
        return Apart(math.inf, allowed, only, size) if lost == _kept(twin, raw) else LOST
    apart = difference(samples, pair.back(raw, *scale))
    if pair.same_bits:
        return Apart(apart)
    if pair.way == "time":  # which is rounded, and so is each step
        allowed += 4 * np.finfo(float).eps * LATER * float(np.linalg.norm(one.w0)) * one.n_steps
    if allowed < apart and pair.way in OF_INERTIA:
        allowed = max(allowed, engine.rounding(twin, raw))
    return Apart(apart, allowed, "", size)


def _finer(one: Description, times: int) -> Description:
    return replace(one, dt=one.dt / times, n_steps=one.n_steps * times, every=one.every * times)


def compare(engine: Engine, name: str, body: str, pair: Pair, one: Description) -> Twins:
    """Return whether a body and its twin move equally in an engine."""
    told = partial(Twins, name, body, pair.name)
    if pair.way and not engine.machine.has(pair.way):
        return told("not available", detail="the adapter has no such way")
    if reason := engine.machine.unsupported(one):
        return told("unsupported", detail=reason)
    try:
        results = [_apart(engine, pair, one, size) for size in (pair.sizes or (None,))]
    except NotAvailable as refusal:
        return told("not available", detail=str(refusal))
    except IntegrationFailed as failure:  # after an `EngineError` its process goes on
        ended = "refused" if isinstance(failure, EngineError) else "crashed"
        return told(ended, detail=getattr(failure, "reason", str(failure)))
    worst = max(results, key=lambda each: -1.0 if math.isnan(each.value) else each.value / (each.allowed or 1e-300))
    told = partial(told, difference=worst.value, allowed=worst.allowed)
    if worst.wrong:
        return _explain(engine, pair, one, worst, told)
    return told("lost" if math.isnan(worst.value) else "equal" if worst.value else "same bits")


def _explain(engine: Engine, pair: Pair, one: Description, apart: Apart, told: Callable[..., Twins]) -> Twins:
    """Return the result of a pair that differs: from which size on, whether it does so with shorter steps, and the simplest."""
    lost, size = math.isinf(apart.value), apart.size

    def wrong(each: Description, size: float | None = size) -> bool:
        with suppress(NotAvailable, IntegrationFailed):
            seen = _apart(engine, pair, each, size)
            return math.isinf(seen.value) if lost else seen.wrong
        return False

    def stays(each: Description) -> bool:  # with shorter steps
        if lost or (pair.exact and not pair.sizes):
            return True
        with suppress(NotAvailable, IntegrationFailed):
            coarse, fine = (_apart(engine, pair, some, size).value for some in (each, _finer(each, 4)))
            return not fine < coarse / 2
        return True

    adaptive = engine.machine.adaptive and not lost and not pair.same_bits
    threshold = "" if size is None or adaptive else _threshold(pair, one, size, wrong)
    if not stays(one):
        return told("same limit", detail="the difference falls with the step", threshold=threshold)
    if adaptive:
        return _with_tolerance(engine, pair, one, apart, told)
    first = _shrink(one, lambda each: wrong(each) and stays(each))
    detail = apart.failure or _words(engine, pair, first, size)
    return told("differs", detail=detail, threshold=threshold, first=first, size=size)


def _with_tolerance(engine: Engine, pair: Pair, one: Description, apart: Apart, told: Callable[..., Twins]) -> Twins:
    """Return the result of a pair that differs in an engine that chooses its steps, which may be by its tolerance."""
    looser = engine.machine.looser()
    if looser is None:
        return told("not available", detail="it chooses its steps by a tolerance that is not known here")
    with looser.closing(), suppress(NotAvailable, IntegrationFailed):
        if _apart(Engine(looser), pair, one, apart.size).value > 2 * apart.value:
            return told("same limit", detail="the difference falls with the tolerance")
    return told("differs", detail=_words(engine, pair, one, apart.size), first=one, size=apart.size)


def _words(engine: Engine, pair: Pair, one: Description, size: float | None) -> str:
    """Return how the reduced twin moves."""
    scale = () if size is None else (size,)
    with suppress(NotAvailable, IntegrationFailed):
        model, samples, _ = engine.first(one)
        (R, w), after = pair.back(run(engine.machine, one, pair.twin(one, *scale), pair.run, model), *scale), _steps(one)
        rates = [np.array2string(each[-1], precision=3, suppress_small=True) for each in (samples[1], w)]
        if not angle_between(R[0], R[-1]) and angle_between(samples[0][0], samples[0][-1]):
            return f"after {after} the twin has not turned; its rates are {rates[1]}, not {rates[0]} rad/s"
        return (
            f"after {after} {float(angle_between(samples[0][-1], R[-1])):.2g} rad apart, rates {rates[0]} and {rates[1]} rad/s"
        )
    return "one of both motions is lost"


def _steps(one: Description) -> str:
    return f"{one.n_steps} steps" if one.n_steps > 1 else "one step"


def _threshold(pair: Pair, one: Description, size: float, wrong: Callable[..., bool]) -> str:
    """Return a sentence about the size from which on a scaled body moves in another way."""
    good, bad = 0.0, math.log(size)
    for _ in range(HALVINGS):
        middle = (good + bad) / 2
        good, bad = (good, middle) if wrong(one, size=math.exp(middle)) else (middle, bad)
    if abs(bad) < 2 * abs(math.log(size)) / 2**HALVINGS:
        return "in all other units"
    at, up = pair.twin(one, math.exp(bad)), size > 1
    speed = f", a speed of {np.linalg.norm(np.cross(at.w0, at.com)):.2g} m/s" * bool(one.com.any())
    if pair.name.startswith("time"):
        return f"{'below' if up else 'above'} {np.linalg.norm(at.w0):.2g} rad/s{speed}"
    moments = np.diag(at.inertia)
    return f"{'above' if up else 'below'} moments of {moments.min():.2g} to {moments.max():.2g} kg m^2, {at.mass:.2g} kg{speed}"


SIMPLER: tuple[Callable[[Description], Description], ...] = (
    lambda one: replace(one, R0=np.eye(3)),
    lambda one: replace(one, com=np.zeros(3), gravity=0.0),
    lambda one: replace(one, inertia=np.diag((1.0, 2.0, 2.5))),
    lambda one: replace(one, inertia=np.eye(3) * np.diag(one.inertia).max()),
    lambda one: replace(one, mass=1.0),
    *(lambda one, axis=axis: replace(one, w0=np.linalg.norm(one.w0) * np.eye(3)[axis]) for axis in range(3)),
    lambda one: replace(one, w0=np.array([float(f"{value:.1g}") for value in one.w0])),
)
"""Simplifications of a body and its start, each kept if the pair still differs."""


def _shrink(one: Description, wrong: Callable[[Description], bool]) -> Description:
    """Return the simplest body with the fewest steps, to 1 %, that still differs."""
    few, enough = 0, one.n_steps
    while enough - few > max(1, few // 100):
        count = (few + enough) // 2 if few else max(1, enough // 8)
        if wrong(replace(one, n_steps=count, every=count)):
            enough = count
        else:
            few = count
    if enough < one.n_steps:
        one = replace(one, n_steps=enough, every=enough)
    for simpler in SIMPLER:
        if wrong(candidate := simpler(one)):
            one = candidate
    return one


def count_twins(pairs: Sequence[Pair] = PAIRS) -> int:
    """Return the number of results for one engine."""
    return sum(len(pair.bodies) for pair in pairs)


def _too_long(machine: Machine, one: Description) -> str:
    """Return why the pairs of a body are not run: a run takes too long; "" if it does not."""
    if machine.unsupported(one):
        return ""
    part, start = one.n_steps // 20, perf_counter()
    with suppress(NotAvailable, IntegrationFailed):
        run = machine.model(replace(one, n_steps=part, every=part))
        run()
        start = perf_counter()  # after a first run, in which an engine may compile
        run()
    spent = (perf_counter() - start) * one.n_steps / part
    return f"{one.n_steps} steps take {spent:.0f} s" if spent > LONGEST else ""


def twins_of(method: Method, tell: Callable[[str], object] = lambda _: None, pairs: Sequence[Pair] = PAIRS) -> Iterator[Twins]:
    """Yield the result of every pair of every body, for one engine. `tell` is called with each before it runs.

    Raise `MissingEngine`.
    """
    with machine_of(method).closing() as machine:
        engine = Engine(machine)
        for body, one in BODIES.items():
            some = [pair for pair in pairs if body in pair.bodies]
            slow = _too_long(machine, one) if some else ""
            for pair in some:
                tell(f"{method.name}: {body}, {pair.name}")
                ended = slow and Twins(method.name, body, pair.name, "not available", detail=slow)
                yield ended or compare(engine, method.name, body, pair, one)
            engine.forget()
