"""Which method and step of ours, and which setting of each engine, has a wanted error over a duration, and at what cost.

1. A trial run tells how fast the body turns; from that follow the spacing of samples and the length of probes.
2. The truth: two independent ones that agree. A closed form is known over the whole duration, anything else over the probes.
3. A disturbed start tells how the motion itself amplifies errors (all three: `groundwork`).
4. Each method is probed from coarse to fine (`bench`, `probing`). Errors are carried to the duration by a law that is told
   (`growth`).
5. The settings found are timed against each other, interleaved.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from conservative.check import positive_number
from conservative.errors import BadInput, nearest
from conservative.method import Grid, Method, Role
from conservative.references.truth import Truth
from conservative.scene import Scene

from ..measures.convergence_order import Order, observed_order
from ..measures.timing import interleaved
from ..studies import selection, step_ladder
from ..studies.case import Case, Done, attempt
from .motion import our_choice, prepared
from .probe import STEPS, Bench, Probe
from .search import Climb, climbed, hopeless

Progress = Callable[[float, str], None]

COST_LIMIT = 1.0
"""Wall time per simulated second, s/s, that a setting may cost: as fast as the body itself."""
TIMED = 0.005
"""Wall time, s, that one timed run is meant to last."""
ROUNDS, TIMING_BUDGET = 7, 0.25
COARSER_START = 4
"""How much longer than the chooser's step the first of our probes is, so that there is an order to be seen."""
LOOSEST = 1e-3
"""Tolerance that adaptive methods start with at most."""


@dataclass(frozen=True)
class Advice:
    """What to use of one method.

    Attributes
    ----------
    line
        Name of the method without the setting that is being looked for.
    best
        The probe at the recommended setting; where nothing reaches the error, at the setting that gets nearest.
    reached
        Whether the wanted error may be expected.
    cost
        Wall time per simulated second at that setting, s/s, interleaved minimum; nan where it could not be timed.
    order
        Observed order in the step; None for adaptive methods and those without truncation error.
    probes
        All runs, coarse to fine.
    reason
        Why the method cannot be used at all, or why it does not reach the error; empty where it does.
    """

    line: str
    role: str
    best: Probe | None
    reached: bool
    cost: float
    order: Order | None
    probes: tuple[Probe, ...]
    reason: str


@dataclass(frozen=True, eq=False)
class Recommendation:
    """What was asked, and every method's advice, ours first; see `Advice`.

    `truth` is what errors are measured against, `bench` what the probes had in common. `missing` are engines not installed.
    """

    bench: Bench
    truth: Truth
    advice: tuple[Advice, ...]
    missing: tuple[str, ...]

    @property
    def ours(self) -> Advice:
        """Advice on our own method."""
        return self.advice[0]

    @property
    def cheapest(self) -> Advice | None:
        """The cheapest of all that reach the error; None where nothing does."""
        good = [advice for advice in self.advice if advice.reached and not math.isnan(advice.cost)]
        return min(good, key=lambda advice: advice.cost, default=None)


def engines(names: Iterable[str] | None = None) -> tuple[Method, ...]:
    """Return a method for each line of the engines named, of all by default: variants that differ in tolerance are one line.

    Engines named have to be installed; of all, a `Missing` method stands for one that is not.

    Raises
    ------
    BadInput
        A name is not that of an engine.
    MissingEngine
        An engine that is named is not installed.
    """
    everything = [method for method in selection.methods(skip_missing=True) if method.role == Role.ENGINE]
    if names is None:
        wanted: Iterable[Method] = everything
    else:
        known = {method.name.partition(":")[0] for method in everything}
        for name in names:
            if name.partition(":")[0] not in known:
                raise BadInput("engine", repr(name), nearest(name, known))
        wanted = selection.methods(names)
    lines = {selection.series(method): method for method in reversed(tuple(wanted))}
    return tuple(reversed(lines.values()))


@dataclass(frozen=True, eq=False)
class Question:
    """What is asked, checked: see `question`. `missing` are engines that are not installed."""

    scene: Scene
    error: float
    duration: float
    methods: tuple[Method, ...]
    missing: tuple[str, ...]
    cost_limit: float


