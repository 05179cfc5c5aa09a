"""Pairs of recordings of one free body: one right and one with a mistake, both wrong, or both right. Some have other times.

`conservative verify a.csv b.csv` is asked with the body and without it. Without it, the files may not tell which one is wrong:
each is a free rotation of a body of its own. `is_free` decides this with the equations of this generator and SciPy's fit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from . import decide, motion
from .files import Planted, simulate, write
from .mistakes import ATTITUDES, DRIFTS, HABITS, READINGS, ROWS, SAMPLES, SCENES, STEPS, TIMES, needs
from .run import is_named, true_names
from .worlds import Draw, World, draw_body

LAYOUT = "quaternions wxyz"
LEFT_OUT = ("body rates", "rates in radians")
"""Mistakes that need files with other options."""
KINDS = {
    "scene": tuple(name for name in SCENES if not needs(name)),
    "step": tuple(STEPS),
    "attitude": (*ATTITUDES, *DRIFTS),
    "reading": tuple(name for name in READINGS if name not in LEFT_OUT),
    "time": tuple("time shift" if name == "time in ms" else name for name in TIMES),  # a column t may be in ms
    "habit": HABITS,
    "rows": ROWS,
}
"""Mistakes that a recording of a free body can have, by kind."""
MISTAKES = tuple((kind, name) for kind, names in KINDS.items() for name in names)
ONE_WRONG, BOTH_WRONG, BOTH_RIGHT = 60, 10, 10
PAIRS = range(ONE_WRONG + BOTH_WRONG + BOTH_RIGHT)
"""Numbers of pairs: first with one wrong recording, then with two, then with none."""
NOISES = {"none": 6, "9 digits": 2, "6 digits": 1, "1e-4": 1}
"""Noises and digits of both recordings, and their shares. Habits and recorders have no noise of their own."""
FREE = 30.0
"""Largest error, in grains, that a free rotation leaves in rows which are one: the fit is coarser than the files."""


@dataclass(frozen=True, eq=False)
class Pair:
    """Two recordings, of which `wrong` are wrong, and the motions in them: times (n,), s, and states (n, 7)."""

    number: int
    made: tuple[Planted, Planted]
    motions: tuple[tuple[Any, Any], tuple[Any, Any]]
    wrong: tuple[int, ...]

    @property
    def scene(self) -> str:
        """The scene file of the body."""
        return self.made[0].scene


def choose(number: int) -> list[tuple[str, str]]:
    """Return the kinds and names of the mistakes of a pair."""
    spread = len(MISTAKES) / ONE_WRONG
    if number < ONE_WRONG:
        return [MISTAKES[int(number * spread)]]
    if number < ONE_WRONG + BOTH_WRONG:
        k = number - ONE_WRONG
        return [MISTAKES[(7 + 8 * k) % len(MISTAKES)], MISTAKES[(53 + 8 * k) % len(MISTAKES)]]
    return []


def plant(number: int) -> Pair:
    """Return a pair: the first drawn one whose mistakes are larger than noise and digits."""
    drawn = (_plant(number, Draw(500_000 + number + len(PAIRS) * attempt)) for attempt in count())
    return next(pair for pair in drawn if all(pair.made[place].expected == "wrong" for place in pair.wrong))


def _plant(number: int, draw: Draw) -> Pair:
    mistakes = choose(number)
    world, rate = draw_free(draw, [name for _, name in mistakes])
    gap = float(f"{2 * math.pi / draw.between(25, 40) / rate:.2e}")
    n = int(draw.between(60, 110))
    still = any(kind == "habit" or name in (*SAMPLES, "held rows") for kind, name in mistakes)
    noise = draw.pick([*NOISES][: 3 if still else None], [*NOISES.values()][: 3 if still else None])
    order = [0, 1] if draw.chance(0.5) else [1, 0]
    made, motions, wrong = dict[int, Planted](), dict[int, tuple[Any, Any]](), list[int]()
    for place, (kind, name) in zip(order, [*mistakes, ("right", "right"), ("right", "right")], strict=False):
        t = gap * np.arange(n)
        if kind == "right":
            t = times_of_right(draw, t, gap)
        recording = Planted(number, kind, name, world, LAYOUT, noise)
        recording.scene = world.toml(float(t[-1]) * 1.5 + gap)
        recording.about |= {"turns": gap * len(t) * rate / (2 * math.pi)}
        recording.about |= {"gap": gap, "parts": int(draw.random.integers(1, 4)), "rate": rate, "parts of the scene": "free"}
        Y = simulate(draw, recording, t, gap, recording.about["parts"], rate)
        write(draw, recording, t[: len(Y)], Y)
        made[place], motions[place] = recording, (t[: len(Y)], Y)
        wrong += [place] * (kind != "right")
    return Pair(number, (made[0], made[1]), (motions[0], motions[1]), tuple(sorted(wrong)))


def draw_free(draw: Draw, mistakes: list[str]) -> tuple[World, float]:
    """Return a free body with three moments and any axes, which all mistakes change, and its rate, rad/s."""
    while True:
        J, axes = draw_body(draw, "any")
        rate = draw.between(0.5, 5)
        direction = draw.vector()
        q = draw.random.normal(size=4)
        world = World(J, q / np.linalg.norm(q), axes @ (rate * direction))
        changed = [SCENES[name](world, Draw(0)) is not None for name in mistakes if name in SCENES]
        if np.abs(direction).min() > 0.2 and all(changed):
            return world, rate


def times_of_right(draw: Draw, t: Any, gap: float) -> Any:
    """Return the times of a right recording: the same ones, other ones of the same run, or those of a later start."""
    how = draw.pick(("same", "rate", "later"))
    if how == "same":
        return t
    if how == "rate":
        return np.linspace(0.0, float(t[-1]), int(len(t) * draw.between(0.8, 1.8)))
    return t[: len(t) - 5] + gap * draw.between(0.2, 4)


def is_free(t: Any, Y: Any, grain: Any, scale: float) -> bool:
    """Return whether rows (n, 7) are a free rotation of some body, up to some grains: SciPy's fit of inertia and start."""
    R = np.moveaxis(np.array([motion.spin(Y[:, :4], np.tile(e, (len(Y), 1))) for e in np.eye(3)]), 0, -1)
    basis = [np.outer(a, b) + np.outer(b, a) for i, a in enumerate(np.eye(3)) for b in np.eye(3)[i:]]
    L = np.stack([np.einsum("nij,jk,nk->ni", R, e, Y[:, 4:]) for e in basis], axis=-1)
    rows = (L - L.mean(axis=0)).reshape(-1, 6)
    _, sizes, null = np.linalg.svd(rows)
    small = null[sizes < max(1e-7 * sizes[0], 1.5 * sizes[-1])]
    ball = np.array([0.5, 0, 0, 0.5, 0, 0.5])
    J = np.tensordot(small.T @ (small @ ball) if len(small) > 1 else null[-1], np.array(basis), 1)
    moments, axes = np.linalg.eigh(J * np.sign(np.trace(J)))
    least = 1e-4 if moments[0] > 0 else 0.02
    half = axes * np.sqrt(np.maximum(moments, least * moments[-1]) / moments[-1])
    lower = np.linalg.qr(half.T)[1].T
    at = np.tril_indices(3)

    def left(p: Any) -> Any:
        half = np.zeros((3, 3))
        half[at] = lower[at] + p[:6]
        y0 = np.append(motion.times(Y[0, :4], motion.turn(p[6:9])), Y[0, 4:] + scale * p[9:])
        made = World(half @ half.T + 1e-9 * np.eye(3), y0[:4], y0[4:]).solve(t - t[0])
        return (np.nan_to_num(decide.differences(Y, made, scale), nan=1e3) / np.repeat(grain, 3)).ravel()

    def size(x: Any) -> float:
        return float(np.sqrt((x**2).mean()))

    begun = np.zeros(12)  # rows without noise show the inertia at once
    return size(left(begun)) < FREE or size(least_squares(left, begun, x_scale="jac", max_nfev=30).fun) < FREE


