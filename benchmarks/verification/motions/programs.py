"""Tolerances of motions: the errors that right programs make on them, of every design in `integrators`."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np

from conservative import registry
from conservative.attitude import Array, angle_between
from conservative.errors import Unsupported
from conservative.grid import Grid

from .integrators import designs, gather
from .motion import SAMPLE, Motion

ORDERS, ANGLES, PARTS = (1, 2, 4), (0.1, 0.03, 0.01), (1, 3, 10)
"""Declared orders and steps that have tolerances: orders; |w| h, rad; and the number of these steps in 0.1 rad."""
LEAST = {1: 1e-6, 2: 1e-6, 4: 1e-10}
"""Errors that are allowed in addition, by order: implicit steps are iterated to a tolerance."""
MARGIN = 2.0
"""Tolerances over the largest error of right programs."""
HELD = 4.0
"""Factor of tolerances of order 1 with a fixed point: Jolt and Rapier hold it by a joint, and err on `heavy_fast` nine times as
much as Euler steps on quaternions and body rates, which is two to three times as much as `MARGIN` allows."""
OURS = {1: (), 2: ("no_squish", "moser_veselov:order=2"), 4: ("no_squish:order=4", "splitting:order=4")}
"""Methods of this package by order, on motions that they take: NoSquish errs up to 23 times as much as Runge and Kutta's."""
QUANTITIES = ("attitude", "rates", "energy", "momentum")


class Measured(NamedTuple):
    """Sizes (3,) of rates, energy and momentum, tolerances (4,) by order and |w| h, and what single precision may add."""

    scale: Array
    tolerances: dict[tuple[int, float], Array]
    single: float


def measure(motions: Sequence[Motion], parts: Sequence[int] = PARTS) -> list[Measured]:
    """Return the tolerances of motions, all motions at once, by steps of 0.1 rad over each of `parts`."""
    held, bodies, comparison = np.array([motion.weight is not None for motion in motions]), gather(motions), Comparison(motions)
    tolerances, more = dict[tuple[int, float], Array](), np.zeros(len(motions))
    for order in ORDERS:
        for n in parts:
            runs = [comparison.errors(*design.samples(bodies, n)) for design in designs(order)]
            largest = np.max([*runs, *(_errors_of(name, motions, comparison.scales, n) for name in OURS[order])], axis=0)
            margin = MARGIN * np.where(held & (order == 1), HELD, 1.0)[:, None]
            tolerances[order, ANGLES[PARTS.index(n)]] = _round_up(margin * largest + LEAST[order])
    if PARTS[-1] in parts:
        rounded = gather(motions, single=True)
        for order in ORDERS:
            for design in designs(order, single=True):
                above = comparison.errors(*design.samples(rounded, PARTS[-1])) - tolerances[order, ANGLES[-1]]
                more = np.maximum(more, above.max(axis=1))
    return [
        Measured(comparison.scales[i], {key: tolerance[i] for key, tolerance in tolerances.items()}, max(single(motion), x))
        for i, (motion, x) in enumerate(zip(motions, _round_up(np.maximum(more, LEAST[4])).tolist(), strict=True))
    ]


def single(motion: Motion) -> float:
    """Return the error that single precision may add by rounding of each step. `measure` adds what right programs need beyond.

    It is larger if a momentum is, from which rates are computed: with a rotor, or a moment that is small. Energies of composed
    splittings need more in some fresh motions, up to twice as much, because the fifteen rotations in a step change the size of
    a momentum always in the same direction. No published motion needs more.
    """
    exact, J = motion.exact, np.linalg.eigvalsh(motion.inertia_B)
    momentum = np.linalg.norm(exact["momentum_W"], axis=1).max() / np.linalg.norm(exact["w_WB_B"], axis=1).max()
    return float(2e-5 + 1e-6 * motion.steps * motion.samples * PARTS[-1] * (1 + momentum / J[0] / 3))


