"""Hypotheses that may explain the error of a recorded motion: each is another reading of the data, or another motion."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain, product
from typing import Any

import numpy as np
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from conservative.attitude import Array, from_quaternion, to_quaternion
from conservative.body import RigidBody
from conservative.potentials.potential import depends_on_time
from conservative.references.engine import principal_axes
from conservative.references.engines.scipy import state_derivative

from .motion import Case, Motion

LONGEST, NEAR, FAR = 100.0, 3.0, 0.05  # rad: angles that hypotheses are tried and first fitted over; error of turned axes
FEWEST, MOST, STEPS = 100, 1000, 20_000  # rows on which they are tried, even over a larger angle; steps of a textbook method
ROUND_OFF, FLOOR, CHANGE = 1e-10, 1e-12, 1e-6  # errors that need no explanation, that are equally good; change for slopes
EXPLAINED, FIRST_ROW = 0.5, 0.05  # largest shares of the error that are left, the second by a start in another first row
NO_GYROSCOPIC_TERM = "The gyroscopic term is missing: without a torque the angular velocity is constant"
WORDS = {
    "transposed": "The attitudes are transposed, or the quaternions conjugated: they map world to body",
    "order xyzw": "The quaternion order is xyzw, but was read as wxyz",
    "order wxyz": "The quaternion order is wxyz, but was read as xyzw",
    "world rates": "The rates are in world axes",
}
Build = Callable[[Array, Case], tuple[Case, Motion]]
"""From fitted numbers (k,), of order 1, and rows, to a reading of the rows and the motion next to it."""


def _rates_first(f: Callable[[Array], Array], y: Array, h: float, corrections: int) -> Array:
    """Return the state after a step of a game engine, with so many corrections of the gyroscopic torque."""
    new = y.copy()
    for _ in range(corrections):
        new[4:] = y[4:] + h * f(new)[4:]
    new[:4] += h * f(new)[:4]
    return new


TEXTBOOK: dict[str, tuple[int, Callable[..., Array]]] = {
    "explicit Euler": (1, lambda f, y, h, _: y + h * f(y)),
    "semi-implicit Euler with an explicit gyroscopic term": (1, lambda f, y, h, _: _rates_first(f, y, h, 1)),
    "semi-implicit Euler with an implicit gyroscopic term": (1, lambda f, y, h, _: _rates_first(f, y, h, 8)),
    "Adams-Bashforth 2 (first step Euler)": (2, lambda f, y, h, before: y + h * (1.5 * f(y) - 0.5 * before)),
    "Heun's method": (2, lambda f, y, h, _: y + h / 2 * (f(y) + f(y + h * f(y)))),
}
"""Orders and steps of methods: from derivative, state, step, s, and the slope of the step before to the next state."""


@dataclass(frozen=True)
class Finding:
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


def diagnose(whole: Case, quaternion: bool) -> tuple[Finding | None, list[Finding]]:
    """Return the hypothesis that explains the error, if any, and all that were tried, best first.

    The best hypothesis is named if it leaves at most half of the error. One that needs fewer numbers is preferred if it leaves
    at most twice as much. None is named if the noise of the first row explains the error as well. `quaternion` is True if the
    order of quaternions can be wrong.
    """
    case = whole.first(LONGEST, FEWEST)
    case = case.take(slice(None, None, -(-len(case.t) // MOST)))
    if case.error.max() <= ROUND_OFF:
        return None, []
    tried: list[Finding] = []
    for each in chain(_readings(case, quaternion), _motions(case), _steps(case), _turned(case), _bodies(case)):
        tried.append(each)
        if max(each.left) <= ROUND_OFF:  # a turned free body is also another body: the order matters
            break
    named = tried
    if case.from_row:
        start = _first_row(case.take(slice(1, None)))
        if max(map(abs, start.values.values())) <= max(start.left):
            named = [each for each in tried if max(each.left) <= EXPLAINED * max(start.left)]
        elif start.share <= FIRST_ROW < min(each.share for each in tried):
            named = [start]
        tried = [*tried, start]
    named = [each for each in named if each.share <= EXPLAINED]
    least = min((max(*each.left, FLOOR) for each in named), default=0.0)
    good = [each for each in named if max(each.left) <= 2 * least]
    return min(good, key=lambda each: (len(each.values), each.share), default=None), sorted(tried, key=lambda each: each.share)


def _try(
    case: Case, name: str, text: str, build: Build, names: Iterable[str] = (), units: Any = 1.0, first: Any = 0
) -> Finding:
    """Return the finding of a hypothesis with fitted numbers of these names, first fitted over the near rows."""
    p = np.zeros(len(keys := list(names))) + first
    for of in (case.first(NEAR, 10), case) if keys else ():
        p = _fit(of, build, p)
    read, motion = build(p, case)
    values = dict(zip(keys, (p * units).tolist(), strict=True))
    left, plain = read.errors(motion).max(axis=1).tolist(), case.error.max(axis=1).tolist()
    return Finding(name, text.format(**values), values, left, plain, max(left) / max(*plain, FLOOR))


def _fit(case: Case, build: Build, p: Array) -> Array:
    """Return the numbers of least squares by Gauss and Newton's method, with shorter steps where it overshoots."""

    def residuals(p: Array) -> Array:
        read, motion = build(p, case)
        return read.differences(motion).ravel()

    now = residuals(p)
    for _ in range(8):
        slopes = np.stack([residuals(p + each) - now for each in CHANGE * np.eye(len(p))], axis=1) / CHANGE
        step = np.linalg.lstsq(slopes, -now, rcond=CHANGE)[0]
        trials = ((p + share * step, residuals(p + share * step)) for share in (1.0, 0.3, 0.1, 0.01))
        better = next(((q, found) for q, found in trials if found @ found < 0.99 * (now @ now)), None)
        if better is None:
            break
        p, now = better
    return p