def outcome(number: int, with_body: bool, folder: Path) -> dict[str, Any]:
    """Return the row of a pair: what was planted, what was answered, and the complaint about it."""
    from conservative.benchmarks.verification.verify import verify

    pair = plant(number)
    paths = [folder / "a.csv", folder / "b.csv"]
    for path, made in zip(paths, pair.made, strict=True):
        path.write_text(made.text, encoding="utf-8")
    (folder / "scene.toml").write_text(pair.scene, encoding="utf-8")
    (found,) = verify(paths, folder / "scene.toml" if with_body else None)
    verdicts = [str(finding.verdict) for finding in found.findings[:2]]
    row: dict[str, Any] = {
        "pair": number, "with body": with_body, "mistakes": [made.mistake for made in pair.made], "wrong": list(pair.wrong),
        "noise": pair.made[0].noise, "verdict": str(found.verdict), "verdicts": verdicts,
        "named": [[list(cause.keys) for cause in finding.causes] for finding in found.findings[:2]],
        "expected": [made.expected for made in pair.made], "identifiable": [made.identifiable for made in pair.made],
        "same": [sorted(made.same) for made in pair.made], "sentence": found.sentence,
    }  # fmt: skip
    row["cannot tell"] = verdicts == ["undecided", "undecided"]
    if not with_body and row["cannot tell"]:
        row["free"] = [
            is_free(*moved, made.about["grain"], made.about["scale"])
            for moved, made in zip(pair.motions, pair.made, strict=True)
        ]
    return row | {"complaint": complaint(row)}


def names(row: dict[str, Any], place: int) -> bool:
    """Return whether an answer names the mistake of a recording, or one that makes the same rows."""
    asked = {"mistake": row["mistakes"][place], "same": row["same"][place], "named": row["named"][place]}
    return is_named(asked) or any({*keys} <= true_names(asked) for keys in asked["named"])


def complaint(row: dict[str, Any]) -> str:
    """Return the complaint about an answer, or ""."""
    wrong, verdicts = row["wrong"], row["verdicts"]
    right = [place for place in (0, 1) if place not in wrong]
    if any(verdicts[place] == "wrong" for place in right):
        return "right called wrong"
    if any(verdicts[place] == "right" for place in wrong if row["expected"][place] == "wrong"):
        return "wrong called right"
    if not wrong:
        return "" if row["verdict"] == "right" else "right not called right"
    if len(wrong) == 2 and not row["with body"]:
        return ""  # no recording determines the body, or one of the mistakes makes another one
    if not row["with body"] and row["cannot tell"]:
        if not all(row["free"]):
            return "the files can tell"
    elif any(verdicts[place] != "wrong" for place in wrong):
        return "wrong one not found"
    if any(row["identifiable"][place] and not names(row, place) for place in wrong):
        return "not named"
    return ""