def _round_up(x: Array) -> Array:
    """Return numbers rounded up to two digits."""
    size = 10.0 ** (np.floor(np.log10(x)) - 1)
    return np.array([float(f"{number:.1e}") for number in (np.ceil(x / size) * size).ravel()]).reshape(x.shape)


def sizes(motions: Sequence[Motion]) -> Array:
    """Return the sizes (n, 3) of rates, kinetic energy and momentum, which errors are relative to."""
    return np.array([
        [np.linalg.norm(w, axis=1).max(), (w @ m.inertia_B * w).sum(axis=1).max() / 2, np.linalg.norm(L, axis=1).max()]
        for m in motions for w, L in [(m.exact["w_WB_B"], m.exact["momentum_W"])]
    ])  # fmt: skip


class Comparison:
    """The exact samples of motions, one after the other, to compare samples of programs with.

    `scales` are the sizes (motions, 3) of rates, kinetic energy and momentum, by default those of the exact motions.
    """

    def __init__(self, motions: Sequence[Motion], scales: Array | None = None) -> None:
        count, none = [motion.samples for motion in motions], (0.0, 0.0, 0.0)
        self.scales = sizes(motions) if scales is None else scales
        self.first = np.cumsum([0, *count])[:-1]

        def repeated(values: Any) -> Array:
            return np.repeat(np.array(values, dtype=float), count, axis=0)

        self.J, self.arm = repeated([motion.inertia_B for motion in motions]), repeated([motion.arm for motion in motions])
        self.rotor = repeated([motion.rotor_momentum_B or none for motion in motions])
        self.scale = repeated(self.scales)
        self.exact = {name: np.concatenate([motion.exact[name][1:] for motion in motions]) for name in SAMPLE}

    def errors(self, R: Array, w: Array) -> Array:
        """Return the largest errors (motions, 4), in `QUANTITIES`, of attitudes (samples, 3, 3) and rates (samples, 3)."""
        exact, size = self.exact, self.scale
        with np.errstate(all="ignore"):
            L = (self.J @ w[..., None])[..., 0]
            energy = (w * L).sum(axis=1) / 2 + (R[:, 2] * self.arm).sum(axis=1)
            momentum = (R @ (L + self.rotor)[..., None])[..., 0]
            made = np.stack([
                angle_between(R, exact["R_WB"]),
                np.linalg.norm(w - exact["w_WB_B"], axis=1) / size[:, 0],
                np.abs(energy - exact["energy"]) / size[:, 1],
                np.linalg.norm(momentum - exact["momentum_W"], axis=1) / size[:, 2],
            ], axis=1)  # fmt: skip
        return np.maximum.reduceat(np.nan_to_num(made, nan=1e6, posinf=1e6), self.first)


def errors(motions: Sequence[Motion], scales: Array, samples: Iterable[tuple[Array, Array]]) -> Array:
    """Return the largest errors (n, 4) of the attitudes and rates of motions."""
    R, w = zip(*samples, strict=True)
    return Comparison(motions, scales).errors(np.concatenate(R), np.concatenate(w))


def error(motion: Motion, scale: Array, samples: tuple[Array, Array]) -> Array:
    """Return the largest errors (4,) of the attitudes and rates at the samples of a motion."""
    return errors([motion], scale[None], [samples])[0]


def _errors_of(name: str, motions: Sequence[Motion], scales: Array, parts: int) -> Array:
    """Return the largest errors (n, 4) of a method of this package; 0 for motions that it does not take."""
    method, out = registry.method(name), np.zeros((len(motions), 4))
    for i, motion in enumerate(motions):
        every = motion.steps * parts
        with suppress(Unsupported):
            trajectory = method.solve(motion.scene, Grid(motion.step / parts, every * motion.samples, every))
            out[i] = error(motion, scales[i], (trajectory.R_WB[1:], trajectory.w_WB_B[1:]))
    return out
