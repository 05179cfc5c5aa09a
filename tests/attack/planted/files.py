"""Files for `conservative verify`: a world, a program, a recorder, a layout, noise, and what the answer should be.

The generator decides before the verification, see `decide.py`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from . import decide, motion
from .layouts import DEG, LAYOUTS, Layout, digits_of, file_of, lines_of
from .mistakes import (
    ATTITUDES,
    ATTITUDES_ALONE,
    BOTH,
    DRIFTS,
    HABITS,
    PAIR,
    READINGS,
    ROWS,
    SAMPLES,
    SCENES,
    STEPS,
    TIMES,
    change_rows,
    habit,
    integrate,
    march,
    needs,
    shift_times,
    slow,
)
from .worlds import Draw, World, draw_world

NOISES = ("none", "single", "9 digits", "6 digits", "4 digits", "1e-4", "1e-3", "1e-2")
MISTAKES: dict[str, tuple[tuple[str, ...], float]] = {
    "right": (("right",), 0.44),
    "scene": (tuple(SCENES), 0.19),
    "step": (tuple(STEPS), 0.13),
    "attitude": ((*ATTITUDES, *DRIFTS), 0.05),
    "reading": (tuple(READINGS), 0.07),
    "time": (TIMES, 0.04),
    "habit": (HABITS, 0.04),
    "rows": (ROWS, 0.03),
    "pair": ((PAIR,), 0.01),
}
"""Kinds of mistakes, their names and shares."""
FEWEST_TICKS = 50
"""Smallest distance of rows in units of whole time stamps."""
SPECIAL = ("at rest", "one axis", "two rows", "three rows", "ball", "constant")
"""Degenerate files."""


@dataclass(eq=False)
class Planted:
    """A file, how it is read, and what the answer should be.

    Attributes
    ----------
    scene, text, ending, options
        The scene file, the recording, its ending, and options of the command.
    mistake, kind
        The planted mistake, or "right".
    expected
        "right" or "wrong", or "" if the file is wrong by less than its noise allows.
    same
        Other mistakes that make the same rows.
    identifiable, reason
        Whether the file determines the mistake, and why not.
    size
        Difference from the exact motion, in grains.
    about
        Facts for tables.
    """

    seed: int
    kind: str
    mistake: str
    world: World
    layout: str
    noise: str
    scene: str = ""
    text: str = ""
    expected: str = "right"
    identifiable: bool = False
    reason: str = ""
    same: set[str] = field(default_factory=set)
    size: float = 0.0
    about: dict[str, Any] = field(default_factory=dict)

    @property
    def ending(self) -> str:
        """The ending of the file's name."""
        return LAYOUTS[self.layout].ending

    @property
    def options(self) -> dict[str, Any]:
        """Options of the command."""
        return LAYOUTS[self.layout].options


def choose(draw: Draw) -> tuple[str, str]:
    """Return a kind of mistake and its name."""
    kind = draw.pick(MISTAKES, [share for _, share in MISTAKES.values()])
    return kind, draw.pick(MISTAKES[kind][0])


def has_times(layout: Layout, world: World, gap: float, coarse: bool) -> bool:
    """Return whether a layout can have the times of the rows."""
    if layout.origin > 1e3 and world.in_time:  # times since 1970 are no times of the scene
        return False
    if layout.whole and gap * layout.second < FEWEST_TICKS:
        return False
    return not (layout.unnamed and coarse)  # only close rows tell the unit of their time


