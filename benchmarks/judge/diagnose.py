"""The judgement of a recorded motion: errors over time, and the hypothesis that explains them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain, combinations, product
from typing import Any

import numpy as np
import pandas as pd
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from conservative.attitude import Array, from_quaternion, to_quaternion
from conservative.body import RigidBody
from conservative.check import replace_unchecked
from conservative.errors import BadInput, TorqueFailed
from conservative.flight import rotation_only
from conservative.invariants import find_energy, kinetic_energy, sizes
from conservative.needs import IN_TIME, Need, join
from conservative.potentials.load import FRAMES
from conservative.potentials.turning import Turning, static_part
from conservative.references.engine import principal_axes
from conservative.references.solvers.scipy import Derivative, state_derivative, wheel_rates
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from .motion import Compared, States
from .table import Recording

NUMERICAL, LONGEST, NEAR = 1000.0, 100.0, 3.0  # rad: angles that are compared without a closed form, explained, fitted first
FEWEST, MOST, STEPS = 100, 1000, 20_000  # rows that are explained, even over a larger angle; steps of a textbook method
ROUND_OFF, FLOOR, FAR = 1e-10, 1e-12, 0.05  # errors that need no explanation, that are equally good, of another motion
EXPLAINED, FIRST_ROW = 0.5, 0.05  # largest shares of the error that are left, the second by another first row or scene
CHANGE, LIMIT = 1e-6, 3.2  # of fitted numbers: for slopes, and their largest size
ACCURACY, FITTING = 10.0, 1e-11  # allowed error over that of a numerical solution; its tolerance while numbers are fitted
MOST_BREAKS = 50  # of loads, if numbers are fitted: some hundred integrations, each of which starts again at every break
READINGS = {
    "transposed": "The attitudes are transposed, or the quaternions conjugated: they map world to body",
    "order xyzw": "The quaternion order is xyzw, but was read as wxyz: correct the names of the columns or --quaternion",
    "order wxyz": "The quaternion order is wxyz, but was read as xyzw: correct the names of the columns or --quaternion",
    "world rates": "The rates are in world axes; --rates world converts them",
}
TURN = "The body axes of the file are not those of the body: turn them by ({turn_1:.5g}, {turn_2:.5g}, {turn_3:.5g}) rad"
BODY = "It is the motion of another body, with principal moments {moments}. Correct --body"
FIRST = "The first row does not fit the others: the motion starts at another attitude or other rates"
NO_TERM = "The gyroscopic term is missing: without a torque the angular velocity is constant"
DAMPED = "The rates are damped by {damping:.4g} per second{more}"
FITTED: dict[str, tuple[str, Sequence[str]]] = {
    "time shift": ("Constant time shift: the file is {shift:+.4g} s ahead of the exact motion", ("shift",)),
    "phase drift": ("Phase drift of order 1: {rate:+.3g} s per second too fast, in proportion to time", ("shift", "rate")),
    "damped": (DAMPED, ("damping",)),
    "no gyroscopic term": (NO_TERM, ()),
    "no gyroscopic term, damped": (f"{NO_TERM}. {DAMPED}", ("damping",)),
    "body axes": (TURN, [f"turn_{i}" for i in (1, 2, 3)]),
    "another body": (BODY, [f"stretch_{ij}" for ij in (11, 12, 13, 22, 23, 33)]),
    "first row": (FIRST, [f"start_{name}_{i}" for name in ("turn", "rate") for i in (1, 2, 3)]),
}
"""Sentences of the hypotheses with fitted numbers, and the names of these."""


def _rates_first(f: Derivative, t: float, y: Array, h: float, corrections: int) -> Array:
    """Return the state after a step of a game engine, with so many corrections of the gyroscopic torque."""
    new = y.copy()
    for _ in range(corrections):
        new[4:] = y[4:] + h * f(t, new)[4:]
    new[:4] += h * f(t, new)[:4]
    return new


TEXTBOOK: dict[str, tuple[int, Callable[..., Array]]] = {
    "explicit Euler": (1, lambda f, t, y, h, _: y + h * f(t, y)),
    "semi-implicit Euler with an explicit gyroscopic term": (1, lambda f, t, y, h, _: _rates_first(f, t, y, h, 1)),
    "semi-implicit Euler with an implicit gyroscopic term": (1, lambda f, t, y, h, _: _rates_first(f, t, y, h, 8)),
    "Adams-Bashforth 2 (first step Euler)": (2, lambda f, t, y, h, before: y + h * (1.5 * f(t, y) - 0.5 * before)),
    "Heun's method": (2, lambda f, t, y, h, _: y + h / 2 * (f(t, y) + f(t + h, y + h * f(t, y)))),
}
"""Orders and steps of methods: from derivative, time, s, state, step, s, and the slope a step before to the next state."""


@dataclass(frozen=True)
class Explanation:
    """A hypothesis that was tried: its name, the sentence that it states about the file, and its fitted numbers in SI units.

    `left` and `plain` are the largest errors with it and without it, over the rows that it was tried on: of attitudes, rad, and
    of rates, relative to the largest. `share` is the share of the error that is left.
    """

    name: str
    sentence: str
    values: dict[str, float]
    left: list[float]
    plain: list[float]
    share: float


def judge(scene: Scene, recording: Recording, from_row: bool, allowed: float) -> tuple[dict[str, Any], pd.DataFrame]:
    """Return the summary of a recording as a motion of a scene, and rows of t, quantity and value.

    Times of the file are those of the scene. The exact motion has the state of the first row at its time, or the scene's
    initial state at t = 0. The summary has the largest errors, of attitudes, rad, and of rates, relative to the largest; the
    unit of each in the file and its size, 0 if the file has none; and the diagnosis. Rows are compared as long as a numerical
    solution is ten times as accurate as `allowed`. Raises `BadInput` for times at which a load of the scene has no value, and
    if a numerical solution is not as accurate in two rows.
    """
    (case, notes), (R, w) = _read(rotation_only(scene), recording, from_row), recording.data
    if not case.closed:
        case = case.first(NUMERICAL, 2)
        case = case.take(slice(0, int(np.searchsorted(case.own_error, allowed / ACCURACY))))
        if len(case.t) < 2:
            got = f"{allowed:g}, of which a numerical solution has more than a tenth in the second row"
            raise BadInput("error", got, "a larger error: no closed form is known for this scene")
        own = f"whose own error is at most {max(case.own_error[-1], FLOOR):.1g}"
        notes.append(f"Rows to {case.t[-1]:g} s are compared with a numerical solution, {own}: no closed form is known.")
    if recording.ignored:
        names = ", ".join(recording.ignored)
        notes.append(f"{names} are not judged. If these angles turn body to world, name their sequence: --euler zyx.")
    named, tried = diagnose(case, recording.norm is not None)
    if tried and (corners := len(case.scene.breaks)) > MOST_BREAKS:
        notes.append(f"Hypotheses with fitted numbers are not tried: the loads have {corners} jumps and corners.")
    (R, w), error = case.data, case.error.max(axis=1).tolist()
    rates = ("deg/s", float(np.degrees(case.scale))) if recording.degrees else ("rad/s", case.scale)
    units = [("rad", float(R is not None)), (rates[0], rates[1] * (w is not None))]
    of = zip(("attitude", "rate"), units, case.error, strict=True)
    series: dict[str, Array] = {f"{name} error, {unit}": errors * size for name, (unit, size), errors in of if size}
    series |= _drifts(case)
    if w is not None and case.torque_free and max(error) > FAR:
        J, L = np.sort(case.scene.body.moments), np.linalg.norm(case.scene.body.momentum(w), axis=1)
        gap = np.abs(kinetic_energy(case.scene.body, w) * 2 * J[1] / L**2 - 1)
        if gap[-len(gap) // 10 :].max() < 0.1 * gap[0]:
            notes.append("The energy approaches L^2/(2 I2): intermediate axis instability is created by the integrator.")
    if recording.norm is not None:
        series["quaternion norm, minus 1"] = np.abs(recording.norm - 1)[: len(case.t)]
    quantities = [{"quantity": name, "largest": float(x.max()), "final": float(x[-1])} for name, x in series.items()]
    rows = pd.concat(pd.DataFrame({"t": case.t, "quantity": name, "value": x}) for name, x in series.items())
    found = {"quantities": quantities, "diagnosis": named, "tried": tried, "notes": notes}
    return {"error": error, "units": units, **found}, rows


def _read(scene: Scene, recording: Recording, from_row: bool) -> tuple[Compared, list[str]]:
    """Return the case of a recording, and notes on its rows."""
    (R, w), t, first = recording.data, recording.t, float(recording.t[0])
    timed = bool(scene.loads or scene.needs & IN_TIME)
    if first < 0 and (timed or not from_row):
        raise BadInput("run", f"a first row at {first:g} s", "times of the scene, from 0 on")
    if timed:  # its loads need values in all rows
        scene = scene.rename(scene.name, t_end=max(scene.t_end, float(t[-1])))
    elif from_row:  # sums of steps and a large time would lose digits
        t = t - first
    whole = Compared(scene, t, (None, None), from_row, float(t[0]) if from_row else 0.0)
    case, notes = whole.read(R, w), [f"{len(t):,} of {recording.rows:,} rows are compared."]
    if first != 0 and not from_row:
        notes.append(f"The first row is compared with the motion of the scene at {first:g} s.")
    elif first != 0 and (w is None or (R is None and not case.torque_free)):
        missing = "attitudes" if R is None else "rates"
        notes.append(f"Without {missing} in the file, the first row, at {first:g} s, gets the scene's at t = 0. See --start.")
    if not recording.order_known and R is not None:
        other = whole.read(from_quaternion(np.roll(to_quaternion(R), 1, axis=1)), w)
        case, order = min((case, "wxyz"), (other, "xyzw"), key=lambda each: float(each[0].error.max()))
        notes.append(f"The order of the quaternions is not named; {order} fits better.")
    return case, notes


def _drifts(case: Compared) -> dict[str, Array]:
    """Return the drifts (n,) of the invariants that the data determine. Balances also need the work of the loads."""
    (R, w), drifts = case.data, dict[str, Array]()
    energy = None if case.scene.potential else find_energy(case.scene.invariants)  # rates alone determine that of a free body
    for each in case.scene.invariants if w is not None else ():
        if w is not None and each.supplied is None and (R is not None or each is energy):
            R_WB = np.broadcast_to(np.eye(3), (len(w), 3, 3)) if R is None else R
            drift = Trajectory(case.scene, case.t, R_WB, w, "file").drift(each)
            # The initial value is that at t = 0, and the field may have turned until the first row.
            drifts[f"drift of {each.name}"] = sizes(drift - drift[0] if case.from_row else drift)
    return drifts


def diagnose(whole: Compared, quaternion: bool) -> tuple[Explanation | None, list[Explanation]]:
    """Return the hypothesis that explains the error, if any, and all that were tried, best first.

    The best hypothesis is named if it leaves at most half of the error. One that needs fewer numbers is preferred if it leaves
    at most twice as much. A missing part of the scene is named if that leaves a twentieth. None is named if the noise of the
    first row explains the error as well. `quaternion` is True if the order of quaternions can be wrong.
    """
    case = whole.first(LONGEST, FEWEST)
    case = case.take(slice(None, None, -(-len(case.t) // MOST)))
    tried: list[Explanation] = []
    if case.error.max() <= ROUND_OFF:
        return None, tried
    parts = list(_parts(case))
    few = len(case.scene.breaks) <= MOST_BREAKS
    fits = (_fitted(case, name) for name in list(FITTED)[:-1] if few or not FITTED[name][1])
    for each in chain(parts, _readings(case, quaternion), _steps(case), fits):
        tried.append(each)
        if explained := max(each.left) <= ROUND_OFF:  # a turned free body is also another body: the order matters
            break
    named = tried
    if case.from_row and few and not explained:
        start = _fitted(case, "first row")
        if max(map(abs, start.values.values())) <= max(start.left):
            named = [each for each in tried if max(each.left) <= EXPLAINED * max(start.left)]
        elif start.share <= FIRST_ROW < min(each.share for each in tried):
            named = [start]
        tried = [*tried, start]
    proven = {each.name for each in parts}
    named = [each for each in named if each.share <= (FIRST_ROW if each.name in proven else EXPLAINED)]
    least = min((max(*each.left, FLOOR) for each in named), default=0.0)
    good = [each for each in named if max(each.left) <= 2 * least]
    return min(good, key=lambda each: (len(each.values), each.share), default=None), sorted(tried, key=lambda each: each.share)


def _explain(case: Compared, name: str, text: str, values: dict[str, float], read: Compared, motion: States) -> Explanation:
    """Return the explanation by a hypothesis: a reading of the file, and the motion next to it."""
    left, plain = read.errors(motion).max(axis=1).tolist(), case.error.max(axis=1).tolist()
    moments, given = np.sort(read.scene.body.moments), case.scene.body.moments
    moments = moments * (sum(given) / sum(moments) if case.torque_free else 1.0)
    listed = ", ".join(f"{each:.6g}" for each in moments) + " kg m^2" + ", or multiples" * case.torque_free
    more = ", in addition to the damping of the scene" * (Need.DAMPING in case.scene.needs)
    text = text.format(**values, moments=listed, more=more)
    return Explanation(name, text, values, left, plain, max(left) / max(*plain, FLOOR))


def _fitted(case: Compared, name: str) -> Explanation:
    """Return the finding of a hypothesis of `FITTED`, whose numbers are fitted over the near rows, then over all."""
    text, names = FITTED[name]
    exact = {"time shift": max(1, len(case.t) // 10), "phase drift": max(1, len(case.t) // 10), "first row": 1}
    case = case.take(slice(exact.get(name, 0), None))  # an exact first row is not shifted, and times stay after the start
    units = np.array([{"shift": 1 / case.scale, "damping": case.scale}.get(each, 1.0) for each in names])

    def build(p: Array, of: Compared) -> tuple[Compared, States]:
        part, scene = np.split(np.clip(p, -LIMIT, LIMIT), [3]), of.scene
        if name == "body axes":
            turn = Rotation.from_rotvec(p).as_matrix().T
            of = of.read(*(None if each is None else each @ turn for each in of.data))
        elif name == "another body":
            of = replace(of, scene=_stretched(scene, expm(np.concatenate(part)[[[0, 1, 2], [1, 3, 4], [2, 4, 5]]])))
            if _impossible(of.scene.body) and not _impossible(scene.body):
                return of, _no_motion(of)
        elif name == "first row":
            R0, w0 = scene.R_WB0 @ Rotation.from_rotvec(part[0]).as_matrix(), scene.w_WB_B0 + part[1] * of.scale
            of = replace(of, scene=scene.rename(scene.name, R_WB0=R0, w_WB_B0=w0))
        elif "shift" in names:
            elapsed = of.t - of.start
            shift, rate = np.clip(p[0] * units[0], -elapsed[0] / 2, elapsed[-1]), np.clip(sum(p[1:]), -0.4, 1.0)
            try:
                return of, of.truth(of.start + elapsed * (1 + rate) + shift)
            except TorqueFailed:  # a function may end with the rows
                return of, _no_motion(of)
        else:
            return of, of.move(of.t, name == "damped", float(sum(part[0] * units)))
        return of, of.truth(of.t)

    def residuals(p: Array, of: Compared) -> Array:
        read, motion = build(p, of)
        return read.differences(motion).ravel()

    def fit(p: Array) -> Explanation:
        coarse = replace(case, tolerance=FITTING)
        for of in (coarse.first(NEAR, 10), coarse) if names else ():
            better: Array | None = p
            while better is not None:  # Gauss and Newton's method; where it overshoots, in fewer directions
                p, now = better, residuals(better, of)
                slopes = np.stack([residuals(p + each, of) - now for each in CHANGE * np.eye(len(p))], axis=1) / CHANGE
                steps = (np.linalg.lstsq(slopes, -now, rcond=cut)[0] for cut in (CHANGE, 0.01, 0.1, 0.5))
                trials = (p + share * step for step in steps for share in (1.0, 0.3))
                better = next((q for q in trials if np.linalg.norm(residuals(q, of)) < 0.9 * np.linalg.norm(now)), None)
        return _explain(case, name, text, dict(zip(names, (p * units).tolist(), strict=True)), *build(p, case))

    if name != "body axes" or case.error.max() <= FAR:
        return fit(np.zeros(len(names)))
    near = case.first(NEAR, 10)
    turns: Any = sorted(Rotation.create_group("O").as_rotvec(), key=lambda p: float(np.linalg.norm(residuals(p, near))))
    return min(map(fit, turns[:4]), key=lambda each: (round(each.share, 3), np.linalg.norm([*each.values.values()])))


def _readings(case: Compared, quaternion: bool) -> Iterator[Explanation]:
    """Yield other readings of attitudes and rates."""
    R, w = case.data
    if R is None:
        return
    attitudes = {"": R, "transposed": np.swapaxes(R, 1, 2)}
    if quaternion:
        rolled = (from_quaternion(np.roll(to_quaternion(R), by, axis=1)) for by in (1, -1))
        attitudes |= dict(zip(("order xyzw", "order wxyz"), rolled, strict=True))
    for name, world in list(product(attitudes, ("", "world rates")[: 1 + (w is not None)]))[1:]:
        names = [each for each in (name, world) if each]
        read = case.read(attitudes[name], (w[:, None] @ attitudes[name])[:, 0] if world and w is not None else w)
        text = ". ".join(READINGS[each] for each in names)
        yield _explain(case, ", ".join(names), text, {}, read, read.truth(read.t))


def _parts(case: Compared) -> Iterator[Explanation]:
    """Yield motions without parts of the scene, with the other sign of one, and in the other axes."""
    scene, body, torque = case.scene, case.scene.body, case.scene.torque
    gone: dict[str, dict[str, Any]] = {
        "the rotor": {"body": RigidBody(body.inertia)},
        "the torque": {"torque": None},
        "the damping": {"damping": None},
        "the field": {"potential": None},
    }
    gone = {name: change for name, change in gone.items() if scene.rename(scene.name, **change).key != scene.key}
    others: dict[str, tuple[str, dict[str, Any]]] = {}
    for names in chain.from_iterable(combinations(gone, n + 1) for n in range(len(gone))):
        name = f"without {join(names)}"
        others[name] = f"It is the motion {name}", {key: x for each in names for key, x in gone[each].items()}
    motor = body.motor and body.motor.in_units(-1.0, 1.0)
    turned = replace(body, rotor_momentum=-body.momentum(np.zeros(3)), motor=motor)
    others["sign of the rotor"] = "The momentum of the rotor has the other sign", {"body": turned}
    others["turning of the field"] = "The field does not turn", {"potential": static_part(scene.potential)}
    if torque is not None:
        here, there = torque.frame, FRAMES[torque.frame == FRAMES[0]]
        others["sign of the torque"] = "The torque has the other sign", {"torque": torque.in_units(-1.0, 1.0)}
        text = f"The components of the torque are taken in {there} axes instead of {here} axes"
        others["axes of the torque"] = text, {"torque": replace_unchecked(torque, frame=there)}
    for name, (text, change) in others.items():
        other = replace(case, scene=scene.rename(scene.name, **change))
        if other.scene.key != scene.key:
            yield _explain(case, name, text, {}, other, other.truth(other.t))


def _no_motion(of: Compared) -> States:
    return np.full((len(of.t), 3, 3), np.nan), np.full((len(of.t), 3), np.nan)


def _impossible(body: RigidBody) -> bool:
    """Return whether a moment exceeds the sum of the other two."""
    return bool(2 * body.moments.max() > (1 + 1e-6) * body.moments.sum())


def _stretched(scene: Scene, stretch: Array) -> Scene:
    """Return the scene of another body, in a field that depends on its inertia as well."""
    inertia, field = stretch @ scene.body.inertia @ stretch, scene.potential
    fixed: Any = static_part(field)
    if hasattr(fixed, "inertia"):
        other = replace(fixed, inertia=inertia)
        field = replace(field, potential=other) if isinstance(field, Turning) else other
    return scene.rename(scene.name, body=replace(scene.body, inertia=inertia), potential=field)


def _steps(case: Compared) -> Iterator[Explanation]:
    """Yield motions by textbook methods, with a step that divides the distance of the rows."""
    gap, exact, wheel = float(np.ptp(case.t)) / (len(case.t) - 1), state_derivative(case.scene), wheel_rates(case.scene)
    axes = principal_axes(case.scene)
    numbers = np.rint((case.t - case.start) / gap).astype(int)
    if np.ptp(case.t - case.start - numbers * gap) > 1e-3 * gap or numbers[0] > FEWEST:
        return

    def march(step: Callable[..., Array], parts: int, of: Compared) -> States:
        y, h, t = np.append(axes.q0, axes.w0 + wheel(case.start)), gap / parts, case.start
        kept, before = [y], exact(t, y)
        with np.errstate(all="ignore"):
            for number in range(1, numbers[len(of.t) - 1] * parts + 1):
                y, before, t = step(exact, t, y, h, before), exact(t, y), case.start + number * h
                y[:4] /= np.linalg.norm(y[:4])
                kept += [y] * (number % parts == 0)
            rows = np.array(kept)[numbers[: len(of.t)]]
            rows[:, 4:] -= [wheel(t) for t in of.t.tolist()]
            return of.motion(rows)

    few = case.take(slice(0, FEWEST // 2))
    truth = few.differences(few.truth(few.t))
    for name, (order, step) in TEXTBOOK.items():
        parts, ratio = [2], 1.0  # the error grows with the step to the power of the order
        while len(parts) < 8 and parts[-1] not in parts[:-1] and ratio > 0:
            found = march(step, parts[-1], few)
            made = few.differences(found) - truth
            ratio = float(-np.sum(truth * made) / (np.sum(made * made) or 1.0))
            parts.append(int(np.clip(np.rint(parts[-1] * max(ratio, 1e-9) ** (-1 / order)), 1, STEPS // FEWEST)))
        if few.errors(found).max() <= EXPLAINED * few.error.max():
            some, h = case.take(slice(0, STEPS // parts[-1])), gap / parts[-1]
            text = f"The rows follow {name} with a step of {h:.4g} s"
            yield _explain(some, name, text, {"step": h}, some, march(step, parts[-1], some))
