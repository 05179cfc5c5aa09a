"""The search for the mistakes that explain the error of a recorded motion."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from decimal import Decimal
from itertools import chain, combinations, product
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from conservative.attitude import Array, angle_between, to_quaternion
from conservative.potentials.uniform_gravity import UniformGravity
from conservative.scene import Scene

from .compare import (
    FLOOR,
    HOPELESS,
    LINEAR,
    LONGEST,
    MOST_NOISE,
    NUMERICAL,
    SIGMAS,
    Compared,
    Effort,
    Solution,
    allow,
    differ,
    estimate_noise,
    exact,
    linearise,
)
from .explanation import HALF, PROVEN, Explanation, Trial, attempt, explain
from .find_steps import PARTS, STEPS_AT_MOST, Linearised, by_step, find_steps
from .mistakes import BY_KEY
from .mistakes.attitudes import DRIFTS, RULES, Drift, align, integrate
from .mistakes.equations import EQUATIONS
from .mistakes.habits import HABITS, HELD, PART_STANDSTILLS, ROWS, STANDSTILLS, Habit, Standstill, any_values
from .mistakes.mistake import Number
from .mistakes.readings import ATTITUDES, AXES, RATES, READINGS, TURN, Reading
from .mistakes.scenes import PARTS as SCENE_PARTS
from .mistakes.scenes import SCENES, SIZES, SceneMistake, with_inertia
from .mistakes.steps import INTEGRATORS
from .mistakes.times import DROPPED, JITTERED, TIMES
from .resampled import find_resampled
from .scene_digits import find_scene_digits
from .solution import Equations, has_closed_form, integrate_rates, truth
from .trials import Drifting, by_drift, by_habit, by_rule, compose, fits, remark_on_damping

FEWEST, FEW, MOST = 100, 12, 2500
"""Rows that are explained: at least `FEWEST`, if the file has them, or `FEW`, if they are far apart without a closed form,
and at most `MOST`, evenly chosen."""
EFFORT = 20_000
"""Work of a search with a `share` of 1, in stretches (`Effort`): about 5 s of an idle core."""
MOST_BREAKS = 50
"""Largest number of jumps and corners of the loads with which numbers are fitted."""
STILL = 1e-9
"""Largest change from row to row while a body stands still, rad, or of rates relative to the scale."""
LITTLE = 0.05
"""Largest share of the error that a fitted number may leave if an integrator explains the rest."""
SHRUNK = 1e-3
"""A motion in other units of time that moves by less than this share of the exact motion stands still."""
SHOWN = 10.0
"""A motion in other units of time that moves by less than this number of allowed errors shows nothing."""
FEW_AT_END = 3
"""Rows at the end that repeat the one before, from which the motion halts."""
AFTER_ERROR, STEPS_OF_HABITS = 12, (*range(1, 13), 15, 16, 20, 24, 25, 30, 40, 50)
"""Rows from the first error on from which the step of a habit is found, and the steps between two rows that are tried."""
NEARLY, SMALL_SHARE, REFINED = 1e-2, 1e-6, 2
"""Largest share of the error that an integrator leaves if sizes of numbers of the scene are fitted to the rest, the change of a
number for slopes, and the number of such fits."""
DRIFTING_ROWS, DRIFTING_EFFORT, MOST_FITS = 300, 30, 20
"""Rows from which a drift is fitted, the work of a fit, and the largest number of its iterations."""
FROZEN = "frozen motion"
"""Key of a mistake that no fitted number explains better."""
_INERTIA = [f"inertia_{ij}" for ij in (11, 12, 13, 22, 23, 33)]
ALL_KINDS = frozenset({"readings", "times", "scenes", "equations", "attitudes", "habits", "rows", "steps", "bodies"})
PROGRAM_KINDS = frozenset({"readings", "times", "scenes", "equations", "attitudes", "habits"})
"""Kinds of mistakes that a program can have beside the errors of its method."""


@dataclass(frozen=True)
class Diagnosis:
    """The mistakes that explain an error, or the best candidates if none does, all that were tried, best first, and notes."""

    named: list[Explanation] = field(default_factory=list)
    tried: list[Explanation] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def diagnose(
    whole: Compared,
    quaternion: bool = True,
    tell: Callable[[str], object] = lambda _: None,
    kinds: frozenset[str] = ALL_KINDS,
) -> Diagnosis:
    """Search for the mistakes of some kinds that explain the error of a file or of the answers of a program.

    A mistake explains a file if the error that remains is within the file's noise or digits and less than half of the original
    error. Of several mistakes that leave similar errors, those with the fewest fitted numbers are named. If none explains the
    file, candidates are those that leave less than half of the error. A mistake that makes attitudes or rates worse is not a
    candidate. `quaternion` is True if the order of quaternions can be wrong. The work is counted, so that the answer is the
    same on a busy machine.
    """
    whole = _before_divergence(whole)
    case = whole.first(LONGEST, FEWEST)  # 100 rad, or 100 rows if they take longer
    case = case.first(NUMERICAL, 2) if has_closed_form(case.scene) else case.first(NUMERICAL / 10, FEW)
    if case.error.max() <= case.allowed.max() and len(case.t) < len(whole.t):
        case = whole  # the error is later
    stride = -(-len(case.t) // MOST)
    case = case.take(slice(None, None, stride)).change(stride=stride, effort=Effort(0.0))
    early = whole.first(LONGEST, FEWEST)
    early = early if has_closed_form(case.scene) else early.first(NUMERICAL / 10, FEW)
    early = early.change(effort=case.effort)
    tried, over = list[Explanation](), False
    for name, search in SEARCHES.items():
        if not kinds & search.kinds or len(case.t) < search.least or (whole.far and not search.whole):
            continue
        tell(name)
        case.effort.left = max(case.effort.left, 0.0) + EFFORT * search.share  # unused work is kept
        for explanation in search.find(early if search.whole else case, _Asked(quaternion, kinds, tuple(tried))):
            if explanation is not None:
                tried.append(explanation)
            if case.effort.over:
                over = True
                break
        found = [explanation.keys for explanation in tried if explanation.explains]
        if found and (search.ends or (FROZEN,) in found):
            break  # the searches that follow take longer and fit more numbers
    bounds = np.maximum(case.plain.max(axis=1), case.allowed)

    def no_worse(explanation: Explanation) -> bool:
        return explanation.explains or bool((np.array(explanation.left) <= bounds).all())

    tried = [explanation for explanation in tried if no_worse(explanation)]
    tried.sort(key=lambda explanation: (not explanation.explains, explanation.share, explanation.keys))
    explaining = [explanation for explanation in tried if explanation.explains]
    # An explanation that leaves much of an error may fit noise by chance. Jitter does not: its errors lie along the motion.
    doubtful = all(explanation.rest > PROVEN and explanation.keys != (JITTERED.key,) for explanation in explaining)
    if case.step is None and doubtful:  # in a file, noise can hide the cause
        tried, explaining = [replace(explanation, explains=False) for explanation in tried], []
    if not explaining:
        notes = ["The search ended before everything was tried: it takes too many trial motions."] * over
        if whole.far:
            notes.append("No trial motion reaches the second row, so that only units of the time are tried.")
        if (corners := len(case.scene.breaks)) > MOST_BREAKS:
            notes.append(f"Other bodies, axes and damping are not fitted: the loads have {corners} jumps and corners.")
        return Diagnosis([explanation for explanation in tried if explanation.share < HALF][:3], tried, notes)
    least = min(explanation.size for explanation in explaining)
    # Similar errors: within three times the smallest one, or within three times the noise.
    good = [explanation for explanation in explaining if explanation.size <= 3 * max(least, 1.0)]
    fewest = min((explanation.numbers, len(explanation.keys)) for explanation in good)
    good = [explanation for explanation in good if (explanation.numbers, len(explanation.keys)) == fewest]
    named = [explanation for explanation in good if _normalised(explanation)] or good
    if case.step is None:
        named = [explanation.with_intervals(case) for explanation in named]
    return Diagnosis(named, tried, _separate(case, named))


def _normalised(explanation: Explanation) -> bool:
    """Return whether quaternions are normalised. Rates alone do not show it."""
    return all(integrator.step.normalised for integrator in INTEGRATORS if integrator.key in explanation.keys)


def _before_divergence(case: Compared) -> Compared:
    """Return the rows before rates exceed three times the exact rates; errors are relative to the largest rate there."""
    w, largest = case.data[1], float(np.linalg.norm(case.exact[1], axis=1).max())
    size = np.zeros(1) if w is None or case.step is not None else np.linalg.norm(w, axis=1)
    if not size.max() > 3 * largest > 0 or np.median(size[np.argmax(size > 3 * largest) :]) <= 3 * largest:
        return case  # no rows, or only single ones, exceed it
    case = case.take(slice(0, max(4, int(np.argmax(size > 3 * largest)))))
    return case.rescale(float(size[: len(case.t)].max()))


def _separate(case: Compared, named: list[Explanation]) -> list[str]:
    """Return a note on the data that would separate several mistakes that explain a file."""
    motions = [explanation.made for explanation in named if explanation.made is not None]
    for kind, i, size, unit in (("attitudes", 0, 1.0, "rad"), ("rates", 1, case.scale, "of the largest rate")):
        pairs = ((a[i], b[i]) for a, b in combinations(motions, 2) if len(a[i]) == len(b[i]))
        apart = max((float(np.abs(a - b).max()) / size for a, b in pairs), default=0.0)
        if case.data[i] is None and apart > 2 * case.allowed[i]:
            return [f"Columns of {kind} would separate these: they differ by up to {apart:.2g} {unit}."]
    return ["They make the same rows. A longer file or more digits may separate them."] * (len(named) > 1)


class _Asked(NamedTuple):
    """What the caller of the search asks for: whether quaternions can have another order, kinds, and what was tried before."""

    quaternion: bool
    kinds: frozenset[str]
    tried: tuple[Explanation, ...]


Explanations = Iterator[Explanation | None]


def _without_numbers(mistakes: Any) -> list[Any]:
    """Return mistakes without numbers, in the order of their keys."""
    return sorted((mistake for mistake in mistakes if not mistake.numbers), key=lambda mistake: mistake.key)


def _usable_readings(case: Compared, quaternion: bool) -> list[tuple[Reading, ...]]:
    """Return the readings that the data can have: one of attitudes, one of rates, both, or one of all axes."""
    usable = [reading for reading in _without_numbers(READINGS) if fits(reading, case)]
    if not quaternion:
        usable = [reading for reading in usable if not reading.quaternions]
    if case.from_row and not _depends_on_world(case.scene):  # its motion is the same in any axes of the world
        usable = [reading for reading in usable if not reading.of_world]
    of = {name: [(), *((reading,) for reading in usable if reading.of == name)] for name in (ATTITUDES, RATES)}
    pairs = [a + b for a, b in product(of[ATTITUDES], of[RATES])]
    return pairs[1:] + [(reading,) for reading in usable if reading.of == AXES]


def _depends_on_world(scene: Scene) -> bool:
    """Return whether the motion of a scene depends on the axes of the world."""
    varying = None if scene.damping is None else scene.damping.of_time
    of_attitude = (scene.torque is not None and (scene.torque.of_attitude or scene.torque.frame != "body")) or (
        varying is not None and varying.of_attitude
    )
    return scene.potential is not None or bool(of_attitude)


def _readings(case: Compared, asked: _Asked) -> Explanations:
    """Yield other readings of attitudes and rates."""
    near = case.take(slice(0, 10))
    for mistakes in _usable_readings(case, asked.quaternion):
        trial = compose(*mistakes)
        motion = trial.build(near)
        if motion is None:
            continue
        R, w = motion(near.scene.R_WB0[None], near.scene.w_WB_B0[None], np.zeros((1, 0)), len(near.t))
        # A reading that makes the first rows much worse than they are is not tried on all rows.
        if (near.errors(R[0], w[0]) <= 2 * case.error[:, :10].max() + 10 * case.allowed.max()).all():
            explanation = _read_again(case, trial) if any(case.open) else None
            if explanation is None:
                # Fits of the start take most of the work. Where noise is open, only readings that leave little are worth it.
                explanation = attempt(case.change(free=()) if any(case.open) else case, trial)
                if any(case.open) and explanation is not None and not explanation.explains and explanation.rest < LITTLE:
                    explanation = attempt(case, trial)
            yield explanation if _moves(case, explanation) else None


def _read_again(case: Compared, trial: Trial) -> Explanation | None:
    """Return the explanation by other readings, of rows whose noise they show only if they are read so; None if they do not.

    Rates in degrees that are read as rad/s turn the body so far between two rows that noise is hidden.
    """
    R, w = case.data
    for reading in trial.mistakes:
        assert isinstance(reading, Reading)
        R, w = reading.read(R, w)
    again, motion = case.read(R, w), trial.build(case)
    scale = case.scale if w is None else float(np.linalg.norm(w, axis=1).max()) or 1.0
    settled = _settle_noise(replace(again, scale=scale))
    if settled is None or motion is None:
        return None
    made = motion(case.scene.R_WB0[None], case.scene.w_WB_B0[None], np.zeros((1, 0)), len(case.t))
    return _of_other_rows(case, trial, settled, (made[0][0], made[1][0]))


def _settle_noise(case: Compared) -> Compared | None:
    """Return a case whose rows show their noise, with a start that explains them; None if there is none."""
    sizes = np.array([1.0, case.scale])
    noise, resolved = estimate_noise(case.t, case.data)
    have = np.array([x is not None for x in case.data])
    if not resolved[have].all() or (noise / sizes > MOST_NOISE).any():
        return None
    allowed = allow(case.rounded, noise / sizes)
    case = replace(case, allowed=allowed.errors, noise=allowed.noise, open=(False, False))
    if not case.passes(case.error) and (case.error.max(axis=1) < HOPELESS * case.allowed * max(1.0, case.turned)).all():
        case = case.at(case.fit(exact(case), np.zeros(0), np.zeros(0))[0])
    return case if case.passes(case.error) else None


def _of_other_rows(case: Compared, trial: Trial, settled: Compared, made: tuple[Array, Array]) -> Explanation:
    """Return the explanation of a case by a trial that turns it into rows which the exact motion explains."""
    explanation = explain(case, trial, made)
    left = (settled.error.max(axis=1) * [1.0, settled.scale / case.scale]).tolist()
    share = float(max(left) / max(*explanation.plain, 1e-15))
    return replace(explanation, left=left, share=share, rest=share, size=settled.size(settled.error), explains=share < HALF)


def _changes(case: Compared, asked: _Asked) -> Explanations:
    """Yield motions of scenes and equations with a mistake."""
    singles = [(mistake,) for mistake in _without_numbers((*SCENES, *EQUATIONS)) if mistake.kind in asked.kinds]
    several = chain.from_iterable(combinations(SCENE_PARTS, n) for n in range(2, len(SCENE_PARTS) + 1))
    singles.sort(key=lambda mistakes: mistakes[0] not in SCENE_PARTS)  # the usual ones first, if the work ends
    trials = [compose(*mistakes) for mistakes in (*singles, *(several if "scenes" in asked.kinds else ()))]
    if case.free:  # fits of the start take most of the work: the nearest motions first
        trials = _nearest_first(case, trials)
    for trial in trials:
        yield attempt(case, trial)


def _nearest_first(case: Compared, trials: list[Trial]) -> list[Trial]:
    """Return trials without numbers that make a difference, by the error that they leave from the start of the scene.

    Motions that break off are left out. Half of the work may go into this; the trials that remain follow in their order.
    """
    ranked, rest, least, case = [], list[Trial](), case.effort.left / 2, case.screen or case
    for number, trial in enumerate(trials):
        motion = trial.build(case)
        if motion is None:
            continue
        if case.effort.left < least:
            rest.append(trial)
            continue
        R, w = case.evaluate(motion, np.zeros((1, 6)))
        if np.isfinite(w).all():
            ranked.append((case.size(case.errors(R[0], w[0])), number, trial))
    return [trial for *_, trial in sorted(ranked)] + rest


def _numbers(case: Compared, asked: _Asked) -> Explanations:
    """Yield motions of scenes and equations with a mistake whose numbers are fitted."""
    if len(case.scene.breaks) > MOST_BREAKS:
        return
    for mistake in sorted((*SCENES, *EQUATIONS), key=lambda mistake: mistake.key):
        if mistake.numbers and mistake.kind in asked.kinds:
            remark = remark_on_damping(case.scene) if mistake is BY_KEY["damping"] else ""
            explanation = attempt(case, compose(mistake, remark=remark))
            yield None if explanation is None else _within_digits(case, explanation)
    if "equations" in asked.kinds:
        remark = remark_on_damping(case.scene)
        yield attempt(case, compose(BY_KEY["no gyroscopic term"], BY_KEY["damping"], remark=remark))


def _within_digits(case: Compared, explanation: Explanation) -> Explanation:
    """Return an explanation, with a remark if the number differs from the scene's by less than the digits of the scene."""
    mistake = BY_KEY[explanation.keys[0]]
    if "factor" not in explanation.values or not isinstance(mistake, SceneMistake):
        return explanation
    remark, trial = _digits_of(case.scene, mistake, explanation.values["factor"]), explanation.trial
    if trial is None:
        return explanation
    trial = replace(trial, remark=trial.remark + remark)
    return replace(explanation, trial=trial, sentence=trial.sentence(explanation.values))


