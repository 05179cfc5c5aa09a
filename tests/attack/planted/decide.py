"""What the answer to a file should be: decided by the generator from its own motions, before the verification runs.

The grain of a file is the root mean square, in a row, of noise, digits and single precision, at least 1e-9: of attitudes, rad,
and of rates, relative to the largest. A file is wrong if it differs from every exact motion by more than `WRONG` grains (root mean
square over the rows; motions start in the first row, or, with noise or digits, as fits best). A mistake is identifiable if it
differs by more than `IDENTIFIABLE` grains from the right motion and from every rival with as few fitted numbers: other mistakes,
whose numbers fit best.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from . import motion
from .layouts import LAYOUTS
from .mistakes import ATTITUDES, BOTH, NUMBERS, SCENES, STEPS, integrate, march, other_orbit
from .worlds import Draw, World, is_table, scaled

FLOOR, WRONG, IDENTIFIABLE = 1e-9, 3.0, 10.0
NEAR = 0.3
"""Largest difference, rad or relative, that is treated to first order."""
FEWEST = 12
CLOSE = 300.0
"""Difference, in grains, above which a wrong scene or reading is not taken for a long step."""


def differences(Y: Any, Z: Any, scale: float) -> Any:
    """Return turns (n, 3), rad, and relative rates (n, 3) between states; those of a method that diverged are large."""
    with np.errstate(all="ignore"):
        q = motion.times(motion.back(Z[:, :4]), Y[:, :4])
        q = q / np.linalg.norm(q, axis=1, keepdims=True)
        d = np.hstack([motion.vector(q), (Y[:, 4:] - Z[:, 4:]) / scale])
    return np.clip(np.where(np.isfinite(d), d, 1e9), -1e9, 1e9)


@dataclass(frozen=True, eq=False)
class Rows:
    """The rows of a file, without noise, beside the exact motion `E` (n, 7) from the state `y0`; differences are in grains."""

    world: World
    t: Any
    Y: Any
    y0: Any
    kept: list[int]
    grain: Any
    scale: float
    inexact: bool
    extra: dict[str, Any] = field(default_factory=dict)

    @cached_property
    def E(self) -> Any:
        return self.world.solve(self.t, self.y0, self.t[0])

    def off(self, Z: Any) -> Any:
        """Return the differences (n k,) of states from the exact motion."""
        return (differences(Z, self.E[: len(Z)], self.scale)[:, self.kept] / self.grain).ravel()

    @cached_property
    def d(self) -> Any:
        """The differences of the file."""
        return self.off(self.Y)

    @cached_property
    def start(self) -> list[Any]:
        """Differences that small changes of the start make, per change of 1; none if the first row is exact."""
        out = []
        for k in self.kept if self.inexact else []:
            e, y = 1e-6, self.y0.copy()
            if k < 3:
                y[:4] = motion.times(y[:4], motion.turn(e * np.eye(3)[k]))
            else:
                y[k + 1] += e * self.scale
            out.append(self.off(self.world.solve(self.t, y, self.t[0])) / e)
        return out

    def left(self, x: Any, *others: Any) -> float:
        """Return the size of differences that neither the start nor other differences explain."""
        if many := [column[: len(x)] for column in (*self.start, *others)]:
            A = np.nan_to_num(np.array(many).T)
            A = A / np.maximum(np.abs(A).max(axis=0), 1e-300)
            x = x - A @ np.linalg.lstsq(A, x, rcond=1e-12)[0]
        square = x.reshape(-1, len(self.kept) // 3, 3) ** 2
        return float(np.sqrt(square.sum(axis=2).mean(axis=0)).max())

    @cached_property
    def near(self) -> int:
        """The number of rows before the differences become too large for first order."""
        far = (np.abs(self.d.reshape(len(self.t), -1) * self.grain) > NEAR).any(axis=1)
        first = int(np.argmax(far)) if far.any() else len(self.t)
        return len(self.t) if first < FEWEST else first

    def take(self, n: int) -> Rows:
        """Return the first rows."""
        return Rows(self.world, self.t[:n], self.Y[:n], self.y0, self.kept, self.grain, self.scale, self.inexact, self.extra)


def rows_of(made: Any, t: Any, Y: Any) -> Rows:
    """Return the rows of a file beside the exact motion that starts in the first of them."""
    has, world = LAYOUTS[made.layout].has.split(), made.world
    kept = [*range(3)] * ("R" in has) + [*range(3, 6)] * ("w" in has)
    y0 = world.start if t[0] == 0 else world.solve(t[:1])[0]
    y0 = np.append(Y[0, :4] / np.linalg.norm(Y[0, :4]) if "R" in has else y0[:4], Y[0, 4:] if "w" in has else y0[4:])
    grain = np.repeat(made.about["grain"], 3)[kept]
    # A method that diverges is compared at the scale of the exact motion.
    scale = float(np.linalg.norm(Y[:, 4:], axis=1).max()) or 1.0
    scale = min(scale, 10 * float(np.linalg.norm(world.solve(t[-1:], y0, t[0])[0, 4:])) + float(np.linalg.norm(y0[4:]))) or 1.0
    inexact = made.noise != "none" or max(made.about["grain"]) > 1e-8
    return Rows(world, t, Y, y0, kept, grain, scale, inexact, dict(made.about))


def decide(made: Any, t: Any, Y: Any) -> None:
    """Decide whether a file is right, whether its mistake is identifiable, and which others make the same rows."""
    made.expected = "right" if made.kind == "right" else "wrong"
    if made.kind == "right" or len(t) < 2:
        return
    if made.mistake == "time in ms":
        made.identifiable, made.size = made.about["turns"] > 0.5, np.inf
        made.reason = "" if made.identifiable else "less than half a turn"
        return
    rows = rows_of(made, t, Y)
    near = rows.take(rows.near)
    made.size = near.left(near.d)
    if near.near < len(t) and made.size < WRONG:
        made.size = max(made.size, rows.left(rows.d))
    norm = abs(np.linalg.norm(Y[:, :4], axis=1) - 1).max() if "q" in LAYOUTS[made.layout].has else 0.0
    few = made.mistake in ("single rows", "first row", "transposed in some rows", "dropped rows")
    if few:
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
    if made.size < IDENTIFIABLE:
        made.reason = "noise or digits nearly hide it"
        made.same = {name for name, _, left in rivals(made, near) if left < IDENTIFIABLE}
        return
    mine, blocking = NUMBERS.get(made.mistake, 0), ""
    for name, numbers, left in rivals(made, near):
        if name != made.mistake and left < IDENTIFIABLE:
            made.same.add(name)
            if numbers <= mine:
                blocking = blocking or name
    made.identifiable = not blocking
    made.reason = f"the same rows: {blocking}" if blocking else ""


def rivals(made: Any, rows: Rows) -> Any:
    """Yield other explanations: a name, the number of its fitted numbers, and what they leave of the differences, in grains."""
    world, t, y0, at = rows.world, rows.t, rows.y0, rows.t[0]
    e = 1e-6

    def motion_of(other: World) -> Any:
        return rows.off(other.solve(t, y0, at))

    def fitted(name: str, *vectors: Any) -> tuple[str, int, float]:
        return name, len(vectors), rows.left(rows.d, *vectors)

    # The scene: parts that are missing, reversed or of another size. A difference of two exact motions is not scaled.
    for name, change in SCENES.items():
        if NUMBERS.get(name, 0) == 0 and name != made.mistake and (other := change(world, Draw(0))) is not None:
            yield name, 0, rows.left(rows.d - motion_of(other))
    varied: list[tuple[str, list[World]]] = [("damping", [world.but(drag=e * rows.scale)])]
    varied += [("size of the rotor", [world.but(wheel=scaled(world.wheel, 1 + e))])] if world.wheel is not None else []
    varied += [("size of the torque", [world.but(torque=scaled(world.torque, 1 + e))])] if world.torque is not None else []
    varied += [("size of the damping", [world.but(damping=world.damping * (1 + e))])] if world.damping is not None else []
    varied += [("size of the field", [world.but(pull=1 + e)])] * (world.field is not None)
    varied += [("rate of the orbit", [other_orbit(world, 1 + e)])] if world.orbit is not None else []
    varied += [("speed of attitudes", [world.but(speed=1 + e)])]
    moments, axes = np.linalg.eigh(world.J)
    bodies = [world.with_inertia(world.J + e * moments[i] * np.outer(axes[:, i], axes[:, i])) for i in range(3)]
    varied += [("other moments", bodies)]
    size = float(moments.mean())
    pairs = [(i, j) for i in range(3) for j in range(i, 3)]
    full = [np.zeros((3, 3)) for _ in pairs]
    for matrix, (i, j) in zip(full, pairs, strict=True):
        matrix[i, j] = matrix[j, i] = 1.0
    varied += [("another body", [world.with_inertia(world.J + e * size * matrix) for matrix in full])]
    for name, others in varied:
        yield fitted(name, *(motion_of(other) / e for other in others))
    # Times: along the motion.
    E = rows.E
    after = world.solve(t + 1e-6 / rows.scale, y0, at)
    late = rows.off(after) / 1e-6
    elapsed = np.repeat((t - at) * rows.scale, len(rows.kept))
    yield fitted("time shift", np.where(elapsed > 0, late, 0.0))
    yield fitted("phase drift", late, elapsed * late)
    if len(rows.kept) == 6:
        yield fitted("rates at other times", rows.off(np.hstack([E[:, :4], after[:, 4:]])) / 1e-6)
        rates = E[:, 4:]
        yield fitted("size of the rates", rows.off(np.hstack([E[:, :4], rates * (1 + e)])) / e)
        yield fitted("bias of the rates", *(rows.off(np.hstack([E[:, :4], rates + e * rows.scale * v])) / e for v in np.eye(3)))
        turns = [motion.turn(e * v) for v in np.eye(3)]
        yield fitted("rates in turned axes", *(
            rows.off(np.hstack([E[:, :4], motion.spin(np.broadcast_to(c, (len(t), 4)), rates)])) / e for c in turns
        ))
        yield fitted("body axes", *(
            rows.off(np.hstack([
                motion.times(E[:, :4], np.broadcast_to(c, (len(t), 4))),
                motion.spin(np.broadcast_to(motion.back(c), (len(t), 4)), rates),
            ])) / e
            for c in turns
        ))  # fmt: skip
        drift = (t - at)[:, None] * rows.scale
        yield fitted("constant turn", *(
            rows.off(np.hstack([motion.times(E[:, :4], motion.turn(e * drift * v)), rates])) / e for v in np.eye(3)
        ))
    # Times of each row for itself.
    if made.mistake in ("jittered times", "dropped rows") or made.size < CLOSE:
        a, b = rows.d.reshape(len(t), -1), late.reshape(len(t), -1)
        along = (a * b).sum(axis=1, keepdims=True) / np.maximum((b * b).sum(axis=1, keepdims=True), 1e-300)
        yield "jittered times", 99, rows.left((a - along * b).ravel())
    # Long steps.
    gap, parts = float(made.about["gap"]), int(made.about["parts"])
    if (made.kind == "step" or made.size < CLOSE) and at == 0:
        index = np.rint(t / gap).astype(int)
        n = int(index[-1]) + 1
        begun = world.but(q0=y0[:4], w0=y0[4:])
        for name in STEPS:
            if name != made.mistake and not (name.startswith("Buss") and is_table(world.wheel)):
                many = march(begun, name, n, gap, parts)[index]
                if np.isfinite(many).all():
                    yield fitted(name, rows.off(many))
    if made.kind == "attitude" and at == 0:
        h = gap / parts
        n = len(t)
        w = world.solve(np.arange((n - 1) * parts + 1) * h, y0)[:, 4:]
        for name, rule in ATTITUDES.items():
            if name != made.mistake:
                yield fitted(name, rows.off(np.hstack([integrate(rule, y0[:4], w, h, parts), E[:, 4:]])))
    # Other readings: what the file means by them is an exact motion.
    if len(rows.kept) == 6 and made.kind != "step":
        for name in BOTH:
            inverse = UNREAD.get(name)
            if inverse and name != made.mistake:
                Z = np.hstack(inverse(rows.Y[:, :4], rows.Y[:, 4:]))
                meant = Rows(world, t, Z, Z[0], rows.kept, rows.grain, rows.scale, rows.inexact)
                yield name, 0, float(np.sqrt((meant.d**2).mean()))


UNREAD: dict[str, Any] = {
    "transposed": lambda q, w: (motion.back(q), w),
    "world rates": lambda q, w: (q, motion.spin(motion.back(q), w)),
    "body rates": lambda q, w: (q, motion.spin(q, w)),
    "reversed rates": lambda q, w: (q, -w),
    "rates in degrees": lambda q, w: (q, np.radians(w)),
    "rates in radians": lambda q, w: (q, np.degrees(w)),
}