def _of(read: Case, p: Array, of: Case) -> tuple[Case, Motion]:
    """Return other data or another scene next to its exact motion, over the times of some rows."""
    read = read.take(slice(len(of.t)))
    return read, read.truth(of.t)


def _readings(case: Case, quaternion: bool) -> Iterator[Finding]:
    """Yield other readings of attitudes and rates."""
    if (R := case.data[0]) is None:
        return
    attitudes, q, w = {"": R, "transposed": np.swapaxes(R, 1, 2)}, to_quaternion(R), case.data[1]
    if quaternion:
        attitudes |= {f"order {name}": from_quaternion(np.roll(q, by, axis=1)) for name, by in (("xyzw", 1), ("wxyz", -1))}
    for name, world in list(product(attitudes, ("", "world rates")))[1:]:
        names = [each for each in (name, world) if each]
        read = case.read(attitudes[name], (w[:, None] @ attitudes[name])[:, 0] if world and w is not None else w)
        yield _try(case, ", ".join(names), ". ".join(WORDS[each] for each in names), partial(_of, read))


def _turned(case: Case) -> Iterator[Finding]:
    """Yield a motion in body axes that are turned by a constant rotation."""
    R, w = case.data

    def turned(p: Array, of: Case) -> tuple[Case, Motion]:
        turn = Rotation.from_rotvec(p).as_matrix().T
        return _of(case.read(None if R is None else R @ turn, None if w is None else w @ turn), p, of)

    def size(p: Any, of: Case) -> float:
        read, motion = turned(p, of)
        return float(np.sum(read.differences(motion) ** 2))

    near, first = case.first(NEAR, 10), np.zeros(3)
    if case.error.max() > FAR:
        turns: Any = sorted(Rotation.create_group("O").as_rotvec(), key=lambda p: size(p, near))
        first = min((_fit(near, turned, each) for each in turns[:4]), key=lambda p: size(p, case))
    text = "The body axes of the file are not those of the body: turn them by ({turn_1:.5g}, {turn_2:.5g}, {turn_3:.5g}) rad"
    yield _try(case, "body axes", text, turned, ("turn_1", "turn_2", "turn_3"), first=first)