def _digits_of(scene: Scene, mistake: SceneMistake, factor: float) -> str:
    """Return the end of a sentence on a number that differs from the scene's by less than the digits of the scene; or ""."""
    if mistake.key != "rate of the orbit":
        return ""
    rate = float(scene.potential.orbit.rate)  # type: ignore[union-attr]
    written = Decimal(f"{rate:.17g}" if len(repr(rate)) > 18 else repr(rate))
    digits = len(written.normalize().as_tuple().digits)
    # Half a unit of the last digit, and a little more for rounding.
    within = abs(factor - 1) <= 0.51 * 10.0 ** (np.ceil(np.log10(rate)) - digits) / rate
    return ", which is within the digits of the scene file" * bool(within)


def _units(case: Compared, asked: _Asked) -> Explanations:
    """Yield times in other units than seconds."""
    for time in TIMES:
        if not time.unit or case.turned * time.unit > 2 * LONGEST:
            continue
        if case.step is not None:
            continue
        settled = None
        if any(case.open):  # rows in another unit of time hide their noise
            settled = _settle_noise(replace(case, t=case.start + (case.t - case.start) * time.unit))
        trial = compose(time)
        explanation = attempt(case, trial) if settled is None else _of_other_rows(case, trial, settled, settled.exact)
        yield explanation if _moves(case, explanation) else None


