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
BY_LETTER = ("quaternions wxyz", "quaternions xyzw", "PlotJuggler", "MuJoCo", "JSON lines", "TUM")
"""Layouts whose names or format define the order of quaternions."""
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
    has = {*layout.has.split()}
    needed = {"R", "w"} if kind == "attitude" or mistake in (*BOTH, *ATTITUDES_ALONE, "rates at other times") else set()
    needed |= {"w"} if mistake in HABITS else {"R"} if mistake in ("body axes", "transposed in some rows") else set()
    needed |= {part for part, change in zip("Rw", SAMPLES.get(mistake, ("", "")), strict=True) if change}
    special = {
        "order xyzw": name in BY_LETTER,
        "order wxyz": name in BY_LETTER,
        "rates in degrees": layout.unit == 1,
        "rates in radians": layout.unit == DEG,
        "world rates": "rates" not in layout.options,
        "body rates": layout.options.get("rates") == "world",
        "time in ms": layout.names[:1] in (("time (s)",), ('"Time (s)"',)),
    }
    return needed <= has and special.get(mistake, True)


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
    noise = draw.pick(NOISES, weights_of_noise(kind, mistake))
    names = [name for name in LAYOUTS if fits(name, kind, mistake) and has_times(LAYOUTS[name], world, gap, coarse)]
    layout = draw.pick(names)
    made = Planted(seed, kind, mistake, world, layout, noise)
    made.about |= {
        "turns": round(turns, 3), "shape": shape, "special": special, "per turn": per_turn, "parts": parts, "gap": gap,
        "rate": rate, "parts of the scene": ", ".join(features(world)),
    }  # fmt: skip
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


def weights_of_noise(kind: str, mistake: str) -> list[float]:
    """Return the weights of `NOISES`."""
    # Programs have habits, and no noise of a sensor; rows that a recorder repeats or interpolates have no noise of their own.
    if kind == "habit" or mistake in (*SAMPLES, "held rows"):
        return [4, 2, 3, 2, 1, 0, 0, 0]
    return [4, 2, 3, 2, 0.5, 1, 1, 1] if kind in ("step", "attitude") else [3, 1, 2, 2, 1, 1.5, 1.5, 1.5]


def degenerate(draw: Draw, special: str, rate: float) -> tuple[World, str]:
    """Return a world that hardly moves: a body at rest, or one that turns about a principal axis."""
    world, *_ = draw_world(draw, "", "principal")
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
    if kind in ("scene", "pair"):
        other = SCENES["another body" if kind == "pair" else name](world, draw)
        assert other is not None
        if kind == "pair":
            made.about["pair"] = ("another body", "damping")
            other = other.but(drag=draw.between(1e-3, 0.03) * rate)
        return other.solve(t)
    if kind == "step":
        return simulate_steps(draw, made, n, gap, parts)
    if name in ATTITUDES:
        Y = world.solve(np.arange((n - 1) * parts + 1) * (gap / parts))
        return np.hstack([integrate(ATTITUDES[name], Y[0, :4], Y[:, 4:], gap / parts, parts), Y[::parts, 4:]])
    if kind == "time" and name != "time in ms":
        return shift_times(draw, name, world, t, gap)
    if kind == "habit":
        return habit(draw, name, world, n, gap, parts)
    Y = world.solve(t)
    if kind == "rows":
        return change_rows(draw, name, Y, rate)
    if name in DRIFTS:
        return np.hstack([DRIFTS[name](world, t, Y, slow(t, Y[:, 4:], draw)), Y[:, 4:]])
    return np.hstack(READINGS[name](Y[:, :4], Y[:, 4:], t, draw)) if kind == "reading" else Y


def simulate_steps(draw: Draw, made: Planted, n: int, gap: float, parts: int) -> Any:
    """Return the states of a method with long steps, and find its round-off in single precision."""
    world, name = made.world, made.mistake
    normalise = draw.chance(0.7) or "q" not in LAYOUTS[made.layout].has
    made.about["normalise"] = normalise
    rows = march(world, name, n, gap, parts, normalise, made.noise == "single")
    if made.noise == "single":
        d = decide.differences(rows, march(world, name, n, gap, parts, normalise), np.abs(world.w0).max())
        made.about["round-off"] = float(np.sqrt(np.nanmean((d**2).sum(axis=1))))
    return rows


