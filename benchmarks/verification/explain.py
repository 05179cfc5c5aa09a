"""The search for the mistakes that explain the error of a recorded motion."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from itertools import combinations, product
from typing import Any

import numpy as np
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from conservative.attitude import Array
from conservative.needs import Need

from .compare import LINEAR, LONGEST, NUMERICAL, Compared, Effort, Solution, exact
from .explanation import PROVEN, Explanation, attempt, explain
from .find_steps import PARTS, STEPS_AT_MOST, find_steps
from .mistakes import catalogue as mistakes
from .mistakes.catalogue import ATTITUDES, BARE, QUATERNION, READINGS
from .solution import Equations, closed, truth

FEWEST, MOST = 100, 2500  # rows that are explained
EFFORT = 30_000  # stretches, after which the search ends: about a minute; the tests of this package take up to 4,344
MOST_BREAKS = 50  # of loads, if numbers are fitted
_INERTIA = [f"inertia_{ij}" for ij in (11, 12, 13, 22, 23, 33)]
NOT_INTEGRAL = "The rates are right, but the attitudes are not their integral: they follow"


@dataclass(frozen=True)
class Diagnosis:
    """The mistakes that explain an error, or the best candidates if none does, all that were tried, best first, and notes."""

    named: list[Explanation] = field(default_factory=list)
    tried: list[Explanation] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def diagnose(whole: Compared, quaternion: bool, tell: Callable[[str], None] = lambda _: None) -> Diagnosis:
    """Search for the mistakes that explain the error of a file.

    A mistake explains a file if it leaves its noise or digits. Of several, the one with the fewest numbers is named, and all
    that leave as little. A candidate leaves less than half of the error. Mistakes that make attitudes or rates worse than they
    are have no place in either. `quaternion` is True if the order of quaternions can be wrong.
    """
    whole = _before_divergence(whole)
    units = [*_units(whole.first(LONGEST, FEWEST))] if closed(whole.scene) else []
    case = whole.first(LONGEST, FEWEST).first(NUMERICAL, 2)
    if case.error.max() <= case.allowed.max() and len(case.t) < len(whole.t):
        case = whole  # the error is later
    stride = -(-len(case.t) // MOST)
    case = replace(case.take(slice(None, None, stride)), stride=stride, effort=Effort(EFFORT))
    tried = units
    for name, search in SEARCHES.items() if len(case.t) > 3 and not any(each.explains for each in units) else ():
        tell(name)
        for each in search(case, quaternion):
            tried.append(each)
            if case.effort.over:
                break
        if search in (_readings, _attitudes, find_steps) and any(each.explains for each in tried):
            break  # the searches that follow take longer and fit more numbers
    bounds = np.maximum(case.plain.max(axis=1), case.allowed)
    tried = [each for each in tried if each.explains or bool((np.array(each.left) <= bounds).all())]  # none that is worse
    tried.sort(key=lambda each: (not each.explains, each.share))
    if all(each.rest > PROVEN for each in tried if each.explains):  # an error that noise hides says little about its cause
        tried = [replace(each, explains=False) for each in tried]
    explaining = [each for each in tried if each.explains]
    if not explaining:
        notes = ["The search ended before everything was tried: it takes too many trial motions."] * case.effort.over
        if (corners := len(case.scene.breaks)) > MOST_BREAKS:
            notes.append(f"Other bodies, axes and damping are not fitted: the loads have {corners} jumps and corners.")
        return Diagnosis([each for each in tried if each.share < 0.5][:3], tried, notes)
    least = min(each.size for each in explaining)
    good = [each for each in explaining if each.size <= 3 * max(least, 1.0)]
    fewest = min(each.numbers for each in good)
    good = [each for each in good if each.numbers == fewest]
    named = [each for each in good if each.name.removesuffix(BARE) == each.name or all(BARE in one.name for one in good)]
    return Diagnosis(named, tried, _separate(case, named))


def _before_divergence(case: Compared) -> Compared:
    """Return the rows before rates exceed three times those of the exact motion; errors are relative to the largest there."""
    w, largest = case.data[1], float(np.linalg.norm(case.exact[1], axis=1).max())
    size = np.zeros(1) if w is None else np.linalg.norm(w, axis=1)
    if not size.max() > 3 * largest > 0:
        return case
    case = case.take(slice(0, max(4, int(np.argmax(size > 3 * largest)))))
    return case.rescale(float(size[: len(case.t)].max()))


def _separate(case: Compared, named: list[Explanation]) -> list[str]:
    """Return the sentence on what would separate several mistakes that explain a file."""
    motions = [each.made for each in named if each.made is not None]
    for kind, i, size, unit in (("attitudes", 0, 1.0, "rad"), ("rates", 1, case.scale, "of the largest rate")):
        apart = max((float(np.abs(a[i] - b[i]).max()) / size for a, b in combinations(motions, 2)), default=0.0)
        if case.data[i] is None and apart > 2 * case.allowed[i]:
            return [f"Columns of {kind} would separate these: they differ by up to {apart:.2g} {unit}."]
    return ["They make the same rows. A longer file or more digits may separate them."] * (len(named) > 1)


def _readings(case: Compared, quaternion: bool) -> Iterator[Explanation]:
    """Yield other readings of attitudes and rates."""
    first = ["", "transposed", *(QUATERNION if quaternion else ())] if case.data[0] is not None else [""]
    second = ["", *(name for name in READINGS if name not in (*first, *QUATERNION))] if case.data[1] is not None else [""]
    for name, other in list(product(first, second))[1:]:
        data = case.data
        if other == "world rates" and case.data[0] is None:
            continue
        for each in filter(None, (name, other)):
            data = READINGS[each][1](*data)
        read = case.read(*data)
        text = ". ".join(READINGS[each][0] for each in (name, other) if each)
        if data[1] is not None and other:
            read = replace(read, scale=float(np.linalg.norm(data[1], axis=1).max()) or 1.0)
        near = read.take(slice(0, 10))
        R, w = exact(near)(near.scene.R_WB0[None], near.scene.w_WB_B0[None], np.zeros((1, 0)), 10)
        if (near.errors(R[0], w[0]) <= 2 * case.error[:, :10].max() + 10 * case.allowed.max()).all():
            yield attempt(case, ", ".join(filter(None, (name, other))), text, exact(read), read=read)


def _changes(case: Compared, _: bool) -> Iterator[Explanation]:
    """Yield motions of scenes and equations with a mistake."""
    for name, text, equations in mistakes.changes(case.scene):
        yield attempt(case, name, text, _by(case, equations))


def _by(case: Compared, equations: Equations) -> Solution:
    equations = replace(equations, tolerance=case.equations().tolerance)

    def motion(R: Array, w: Array, _: Array, n: int) -> tuple[Array, Array]:
        return equations.solve(case.start, R, w, case.t[:n])

    return motion


def _units(case: Compared) -> Iterator[Explanation]:
    """Yield times in other units than seconds."""
    for size in (1e-3, 1e-6, 1e-9, 60.0):
        if case.turned * size < 2 * LONGEST and not case.scene.loads:
            read = replace(case, t=case.start + (case.t - case.start) * size)
            yield attempt(case, f"time in {size:g} s", f"The times are in units of {size:g} s", exact(read), read=read)


def _times(case: Compared, _: bool) -> Iterator[Explanation]:
    """Yield the right states at other times: shifted, in proportion, with rows missing, jittered, or rates apart."""
    later = np.append(0, np.arange(max(1, len(case.t) // 20), len(case.t)))  # the first row, which is exact, and later ones
    rest, gap, unit = case.take(later), float(np.median(np.diff(case.t))), 1 / case.scale
    end = float(case.t[-1] + 0.1 * (case.t[-1] - case.start) + 2 * gap)

    def moved(both: bool) -> Solution:
        known: list[Any] = []

        def motion(R: Array, w: Array, p: Array, n: int) -> tuple[Array, Array]:
            if case.free or not known:
                known[:] = [case.equations().flow(case.start, R, w, end)]
            flow = known[0]
            times = (
                case.start
                + (rest.t[:n] - case.start) * (1 + np.clip(p[:, 1:].sum(axis=1), -0.5, 0.1))[:, None]
                + p[:, :1] * unit
            )
            times[:, 0] = rest.t[0]
            a, b = flow.shifted(np.clip(times, case.start, end))
            return (a if both else np.broadcast_to(flow.at(rest.t[:n])[0], a.shape)), b

        return motion

    yield attempt(
        rest, "time shift", "Constant time shift: the file is {shift:+.4g} s ahead of the exact motion after its first row",
        moved(True), [0.0], lambda p: {"shift": float(p[0]) * unit},
    )  # fmt: skip
    yield attempt(
        rest, "phase drift", "The time is scaled: the file is {rate:+.3g} s per second too fast, and {shift:+.3g} s ahead",
        moved(True), [0.0, 0.0], lambda p: {"shift": float(p[0]) * unit, "rate": float(p[1])},
    )  # fmt: skip
    if all(x is not None for x in case.data):
        yield attempt(
            rest, "rates at other times", "The rates are {late:+.4g} s late against the attitudes (leapfrog: half a step)",
            moved(False), [0.0], lambda p: {"late": -float(p[0]) * unit},
        )  # fmt: skip
    yield from _own_times(case, gap, end)


def _own_times(case: Compared, gap: float, end: float) -> Iterator[Explanation]:
    """Yield the right states at times that are found row by row: with rows missing in between, or jittered."""
    tau, e = case.t.copy(), 1e-6 / case.scale
    end += min(end - case.start, 50 * gap)
    flow = Equations(case.scene).flow(case.start, case.scene.R_WB0[None], case.scene.w_WB_B0[None], end + e)

    def sample(t: Array) -> tuple[Array, Array]:
        R, w = flow.at(np.clip(t, case.start, end + e))
        return R[0], w[0]

    weights = 1 / np.repeat(case.noise, [9, 3]) ** 2
    for _ in range(8):
        d = case.differences(*sample(tau))
        v = (case.differences(*sample(tau + e)) - d) / e
        tau = tau - (d * v * weights).sum(axis=1) / ((v * v * weights).sum(axis=1) + 1e-300)
        tau = np.clip(tau, case.start, end)
        tau[0] = case.t[0]
    off = tau - case.t
    lost, size = np.rint(off / gap), float(np.sqrt(np.mean(off**2)))
    if lost.max() >= 1 and np.abs(off - lost * gap).max() < 0.2 * gap and (np.diff(lost) >= 0).all():
        at = float(case.t[np.flatnonzero(lost)[0]])
        text = "Rows are missing: {rows:.0f}, the first before {at:.6g} s, and the times are those of a file without gaps"
        values = {"rows": float(lost.max()), "at": at}
        yield explain(case, "dropped rows", text, sample(case.t + lost * gap), values, numbers=2)
    elif abs(float(np.mean(off))) < 0.5 * size:
        text = "The time stamps are jittered by {jitter:.3g} s (root of the mean square)"
        yield explain(case, "jittered times", text, sample(tau), {"jitter": size}, numbers=3)


def _attitudes(case: Compared, _: bool) -> Iterator[Explanation]:
    """Yield attitudes by usual rules from the exact rates, if the rates of the file are exact."""
    R, w = case.data
    if R is None or w is None:
        return
    alone = replace(case, data=(None, w), free=case.free[3:])
    if alone.free:  # the integral collects what the first row is off
        case = replace(case, scene=alone.at(alone.fit(exact(alone), np.zeros(0), np.zeros(0))[0]).scene)
    made = case.exact
    if case.errors(*made)[1].max() > case.allowed[1]:
        return
    for name, rule in ATTITUDES.items():
        wanted, seen, found = [case.stride, 1], set[int](), list[Explanation]()
        while wanted and len(seen) < 8:
            parts = wanted.pop()
            if parts in seen or not 1 <= parts <= PARTS or parts * len(case.t) > 4 * STEPS_AT_MOST:
                continue
            seen.add(parts)
            fine = np.append((case.t[:-1, None] + np.diff(case.t)[:, None] * np.arange(parts) / parts).ravel(), case.t[-1])
            rates = truth(case.scene, case.start, fine)[1] if parts > 1 else made[1]
            turned = mistakes.integrate(rule, case.scene.R_WB0, rates, np.diff(fine), parts)
            error, gone = turned - made[0], R - made[0]
            small = np.linalg.norm(gone, axis=(1, 2)) < LINEAR
            ratio = float((error * gone)[small].sum() / ((error * error)[small].sum() or 1.0)) if small.sum() > 2 else 1.0
            if case.free:  # the first attitude has noise too
                turned = mistakes.align(turned, R, name.endswith(mistakes.IN_WORLD))
            found.append(explain(
                case, f"attitudes by {name}", f"{NOT_INTEGRAL} {name}, with a step of {{step:.4g}} s",
                (turned, made[1]), {"step": float(np.median(np.diff(case.t))) / parts},
            ))  # fmt: skip
            if found[-1].explains:
                break
            if ratio > 0:
                wanted += [max(1, round(parts * ratio ** (-1 / order))) for order in (1, 2)]
        yield min(found, key=lambda each: each.share)


def _fits(case: Compared, _: bool) -> Iterator[Explanation]:
    """Yield motions with numbers that are fitted."""
    scene = case.scene
    if len(scene.breaks) > MOST_BREAKS:
        return
    more = ", in addition to the damping of the scene" * (Need.DAMPING in scene.needs)
    for name, text, term in (("damped", "", 1.0), ("no gyroscopic term, damped", f"{mistakes.NO_TERM}. ", 0.0)):
        text += "The rates are damped by {damping:.4g} per second" + more

        def motion(R: Array, w: Array, p: Array, n: int, term: float = term) -> tuple[Array, Array]:
            return case.equations(scene, term, damping=p[:, 0] * case.scale).solve(case.start, R, w, case.t[:n])

        yield attempt(case, name, text, motion, [0.0], lambda p: {"damping": float(p[0]) * case.scale})
    if case.start == case.t[0]:
        have = [*range(3)] * (case.data[0] is not None) + [*range(3, 6)] * (case.data[1] is not None)
        rest = replace(case.take(slice(1, None)), free=tuple(have))
        if len(rest.t) > 3:
            initial, _extra, fitted = rest.fit(exact(rest), np.empty(0), np.empty(0))
            names = [f"start_{kind}_{i}" for kind in ("turn", "rate") for i in (1, 2, 3)]
            text = "The first row does not fit the others: the motion starts at another attitude or other rates"
            found = explain(replace(rest, free=()), "first row", text, fitted, {names[i]: float(initial[i]) for i in have})
            yield replace(found, numbers=len(have), explains=found.explains and found.size < 100)
    moments = fit_moments(case)
    yield replace(moments, sentence=f"It is the motion of another body. {moments.sentence}. Correct --body")
    if moments.explains:
        return
    yield _turned_axes(case)
    yield _other_body(case)


def _turned_axes(case: Compared) -> Explanation:
    """Return the explanation by body axes that are turned, fitted from the best of 24 directions."""

    def motion(of: Compared) -> Solution:
        def turned(R: Array, w: Array, p: Array, n: int) -> tuple[Array, Array]:
            C = Rotation.from_rotvec(p).as_matrix()
            a, b = exact(of)(R @ np.swapaxes(C, 1, 2), (C @ w[..., None])[..., 0], p, n)
            return a @ C[:, None], (np.swapaxes(C, 1, 2)[:, None] @ b[..., None])[..., 0]

        return turned

    near, turns = case.first(3.0, 10), Rotation.create_group("O").as_rotvec()
    many = np.broadcast_to(case.scene.R_WB0, (24, 3, 3)), np.broadcast_to(case.scene.w_WB_B0, (24, 3))
    left = np.linalg.norm(near.differences(*motion(near)(*many, turns, len(near.t))), axis=(1, 2))
    text = "The body axes of the file are not those of the body: turn them by ({turn_1:.5g}, {turn_2:.5g}, {turn_3:.5g}) rad"

    def values(p: Array) -> dict[str, float]:
        back = Rotation.from_rotvec(p).as_rotvec()
        return {f"turn_{i + 1}": float(x) for i, x in enumerate(back)}

    found = [attempt(case, "body axes", text, motion(case), turns[k].tolist(), values, most=30) for k in np.argsort(left)[:3]]
    return min(found, key=lambda each: (round(each.share, 3), np.linalg.norm([*each.values.values()])))


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

    initial, p, made = case.fit(_with_inertia(case, inertia), np.zeros(3 - ratios), np.full(3 - ratios, 1e-5))
    unit = body.moments[0] if ratios else 1.0
    moments, own = np.diag(body.R_BP.T @ inertia(p) @ body.R_BP) / unit, " : ".join(f"{x:.4g}" for x in body.moments / unit)
    off = [0.0] * ratios + (2 * case.deviations(_with_inertia(case, inertia), np.append(initial, p), 1e-5)[6:]).tolist()
    known = " : ".join(f"{x:.6g}" + f" ± {x * d:.1g}" * (d > 0) for x, d in zip(moments, off, strict=True))
    text = f"The principal moments that fit the rows best {'have the ratios' if ratios else 'are'} {known} (of the body: {own})"
    return _possible(explain(case, "other moments", text, made, _components(inertia(p)), numbers=len(p)))


def _components(inertia: Array) -> dict[str, float]:
    return dict(zip(_INERTIA, inertia[np.triu_indices(3)].tolist(), strict=True))


def _possible(found: Explanation) -> Explanation:
    """Return an explanation by another inertia, which explains nothing if no body has it."""
    moments = np.linalg.eigvalsh(np.array([*found.values.values()])[[[0, 1, 2], [1, 3, 4], [2, 4, 5]]])
    return replace(found, explains=found.explains and bool(2 * moments.max() < (1 + 1e-6) * moments.sum()))


def _with_inertia(case: Compared, inertia: Callable[[Array], Array]) -> Solution:
    """Return the motion as a function of initial states and the numbers of an inertia."""

    def motion(R: Array, w: Array, p: Array, n: int) -> tuple[Array, Array]:
        scenes = [mistakes.with_inertia(case.scene, inertia(numbers)) or case.scene for numbers in p]
        made = [case.equations(scene).solve(case.start, R[[i]], w[[i]], case.t[:n]) for i, scene in enumerate(scenes)]
        return np.concatenate([a for a, _ in made]), np.concatenate([b for _, b in made])

    return motion


def _other_body(case: Compared) -> Explanation:
    """Return the explanation by another inertia."""
    free = case.scene.free and case.scene.body.rotor_momentum is None
    J = case.scene.body.inertia

    def inertia(p: Array) -> Array:
        stretch = expm(np.clip(p, -3, 3)[[[0, 1, 2], [1, 3, 4], [2, 4, 5]]])
        made = stretch @ J @ stretch
        return made * (np.trace(J) / np.trace(made)) if free else made

    text = "It is the motion of another body, with the inertia ({inertia_11:.6g}, {inertia_22:.6g}, {inertia_33:.6g}; "
    text += "{inertia_12:.6g}, {inertia_13:.6g}, {inertia_23:.6g}) kg m^2"
    text += " or a multiple of it. Correct --body" if free else ". Correct --body"
    motion = _with_inertia(case, inertia)
    return _possible(attempt(case, "another body", text, motion, [0.0] * 6, lambda p: _components(inertia(p))))


SEARCHES: dict[str, Callable[[Compared, bool], Iterator[Explanation]]] = {
    "other equations": _changes,
    "other readings": _readings,
    "other times": _times,
    "attitudes from rates": _attitudes,
    "integrators": find_steps,
    "other bodies": _fits,
}
"""Searches by the work that they do, in their order."""
