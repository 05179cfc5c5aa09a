"""Rounding that the digits of a file make."""

from __future__ import annotations

import math

import numpy as np

from conservative.attitude import Array
from conservative.check import SMALLEST

from .layout import Layout

TURNS = {"quaternion": 2.0, "modified Rodrigues": 4.0, "Rodrigues": 4.0}
"""Angle, rad, for a change of 1 in a component, by the kind of attitude; 1 for others."""
OUTLIER = 1e4
"""Largest value relative to the median that digits are relative to: a value in error has another round-off than the others."""


def find_digits(raw: Array, layout: Layout) -> tuple[float, float, float]:
    """Return the largest round-off of times, s, attitudes, rad, and rates, rad/s, that the digits of rows stand for."""
    count = 1 + len(layout.used["rates"])
    t, gaps = raw[:, 0], np.diff(raw[:, 0])
    # Equal gaps up to round-off: the times are exact, whatever their digits.
    uniform = np.ptp(gaps) <= 8 * np.spacing(np.abs(t).max()) if len(gaps) else True
    off = t - np.rint((t - t[0]) / gaps.min()) * gaps.min() - t[0]
    time = 0.0 if uniform else min(find_quantum(t[:, None]), float(np.abs(off).max()))
    time = max(time, float(np.spacing(np.abs(t).max()) / 2))
    parts = [find_quantum(part) * float(np.abs(size).max()) if part.size else 0.0 for part, size in (
        (raw[:, count:], layout.sizes[count:]), (raw[:, 1:count], layout.sizes[1:count])
    )]  # fmt: skip
    return time * float(layout.sizes[0]), parts[0] * TURNS.get(layout.attitude or "", 1.0), parts[1]


def find_quantum(values: Array) -> float:
    """Return half of the last digit, or of the last bit, that all values of a kind have, of the largest that is no outlier."""
    sizes = np.abs(values[values != 0])
    largest = min(float(sizes.max()), OUTLIER * float(np.median(sizes))) if sizes.size else 1.0
    x = np.unique(values[:: max(1, len(values) // 500)])
    x = x[np.abs(x) >= SMALLEST]
    if len(x) < 5:  # a constant does not show digits
        return largest * 2.0**-53
    near, half, unit = 4 * np.spacing(np.abs(x)), 0.0, np.zeros_like(x)
    exponent, whole = np.floor(np.log10(np.abs(x))), math.floor(math.log10(largest))
    for digits in range(3, 16):
        unit = 10.0 ** (exponent - digits + 1)
        if (np.abs(np.rint(x / unit) * unit - x) <= near).all():
            half = 0.5 * 10.0 ** (whole - digits + 1)
            break
    else:
        unit[:] = 0.0
    with np.errstate(over="ignore"):
        single = x.astype(np.float32)
    if (np.abs(single - x) <= unit / 2 + near).all():  # single precision, also if printed with nine digits
        half = max(half, largest * 2.0**-24)
    return max(half, largest * 2.0**-53)