def _motions(case: Case) -> Iterator[Finding]:
    """Yield motions that are shifted in time, without the gyroscopic term, and damped."""
    late = case.take(slice(max(1, len(case.t) // 10), None))  # an exact first row is not shifted; and times stay above 0
    scale = case.scale

    def shifted(p: Array, of: Case) -> tuple[Case, Motion]:
        shift, rate = np.clip(p[0] / scale, -late.t[0] / 2, late.t[-1]), np.clip(1e-3 * sum(p[1:]), -0.4, 1.0)
        return of, of.truth(of.t * (1 + rate) + shift)

    text = "Constant time shift: the file is {shift:+.4g} s ahead of the exact motion"
    yield _try(late, "time shift", text, shifted, ["shift"], 1 / scale)
    text = "Phase drift: the motion is {rate:+.3g} s per second too fast, so that errors grow in proportion to time"
    yield _try(late, "phase drift", text, shifted, ["shift", "rate"], [1 / scale, 1e-3])

    def damped(gyroscopic: bool, p: Array, of: Case) -> tuple[Case, Motion]:
        return of, of.move(of.t, gyroscopic, float(np.clip(sum(p), -0.1, 10.0)) * scale)

    text = "The rates are damped by {damping:.4g} per second"
    yield _try(case, "damped", text, partial(damped, True), ["damping"], scale)
    yield _try(case, "no gyroscopic term", NO_GYROSCOPIC_TERM, partial(damped, False))
    text, name = f"{NO_GYROSCOPIC_TERM}. {text}", "no gyroscopic term, damped"
    yield _try(case, name, text, partial(damped, False), ["damping"], scale)


def _bodies(case: Case) -> Iterator[Finding]:
    """Yield the motion of a body with another inertia."""
    scene = case.scene

    def other(p: Array, of: Case) -> tuple[Case, Motion]:
        stretch = expm(np.clip(p, -2.0, 2.0)[[[0, 1, 2], [1, 3, 4], [2, 4, 5]]])
        J = stretch @ scene.body.inertia @ stretch
        return _of(replace(case, scene=scene.rename(scene.name, body=RigidBody((J + J.T) / 2))), p, of)

    found = _try(case, "another body", "", other, ("s11", "s12", "s13", "s22", "s23", "s33"))
    body = other(np.array(list(found.values.values())), case)[0].scene.body
    text = f"It is the motion of another body, with principal moments {np.sort(body.moments).round(9).tolist()} kg m^2"
    yield replace(found, sentence=text + " or multiples" * scene.free)


def _first_row(case: Case) -> Finding:
    """Return the motion from an initial state that is fitted to the other rows."""

    def moved(p: Array, of: Case) -> tuple[Case, Motion]:
        (turn, rates), scene = np.clip(p, -1.0, 1.0).reshape(2, 3), case.scene
        R0, w0 = scene.R_WB0 @ Rotation.from_rotvec(turn).as_matrix(), scene.w_WB_B0 + rates * case.scale
        return _of(replace(case, scene=scene.rename(scene.name, R_WB0=R0, w_WB_B0=w0)), p, of)

    text = "The first row does not fit the others: the motion starts at another attitude or other rates"
    return _try(case, "first row", text, moved, ("turn_1", "turn_2", "turn_3", "rate_1", "rate_2", "rate_3"))


def _steps(case: Case) -> Iterator[Finding]:
    """Yield motions by textbook methods, with a step that divides the distance of the rows."""
    gap, axes, f = float(case.t[-1]) / (len(case.t) - 1), principal_axes(case.scene), partial(state_derivative(case.scene), 0.0)
    if np.ptp(np.diff(case.t)) > 1e-3 * gap or depends_on_time(case.scene.potential):
        return

    def march(step: Callable[..., Array], parts: int, p: Any, of: Case) -> tuple[Case, Motion]:
        y = before = np.append(axes.q0, axes.w0)
        kept = [y]
        with np.errstate(all="ignore"):
            for number in range(1, (len(of.t) - 1) * parts + 1):
                y, before = step(f, y, gap / parts, f(before)), y
                y[:4] /= np.linalg.norm(y[:4])
                kept += [y] * (number % parts == 0)
            return of, of.motion(np.array(kept))

    few = case.take(slice(0, FEWEST // 2))
    exact = few.differences(few.truth(few.t))
    for name, (order, step) in TEXTBOOK.items():
        parts, ratio = [2], 1.0  # the error grows with the step to the power of the order
        while len(parts) < 8 and parts[-1] not in parts[:-1] and ratio > 0:
            found = march(step, parts[-1], None, few)[1]
            made = few.differences(found) - exact
            ratio = float(-np.sum(exact * made) / (np.sum(made * made) or 1.0))
            parts.append(int(np.clip(np.rint(parts[-1] * max(ratio, 1e-9) ** (-1 / order)), 1, STEPS // FEWEST)))
        if few.errors(found).max() <= EXPLAINED * few.error.max():
            some, text = (
                case.take(slice(0, STEPS // parts[-1])),
                f"The rows follow {name} with a step of {gap / parts[-1]:.4g} s",
            )
            yield replace(_try(some, name, text, partial(march, step, parts[-1])), values={"step": gap / parts[-1]})