def fits(name: str, kind: str, mistake: str) -> bool:
    """Return whether a layout can show a mistake."""
    layout = LAYOUTS[name]
    has = layout.has.split()
    if mistake in ("order xyzw", "order wxyz"):
        return "q" in has and name in ("quaternions wxyz", "quaternions xyzw", "PlotJuggler", "MuJoCo", "JSON lines", "TUM")
    if mistake == "rates in degrees":
        return "w" in has and "R" in has and layout.unit == 1
    if mistake == "rates in radians":
        return "w" in has and "R" in has and layout.unit == DEG
    if mistake == "world rates":
        return "w" in has and "R" in has and "rates" not in layout.options
    if mistake == "body rates":
        return layout.options.get("rates") == "world"
    if mistake == "time in ms":
        return layout.names[:1] in (("time (s)",), ('"Time (s)"',))
    if mistake in BOTH or kind == "attitude" or mistake == "rates at other times" or mistake in ATTITUDES_ALONE:
        return "R" in has and "w" in has
    if mistake in ("body axes", "transposed in some rows"):
        return "R" in has
    if mistake in SAMPLES:
        return all(part in has for part, change in zip("Rw", SAMPLES[mistake], strict=True) if change)
    if mistake in HABITS:
        return "w" in has
    return True


def plant(seed: int) -> Planted:
    """Return the file of a seed."""
    draw = Draw(seed)
    kind, mistake = choose(draw)
    special = draw.pick(SPECIAL) if kind == "right" and draw.chance(0.15) else ""
    turns = draw.between(0.2, 50)
    world, rate, shape = draw_world(draw, needs(mistake), "ball" if special == "ball" else "", 6 * turns)
    while kind == "scene" and SCENES[mistake](world, Draw(0)) is None:
        world, rate, shape = draw_world(draw, needs(mistake), "", 6 * turns)
    if mistake.startswith("Buss") and isinstance(world.wheel, tuple):
        world = world.but(wheel=world.wheel[1][0])
    if special in ("at rest", "constant", "one axis"):
        world, shape = degenerate(draw, special, rate)
    coarse = kind in ("right", "scene", "reading") and draw.chance(0.15)
    per_turn = draw.between(1.05, 6.3) if coarse else draw.between(12, 40) if kind == "step" else draw.between(20, 80)
    few = kind in ("scene", "reading", "step") and draw.chance(0.04)
    fewest = {"two rows": 2, "three rows": 3}.get(special, draw.pick((2, 3, 5, 8, 13)) if few else 40)
    most = fewest if fewest < 40 else 1200 if kind == "step" else 2000
    n = int(np.clip(turns * per_turn, fewest, most))
    gap = float(f"{2 * math.pi / per_turn / rate:.2e}")
    turns = n * gap * rate / (2 * math.pi)
    parts = min(int(draw.random.integers(1, 9)), max(1, 4000 // n))
    # Programs have habits, and no noise of a sensor.
    weights = {"step": [4, 2, 3, 2, 0.5, 1, 1, 1], "attitude": [4, 2, 3, 2, 0.5, 1, 1, 1], "habit": [4, 2, 3, 2, 1, 0, 0, 0]}
    noise = draw.pick(NOISES, weights.get(kind, [3, 1, 2, 2, 1, 1.5, 1.5, 1.5]))
    names = [name for name in LAYOUTS if fits(name, kind, mistake) and has_times(LAYOUTS[name], world, gap, coarse)]
    layout = draw.pick(names)
    made = Planted(seed, kind, mistake, world, layout, noise)
    made.about |= {"turns": round(turns, 3), "shape": shape, "special": special, "per turn": per_turn, "parts": parts, "gap": gap,
                   "rate": rate, "parts of the scene": ", ".join(features(world))}  # fmt: skip
    t = gap * np.arange(n)
    stamped = t
    if kind in ("right", "scene") and not coarse and draw.chance(0.15) and n > 5:  # rows at irregular times, with their stamps
        t = np.append(0.0, np.sort(t[1:] + gap * draw.random.uniform(-0.3, 0.3, size=n - 1)))
        t = stamped = np.round(t / gap, 4) * gap
        made.about["irregular"] = True
    made.scene = world.toml(float(t[-1]) * 1.01 + gap)
    Y = simulate(draw, made, t, gap, parts, rate)
    n = len(Y)
    t, stamped = t[:n], stamped[:n]
    has = LAYOUTS[layout].has
    if kind in ("right", "scene") and "R" in has and "w" in has and n > 60 and draw.chance(0.2):
        cut = int(0.3 * n)  # the recording begins later
        t, stamped, Y = t[cut:], stamped[cut:], Y[cut:]
        made.about["cut"] = cut
    if kind in ("right", "scene", "step", "reading") and len(t) > 60 and draw.chance(0.15):  # gaps
        a = int(draw.random.integers(len(t) // 4, 3 * len(t) // 4))
        kept = np.delete(np.arange(len(t)), np.arange(a, a + int(draw.random.integers(1, len(t) // 5))))
        t, stamped, Y = t[kept], stamped[kept], Y[kept]
        made.about["gaps"] = n - len(kept)
    write(draw, made, t, Y)
    return made


def degenerate(draw: Draw, special: str, rate: float) -> tuple[World, str]:
    """Return a world that hardly moves: a body at rest, or one that turns about a principal axis."""
    world, _, shape = draw_world(draw, "", "principal")
    free = World(world.J, world.q0, world.w0)
    if special == "one axis":
        return free.but(w0=rate * draw.sign() * np.eye(3)[draw.random.integers(3)]), "about a principal axis"
    return free.but(w0=np.zeros(3)), "at rest"


def features(world: World) -> list[str]:
    """Return the parts of a world."""
    parts = [] if world.field is None else [world.field[0]]
    parts += ["orbit"] * (world.orbit is not None)
    for name in ("wheel", "torque"):
        given = getattr(world, name)
        if given is not None:
            parts.append({"wheel": "motor", "torque": "torque table"}[name] if isinstance(given, tuple) else name)
    parts += [f"in {world.axes} axes"] * (world.torque is not None)
    return [*parts, *["damping"] * (world.damping is not None)] or ["free"]


def simulate(draw: Draw, made: Planted, t: Any, gap: float, parts: int, rate: float) -> Any:
    """Return the states in the rows of a file, without noise."""
    world, name, kind, n = made.world, made.mistake, made.kind, len(t)
    if kind == "scene":
        other = SCENES[name](world, draw)
        assert other is not None
        made.about["other"] = other
        return other.solve(t)
    if kind == "step":
        normalise = draw.chance(0.7) or "q" not in LAYOUTS[made.layout].has
        made.about["normalise"] = normalise
        rows = march(world, name, n, gap, parts, normalise, made.noise == "single")
        if made.noise == "single":
            d = decide.differences(rows, march(world, name, n, gap, parts, normalise), np.abs(world.w0).max())
            made.about["round-off"] = float(np.sqrt(np.nanmean((d**2).sum(axis=1))))
        return rows
    if name in DRIFTS:
        Y = world.solve(t)
        return np.hstack([DRIFTS[name](world, t, Y, slow(t, Y[:, 4:], draw)), Y[:, 4:]])
    if kind == "attitude":
        Y = world.solve(np.arange((n - 1) * parts + 1) * (gap / parts))
        q = integrate(ATTITUDES[name], Y[0, :4], Y[:, 4:], gap / parts, parts)
        return np.hstack([q, Y[::parts, 4:]])
    if kind == "time" and name != "time in ms":
        return shift_times(draw, name, world, t, gap)
    if kind == "habit":
        return habit(draw, name, world, n, gap, parts)
    if kind == "pair":
        other = SCENES["another body"](world, draw)
        assert other is not None
        made.about["pair"] = ("another body", "damping")
        return other.but(drag=draw.between(1e-3, 0.03) * rate).solve(t)
    Y = world.solve(t)
    if kind == "rows":
        return change_rows(draw, name, Y, rate)
    if kind == "reading":
        q, w = READINGS[name](Y[:, :4], Y[:, 4:], t, draw)
        return np.hstack([q, w])
    return Y


def finite(Y: Any) -> Any:
    """Return the rows of a method before it diverges."""
    good = np.isfinite(Y).all(axis=1) & (np.abs(np.where(np.isfinite(Y), Y, 0.0)).max(axis=1) < 1e12)
    return Y[: int(np.argmin(good)) if not good.all() else len(Y)]


def write(draw: Draw, made: Planted, t: Any, Y: Any) -> None:
    """Write the text of a file, find the grain of its attitudes, rad, and rates, relative to the largest, and decide."""
    layout = LAYOUTS[made.layout]
    Y = finite(Y)
    t = t[: len(Y)]
    sigma = float(made.noise) if made.noise.startswith("1e") else 0.0
    scale = float(np.linalg.norm(Y[:, 4:], axis=1).max()) or 1.0
    q, w = Y[:, :4].copy(), Y[:, 4:].copy()
    if sigma:
        q = motion.times(q, motion.turn(sigma * draw.random.normal(size=(len(q), 3))))
        w = w + sigma * scale * draw.random.normal(size=w.shape)
    number = digits_of(made.noise)
    ticks = t
    if layout.second > 1:
        ticks = t * layout.second
    if layout.whole:
        ticks = np.array([round(x * layout.second) for x in t.tolist()], dtype=object)
        base = round(layout.origin * layout.second) if not made.world.in_time else 0
        ticks = ticks + base
    if made.mistake == "time in ms":
        ticks = t * 1e3
    blocks = layout.columns(q, w, t)
    blocks = [(kind, ticks if kind in ("t", "sec") else x) for kind, x in blocks]
    single = made.noise == "single"
    blocks = [(kind, x.astype(np.float32) if single and kind in ("q", "w") else x) for kind, x in blocks]
    found = {}
    for kind, x in zip((kind for kind, _ in blocks), (x for _, x in layout.columns(q, w, t)), strict=True):
        if kind in ("q", "w"):
            rounded = np.array([float(number % v) for v in (x.astype(np.float32) if single else x).ravel()]).reshape(x.shape)
            found[kind] = float(np.sqrt(((rounded - x) ** 2).sum(axis=1).mean()))
    late = 0.0
    if layout.whole:
        late = float(
            np.sqrt(np.mean([(int(k) - base - x * layout.second) ** 2 for k, x in zip(ticks, t.tolist(), strict=True)]))
        )
        late = (late / layout.second + (1.2e-7 if layout.origin > 1e6 and layout.second == 1e9 else 0.0)) * scale
    more = made.about.get("round-off", 0.0)
    axis = math.sqrt(3) * sigma
    world_rates = layout.options.get("rates") == "world"
    angle = math.hypot(layout.angle * found.get("q", 0.0), axis, late, more) + decide.FLOOR
    rates = math.hypot(found.get("w", 0.0) / layout.unit / scale, axis, late, more) + decide.FLOOR
    rates = math.hypot(rates, angle) if world_rates else rates
    made.about |= {"grain": (angle, rates), "scale": scale, "rows": len(t)}
    empty = np.zeros(len(t), bool)
    if made.kind in ("right", "scene", "reading") and len(t) > 60 and draw.chance(0.12):
        empty[draw.random.choice(np.arange(1, len(t) - 1), size=len(t) // 15, replace=False)] = True
        made.about["nan"] = int(empty.sum())
    lines = lines_of(layout, blocks, number, empty)
    if made.kind in ("right", "scene", "step", "reading") and len(t) > 20 and draw.chance(0.12):
        twice = draw.random.choice(np.arange(1, len(t)), size=max(1, len(t) // 10), replace=False)
        lines = [line for i, line in enumerate(lines) for line in [line] * (1 + (i in {*twice.tolist()}))]
        made.about["duplicated"] = len(twice)
    made.text = file_of(layout, lines)
    decide.decide(made, t[~empty], Y[~empty])
