"""Splittings into free rotations and kicks: sequences of both that form one symmetric step of higher order.

The kinetic energy is quadratic in the momentum, and a kick depends on the attitude only. Many commutators are therefore zero,
as for Runge-Kutta-Nyström methods, and sequences that use this have much smaller errors than compositions of steps of order
2. They have more stages, and require exact free rotations.
"""

from __future__ import annotations

import itertools
from fractions import Fraction
from typing import NamedTuple

from .compositions import composition_of

Lengths = tuple[tuple[Fraction, ...], tuple[Fraction, ...]]
"""Rotations, and the kicks after each of them, relative to the step; the first rotation or the last kick can be 0."""


class Sequence(NamedTuple):
    """Order, publication, whether a kick comes first, and decimals of the first lengths, kicks and rotations in turn.

    The last two lengths before the mirror are left out: each kind sums to 1. Tests measure the order.
    """

    order: int
    source: str
    kick_first: bool
    half: str

    @property
    def lengths(self) -> Lengths:
        """Rotations and kicks."""
        half = [Fraction(text) for text in self.half.split()]
        for total in (Fraction(1, 2), Fraction(1)):
            half.append(total - 2 * total * sum(half[len(half) % 2 :: 2], start=Fraction(0)))
        whole = (Fraction(0),) * self.kick_first + (*half, *half[-2::-1]) + (Fraction(0),) * (not self.kick_first)
        return whole[::2], whole[1::2]


SEQUENCES = {
    sequence.order: sequence
    for sequence in (
        Sequence(
            4,
            "Blanes & Moan 2002, SRKN6b",
            True,
            "0.0829844064174052 0.245298957184271 0.3963098014983680 0.604872665711080 -0.0390563049223486",
        ),
        Sequence(
            6,
            "Blanes & Moan 2002, SRKN14a",
            False,
            "0.0378593198406116 0.09171915262446165 0.102635633102435 0.183983170005006 -0.0258678882665587 "
            "-0.05653436583288827 0.314241403071447 0.004914688774712854 -0.130144459517415 0.143761127168358 "
            "0.106417700369543 0.328567693746804 -0.00879424312851058",
        ),
    )
}
"""Sequences by order. Their errors on random bodies are below a twentieth (order 4) and a thousandth (order 6) of the errors
of the composition with the same step."""


def lengths_of(order: int, exact: bool) -> Lengths:
    """Return the lengths of a sequence if rotations are `exact` and there is one, else of a composition of order 2.

    A step of order 2 is half a kick, a rotation and half a kick. Raise `BadInput` if there is none of this order.
    """
    composition = composition_of(order)
    if exact and order in SEQUENCES:
        return SEQUENCES[order].lengths
    weights = (Fraction(0), *composition.weights, Fraction(0))
    return weights[:-1], tuple((a + b) / 2 for a, b in itertools.pairwise(weights))
