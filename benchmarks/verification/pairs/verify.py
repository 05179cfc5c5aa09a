"""Whether both descriptions of a pair move equally in an engine, without a reference solution.

A pair that differs is reduced to the simplest one, and to the size from which on it differs.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from enum import StrEnum
from types import MappingProxyType

import numpy as np

from conservative.attitude import angle_between, rotation_about
from conservative.check import choice
from conservative.errors import IntegrationFailed
from conservative.method import Method
from conservative.references.worker.client import EngineCrashed, EngineError

from ...measures.errors import is_lost
from ..compare import largest_difference
from ..finding import Cause, Finding, Verdict
from .causes import find_causes, usual
from .pairs import LOADED, OF_INERTIA, PAIRS, TURNED, Description, Pair, Samples, frame_back, to_principal
from .runner import NotAvailable, Runner, run, runner_of
from .script import script_name, script_of

BODY = Description(1.7, np.zeros(3), np.diag((2.1, 3.3, 4.2)), rotation_about((1, -1, 0.3), 1.1), np.array((0.9, -1.1, 0.7)))
TOP, _ = to_principal(replace(BODY, com=np.array((0.3, -0.2, 0.5)), gravity=2.3))
NEEDLE = replace(
    BODY,
    mass=0.12,
    inertia=np.diag((1.7231e-4, 6.58e-6, 1.7243e-4)),
    w0=np.array((21.0, 35.0, -17.0)),
    dt=0.004,
    n_steps=800,  # MuJoCo 3.12.0 loses it after 397
    every=400,
)
ROD = replace(BODY, inertia=np.diag((1e-3, 2e-7, 1.0001e-3)), w0=np.array((0.9, 4.0, -1.1)))
SPINNING = replace(ROD, w0=np.array((0.0, 4.0, 0.0)))
BODIES = {"body": BODY, "top": TOP, "needle": NEEDLE, "thin rod": ROD, "rod about its axis": SPINNING}
"""Motions that are not chaotic, in principal axes."""
PERTURBED = 4
"""Number of starts that are perturbed to measure how an error of rounding grows."""
ROUNDING = 10.0
"""Errors of rounding that a step may add, in units of that growth. Right engines and programs add at most 3.2."""
DIGITS = 10.0
"""Difference of two motions, in units of the resolution with which a program writes its samples."""
LATER = 1000.0
"""Another initial time in s, in adapters."""
HALVINGS = 12
"""Halvings of the interval, in powers of ten, that contains a threshold: to 1 % for an interval of nine powers."""
OWN_SHARE = 1e-3
"""Share of the error of the step below which a difference is negligible."""


class Relation(StrEnum):
    """The relation of the two motions of a pair."""

    SAME_BITS = "same bits"
    EQUAL = "equal"
    SAME_LIMIT = "same limit"
    """The difference goes away with the step: the engine has two schemes for one body."""
    DIFFERS = "differs"
    CRASHES = "crashes"
    """The engine crashes with the second description, and runs the first one."""
    NEGLIGIBLE = "negligible"
    """The difference is a small share of the error of the step: an iteration that ends at a tolerance may leave it."""
    UNKNOWN = "tolerance unknown"
    """The motions differ, and the tolerance with which the engine chooses its steps is not known."""
    REFUSED = "refused"
    """The engine answers with an error."""
    LOST = "lost"
    """The first motion ends early or gains energy, and the second one as well or ends early: the step is too long."""
    ROUNDED = "rounded"
    """Round-off may turn the body by so much that its attitude is lost, so that equal motions show nothing."""
    NOT_RUN = "not run"
    """The first description does not run, so that nothing can be compared."""
    UNSUPPORTED = "unsupported"
    NOT_AVAILABLE = "not available"


VERDICTS: Mapping[Relation, Verdict] = MappingProxyType(
    {
        **dict.fromkeys((Relation.SAME_BITS, Relation.EQUAL, Relation.SAME_LIMIT, Relation.NEGLIGIBLE), Verdict.RIGHT),
        **dict.fromkeys((Relation.DIFFERS, Relation.CRASHES), Verdict.WRONG),
        Relation.UNKNOWN: Verdict.UNDECIDED,
        **dict.fromkeys((Relation.REFUSED, Relation.LOST, Relation.ROUNDED, Relation.NOT_RUN), Verdict.NOT_TESTED),
        **dict.fromkeys((Relation.UNSUPPORTED, Relation.NOT_AVAILABLE), Verdict.NOT_TESTED),
    }
)
"""The verdict on a pair."""


@dataclass(frozen=True, eq=False)
class PairFinding(Finding):
    """The finding on one pair of descriptions, and what repeats a pair that differs.

    Attributes
    ----------
    body, pair
        Names in `BODIES` and `PAIRS`; `case` has both.
    quantity
        The quantity that a pair scales; "" for other pairs.
    relation
        Relation of the two motions, which decides the verdict (`VERDICTS`).
    threshold
        From which size on the motions differ; "" without one.
    first, scale
        The first description, reduced, and the factor by which the second one is scaled; None if there is none.
    request
        The numbers of `first` that are not 0, by their names in PROTOCOL.md.
    script, script_file
        A script in the engine's own language that repeats the pair, and the name of its file; "" if there is none.
    """

    body: str = ""
    pair: str = ""
    quantity: str = field(default="", repr=False)
    relation: Relation = Relation.NOT_AVAILABLE
    threshold: str = ""
    first: Description | None = field(default=None, repr=False)
    scale: float | None = None
    request: Mapping[str, object] = field(default_factory=lambda: MappingProxyType({}))
    script: str = ""
    script_file: str = ""

    @property
    def factor(self) -> float:
        """How many times the difference exceeds the allowed one; infinite if the same bits are expected."""
        return self.error / self.allowed if self.allowed else math.inf


def difference(first: Samples, second: Samples) -> float:
    """Return the largest difference of two motions; of their ends, if only these are the same times."""
    if len(first[0]) != len(second[0]):
        first, second = ((R[[0, -1]], w[[0, -1]]) for R, w in (first, second))
    return largest_difference(first, second)


class FirstFailed(Exception):
    """The first description does not run; the message is the reason."""


@dataclass(frozen=True, eq=False)
class FirstRun:
    """The run of a first description: its model, its samples, and the difference that rounding explains."""

    model: Callable[[], Samples]
    samples: Samples
    allowed: float


class Engine:
    """The runs of an engine that second descriptions are compared with, each made once."""

    def __init__(self, runner: Runner) -> None:
        self.runner = runner
        self._runs: dict[int, tuple[Description, FirstRun | FirstFailed]] = {}

    def forget(self) -> None:
        """Forget all runs, before another body follows."""
        self._runs.clear()

    def first(self, description: Description) -> FirstRun:
        """Return the run of a first description. Raise `FirstFailed`."""
        if id(description) not in self._runs:
            for key in list(self._runs)[1:]:  # the body's own, which came first, stays
                del self._runs[key]
            self._runs[id(description)] = description, self._run(description)
        run = self._runs[id(description)][1]
        if isinstance(run, FirstFailed):
            raise run
        return run

    def _run(self, description: Description) -> FirstRun | FirstFailed:
        try:
            model = self.runner.model(description)
            samples = model()
        except NotAvailable as error:
            return FirstFailed(str(error))
        except IntegrationFailed as failure:
            return FirstFailed(getattr(failure, "reason", str(failure)))
        return FirstRun(model, samples, self.rounding(description, samples))

    def rounding(self, body: Description, samples: Samples) -> float:
        """Return the largest difference of a run from its samples that errors of rounding explain."""
        random, eps = np.random.default_rng(5), self.runner.precision
        largest = eps
        for _ in range(PERTURBED):
            axis, factor, rough = random.standard_normal(3), *random.choice((-1.0, 1.0), (2, 3, 3))
            J = body.inertia * (1 + eps * (rough + rough.T) / 2)
            if body.com.any() or np.count_nonzero(J) > 3:
                # An engine moves such an inertia to the centre or to principal axes, with rounding of its largest part.
                J = J + eps * (body.mass * (body.com @ body.com) + np.abs(J).max()) * (rough + rough.T) / 2
            moved = replace(body, R0=rotation_about(axis, eps) @ body.R0, w0=body.w0 * (1 + eps * factor[0]), inertia=J)
            moved, R_FG = (moved, np.eye(3)) if body.variant in TURNED else to_principal(moved)
            with suppress(NotAvailable, IntegrationFailed):
                largest = max(largest, difference(samples, frame_back(R_FG)(self.runner.model(moved)())))
        steps = math.sqrt(body.n_steps) if self.runner.adaptive else body.n_steps
        return ROUNDING * largest * steps


@dataclass(frozen=True)
class Apart:
    """The difference of two motions, the allowed one, how the second motion ended early, and the scale of its description."""

    value: float
    allowed: float = 0.0
    failure: str = ""
    scale: float | None = None
    crashed: bool = False

    @property
    def wrong(self) -> bool:
        return self.value > self.allowed


LOST = Apart(math.nan, math.nan)
"""Nothing can be compared: the first motion ends early or gains energy, and the second one may."""
WILD = 100.0
"""Largest rate of a motion that is not lost, relative to the largest one at the start."""
GAIN = 0.5
"""Share of its energy that a motion may gain; otherwise the step is too long, and a lost second motion shows nothing."""


def _kept(description: Description, samples: Samples) -> bool:
    with np.errstate(invalid="ignore"):
        bounded = np.abs(samples[1]).max() < WILD * np.abs(description.w0).max()  # False for nan
    return bool(bounded) and bool(np.isfinite(samples[0]).all())


def _stable(description: Description, samples: Samples) -> bool:
    """Whether a motion that is kept gains little energy, so that the step is not too long for the scheme."""
    R, w = samples
    kinetic = np.einsum("ni,ij,nj->n", w, description.joint_inertia, w) / 2
    weight = description.mass * description.gravity
    energy = kinetic + weight * (R @ description.com)[:, 2]
    return bool(energy.max() - energy[0] <= GAIN * (kinetic[0] + weight * np.linalg.norm(description.com)))


def _scaled(scale: float | None) -> tuple[float, ...]:
    return () if scale is None else (scale,)


def _apart(engine: Engine, pair: Pair, description: Description, scale: float | None) -> Apart:
    """Compare the motions of a pair. Raise `FirstFailed`, `NotAvailable`, or `EngineError` if the second one is refused."""
    first = engine.first(description)
    second = pair.second(description, *_scaled(scale))
    samples, allowed = first.samples, first.allowed
    lost = not _kept(description, samples) or not _stable(description, samples)
    try:
        raw = run(engine.runner, description, second, pair, first.model)
    except EngineError:
        raise
    except IntegrationFailed as failure:
        crashed = isinstance(failure, EngineCrashed)
        return LOST if lost else Apart(math.inf, allowed, str(failure), scale, crashed)
    if pair.variant == "zero" and not lost and not np.isfinite(raw[1]).all():
        raise EngineError("numbers that are not finite")
    if not _kept(description, samples) or not _kept(second, raw):
        return LOST if lost else Apart(math.inf, allowed, "the second motion is lost", scale)
    apart = difference(samples, pair.back(raw, *_scaled(scale)))
    if pair.same_bits:
        return Apart(apart)
    if engine.runner.digits:
        allowed += DIGITS * max(engine.runner.digits.resolution(motion) for motion in (samples, raw))
    if pair.variant == "time":  # a large time is rounded, and so is each step
        allowed += 4 * np.finfo(float).eps * LATER * float(np.linalg.norm(description.w0)) * description.n_steps
    if allowed < 10 * apart and pair.variant in OF_INERTIA:
        allowed = max(allowed, engine.rounding(second, raw))
    return Apart(apart, allowed, "", scale)


def _finer(description: Description, times: int) -> Description:
    return replace(description, dt=description.dt / times, n_steps=description.n_steps * times, every=description.every * times)


@dataclass(frozen=True)
class _Pair:
    """A pair of one body in one engine, and the finding that is made of it."""

    engine: Engine
    method: Method
    subject: str
    body: str
    pair: Pair
    description: Description

    def finding(self, relation: Relation, apart: Apart = LOST, detail: str = "", **repeat: object) -> PairFinding:
        by = "bits" if self.pair.same_bits else "rounding"
        return PairFinding(
            self.subject,
            "pairs",
            f"{self.body}: {self.pair.name}",
            VERDICTS[relation],
            apart.value,
            apart.allowed,
            by="order" if relation in (Relation.SAME_LIMIT, Relation.NEGLIGIBLE) else by,
            detail=detail,
            body=self.body,
            pair=self.pair.name,
            quantity=self.pair.quantity,
            relation=relation,
            **repeat,  # type: ignore[arg-type]
        )

    def compare(self) -> PairFinding:
        """Return the finding on the pair."""
        runner, pair = self.engine.runner, self.pair
        if pair.variant and not runner.has(pair.variant):
            return self.finding(Relation.NOT_AVAILABLE, detail=f"the engine has no description {pair.variant!r}")
        if reason := runner.unsupported(self.description):
            return self.finding(Relation.UNSUPPORTED, detail=reason)
        try:
            results = [_apart(self.engine, pair, self.description, scale) for scale in (pair.scales or (None,))]
        except FirstFailed as failure:
            return self.finding(Relation.NOT_RUN, detail=f"the first description does not run: {failure}")
        except NotAvailable as error:
            return self.finding(Relation.NOT_AVAILABLE, detail=str(error))
        except EngineError as refusal:  # its process goes on
            return self.finding(Relation.REFUSED, detail=f"refused: {refusal.reason}")
        worst = max(results, key=lambda result: -1.0 if math.isnan(result.value) else result.value / (result.allowed or 1e-300))
        if worst.wrong:
            return self.explain(worst)
        if math.isnan(worst.value):
            return self.finding(Relation.LOST, detail="the step is too long: the first motion is lost or gains energy")
        relation = Relation.EQUAL if worst.value else Relation.SAME_BITS
        detail = str(relation)
        if is_lost(worst.allowed):
            relation, detail = Relation.ROUNDED, f"round-off of this engine may turn the body by {worst.allowed:.2g} rad"
        return self.finding(relation, worst, detail)

    def explain(self, apart: Apart) -> PairFinding:
        """Return the finding on a pair that differs: from which size on, whether with shorter steps too, and the simplest."""
        engine, pair, description, lost, scale = self.engine, self.pair, self.description, math.isinf(apart.value), apart.scale

        def wrong(candidate: Description, scale: float | None = scale) -> bool:
            with suppress(FirstFailed, NotAvailable, IntegrationFailed):
                seen = _apart(engine, pair, candidate, scale)
                return math.isinf(seen.value) if lost else seen.wrong
            return False

        def stays(candidate: Description) -> bool:  # with shorter steps, the pair still differs
            if lost or (pair.exact and not pair.scales):
                return True
            with suppress(FirstFailed, NotAvailable, IntegrationFailed):
                coarse, fine = (_apart(engine, pair, some, scale).value for some in (candidate, _finer(candidate, 4)))
                return not fine < coarse / 2
            return True

        adaptive = engine.runner.adaptive and not lost and not pair.same_bits
        threshold = "" if scale is None or adaptive else _threshold(pair, description, scale, wrong)
        if not stays(description):
            detail = "the difference falls with the step"
            return self.finding(Relation.SAME_LIMIT, apart, detail, threshold=threshold)
        if adaptive:
            return self.with_tolerance(apart)
        causes = () if lost else _causes(engine, pair, description, apart)
        if not (lost or pair.same_bits or causes) and apart.value < OWN_SHARE * (own := _own_error(engine, description)):
            detail = f"the difference of {apart.value:.2g} is a small share of the error of the step, {own:.2g}"
            return self.finding(Relation.NEGLIGIBLE, replace(apart, allowed=OWN_SHARE * own), detail, threshold=threshold)
        first = _reduce(description, pair, scale, lambda candidate: wrong(candidate) and stays(candidate))
        motion = apart.failure or _describe_motion(engine, pair, first, scale)
        return self.wrong(apart, first, motion, threshold, causes)

    def wrong(
        self, apart: Apart, first: Description, motion: str, threshold: str = "", causes: tuple[Cause, ...] = ()
    ) -> PairFinding:
        """Return the finding on a pair that differs, with the data that repeats it."""
        size = f"{apart.value / apart.allowed:.2g} times the allowed difference" if apart.allowed else "not the same bits"
        detail = "; ".join(filter(None, (threshold, "" if math.isinf(apart.value) else size, motion)))
        relation = Relation.CRASHES if apart.crashed else Relation.DIFFERS
        repeat = {"causes": causes, "threshold": threshold, "first": first, "scale": apart.scale, "request": _plain(first)}
        if script := script_of(self.method, self.pair, first, apart.scale):
            repeat |= {"script": script, "script_file": script_name(self.method, self.pair.name)}
        return self.finding(relation, apart, detail, **repeat)

    def with_tolerance(self, apart: Apart) -> PairFinding:
        """Return the finding on a pair that differs in an engine that chooses its steps, which may be by its tolerance."""
        engine, pair, description = self.engine, self.pair, self.description
        looser = engine.runner.looser()
        if looser is None:
            return self.finding(Relation.UNKNOWN, apart, "it chooses its steps by a tolerance that is not known here")
        with looser.closing(), suppress(FirstFailed, NotAvailable, IntegrationFailed):
            if _apart(Engine(looser), pair, description, apart.scale).value > 2 * apart.value:
                return self.finding(Relation.SAME_LIMIT, apart, "the difference falls with the tolerance")
        return self.wrong(apart, description, _describe_motion(engine, pair, description, apart.scale))


def _causes(engine: Engine, pair: Pair, description: Description, apart: Apart) -> tuple[Cause, ...]:
    """Return mistakes with which a body that is made as usual moves as the one that the engine loads, sets or scales."""
    if pair.variant not in LOADED:
        return ()
    second = pair.second(description, *_scaled(apart.scale))
    samples = engine.runner.model(second)()

    def leaves(body: Description) -> float:
        turned, back = usual(body)
        return difference(samples, back(engine.runner.model(turned)()))

    return find_causes(second, apart.value, apart.allowed, leaves)


def _plain(description: Description) -> Mapping[str, object]:
    numbers = {name: value for name, value in description.numbers.items() if np.any(value)}
    return MappingProxyType(
        {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in numbers.items()}
    )


def _own_error(engine: Engine, description: Description) -> float:
    """Return the change of the motion with a fourth of the step: about the error of the step."""
    with suppress(FirstFailed, NotAvailable, IntegrationFailed):
        coarse, fine = (engine.first(some).samples for some in (description, _finer(description, 4)))
        own = difference(coarse, fine)
        return own if math.isfinite(own) else 0.0
    return 0.0


def _describe_motion(engine: Engine, pair: Pair, description: Description, scale: float | None) -> str:
    """Return how the second description of a reduced pair moves."""
    with suppress(FirstFailed, NotAvailable, IntegrationFailed):
        first, second = engine.first(description), pair.second(description, *_scaled(scale))
        R, w = pair.back(run(engine.runner, description, second, pair, first.model), *_scaled(scale))
        (R0, w0), after = first.samples, f"{description.n_steps} steps" if description.n_steps > 1 else "one step"
        rates = [np.array2string(rate[-1], precision=3, suppress_small=True) for rate in (w0, w)]
        if not angle_between(R[0], R[-1]) and angle_between(R0[0], R0[-1]):
            return f"after {after} the second body has not turned; its rates are {rates[1]}, not {rates[0]} rad/s"
        return f"after {after} {float(angle_between(R0[-1], R[-1])):.2g} rad apart, rates {rates[0]} and {rates[1]} rad/s"
    return "one of both motions is lost"


def _threshold(pair: Pair, description: Description, scale: float, wrong: Callable[..., bool]) -> str:
    """Return a phrase on the size from which on a scaled body moves differently, after `HALVINGS` trials."""
    good, bad = 0.0, math.log(scale)
    for _ in range(HALVINGS):
        middle = (good + bad) / 2
        good, bad = (good, middle) if wrong(description, scale=math.exp(middle)) else (middle, bad)
    if abs(bad) < 2 * abs(math.log(scale)) / 2**HALVINGS:
        return "in all other units"
    at, up = pair.second(description, math.exp(bad)), scale > 1
    speed = f", a speed of {np.linalg.norm(np.cross(at.w0, at.com)):.2g} m/s" * bool(description.com.any())
    if pair.quantity == "time":
        return f"{'below' if up else 'above'} {np.linalg.norm(at.w0):.2g} rad/s{speed}"
    moments = np.diag(at.inertia)
    return f"{'above' if up else 'below'} moments of {moments.min():.2g} to {moments.max():.2g} kg m^2, {at.mass:.2g} kg{speed}"


SIMPLER: tuple[Callable[[Description], Description], ...] = (
    lambda d: replace(d, R0=np.eye(3)),
    lambda d: replace(d, com=np.zeros(3), gravity=0.0),
    lambda d: replace(d, inertia=np.diag((1.0, 2.0, 2.5))),
    lambda d: replace(d, inertia=np.eye(3) * np.diag(d.inertia).max()),
    lambda d: replace(d, mass=1.0),
    *(lambda d, axis=axis: replace(d, w0=np.linalg.norm(d.w0) * np.eye(3)[axis]) for axis in range(3)),
    lambda d: replace(d, w0=np.array([float(f"{value:.1g}") for value in d.w0])),
)
"""Simplifications of a body and its start, each kept if the pair still differs and both bodies are possible."""


def _reduce(description: Description, pair: Pair, scale: float | None, wrong: Callable[[Description], bool]) -> Description:
    """Return the simplest body with the fewest steps, to 1 %, that still differs."""
    few, enough = 0, description.n_steps
    while enough - few > max(1, few // 100):
        count = (few + enough) // 2 if few else max(1, enough // 8)
        if wrong(replace(description, n_steps=count, every=count)):
            enough = count
        else:
            few = count
    if enough < description.n_steps:
        description = replace(description, n_steps=enough, every=enough)
    for simpler in SIMPLER:
        candidate, _ = to_principal(simpler(description))
        if candidate.possible and pair.second(candidate, *_scaled(scale)).possible and wrong(candidate):
            description = candidate
    return description


def select_pairs(names: Sequence[str]) -> tuple[Pair, ...]:
    """Return pairs by name, by default all. Raise `BadInput`."""
    for name in names:
        choice("pairs", name, tuple(pair.name for pair in PAIRS))
    return tuple(pair for pair in PAIRS if not names or pair.name in names)


def verify_pairs(
    method: Method,
    names: Sequence[str] = (),
    tell: Callable[[str], object] = lambda what: None,
    subject: str = "",
) -> Iterator[PairFinding]:
    """Yield the finding on every pair of every body in an engine, program or method. No verdict depends on times of runs.

    Parameters
    ----------
    method
        The engine, program or method.
    names
        Names of pairs, by default all.
    tell
        Function that is called with a text before each pair.
    subject
        Name in the findings, by default the name of the method.

    Raises
    ------
    BadInput
        A name is unknown.
    MissingEngine
        The engine is not installed.
    """
    pairs = select_pairs(names)
    with runner_of(method).closing() as runner:
        engine = Engine(runner)
        for body, description in BODIES.items():
            for pair in pairs:
                if body in pair.bodies:
                    tell(f"{body}, {pair.name}")
                    yield _Pair(engine, method, subject or method.name, body, pair, description).compare()
            engine.forget()
