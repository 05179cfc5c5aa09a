"""Whether the attitudes of a recording turn by its rates: R' = R [w]x, which holds for any body in any field."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation, RotationSpline

from conservative.attitude import Array

from ..compare import SIGMAS, UNITS_OF_DIGITS, estimate_noise
from ..finding import Cause
from ..mistakes.readings import AXES, READINGS, Reading
from ..solution import States, integrate_rates
from .table import Recording

ROWS, FEWEST_ROWS = 400, 8
"""Largest and smallest number of rows that are compared."""
TURN = 0.5
"""Turn, rad, over which attitudes and rates are compared: much larger than noise, and nearly about one axis."""
CLEARLY, MOSTLY = 0.05, 0.6
"""Shares of `TURN` by which attitudes and rates contradict each other: clearly, if a mistake explains it, and without one. An
integrator makes smaller errors."""
LEFT, MOST_LEFT = 1e-3, 0.3
"""Share of a contradiction that an explanation leaves at most, and the share if digits, noise and interpolation allow more."""
BY_NUMBERS = (("size of the rates",), ("rates in turned axes", "rates in mirrored axes"))
"""Readings with numbers, in the order in which they are tried if no reading without numbers explains a contradiction."""


@dataclass(frozen=True, eq=False)
class Contradiction:
    """How a recording contradicts itself.

    Attributes
    ----------
    size
        The median difference, rad, between turns of the attitudes and turns by the rates, over a turn of `TURN`.
    causes
        Mistakes that explain it.
    repaired
        The recording without the mistake, if there is a single one.
    """

    size: float
    causes: tuple[Cause, ...] = ()
    repaired: Recording | None = None

    @property
    def proven(self) -> bool:
        """True if the recording is wrong: a mistake explains the contradiction, or nearly the whole motion is contradicted."""
        return bool(self.causes) or self.large

    @property
    def large(self) -> bool:
        """True if nearly the whole motion is contradicted."""
        return self.size > MOSTLY * TURN


def find_contradiction(recording: Recording, explain: bool = True) -> Contradiction | None:
    """Return how the attitudes of a recording contradict its rates, and which mistakes `explain` it.

    None if they agree but for errors that an integrator can make, or if the rows are too few or too far apart to decide.
    """
    t, data = recording.t[:ROWS], recording.data
    if data[0] is None or data[1] is None or len(t) < FEWEST_ROWS:
        return None
    R, w = data[0][:ROWS], data[1][:ROWS]
    turned: Array = np.linalg.norm(Rotation.from_matrix(np.swapaxes(R[:-1], 1, 2) @ R[1:]).as_rotvec(), axis=1)
    by_rates = np.linalg.norm(w[1:] + w[:-1], axis=1) / 2 * np.diff(t)
    gap = float(np.median(turned if turned.sum() > TURN else by_rates))
    if not TURN / len(turned) < gap < TURN / 2:
        return None
    k = math.ceil(TURN / gap)
    size = float(np.median(_apart(t, (R, w), k)))
    if size <= CLEARLY * TURN:
        return None
    if not explain:
        return Contradiction(size)
    causes, readings = list[Cause](), list[tuple[Reading, list[float]]]()
    usable = [reading for reading in READINGS if not reading.of_world and reading.of != AXES]
    usable = [reading for reading in usable if not reading.quaternions or recording.flipped is not None]
    for keys in ((), *BY_NUMBERS):
        for reading in usable:
            if reading.key in keys or not (keys or reading.numbers):
                numbers = _fit(t, (R, w), k, reading)
                read = reading.read(R, w, *numbers)
                left = float(_apart(t, read, k).max())
                if left <= max(LEFT * size, min(MOST_LEFT * size, _allow(recording, t, read, k))):
                    values = {number.name: value for number, value in zip(reading.numbers, numbers, strict=True)}
                    sentence = reading.sentence.format(**values)
                    causes.append(Cause((reading.key,), sentence, left, size, MappingProxyType(values), reading.option))
                    readings.append((reading, numbers))
        if causes:
            break
    if len(causes) != 1:
        return Contradiction(size, tuple(causes))
    ((reading, numbers),) = readings
    return Contradiction(size, tuple(causes), replace(recording, data=reading.read(*data, *numbers)))


def _apart(t: Array, data: States, k: int) -> Array:
    """Return the angles (n - k,), rad, between turns of attitudes over `k` rows and turns by rates."""
    R, w = data
    assert R is not None
    assert w is not None
    by_rates = integrate_rates(CubicSpline(t, w), t, t)
    return _turns(R, k, by_rates)


def _turns(R: Array, k: int, other: Array) -> Array:
    return np.linalg.norm(_vectors(R, k, other), axis=1)


def _vectors(R: Array, k: int, other: Array) -> Array:
    """Return the rotation vectors (n - k, 3), rad, between turns over `k` rows of two series of attitudes."""
    first, second = (np.swapaxes(x[:-k], 1, 2) @ x[k:] for x in (R, other))
    return Rotation.from_matrix(np.swapaxes(first, 1, 2) @ second).as_rotvec()


def _allow(recording: Recording, t: Array, data: States, k: int) -> float:
    """Return the difference over `k` rows that digits, noise and the interpolation of rates allow."""
    _, w = data
    assert w is not None
    time, attitude, rate = recording.digits
    noise, _ = estimate_noise(t, data)  # of rows that are too far apart to tell, it is larger than the noise
    length, scale = float((t[k:] - t[:-k]).max()), float(np.linalg.norm(w, axis=1).max())
    digits = 2 * (attitude + time * scale) + rate * length
    fine = integrate_rates(CubicSpline(t, w), t, t)
    coarse = integrate_rates(CubicSpline(t[::2], w[::2]), t[::2], t[::2])
    between = _turns(fine[::2], max(1, k // 2), coarse)
    return float(between.max()) + UNITS_OF_DIGITS * digits + SIGMAS * float(2 * noise[0] + noise[1] * length)


def _fit(t: Array, data: States, k: int, reading: Reading) -> list[float]:
    """Return the numbers of a reading of the rates with which attitudes turn by them."""
    R, w = data
    assert R is not None
    assert w is not None
    if not reading.numbers:
        return []
    turns = Rotation.from_matrix(R)
    rates = RotationSpline(t, turns)(t, 1)
    if len(reading.numbers) == 1:
        start = np.array([float((w * rates).sum() / (rates * rates).sum())])
    else:
        sign = -1.0 if reading.key == "rates in mirrored axes" else 1.0
        U, _, V = np.linalg.svd(rates.T @ (sign * w))
        start = Rotation.from_matrix(U @ np.diag([1, 1, np.linalg.det(U @ V)]) @ V).as_rotvec()

    def off(numbers: Array) -> Array:
        _, read = reading.read(None, w, *numbers)
        assert read is not None
        return _vectors(R, k, integrate_rates(CubicSpline(t, read), t, t)).ravel()

    return least_squares(off, start, max_nfev=20).x.tolist()