def _moves(case: Compared, explanation: Explanation | None) -> bool:
    """Return whether a motion differs from standing still: a mistake that only shrinks the motion explains nothing.

    The error of a program is proportional to its motion, so the remaining error is compared with the motion and not with the
    tolerance of the program.
    """
    if explanation is None or explanation.made is None:
        return False
    some = case.take(slice(0, len(explanation.made[0])))
    still = _still(some)
    moved, whole = some.apart(explanation.made, still), some.apart(some.exact, still)
    if case.step is None:
        return bool((moved > np.maximum(SHOWN * some.allowed, SHRUNK * whole)).any())
    return bool(((moved > SHRUNK / 2 * whole) & (np.array(explanation.left) < HALF * moved)).any())


def _still(case: Compared) -> tuple[Array, Array]:
    """Return the rows of a body that stands still, with the rates of the start."""
    n = len(case.t)
    return np.broadcast_to(case.scene.R_WB0, (n, 3, 3)), np.broadcast_to(case.scene.w_WB_B0, (n, 3))


def _times(case: Compared, asked: _Asked) -> Explanations:
    """Yield the right states at other times: shifted, in proportion, with rows missing, jittered, or rates apart."""
    if case.step is not None:
        for time in TIMES:
            if time.of_step or (time.unit and case.turned * time.unit < 2 * LONGEST):
                explanation = attempt(case, compose(time))
                yield explanation if not time.unit or _moves(case, explanation) else None
        return
    later = np.append(0, np.arange(max(1, len(case.t) // 20), len(case.t)))  # the first row, which is exact, and later ones
    for time in TIMES:
        if not time.of_step and not time.unit:
            some = case.take(later)
            explanation = attempt(some, compose(time))
            yield explanation if _moves(some, explanation) else None
    if "rows" in asked.kinds:
        gap = float(np.median(np.diff(case.t)))
        yield from _own_times(case, gap, float(case.t[-1] + 0.1 * (case.t[-1] - case.start) + 2 * gap))


def _own_times(case: Compared, gap: float, end: float) -> Explanations:
    """Yield the right states at times that are found row by row: with rows missing in between, or jittered."""
    starts = [case]
    if case.free:  # a first row with noise, or jitter that a fit of the start takes for noise
        starts.append(case.at(case.fit(exact(case), np.zeros(0), np.zeros(0))[0]))
    explanations = [explanation for start in starts if (explanation := _by_own_times(start, gap, end)) is not None]
    yield min(explanations, key=lambda explanation: (not explanation.explains, explanation.size), default=None)


def _by_own_times(case: Compared, gap: float, end: float) -> Explanation | None:
    """Return the explanation by the times at which the motion from the initial state is nearest to the rows."""
    tau, e = case.t.copy(), 1e-6 / case.scale  # e: s, for slopes
    end += min(end - case.start, 50 * gap)  # up to 50 lost rows
    flow = Equations(case.scene).flow(case.start, case.scene.R_WB0[None], case.scene.w_WB_B0[None], end + e)

    def sample(t: Array) -> tuple[Array, Array]:
        R, w = flow.at(np.clip(t, case.start, end + e))
        return R[0], w[0]

    weights = 1 / np.repeat(case.noise, [9, 3]) ** 2
    for _ in range(8):  # Gauss-Newton for the time of each row
        d = case.differences(*sample(tau))
        v = (case.differences(*sample(tau + e)) - d) / e
        tau = tau - (d * v * weights).sum(axis=1) / ((v * v * weights).sum(axis=1) + 1e-300)
        tau = np.clip(tau, case.start, end)
        tau[0] = case.t[0]
    off = tau - case.t
    lost, size = np.rint(off / gap), float(np.sqrt(np.mean(off**2)))
    # Times that are off by whole gaps, more and more of them, are lost rows. Times that scatter about 0 are jitter.
    if lost.max() >= 1 and np.abs(off - lost * gap).max() < 0.2 * gap and (np.diff(lost) >= 0).all():
        at = float(case.t[np.flatnonzero(lost)[0]])
        values = {"rows": float(lost.max()), "at": at}
        later = replace(case, t=case.t + lost * gap)
        if case.free and not later.passes(later.error):  # the start was fitted to times that are wrong
            later = later.at(later.fit(exact(later), np.zeros(0), np.zeros(0))[0])
        return explain(case, Trial((DROPPED,), _nowhere), later.exact, values, numbers=2)
    if (held := _held_again(case)).any() and np.abs(off[~held]).max(initial=0.0) < 0.01 * gap:
        places = np.flatnonzero(held)
        right = case
        if case.free:  # the start was fitted to rows that are held
            rest = case.take(~held)
            right = case.at(rest.fit(exact(rest), np.zeros(0), np.zeros(0))[0])
        made: Any = HELD.change(right.exact, case.data, held)
        values = {"period": float(round(len(held) / len(places))), "first": float(places[0] * case.stride + 1)}
        return explain(case, Trial((HELD,), _nowhere), made, values, numbers=2)
    if abs(float(np.mean(off))) < 0.5 * size:
        # Every row has a time of its own: this ranks behind explanations by one or two fitted numbers.
        return explain(case, Trial((JITTERED,), _nowhere), sample(tau), {"jitter": size}, numbers=3)
    return None


def _held_again(case: Compared) -> Any:
    """Return which rows repeat the row before in all numbers, while the motion goes on."""
    same = np.ones(len(case.t), bool)
    same[0] = False
    for x in case.data:
        if x is not None:
            same[1:] &= (np.diff(x, axis=0).reshape(len(same) - 1, -1) == 0).all(axis=1)
    if same[-FEW_AT_END:].all():  # a motion that halts, and no rows that repeat
        return same & False
    moved = np.append(0.0, (np.abs(np.diff(case.exact[0], axis=0)).max(axis=(1, 2))))
    return same & (moved > STILL) if same.sum() < HALF * len(same) else same & False


def _nowhere(case: Compared) -> None:
    """Return no motion: the mistake belongs to one recording."""


def _attitudes(case: Compared, asked: _Asked) -> Explanations:
    """Yield attitudes by usual rules from the exact rates, if the rates of the file are exact."""
    R, w = case.data
    if R is None or w is None:
        return
    if case.step is not None:
        if (case.errors(*case.exact)[1] <= case.allowed[1]).all():
            for rule in RULES:
                yield attempt(case, by_rule(rule, 1), known={"step": case.step})
        return
    case = _at_fitted_rates(case)
    made = case.exact
    if case.errors(*made)[1].max() > case.allowed[1] or not case.from_row:
        return
    limits = {False: made[0], True: _on_the_wrong_side(case)}  # of short steps
    for rule in RULES:
        wanted, seen, explanations = [case.stride, 1], set[int](), list[Explanation]()
        while wanted and len(seen) < 8:  # each try is nearer to the best number of steps, so a few are enough
            parts = wanted.pop()
            if parts in seen or not 1 <= parts <= PARTS or parts * len(case.t) > 4 * STEPS_AT_MOST:
                continue
            seen.add(parts)
            case.effort.spend(parts * len(case.t) / 100)  # a stretch for every 100 steps of an attitude
            fine = np.append((case.t[:-1, None] + np.diff(case.t)[:, None] * np.arange(parts) / parts).ravel(), case.t[-1])
            rates = truth(case.scene, case.start, fine)[1] if parts > 1 else made[1]
            turned = integrate(rule.matrices, case.scene.R_WB0, rates, np.diff(fine), parts)
            error, gone = turned - limits[rule.world], R - limits[rule.world]
            small = np.linalg.norm(gone, axis=(1, 2)) < LINEAR
            ratio = float((error * gone)[small].sum() / ((error * error)[small].sum() or 1.0)) if small.sum() > 2 else 1.0
            if case.free:  # the first attitude has noise too
                aligned = align(turned, R, rule.world)
                turned = aligned if angle_between(aligned[0], turned[0]) <= case.allowed[0] else turned
            step = float(np.median(np.diff(case.t))) / parts
            explanations.append(explain(case, by_rule(rule, parts), (turned, made[1]), {"step": step}))
            if explanations[-1].explains:
                break
            if ratio > 0:
                wanted += [max(1, round(parts * ratio ** (-1 / order))) for order in (1, 2)]
        yield min(explanations, key=lambda explanation: explanation.share)


def _on_the_wrong_side(case: Compared) -> Array:
    """Return the attitudes (n, 3, 3) whose quaternions are q' = w q / 2 with the exact rates, in body axes."""
    start, end = case.scene.R_WB0, float(case.t[-1])
    flow = Equations(case.scene).flow(case.start, start[None], case.scene.w_WB_B0[None], end)
    # The conjugate obeys p' = p (-w) / 2.
    turned = integrate_rates(lambda t: -flow.at(t.ravel())[1].reshape(*t.shape, 3), np.array(flow.ends), case.t)
    return np.swapaxes(turned, 1, 2) @ start


def _at_fitted_rates(case: Compared) -> Compared:
    """Return the case whose initial state fits the rates of all rows, because the integral collects the noise of the first row.

    Without a field and loads, rates do not depend on the attitude. An attitude that differs by more than the noise is not one.
    """
    alone = replace(case, data=(None, case.data[1]), free=case.free[3:] if case.scene.free else case.free)
    if not alone.free:
        return case
    initial = alone.fit(exact(alone), np.zeros(0), np.zeros(0))[0]
    if np.linalg.norm(initial[:3]) > case.allowed[0]:
        initial = replace(alone, free=case.free[3:]).fit(exact(alone), np.zeros(0), np.zeros(0))[0]
    return replace(case, scene=alone.at(initial).scene)


def _drifts(case: Compared, asked: _Asked) -> Explanations:
    """Yield attitudes that drift against rates that are right, at a constant rate."""
    R, w = case.data
    if R is None or w is None or case.step is not None:
        return
    case = _at_fitted_rates(case)
    if case.errors(*case.exact)[1].max() > case.allowed[1]:
        return
    some = case.take(np.unique(np.linspace(0, len(case.t) - 1, DRIFTING_ROWS).astype(int)))
    start, fitted = (case.scene.R_WB0, case.scene.w_WB_B0), Drifting(some, case.scene.R_WB0, case.scene.w_WB_B0, some.exact[0])
    whole = Drifting(case, *start, case.exact[0])
    for drift in DRIFTS:
        numbers, offset = _fit_drift(fitted, drift)
        values = dict(zip((number.name for number in drift.numbers), numbers.tolist(), strict=True))
        yield explain(case, by_drift(drift), (offset @ whole(drift, numbers), case.exact[1]), values)


def _fit_drift(drifting: Drifting, drift: Drift) -> tuple[Array, Array]:
    """Return the numbers of a drift that fit attitudes best, and the turn (3, 3) of the world by which a noisy start is off.

    More and more rows are fitted, because a small error of the rate turns late attitudes by any angle.
    """
    case, numbers, offset, small = drifting.case, np.zeros(len(drift.numbers)), np.eye(3), 1e-6 * drifting.case.scale
    assert case.data[0] is not None
    case.effort.spend(DRIFTING_EFFORT)
    for _ in range(MOST_FITS):
        made = offset @ drifting(drift, numbers)
        apart = _angles(made, case.data[0])
        far = np.flatnonzero(np.linalg.norm(apart, axis=1) > 1)
        near = slice(0, max(int(far[0]), 4) if len(far) else len(apart))
        moved = [_angles(made, offset @ drifting(drift, numbers + small * e))[near] / small for e in np.eye(len(numbers))]
        slopes = np.stack([x.ravel() for x in moved], axis=1)
        if case.free:
            slopes = np.hstack([slopes, np.swapaxes(made, 1, 2)[near].reshape(-1, 3)])
        change = np.linalg.lstsq(slopes, apart[near].ravel(), rcond=None)[0]
        numbers = numbers + change[: len(numbers)]
        offset = Rotation.from_rotvec(change[len(numbers) :]).as_matrix() @ offset if case.free else offset
        if near.stop == len(apart) and np.abs(slopes @ change).max() < 1e-14:
            break
    return numbers, offset if angle_between(offset, np.eye(3)) <= case.allowed[0] else np.eye(3)


def _angles(first: Array, second: Array) -> Array:
    """Return the rotation vectors (n, 3) in body axes from attitudes to others."""
    return Rotation.from_matrix(np.swapaxes(first, 1, 2) @ second).as_rotvec()


def _habits(case: Compared, asked: _Asked) -> Explanations:
    """Yield motions whose state is changed after each step, or that stand still."""
    for standstill in STANDSTILLS:
        yield _standstill(case, standstill)
    for standstill in PART_STANDSTILLS:
        yield _part_standstill(case, standstill)
    w = case.data[1]
    if w is None or len(case.scene.breaks) > MOST_BREAKS:
        return
    before = _rates_before(case)
    rows = w if case.from_row else np.vstack([case.scene.w_WB_B0, w])
    for habit in HABITS:
        numbers = habit.guess(rows[1:], before[-len(rows) + 1 :])
        if not numbers:
            continue
        known = dict(zip((number.name for number in habit.numbers), numbers, strict=True))
        for step in _steps_of(case, habit, known):
            explanation = attempt(case, _at_numbers(by_habit(habit, step), numbers), known=known)
            if explanation is not None:
                yield replace(explanation, trial=by_habit(habit, step), numbers=len(numbers))


def _steps_of(case: Compared, habit: Habit, known: Mapping[str, float]) -> list[float]:
    """Return the step, s, with which a habit explains most of a few rows from the first error on; [] if it explains little."""
    if case.step is not None:
        return [case.step]
    k = int(np.flatnonzero((case.error > case.allowed[:, None]).any(axis=0))[:1].sum())
    begin, gap = max(0, k - 2), float(np.median(np.diff(case.t)))
    R, w = (x[begin] for x in case.exact)
    some = case.take(slice(begin, k + AFTER_ERROR))
    some = replace(some, scene=some.scene.rename("rows", R_WB0=R, w_WB_B0=w), start=float(some.t[0]), free=())
    best = HALF, 0
    for parts in STEPS_OF_HABITS:
        trial = _at_numbers(by_habit(habit, gap / parts), tuple(known.values()))
        explanation = attempt(some, trial, known=known, ranked=True)
        if explanation is None or case.effort.over or (best[1] and parts > 3 * best[1]):
            break
        best = min(best, (explanation.share, parts))
        if explanation.explains:
            break
    return [gap / best[1]] if best[1] else []


def _at_numbers(trial: Trial, numbers: tuple[float, ...]) -> Trial:
    """Return a trial whose numbers are known."""

    def build(case: Compared) -> Solution | None:
        motion = trial.build(case)
        if motion is None:
            return None
        return lambda R, w, p, n: motion(R, w, np.broadcast_to(numbers, (len(R), len(numbers))), n)

    return replace(trial, build=build, numbers=())


def _rates_before(case: Compared) -> Array:
    """Return the rates (n, 3) of exact motions from the row before, or if these are unknown, of the whole exact motion."""
    R, w = case.data
    equations = case.equations()
    gaps = np.diff(case.t)
    R = np.broadcast_to(np.eye(3), (len(case.t), 3, 3)) if R is None and case.scene.free else R
    if R is None or w is None or not equations.steady or np.ptp(gaps) > 1e-6 * gaps.min():
        return case.exact[1]
    case.effort.spend(len(case.t) / 10)
    made = equations.solve(0.0, R[:-1], w[:-1], np.array([gaps.mean()]))[1][:, 0]
    return np.vstack([case.exact[1][:1], made])


def _still_within(case: Compared) -> Array:
    """Return the changes (2,) of attitudes, rad, and relative rates that a body that stands still has by its noise."""
    return np.where(case.noise * SIGMAS > np.maximum(case.rounded, FLOOR), 2 * SIGMAS * case.noise, STILL)


def _first_still(case: Compared, i: int) -> int:
    """Return the first row from which attitudes (0) or rates (1) stand still, as in the last row."""
    x = case.data[i]
    assert x is not None
    apart = np.abs(x - x[-1]).reshape(len(x), -1).max(axis=1) / (case.scale if i else 1.0)
    going = np.flatnonzero(apart > _still_within(case)[i])
    return int(going[-1]) + 1 if len(going) else 0


def _until(case: Compared, k: int) -> Compared:
    """Return the case whose initial state fits the rows before one of them, and is not fitted to the others."""
    before = case.take(slice(0, k))
    if not case.free or k < 4:
        return case
    return replace(case.at(before.fit(exact(before), np.zeros(0), np.zeros(0))[0]), free=())


def _part_standstill(case: Compared, mistake: Standstill) -> Explanation | None:
    """Return the explanation by attitudes or rates that stand still from a time on while the others go on."""
    i = int(mistake.of or 0)
    if case.data[0] is None or case.data[1] is None or case.step is not None:
        return None
    k, x = _first_still(case, i), case.data[i]
    assert x is not None
    rest = i == 1 and bool(np.abs(x[k:]).max() <= _still_within(case)[1] * case.scale)
    if len(case.t) - k < 3 or mistake.rest != (0.0 if rest else 1.0) or (case.error[i, k:] <= case.allowed[i]).all():
        return None
    case = _until(case, k)

    def build(of: Compared) -> Solution | None:
        motion, equations = exact(of), of.equations()

        def frozen(R: Array, w: Array, p: Array, n: int) -> tuple[Array, Array]:
            t = np.minimum(of.t[:n], np.clip(p[:, :1], of.start, None))
            last = equations.flow(of.start, R, w, float(max(t.max(), of.start)) + 1e-9 * (of.t[-1] - of.start)).at_own_times(t)
            going = motion(R, w, np.zeros((len(R), 0)), n)
            rates = np.where((of.t[:n] > p[:, :1])[..., None], mistake.rest, 1.0) * last[1]
            return (last[0], going[1]) if i == 0 else (going[0], rates)

        return frozen

    trial = Trial((mistake,), build, mistake.numbers, anew=lambda other: _part_standstill(other, mistake))
    if k == 0 or rest:
        stop = float(case.t[k])  # between two rows
        known = {"time": stop}
        explanation = attempt(case, _at_numbers(trial, (0.5 * (stop + case.t[k - 1]) if k else stop,)), known=known)
        return None if explanation is None else replace(explanation, trial=trial, numbers=min(k, 1))
    return attempt(case, trial, [float(case.t[k - 1] + case.t[k]) / 2])


def _standstill(case: Compared, mistake: Standstill) -> Explanation | None:
    """Return the explanation by a body that stands still from a time on; None if the rows do not."""
    R, w = case.data
    k = max(_first_still(case, i) for i in range(2) if case.data[i] is not None)
    rest = w is None or bool(np.abs(w[k:]).max() <= _still_within(case)[1] * case.scale)
    if (
        len(case.t) - k < 3
        or (w is not None and mistake.rest != (0.0 if rest else 1.0))
        or (w is None and mistake.rest and not mistake.from_start)
    ):
        return None
    start = _still(case)
    stays_at_start = R is not None and k == 0 and case.apart((np.broadcast_to(R[0], R.shape), start[1]), start)[0] <= STILL
    if mistake.from_start != stays_at_start or (R is None and not rest):
        return None
    stop, case = float(case.t[k]), _until(case, k)

    def build(of: Compared) -> Solution | None:
        equations = of.equations()

        def motion(R: Array, w: Array, p: Array, n: int) -> tuple[Array, Array]:
            at = np.clip(p[:, :1] if p.shape[1] else of.start, of.start, None)
            t = np.minimum(of.t[:n], at) if p.shape[1] else np.full((len(R), n), of.start)
            flow = equations.flow(of.start, R, w, float(max(t.max(), of.start)) + 1e-9 * (of.t[-1] - of.start))
            a, b = flow.at_own_times(t)
            return a, np.where((of.t[:n] >= stop)[:, None], mistake.rest, 1.0) * b

        return motion

    trial = Trial((mistake,), build, mistake.numbers, anew=lambda other: _standstill(other, mistake))
    if R is None or mistake.from_start:  # rates alone do not show when, between two rows, the body stopped
        known = {number.name: stop for number in mistake.numbers}
        explanation = attempt(case, _at_numbers(trial, tuple(known.values())), known=known)
        return None if explanation is None else replace(explanation, trial=trial)
    return attempt(case, trial, [stop if k == 0 else float(case.t[k - 1] + case.t[k]) / 2])


def _rows(case: Compared, asked: _Asked) -> Explanations:
    """Yield right motions of which some rows are written wrongly: every n-th, or where the quaternion changes its sign."""
    error = (case.error / case.allowed[:, None]).max(axis=0)
    off = _off_rows(error)
    if off is None:
        return
    rest = ~off
    noise = np.maximum(np.sqrt((case.error[:, rest] ** 2).mean(axis=1)), 1e-13)
    allowed = np.maximum(1e-9, np.minimum(case.allowed, 10 * noise))
    fine = case.change(noise=noise, allowed=allowed)
    places, q = np.flatnonzero(off), to_quaternion(case.exact[0])
    signs = (q[1:] * q[:-1]).sum(axis=1) < 0 if case.flipped is None else case.flipped[1:]  # the scalar is not negative
    near = bool(signs.any()) and all(np.abs(np.flatnonzero(signs) + 1 - k).min() <= 1 for k in places)
    gaps = np.diff(places)
    periodic = len(places) > 2 and np.ptp(gaps) == 0
    for row in ROWS:
        if periodic if row.periodic else near:
            made: Any = row.change(case.exact, case.data, off)
            values = {"first": float(places[0] * case.stride + 1)}
            values |= {"period": float(gaps[0] * case.stride)} if row.periodic else {"rows": float(len(places))}
            yield explain(fine, Trial((row,), _nowhere), made, values, numbers=len(values) - (not row.periodic) + row.any)
    if not periodic and not near:
        worst = float(case.error[:, places[0]].max())
        values = {"row": float(places[0] * case.stride + 1), "time": float(case.t[places[0]]), "error": worst}
        made = any_values(case.exact, case.data, off)
        # Rows with any values explain much: this ranks behind all explanations by fitted numbers.
        yield explain(fine, Trial((BY_KEY["single rows"],), _nowhere), made, values, numbers=9)


def _off_rows(error: Array) -> Any:
    """Return which rows are off, if all others are much nearer: every n-th row, n up to 6, or up to a tenth of all rows."""
    n = len(error)
    for period in range(2, 7):
        for first in range(period):
            off = np.arange(n) % period == first
            if off.sum() > 3 and np.median(error[off]) > 100 * error[~off].max():
                return off & (error > 10 * error[~off].max())
    order = np.sort(error)
    small = order[: int(0.9 * n)].max()
    off = error > 100 * max(small, 1e-6)
    return off if 0 < off.sum() <= 0.1 * n else None


def _sensors(case: Compared, asked: _Asked) -> Explanations:
    """Yield rates and attitudes in axes that are turned against each other, and rates of another size or with a bias."""
    R, w = case.data
    if R is None or w is None or len(case.scene.breaks) > MOST_BREAKS:
        return
    turns = Rotation.from_matrix(np.swapaxes(R[:-1], 1, 2) @ R[1:]).as_rotvec() / np.diff(case.t)[:, None]
    w = (w[1:] + w[:-1]) / 2
    for key, sign, of in (("rates in turned axes", 1.0, 1), ("rates in mirrored axes", -1.0, 1), ("turned attitudes", 1.0, 0)):
        U, _, V = np.linalg.svd((sign * w).T @ turns)  # sign w = C' turns
        C = V.T @ np.diag([1, 1, np.linalg.det(U @ V)]) @ U.T
        turn = Rotation.from_matrix(C if of else C.T).as_rotvec()
        best = attempt(case, compose(BY_KEY[key]), turn.tolist(), most=20)
        yield best and _shortest_turn(best)
    yield attempt(case, compose(BY_KEY["bias of the rates"]), (w - turns).mean(axis=0).tolist(), most=20)
    size = float((w * turns).sum() / ((turns * turns).sum() or 1.0))
    yield attempt(case, compose(BY_KEY["size of the rates"]), [size], most=20) if abs(size) > 1e-3 else None


def _turned_axes(case: Compared, asked: _Asked) -> Explanations:
    """Yield turned axes of the world or of the body, from the best of 24 directions."""
    if len(case.scene.breaks) > MOST_BREAKS:
        return
    if case.data[0] is not None and not (case.from_row and case.scene.free):  # it moves equally in any axes of the world
        yield _best_turn(case, *_turns_of_world(case))
    yield _best_turn(case, compose(BY_KEY["body axes"]), Rotation.create_group("O").as_rotvec())


def _turns_of_world(case: Compared) -> tuple[Trial, Array]:
    """Return the trial of a turned world and turns to start with, of two numbers if the field is uniform."""
    mistake = BY_KEY["turned world"]
    if not isinstance(case.scene.potential, UniformGravity) or case.scene.loads:
        return compose(mistake), Rotation.create_group("O").as_rotvec()
    angles = np.arange(8) * np.pi / 4
    around = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    turns = np.vstack([np.zeros((1, 2)), around * np.pi / 2, around[:3:2] * np.pi])
    return compose(replace(mistake, numbers=mistake.numbers[:2])), turns


def _best_turn(case: Compared, trial: Trial, turns: Array) -> Explanation | None:
    """Return the explanation by a turn that is nearest to one of several."""
    near, n = case.first(3.0, 10), len(turns)
    motion = trial.build(near)
    assert motion is not None
    many = np.broadcast_to(case.scene.R_WB0, (n, 3, 3)), np.broadcast_to(case.scene.w_WB_B0, (n, 3))
    left = np.linalg.norm(near.differences(*motion(*many, turns, len(near.t))), axis=(1, 2))
    known = {number.name: 0.0 for number in TURN[len(trial.numbers) :]}
    explanations = [attempt(case, trial, turns[k].tolist(), most=30, known=known) for k in np.argsort(left, kind="stable")[:3]]
    shortest = [_shortest_turn(explanation) for explanation in explanations if explanation is not None]
    return min(
        shortest,
        key=lambda explanation: (round(explanation.share, 3), np.linalg.norm([*explanation.values.values()])),
        default=None,
    )


def _shortest_turn(explanation: Explanation) -> Explanation:
    """Return an explanation by a turn of at most half a revolution."""
    turn = Rotation.from_rotvec([*explanation.values.values()]).as_rotvec().tolist()
    values, trial = dict(zip(explanation.values, turn, strict=True)), explanation.trial
    return replace(explanation, values=values, sentence=explanation.sentence if trial is None else trial.sentence(values))


def _bodies(case: Compared, asked: _Asked) -> Explanations:
    """Yield other first rows and other bodies."""
    if len(case.scene.breaks) > MOST_BREAKS:
        return
    if case.from_row:
        have = [*range(3)] * (case.data[0] is not None) + [*range(3, 6)] * (case.data[1] is not None)
        rest = replace(case.take(slice(1, None)), free=tuple(have), start=case.start)
        if len(rest.t) > 3:
            initial, _extra, fitted = rest.fit(exact(rest), np.empty(0), np.empty(0))
            names = [f"start_{kind}_{i}" for kind in ("turn", "rate") for i in (1, 2, 3)]
            values = {names[i]: float(initial[i]) for i in have}
            explanation = explain(replace(rest, free=()), Trial((BY_KEY["first row"],), _nowhere), fitted, values)
            yield replace(explanation, numbers=len(have), explains=explanation.explains and explanation.size < 100)
    moments = fit_moments(case)
    sentence = BY_KEY["other moments"].sentence.format(text=moments.sentence)
    yield replace(moments, sentence=sentence)
    if not moments.explains:
        yield _other_body(case)


def fit_moments(case: Compared) -> Explanation:
    """Return the explanation by other principal moments in the same axes, ratios only if the motion depends on no more.

    The sentence has intervals of two standard deviations for the noise of the rows.
    """
    body, ratios = case.scene.body, case.scene.free and case.scene.body.rotor_momentum is None
    have = [*range(3)] * (case.data[0] is not None) + [*range(3, 6)] * (case.data[1] is not None)
    case = case.first(LONGEST, FEWEST)
    case = replace(case.take(slice(None, None, -(-len(case.t) // MOST))), free=tuple(have))

    def inertia(p: Array) -> Array:
        return body.R_BP @ np.diag(body.moments * np.exp(np.clip([*[0.0] * ratios, *p], -3, 3))) @ body.R_BP.T

    initial, p, made = case.fit(motion_with_inertia(case, inertia), np.zeros(3 - ratios), np.full(3 - ratios, 1e-5))
    unit = body.moments[0] if ratios else 1.0
    moments, own = np.diag(body.R_BP.T @ inertia(p) @ body.R_BP) / unit, " : ".join(f"{x:.4g}" for x in body.moments / unit)
    off = [0.0] * ratios + (2 * case.deviations(motion_with_inertia(case, inertia), np.append(initial, p), 1e-5)[6:]).tolist()
    fitted = " : ".join(f"{x:.6g}" + f" ± {x * d:.1g}" * (d > 0) for x, d in zip(moments, off, strict=True))
    text = (
        f"The principal moments that fit the rows best {'have the ratios' if ratios else 'are'} {fitted} (of the body: {own})"
    )
    # The 0 is a placeholder: the sentence is formatted later.
    explanation = explain(case, Trial((BY_KEY["other moments"],), _nowhere), made, {"text": 0.0}, numbers=len(p))
    return _possible(replace(explanation, sentence=text, values=_components(inertia(p))))


def _components(inertia: Array) -> dict[str, float]:
    return dict(zip(_INERTIA, inertia[np.triu_indices(3)].tolist(), strict=True))


def _possible(explanation: Explanation) -> Explanation:
    """Return an explanation by another inertia, which explains nothing if no body has it."""
    moments = np.linalg.eigvalsh(np.array([*explanation.values.values()])[[[0, 1, 2], [1, 3, 4], [2, 4, 5]]])
    return replace(explanation, explains=explanation.explains and bool(2 * moments.max() < (1 + 1e-6) * moments.sum()))


def motion_with_inertia(case: Compared, inertia: Callable[[Array], Array]) -> Solution:
    """Return the motion as a function of initial states and the numbers of an inertia."""

    def motion(R: Array, w: Array, p: Array, n: int) -> tuple[Array, Array]:
        scenes = [with_inertia(case.scene, inertia(numbers)) or case.scene for numbers in p]
        made = [case.equations(scene).solve(case.start, R[[i]], w[[i]], case.t[:n]) for i, scene in enumerate(scenes)]
        return np.concatenate([a for a, _ in made]), np.concatenate([b for _, b in made])

    return motion


def stretched(J: Array, same_trace: bool) -> Callable[[Array], Array]:
    """Return the function from six numbers to an inertia (3, 3): J for zeros; with `same_trace` all have the trace of J."""

    def inertia(p: Array) -> Array:
        stretch = expm(np.clip(p, -3, 3)[[[0, 1, 2], [1, 3, 4], [2, 4, 5]]])
        made = stretch @ J @ stretch
        return made * (np.trace(J) / np.trace(made)) if same_trace else made

    return inertia


def _other_body(case: Compared) -> Explanation | None:
    """Return the explanation by another inertia; None if none can explain the first rows."""
    free = case.scene.free and case.scene.body.rotor_momentum is None
    inertia = stretched(case.scene.body.inertia, free)
    mistake = BY_KEY["another body"]
    numbers = tuple(Number(f"stretch_{name}") for name in _INERTIA)
    trial = Trial((mistake,), lambda of: motion_with_inertia(of, inertia), numbers)
    explanation = attempt(case, replace(trial, mistakes=(replace(mistake, sentence=""),)))  # its sentence has no fitted number
    if explanation is None:
        return None
    (a, b, c), (d, e, f) = (
        (made := inertia(np.array([*explanation.values.values()])))[[0, 1, 2], [0, 1, 2]],
        made[[0, 0, 1], [1, 2, 2]],
    )
    text = f"the inertia ({a:.6g}, {b:.6g}, {c:.6g}; {d:.6g}, {e:.6g}, {f:.6g}) kg m^2" + " or a multiple of it" * free
    return _possible(replace(explanation, sentence=mistake.sentence.format(text=text), values=_components(made), trial=None))


def _steps(case: Compared, asked: _Asked) -> Explanations:
    """Yield integrators, of the scene whose number was fitted best if it leaves little, or of the scene."""
    sized = [
        explanation
        for explanation in asked.tried
        if explanation.keys[1:] == () and "factor" in explanation.values and explanation.rest < LITTLE
    ]
    for fitted in sorted(sized, key=lambda explanation: (explanation.size, explanation.keys))[:1]:
        mistake = BY_KEY[fitted.keys[0]]
        if not isinstance(mistake, SceneMistake) or fitted.explains:
            continue
        explanations = [*_steps_in(case, {mistake: fitted.values["factor"]})]
        yield from explanations
        if any(explanation is not None and explanation.explains for explanation in explanations):
            return
    if not any(explanation.explains for explanation in asked.tried):
        yield from _steps_in(case, {})


Sizes = Mapping[SceneMistake, float]
"""Factors of numbers of a scene."""


def _steps_in(case: Compared, sizes: Sizes) -> Explanations:
    """Yield integrators of a scene whose numbers have other sizes.

    If an integrator leaves little, these and other sizes are fitted to what it leaves, and it runs again. A size that was
    fitted without the integrator has a part of its error: the integrator is the one that explains most beside all sizes.
    """
    best: Explanation | None = None
    if sizes:
        if (scene := _resize(case.scene, sizes)) is None:
            return
        of_scene = replace(case, scene=scene)
        linear = Linearised(of_scene, [*_columns(of_scene).values()])
        left, parts, _, integrator = linear.rank()[0]
        if left > LITTLE:
            return
        made = linear.errors(integrator.step, parts)
        sizes = _refine(of_scene, linear.away[: linear.used] - made, sizes)
        trial: Trial | None = by_step(integrator, parts)
        best = _attempt_steps(case, sizes, trial, float(case.t[1] - case.t[0]) / parts)
        yield best
    else:
        for explanation in find_steps(case):
            yield explanation
            if best is None or (not explanation.explains, explanation.share) < (not best.explains, best.share):
                best = explanation
        trial = None if best is None else best.trial
    for _ in range(REFINED):
        if best is None or best.explains or best.share > NEARLY or trial is None or best.made is None:
            return
        rows = replace(case, scene=_resize(case.scene, sizes) or case.scene).take(slice(0, len(best.made[0])))
        R, w = (x if y is None else y for x, y in zip(best.made, rows.data, strict=True))
        sizes = _refine(rows, differ(*best.made, R, w, rows.scale), sizes)
        best = _attempt_steps(case, sizes, trial, best.values["step"])
        yield best


def _attempt_steps(case: Compared, sizes: Sizes, trial: Trial | None, step: float) -> Explanation | None:
    """Return the explanation by an integrator in the scene whose numbers have other sizes."""
    scene = _resize(case.scene, sizes)
    if scene is None or trial is None:
        return None
    explanation = attempt(replace(case, scene=scene), trial, known={"step": step}, ranked=True)
    return None if explanation is None else _in_sizes(case, sizes, explanation)


def _resize(scene: Scene, sizes: Sizes) -> Scene | None:
    """Return the scene with other sizes of its numbers; None if it has not all of them."""
    for mistake, factor in sizes.items():
        other = scene if factor == 1 else mistake.change(scene, factor)
        if other is None:
            return None
        scene = other
    return scene


def _columns(case: Compared) -> dict[SceneMistake, Array]:
    """Return the differences (n, 6) that the size of each number of the scene makes, to first order, for a change of 1."""
    out = dict[SceneMistake, Array]()
    for mistake in SIZES:
        other = mistake.change(case.scene, 1 + SMALL_SHARE)
        if other is not None:
            made = truth(other, case.start, case.t)
            out[mistake] = differ(*case.exact, *made, case.scale) / SMALL_SHARE
    return out


def _refine(case: Compared, left: Array, sizes: Sizes) -> Sizes:
    """Return the fewest sizes of numbers of the scene that explain, to first order, differences (n, 6) of the first rows.

    `sizes` are the ones of the case so far.
    """
    some = case.take(slice(0, len(left)))
    weights = np.repeat([float(x is not None) for x in some.data] / some.noise, 3)
    wanted, flow = (left * weights).ravel(), linearise(some)[2]
    starts = [(flow[:, :, k] * weights).ravel() for k in some.free]
    columns = {mistake: (x * weights).ravel() for mistake, x in _columns(some).items()}
    fits = list[tuple[float, tuple[SceneMistake, ...], Any]]()
    for count in range(len(columns) + 1):
        for chosen in combinations(columns, count):
            matrix = np.stack([*(columns[mistake] for mistake in chosen), *starts, 0 * wanted], axis=1)
            numbers = np.linalg.lstsq(matrix, wanted, rcond=None)[0]
            fits.append((float(np.linalg.norm(wanted - matrix @ numbers)), chosen, numbers))
    _, chosen, numbers = next(fit for fit in fits if fit[0] <= 2 * min(size for size, *_ in fits))
    changes = dict(zip(chosen, numbers.tolist(), strict=False))
    return {
        mistake: sizes.get(mistake, 1.0) * (1 + changes.get(mistake, 0.0))
        for mistake in SIZES
        if mistake in {**sizes, **changes}
    }


def _in_sizes(case: Compared, sizes: Sizes, explanation: Explanation) -> Explanation:
    """Return an explanation in a scene with other sizes of its numbers as an explanation of the case in its own scene."""
    trial = explanation.trial
    if not sizes or trial is None or explanation.made is None:
        return explanation
    named = [
        replace(mistake, sentence=mistake.sentence.format(factor=factor) + _digits_of(case.scene, mistake, factor), numbers=())
        for mistake, factor in sizes.items()
    ]
    both = Trial((*named, *trial.mistakes), _in_scene(sizes, trial))
    rows = case.take(slice(0, len(explanation.made[0])))
    values = {f"factor {i}" if i else "factor": factor for i, factor in enumerate(sizes.values())}
    return explain(rows, both, explanation.made, values | explanation.values)


def _in_scene(sizes: Sizes, trial: Trial) -> Callable[[Compared], Solution | None]:
    """Return the motion of a trial in the scene with other sizes of its numbers."""

    def build(case: Compared) -> Solution | None:
        other = _resize(case.scene, sizes)
        return None if other is None else trial.build(replace(case, scene=other))

    return build


def _several(case: Compared, asked: _Asked) -> Explanations:
    """Yield two to four mistakes of a program at once: of its scene or equations, attitudes, rates and times."""
    if case.step is None or any(explanation.explains for explanation in asked.tried):
        return
    moved = [(), *((mistake,) for mistake in _without_numbers((*SCENES, *EQUATIONS)) if mistake.kind in asked.kinds)]
    times = [(), *((time,) for time in TIMES if not time.numbers and fits(time, case))] if "times" in asked.kinds else [()]
    readings = [(), *_usable_readings(case, asked.quaternion)] if "readings" in asked.kinds else [()]
    ranked = []
    start = case.scene.R_WB0[None], case.scene.w_WB_B0[None], np.zeros((1, 0)), len(case.t)
    for first, second in product(moved, times):
        if second and second[0].unit and not case.allowed.max() < case.turned * second[0].unit <= LONGEST:
            continue
        motion = compose(*first, *second).build(case) if first or second else exact(case)
        if motion is None:
            continue
        case.effort.spend(1 + case.turned)
        R, w = motion(*start)
        R, w = R[0], w[0]
        for third in readings:
            a, b = R, w
            for reading in third:
                a, b = reading.write(a, b)
            if len(mistakes := (*first, *second, *third)) > 1:
                ranked.append((len(mistakes), case.size(case.errors(a, b)), mistakes))
    allowed = float((case.allowed / case.noise).max())

    def rank(candidate: tuple[int, float, Any]) -> tuple[float, float]:
        number, left, _ = candidate
        return max(left, allowed) * 10**number, left  # one mistake more has to leave less than a tenth

    for _, _, mistakes in sorted(ranked, key=rank)[:3]:
        yield attempt(case, compose(*mistakes))


@dataclass(frozen=True)
class Search:
    """A part of the search, which finds explanations of some kinds.

    `share` is the part of `EFFORT` that is added when this part begins. If it `ends` the search, mistakes that explain the
    error end it after this part. `whole` is True for a part that takes rows at any angle; `least` is the number of rows that it
    needs.
    """

    find: Callable[[Compared, _Asked], Explanations]
    kinds: frozenset[str]
    share: float
    ends: bool = False
    whole: bool = False
    least: int = 4


SEARCHES = {
    "units of time": Search(_units, frozenset({"times"}), 0.05, ends=True, whole=True, least=1),
    "other equations": Search(_changes, frozenset({"scenes", "equations"}), 0.3),
    "other readings": Search(_readings, frozenset({"readings"}), 0.2, ends=True),
    "habits": Search(_habits, frozenset({"habits"}), 0.1, least=1),
    "resampled rows": Search(lambda case, asked: find_resampled(case), frozenset({"rows"}), 0.05, ends=True, whole=True),
    "wrong rows": Search(_rows, frozenset({"rows"}), 0.01, ends=True),
    "other times": Search(_times, frozenset({"times"}), 0.1),
    "axes and sizes of rates": Search(_sensors, frozenset({"readings"}), 0.1),
    "digits of the scene": Search(lambda case, asked: find_scene_digits(case), frozenset({"scenes"}), 0.05, ends=True),
    "fitted numbers": Search(_numbers, frozenset({"scenes", "equations"}), 0.15),
    "attitudes from rates": Search(_attitudes, frozenset({"attitudes"}), 0.3, ends=True),
    "drifting attitudes": Search(_drifts, frozenset({"attitudes"}), 0.1, ends=True),
    "integrators": Search(_steps, frozenset({"steps"}), 0.25, ends=True),
    "several mistakes": Search(_several, frozenset({"readings", "times", "scenes", "equations"}), 0.1, ends=True),
    "other axes": Search(_turned_axes, frozenset({"readings"}), 0.1),
    "other bodies": Search(_bodies, frozenset({"bodies"}), 0.1),
}
"""Parts of the search by the work that they do, in their order."""
