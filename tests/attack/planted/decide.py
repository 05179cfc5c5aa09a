"""What the answer to a file should be: decided by the generator from its own motions, before the verification runs.

The grain of a file is the root mean square, in a row, of noise, digits and single precision, at least 1e-9: of attitudes, rad,
and of rates, relative to the largest. A file is wrong if it differs from every exact motion by more than `WRONG` grains (root
mean square over the rows). These motions start in the first row, or, with noise or digits, as fits best. A mistake is
identifiable if it differs by more than `IDENTIFIABLE` grains from the right motion, and from every rival with as few fitted
numbers: another mistake, whose numbers fit best.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from . import motion
from .layouts import LAYOUTS
from .mistakes import ATTITUDES, DRIFTS, NUMBERS, SCENES, STEPS, integrate, march, other_orbit
from .worlds import Draw, World, is_table, scaled

FLOOR, WRONG, IDENTIFIABLE = 1e-9, 3.0, 10.0
NEAR = 0.2
"""Largest difference, rad or relative, with which fits begin."""
FEWEST, ENOUGH = 12, 8
"""Smallest number of rows of a fit, and of rows that determine a mistake."""
ENOUGH_FOR_NOISE = 30
"""Smallest number of rows that show how large their noise is."""
CLOSE = 300.0
"""Difference, in grains, above which another mistake is not taken for a long step, or for times that scatter."""
SMALL, MOST = 1e-6, 8
"""Changes for slopes, and the largest number of steps of a fit."""
MOST_BIASED = 150
"""Largest number of rows with which the drift of a bias is fitted, which takes long."""
Build = Callable[[Any, Any, int], Any]
"""From an initial state (7,), numbers (k,) and n to the first rows (n, 7)."""
FARTHEST = 1.5
"""Largest number of a fit: radians, or relative."""


def differences(Y: Any, Z: Any, scale: float) -> Any:
    """Return turns (n, 3), rad, and relative rates (n, 3) between states; those of a method that diverged are large."""
    with np.errstate(all="ignore"):
        q = motion.times(motion.back(Z[:, :4]), Y[:, :4])
        q = q / np.linalg.norm(q, axis=1, keepdims=True)
        d = np.hstack([motion.vector(q), (Y[:, 4:] - Z[:, 4:]) / scale])
    return np.clip(np.where(np.isfinite(d), d, 1e9), -1e9, 1e9)


@dataclass(frozen=True, eq=False)
class Rows:
    """The rows of a file, without noise, and what they should be: the exact motion from `y0`. Differences are in grains."""

    world: World
    t: Any
    Y: Any
    y0: Any
    kept: list[int]
    grain: Any
    scale: float
    inexact: bool

    def exact(self, y0: Any, n: int, world: World | None = None, late: float = 0.0) -> Any:
        """Return the first rows of an exact motion from a state in the first row, at times that are later."""
        return (world or self.world).solve(self.t[:n] + late, y0, self.t[0])

    def off(self, Z: Any) -> Any:
        """Return the differences (n k,) of the first rows from other ones."""
        return (differences(self.Y[: len(Z)], Z, self.scale)[:, self.kept] / self.grain).ravel()

    def size(self, x: Any) -> float:
        """Return the root mean square of a row, of attitudes or of rates."""
        square = x.reshape(-1, len(self.kept) // 3, 3) ** 2
        return float(np.sqrt(square.sum(axis=2).mean(axis=0)).max())

    @cached_property
    def d(self) -> Any:
        """The differences from the exact motion."""
        return self.off(self.exact(self.y0, len(self.t)))

    @cached_property
    def near(self) -> int:
        """The number of rows before the differences become large, with which fits begin."""
        far = (np.abs(self.d.reshape(len(self.t), -1) * self.grain) > NEAR).any(axis=1)
        first = int(np.argmax(far)) if far.any() else len(self.t)
        return min(max(first, FEWEST), len(self.t))

    def moved(self, p: Any) -> Any:
        """Return the initial state after small changes of what the file shows of it."""
        y, k = self.y0.copy(), 3 * (0 in self.kept)
        if k:
            y[:4] = motion.times(y[:4], motion.turn(p[:3]))
        if 3 in self.kept:
            y[4:] = y[4:] + self.scale * p[k : k + 3]
        return y

    @cached_property
    def begun(self) -> Any:
        """Slopes of the differences for changes of the start; none if the first row is exact."""
        if not self.inexact:
            return np.zeros((len(self.d), 0))
        moved = [self.off(self.exact(self.moved(SMALL * v), len(self.t))) - self.d for v in np.eye(len(self.kept))]
        return np.array(moved).T / SMALL

    def fit(self, numbers: int = 0, build: Build | None = None, goal: float = IDENTIFIABLE) -> float:
        """Return the size of the differences that a start and some numbers leave, which fit best; early if it is hopeless.

        The fit begins with the first rows, in which differences are small.
        """
        free = len(self.kept) * self.inexact
        p, left = np.zeros(free + numbers), np.inf

        def rows(p: Any, n: int) -> Any:
            y0 = self.moved(p) if free else self.y0
            return self.off(self.exact(y0, n) if build is None else build(y0, p[free:], n))

        for n in sorted({self.near, len(self.t)}):
            x = rows(p, n)
            left, A = self.size(x), None
            for _ in range(MOST if len(p) else 0):
                if left < 0.1 * goal:
                    break
                if A is None:
                    at = len(x)
                    begun = self.begun[:at] if not p.any() else self.slopes(rows, p, n, range(free), x)
                    A = np.hstack([begun, self.slopes(rows, p, n, range(free, len(p)), x)])
                sizes = np.maximum(np.abs(A).max(axis=0), 1e-300)
                step = np.linalg.lstsq(A / sizes, -x, rcond=1e-6)[0] / sizes
                if not np.abs(p + step).max() <= FARTHEST:
                    break
                y = rows(p + step, n)
                new = self.size(y)
                if new < 0.3 * left:
                    p, x, left = p + step, y, new
                elif new < left:  # new slopes, if they can help
                    done = new > 0.9 * left
                    p, x, left, A = p + step, y, new, None
                    if done:
                        break
                else:
                    break
            if left > goal:
                break
        return left

    def slopes(self, rows: Any, p: Any, n: int, places: Any, x: Any) -> Any:
        return np.array([rows(p + SMALL * np.eye(len(p))[i], n) - x for i in places]).reshape(-1, len(x)).T / SMALL


def start_in(world: World, t: Any, Y: Any, kept: list[int]) -> Any:
    """Return the state in the first row: of the file, or of the scene, what the file does not have."""
    y0 = world.start if t[0] == 0 else world.solve(t[:1])[0]
    q = Y[0, :4] / np.linalg.norm(Y[0, :4]) if 0 in kept else y0[:4]
    return np.append(q, Y[0, 4:] if 3 in kept else y0[4:])


def rows_of(made: Any, t: Any, Y: Any) -> Rows:
    """Return the rows of a file beside the exact motion that starts in the first of them."""
    has, world = LAYOUTS[made.layout].has.split(), made.world
    kept = [*range(3)] * ("R" in has) + [*range(3, 6)] * ("w" in has)
    y0 = start_in(world, t, Y, kept)
    grain = np.repeat(made.about["grain"], 3)[kept]
    # A method that diverges is compared at the scale of the exact motion.
    scale = float(np.linalg.norm(Y[:, 4:], axis=1).max()) or 1.0
    scale = min(scale, 10 * float(np.linalg.norm(world.solve(t[-1:], y0, t[0])[0, 4:])) + float(np.linalg.norm(y0[4:]))) or 1.0
    return Rows(world, t, Y, y0, kept, grain, scale, made.noise != "none" or max(made.about["grain"]) > 1e-8)


def decide(made: Any, t: Any, Y: Any) -> None:
    """Decide whether a file is right, whether its mistake is identifiable, and which others make the same rows."""
    made.expected = "right" if made.kind == "right" else "wrong"
    if made.noise.startswith("1e") and len(t) < ENOUGH_FOR_NOISE:
        made.expected, made.reason = "", "too few rows to know their noise"
    if made.kind == "right" or made.reason:
        return
    if made.mistake == "time in ms":
        made.identifiable, made.size = made.about["turns"] > 0.5, np.inf
        made.reason = "" if made.identifiable else "less than half a turn"
        return
    rows = rows_of(made, t, Y)
    made.size = rows.fit(goal=WRONG)
    norm = abs(np.linalg.norm(Y[:, :4], axis=1) - 1).max() if "q" in LAYOUTS[made.layout].has else 0.0
    if made.mistake in ("single rows", "first row", "transposed in some rows", "dropped rows"):
        d = (rows.d.reshape(len(t), -1, 3) ** 2).sum(axis=2)
        made.size = max(made.size, float(np.sqrt(d.max())) / 5)
    if max(made.size, norm / made.about["grain"][0] * (norm > 1e-5)) < WRONG:
        raw = float(np.sqrt((rows.d**2).mean())) * min(made.about["grain"])
        made.expected = "right" if raw < 1e-11 else ""
        made.reason = "the mistake makes no difference in this scene" if raw < 1e-11 else "noise or digits hide it"
        return
    if made.kind == "pair":
        made.reason, made.same = "two mistakes at once", {*made.about["pair"]}
        return
    mine, blocking = NUMBERS.get(made.mistake, 0), list[str]()
    for name, numbers, left in rivals(made, rows):
        if name != made.mistake and left < IDENTIFIABLE:
            made.same.add(name)
            # A limit that only the first row exceeds is another start.
            blocking += [name] * (numbers <= mine or (made.kind == "habit" and name == "first row"))
    made.reason = f"the same rows: {blocking[0]}" if blocking else ""
    if made.size < IDENTIFIABLE:
        made.reason = "noise or digits nearly hide it"
    elif len(t) < ENOUGH:
        made.reason = f"fewer than {ENOUGH} rows"
    made.identifiable = not made.reason


def rivals(made: Any, rows: Rows) -> Iterator[tuple[str, int, float]]:
    """Yield other explanations: a name, the number of its fitted numbers, and what they leave of the differences, in grains."""
    for name, numbers, build in explanations(rows):
        if name != made.mistake:
            yield name, numbers, rows.fit(numbers, build)
    if made.mistake != "first row" and len(rows.t) > 2:
        others = replace(rows, t=rows.t[1:], Y=rows.Y[1:], y0=start_in(rows.world, rows.t[1:], rows.Y[1:], rows.kept))
        yield "first row", len(rows.kept), others.fit()
    if made.mistake == "dropped rows" or made.size < CLOSE:
        yield "jittered times", 99, along_the_motion(rows)
    yield from steps(made, rows)
    if len(rows.kept) == 6 and made.kind != "step":
        yield from readings(made, rows)


def explanations(rows: Rows) -> Iterator[tuple[str, int, Build]]:
    """Yield explanations that can be fitted: a name, the number of its numbers, and its rows."""
    world, at, t = rows.world, rows.t[0], rows.t
    for name, change in SCENES.items():  # parts that are missing or reversed
        if NUMBERS.get(name, 0) == 0 and (other := change(world, Draw(0))) is not None:
            yield name, 0, lambda y, p, k, other=other: other.solve(t[:k], y, at)
    for name, numbers, vary in varied(world, rows.scale):
        yield name, numbers, lambda y, p, k, vary=vary: vary(p).solve(t[:k], y, at)
    elapsed = t - at
    shifted: dict[str, tuple[int, Any]] = {
        "time shift": (1, lambda p: np.where(elapsed > 0, elapsed + p[0] / rows.scale, 0.0)),
        "time scale": (1, lambda p: elapsed * (1 + p[0])),
        "phase drift": (2, lambda p: elapsed * (1 + p[1]) + p[0] / rows.scale),
    }
    for name, (numbers, times) in shifted.items():
        yield name, numbers, lambda y, p, k, times=times: solve_any(world, at + times(p)[:k], y, at)
    if len(rows.kept) == 6:
        for name, numbers, change in rates_and_attitudes(rows):
            yield name, numbers, lambda y, p, k, change=change: change(rows.exact(y, k), y, p)


def along_the_motion(rows: Rows) -> float:
    """Return what another time for each row leaves, to first order."""
    late = rows.off(solve_any(rows.world, rows.t + SMALL / rows.scale, rows.y0, rows.t[0])) - rows.d
    a, b = rows.d.reshape(len(rows.t), -1), late.reshape(len(rows.t), -1)
    along = (a * b).sum(axis=1, keepdims=True) / np.maximum((b * b).sum(axis=1, keepdims=True), 1e-300)
    return rows.size((a - along * b).ravel())


def readings(made: Any, rows: Rows) -> Iterator[tuple[str, int, float]]:
    """Yield other readings: what the file means by them is an exact motion."""
    for name in UNREAD:
        if name != made.mistake:
            Z = np.hstack(UNREAD[name](rows.Y[:, :4], rows.Y[:, 4:]))
            meant = replace(rows, Y=Z, y0=Z[0])
            few = replace(meant, t=rows.t[:3], Y=Z[:3])
            if few.size(few.d) < 30 * IDENTIFIABLE:
                yield name, 0, meant.fit()


def solve_any(world: World, t: Any, y: Any, at: float) -> Any:
    """Return the exact motion at times that may lie before the first row or out of order."""
    order = np.argsort(t, kind="stable")
    early = t[order] < at
    out = np.empty((len(t), 7))
    out[order[~early]] = world.solve(t[order[~early]], y, at)
    if early.any():  # backwards in time: a small part of a row, to first order
        step = 1e-4 / world.rate
        ahead = world.solve(np.array([at + step]), y, at)[0]
        out[order[early]] = y + (t[order[early]] - at)[:, None] / step * (ahead - y)
    return out


def varied(world: World, scale: float) -> Iterator[tuple[str, int, Callable[[Any], World]]]:
    """Yield other worlds: a name, the number of their numbers, and the world of some numbers, which are 0 for the right one."""
    yield "damping", 1, lambda p: world.but(drag=p[0] * scale)
    if world.wheel is not None:
        yield "size of the rotor", 1, lambda p: world.but(wheel=scaled(world.wheel, 1 + p[0]))
    if world.torque is not None:
        yield "size of the torque", 1, lambda p: world.but(torque=scaled(world.torque, 1 + p[0]))
    if world.damping is not None:
        yield "size of the damping", 1, lambda p: world.but(damping=world.damping * (1 + p[0]))
    if world.field is not None:
        yield "size of the field", 1, lambda p: world.but(pull=1 + p[0])
    if world.orbit is not None:
        yield "rate of the orbit", 1, lambda p: other_orbit(world, 1 + p[0])
    yield "speed of attitudes", 1, lambda p: world.but(speed=1 + p[0])
    moments, axes = np.linalg.eigh(world.J)
    yield "other moments", 3, lambda p: world.with_inertia(axes @ np.diag(moments * np.exp(p)) @ axes.T)

    def body(p: Any) -> World:
        half = np.eye(3)
        half[np.tril_indices(3)] += p
        return world.with_inertia(half @ world.J @ half.T)

    yield "another body", 6, body


def rates_and_attitudes(rows: Rows) -> Iterator[tuple[str, int, Callable[[Any, Any, Any], Any]]]:
    """Yield changes of exact rows (n, 7), which start at y, by numbers, that only attitudes and rates together show."""
    world, t, scale = rows.world, rows.t, rows.scale
    at = t[0]

    def late(Z: Any, y: Any, p: Any) -> Any:
        return np.hstack([Z[:, :4], solve_any(world, t[: len(Z)] - p[0] / scale, y, at)[:, 4:]])

    def turned(Z: Any, y: Any, p: Any) -> Any:
        return np.hstack([Z[:, :4], motion.spin(np.broadcast_to(motion.turn(p), (len(Z), 4)), Z[:, 4:])])

    def axes(Z: Any, y: Any, p: Any) -> Any:
        c = np.broadcast_to(motion.turn(p), (len(Z), 4))
        return np.hstack([motion.times(Z[:, :4], c), motion.spin(motion.back(c), Z[:, 4:])])

    def drifting(change: Any, axis: Any) -> Any:
        return lambda Z, y, p: np.hstack([change(world, t[: len(Z)], Z, scale * p * axis), Z[:, 4:]])

    yield "rates at other times", 1, late
    yield "size of the rates", 1, lambda Z, y, p: np.hstack([Z[:, :4], Z[:, 4:] * (1 + p[0])])
    yield "bias of the rates", 3, lambda Z, y, p: np.hstack([Z[:, :4], Z[:, 4:] + scale * p])
    yield "rates in turned axes", 3, turned
    yield "body axes", 3, axes
    for name, change in DRIFTS.items():
        if name != "drift of a bias" or len(t) < MOST_BIASED:
            heading = name == "heading drift"
            yield name, 1 if heading else 3, drifting(change, np.ones(3) if not heading else np.array([0, 0, 1.0]))


def steps(made: Any, rows: Rows) -> Iterator[tuple[str, int, float]]:
    """Yield integrators, and rules for attitudes. Their differences are scaled, so that each has its best step."""
    world, t, y0, at, E = rows.world, rows.t, rows.y0, rows.t[0], rows.exact(rows.y0, len(rows.t))
    gap, parts = float(made.about["gap"]), int(made.about["parts"])
    if at != 0 or not (made.kind == "step" or made.mistake in ATTITUDES or made.size < CLOSE):
        return
    near = rows.near

    def scaled_size(Z: Any) -> float:
        # Differences from the exact motion are a multiple of those of the rival.
        x = (differences(E[:near], Z[:near], rows.scale)[:, rows.kept] / rows.grain).ravel()
        A = np.column_stack([rows.begun[: len(x)], x])
        A = A / np.maximum(np.abs(A).max(axis=0), 1e-300)
        d = rows.d[: len(x)]
        return rows.size(d - A @ np.linalg.lstsq(A, d, rcond=1e-12)[0])

    begun = world.but(q0=y0[:4], w0=y0[4:])
    index = np.rint(t / gap).astype(int)
    for name in STEPS if made.mistake not in ATTITUDES else ():
        if name != made.mistake and not (name.startswith("Buss") and is_table(world.wheel)):
            Z = march(begun, name, int(index[-1]) + 1, gap, parts)[index]
            if np.isfinite(Z).all():
                yield name, 1, scaled_size(Z)
    if made.mistake in ATTITUDES:
        h = gap / parts
        w = world.solve(np.arange((near - 1) * parts + 1) * h, y0)[:, 4:]
        for name, rule in ATTITUDES.items():
            if name != made.mistake:
                yield name, 1, scaled_size(np.hstack([integrate(rule, y0[:4], w, h, parts), E[:near, 4:]]))


UNREAD: dict[str, Any] = {
    "transposed": lambda q, w: (motion.back(q), w),
    "world rates": lambda q, w: (q, motion.spin(motion.back(q), w)),
    "body rates": lambda q, w: (q, motion.spin(q, w)),
    "reversed rates": lambda q, w: (q, -w),
    "rates in degrees": lambda q, w: (q, np.radians(w)),
    "rates in radians": lambda q, w: (q, np.degrees(w)),
}