def question(
    scene: Scene,
    error: float = 1e-6,
    duration: float | None = None,
    engine_names: Iterable[str] | None = None,
    cost_limit: float = COST_LIMIT,
) -> Question:
    """Return what is asked, or say what is wrong with it.

    Parameters
    ----------
    scene
        What moves.
    error
        Largest attitude error over the duration, rad.
    duration
        s; default the scene's.
    engine_names
        Engines, such as `("mujoco",)`; default all that are installed.
    cost_limit
        Wall time per simulated second, s/s, that a setting may cost.

    Raises
    ------
    BadInput
        An argument cannot be used.
    MissingEngine
        An engine that is named is not installed.
    """
    positive_number("error", error, "a finite attitude error above 0, rad")
    end = scene.t_end if duration is None else positive_number("duration", duration, "a finite duration above 0, s")
    positive_number("cost_limit", cost_limit, "a finite wall time per simulated second above 0, s/s")
    found = engines(engine_names)
    missing = tuple(method.name for method in found if isinstance(method, selection.Missing))
    methods = tuple(method for method in found if not isinstance(method, selection.Missing))
    return Question(scene, error, end, methods, missing, cost_limit)


def recommend(asked: Question, progress: Progress = lambda share, what: None) -> Recommendation:
    """Return what to integrate a scene with.

    Parameters
    ----------
    asked
        From `question`.
    progress
        Called with the share of all work that is done and what comes next.

    Raises
    ------
    Disagreement
        No truth is known.
    """
    progress(0.0, "the motion and its truth")
    bench, truth = prepared(asked.scene, asked.error, asked.duration, asked.cost_limit)
    own, step = our_choice(bench, bench.target * min(1.0, bench.short / bench.duration))
    roles: dict[str, str] = {}
    climbs: dict[str, Climb | str] = {}
    for i, method in enumerate((own, *asked.methods)):
        line = selection.series(method)
        progress(0.2 + 0.7 * i / (1 + len(asked.methods)), f"probing {line}")
        roles[line] = method.role
        climbs[line] = method.unsupported(asked.scene) or climbed(bench, *start(bench, method, step))
    progress(0.9, "timing what was found")
    costs = timed(bench, climbs)
    advised = tuple(advice(bench, line, roles[line], climb, costs.get(line)) for line, climb in climbs.items())
    return Recommendation(bench, truth, advised, asked.missing)


def start(bench: Bench, method: Method, step: float) -> tuple[Method, float]:
    """Return the method and the step to begin with: ours near where the chooser ends, others far off."""
    setting = selection.tolerance_setting(method)
    if setting is not None:
        loosest = 10.0 ** math.floor(math.log10(min(LOOSEST, bench.error)))
        return selection.at_tolerance(method, setting, float(f"{loosest:.0e}")), bench.spacing
    longest = bench.step_at_most(bench.short / STEPS)
    if method.role != Role.OURS:
        return method, min(longest, bench.step_at_most(step_ladder.RADIANS / bench.rate))
    return method, step if method.order is None else min(COARSER_START * step, longest)


def timed(bench: Bench, climbs: dict[str, Climb | str]) -> dict[str, float]:
    """Return the wall time per simulated second of the settings found, s/s, by line: interleaved minimums."""
    runs, lengths = {}, {}
    for line, climb in climbs.items():
        probe = None if isinstance(climb, str) else climb.best(bench.target)
        if probe is None or not probe.outcome.ok:
            continue
        length = TIMED / probe.cost
        n = max(1, round(length / probe.dt))
        adaptive = selection.tolerance_setting(probe.method) is not None
        grid = Grid(length, 1) if adaptive else Grid(probe.dt, n, n)
        outcome = attempt(Case("recommendation", bench.scene, probe.method, grid))
        if isinstance(outcome, Done):
            runs[line], lengths[line] = outcome.run, grid.dt * grid.n_steps
    found = interleaved(runs, ROUNDS, min_time=TIMED, budget=TIMING_BUDGET)
    return {line: timing.minimum / lengths[line] for line, timing in found.items()}


def advice(bench: Bench, line: str, role: str, climb: Climb | str, cost: float | None) -> Advice:
    """Return what to say about one line of settings; a text instead of probes is why there are none."""
    if isinstance(climb, str):
        return Advice(line, role, None, False, math.nan, None, (), climb)
    probe = climb.best(bench.target)
    reached = probe.expected <= bench.error
    order = None if probe.method.order is None else observed_order(*climb.converging())
    reason = "" if reached else shortfall(bench, climb, probe)
    return Advice(line, role, probe, reached, math.nan if cost is None else cost, order, climb.probes, reason)


def shortfall(bench: Bench, climb: Climb, probe: Probe) -> str:
    """Return why nothing finer was found."""
    last = climb.last
    if not probe.outcome.ok:
        return str(probe.outcome)
    if math.isinf(bench.amplification.excess(probe.length, bench.duration)):
        return "the motion amplifies errors without bound"
    if hopeless(last):
        return "finer settings do not help any more: round-off"
    if last[-1].cost > bench.cost_limit / 2:
        return f"anything finer costs more than {bench.cost_limit:g} s per simulated second"
    if selection.tolerance_setting(probe.method) is not None:
        return "it has no tighter tolerance"
    return f"not within {len(last)} probes"
