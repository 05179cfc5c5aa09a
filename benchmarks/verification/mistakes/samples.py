"""Samples: a recorder makes rows from right samples that are further apart than the rows. It repeats them or interpolates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.spatial.transform import Rotation

from conservative.attitude import Array

from .mistake import Mistake, Number

Law = Callable[[Array, Array, Array], Array]
"""From shares (n,) of the time from one sample to the next, and both samples (n, 3, 3) or (n, 3), to rows."""


@dataclass(frozen=True)
class Resampling(Mistake):
    """Rows from samples: `attitudes` and `rates` are the laws of both, None for a quantity whose rows are right.

    `held` is True if rows repeat samples; False if they lie between samples.
    """

    kind: ClassVar[str] = "rows"
    attitudes: Law | None
    rates: Law | None
    held: bool = False


def _hold(share: Array, a: Array, b: Array) -> Array:
    return a


def _line(share: Array, a: Array, b: Array) -> Array:
    return a + share[:, None] * (b - a)


def _turn(of_angle: Callable[[Array, Array], Array]) -> Law:
    """Return the law that turns from one attitude to the next about one axis, by angles for shares and the whole angle."""

    def law(share: Array, a: Array, b: Array) -> Array:
        turn = Rotation.from_matrix(np.swapaxes(a, 1, 2) @ b).as_rotvec()
        angle = np.linalg.norm(turn, axis=1)
        part = of_angle(share, angle) / np.where(angle == 0, 1.0, angle)
        return a @ Rotation.from_rotvec(turn * part[:, None]).as_matrix()

    return law


def _chord(share: Array, angle: Array) -> Array:
    """Return the angles of points on the chord of an arc, seen from its centre."""
    return np.arctan2(share * np.sin(angle), 1 - share + share * np.cos(angle))


TURNS: dict[str, tuple[str, Callable[[Array, Array], Array]]] = {
    "interpolated quaternions": ("the components of quaternions are interpolated", lambda s, angle: 2 * _chord(s, angle / 2)),
    "attitudes by slerp": ("attitudes turn evenly from sample to sample (slerp)", lambda s, angle: s * angle),
    "interpolated matrices": ("the elements of rotation matrices are interpolated", _chord),
}
"""How attitudes are interpolated: the text, and the angle for a share of the time and the angle between two samples."""


def _resampling(key: str, what: str, attitudes: Law | None, rates: Law | None, held: bool = False) -> Resampling:
    right = " The other columns are right" * (attitudes is None or rates is None)
    verb = "Rows repeat samples until the next one" if held else "Rows lie between samples"
    text = f"{verb}, which are {{spacing:.5g}} s apart and right: {what}.{right}"
    return Resampling(key, text.rstrip("."), attitudes, rates, held, numbers=(Number("spacing", unit="s"),))


RESAMPLED = (
    _resampling("held samples", "attitudes and rates are held", _hold, _hold, True),
    _resampling("held attitudes", "attitudes are held", _hold, None, True),
    _resampling("held rates", "rates are held", None, _hold, True),
    _resampling("interpolated rates", "rates are interpolated", None, _line),
    *(_resampling(key, what, _turn(angle), None) for key, (what, angle) in TURNS.items()),
    *(
        _resampling(f"{key} and interpolated rates", f"{what}, and rates are interpolated", _turn(angle), _line)
        for key, (what, angle) in TURNS.items()
    ),
)