def finite(Y: Any) -> Any:
    """Return the rows of a method before it diverges."""
    good = np.isfinite(Y).all(axis=1) & (np.abs(np.where(np.isfinite(Y), Y, 0.0)).max(axis=1) < 1e12)
    return Y[: int(np.argmin(good)) if not good.all() else len(Y)]


def write(draw: Draw, made: Planted, t: Any, Y: Any) -> None:
    """Write the text of a file, find the grain of its attitudes, rad, and rates, relative to the largest, and decide."""
    layout, Y = LAYOUTS[made.layout], finite(Y)
    t = t[: len(Y)]
    sigma = float(made.noise) if made.noise.startswith("1e") else 0.0
    scale = float(np.linalg.norm(Y[:, 4:], axis=1).max()) or 1.0
    q, w = Y[:, :4].copy(), Y[:, 4:].copy()
    if sigma:
        q = motion.times(q, motion.turn(sigma * draw.random.normal(size=(len(q), 3))))
        w = w + sigma * scale * draw.random.normal(size=w.shape)
    stamps, late = stamps_of(layout, t, made.world.in_time)
    stamps = t * 1e3 if made.mistake == "time in ms" else stamps
    number, single = digits_of(made.noise), made.noise == "single"
    blocks, rounded = list[tuple[str, Any]](), {"q": 0.0, "w": 0.0}
    for kind, x in layout.columns(q, w, t):
        if kind in rounded:
            kept = x.astype(np.float32) if single else x
            blocks.append((kind, kept))
            off = np.array([float(number % v) for v in kept.ravel()]).reshape(x.shape) - x
            rounded[kind] = float(np.sqrt((off**2).sum(axis=1).mean()))
        else:
            blocks.append((kind, stamps if kind in ("t", "sec") else x))
    others = math.sqrt(3) * sigma, late * scale, made.about.get("round-off", 0.0)
    angle = math.hypot(layout.angle * rounded["q"], *others) + decide.FLOOR
    rates = math.hypot(rounded["w"] / layout.unit / scale, *others) + decide.FLOOR
    rates = math.hypot(rates, angle) if layout.options.get("rates") == "world" else rates
    made.about |= {"grain": (angle, rates), "scale": scale, "rows": len(t)}
    empty = np.zeros(len(t), bool)
    if made.kind in ("right", "scene", "reading") and len(t) > 60 and draw.chance(0.12):
        empty[draw.random.choice(np.arange(1, len(t) - 1), size=len(t) // 15, replace=False)] = True
        made.about["nan"] = int(empty.sum())
    lines = lines_of(layout, blocks, number, empty)
    if made.kind in ("right", "scene", "step", "reading") and len(t) > 20 and draw.chance(0.12):
        twice = {*draw.random.choice(np.arange(1, len(t)), size=max(1, len(t) // 10), replace=False).tolist()}
        lines = [line for i, line in enumerate(lines) for line in [line] * (1 + (i in twice))]
        made.about["duplicated"] = len(twice)
    made.text = file_of(layout, lines)
    decide.decide(made, t[~empty], Y[~empty])


def stamps_of(layout: Layout, t: Any, in_time: bool) -> tuple[Any, float]:
    """Return time stamps in the unit of a layout, and the root mean square of their rounding, s."""
    if not layout.whole:
        return t * layout.second if layout.second > 1 else t, 0.0
    # Times since 1970 are not times of a scene that depends on time; whole numbers stay exact.
    base = 0 if in_time else round(layout.origin * layout.second)
    ticks = [round(x * layout.second) for x in t.tolist()]
    off = np.array([tick - x * layout.second for tick, x in zip(ticks, t.tolist(), strict=True)]) / layout.second
    far = 1.2e-7 if layout.origin > 1e6 and layout.second == 1e9 else 0.0  # in double precision, s since 1970
    return np.array([base + tick for tick in ticks], dtype=object), float(np.sqrt((off**2).mean())) + far
