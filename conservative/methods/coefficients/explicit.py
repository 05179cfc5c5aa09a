"""Explicit Runge-Kutta methods: a tableau and an order each. Tests check the order conditions.

Three steppers use them, one for each path of data. `kernels.projected.take_step` skips the zeros of `packed`, of which
`DORMAND_PRINCE_8` has 20 among 78 coefficients. `kernels.textbook.runge_kutta_step` turns the body by exponentials, because
rotations cannot be added. The search for integrators in `benchmarks/verification/mistakes/steps.py` steps many
states at once, with any equations.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...attitude import Array

Row = tuple[float, ...]


@dataclass(frozen=True)
class ExplicitTableau:
    """An explicit Runge-Kutta method.

    Attributes
    ----------
    source
        Publication.
    order
        Order of convergence.
    A
        Row i has the i coefficients of the earlier slopes in stage i; the first row is empty.
    b
        Weights (stages,) of the slopes.
    """

    source: str
    order: int
    A: tuple[Row, ...]
    b: Row

    @cached_property
    def packed(self) -> tuple[Array, Array, Array]:
        """Nonzero entries of A and then b: factors (n,), their columns (n,), and the index at which each row starts."""
        rows = [[(value, column) for column, value in enumerate(row) if value] for row in (*self.A, self.b)]
        values, columns = zip(*itertools.chain(*rows), strict=True)
        return np.array(values), np.array(columns), np.cumsum([0, *map(len, rows)])

    @property
    def c(self) -> Row:
        """Times of the stages relative to the step: sums of the rows."""
        return tuple(math.fsum(row) for row in self.A)


DORMAND_PRINCE_8 = ExplicitTableau(
    source="Dormand & Prince; Hairer, Norsett & Wanner, Solving Ordinary Differential Equations I, II.5 (DOP853)",
    order=8,
    A=(
        (),
        (0.05260015195876773,),
        (0.0197250569845379, 0.0591751709536137),
        (0.02958758547680685, 0.0, 0.08876275643042054),
        (0.2413651341592667, 0.0, -0.8845494793282861, 0.924834003261792),
        (0.037037037037037035, 0.0, 0.0, 0.17082860872947386, 0.12546768756682242),
        (0.037109375, 0.0, 0.0, 0.17025221101954405, 0.06021653898045596, -0.017578125),
        (0.03709200011850479, 0.0, 0.0, 0.17038392571223998, 0.10726203044637328, -0.015319437748624402, 0.008273789163814023),
        (
            *(0.6241109587160757, 0.0, 0.0, -3.3608926294469414, -0.868219346841726, 27.59209969944671),
            *(20.154067550477894, -43.48988418106996),
        ),
        (
            *(0.47766253643826434, 0.0, 0.0, -2.4881146199716677, -0.590290826836843, 21.230051448181193),
            *(15.279233632882423, -33.28821096898486, -0.020331201708508627),
        ),
        (
            *(-0.9371424300859873, 0.0, 0.0, 5.186372428844064, 1.0914373489967295, -8.149787010746927),
            *(-18.52006565999696, 22.739487099350505, 2.4936055526796523, -3.0467644718982196),
        ),
        (
            *(2.273310147516538, 0.0, 0.0, -10.53449546673725, -2.0008720582248625, -17.9589318631188, 27.94888452941996),
            *(-2.8589982771350235, -8.87285693353063, 12.360567175794303, 0.6433927460157636),
        ),
    ),
    b=(
        *(0.054293734116568765, 0.0, 0.0, 0.0, 0.0, 4.450312892752409, 1.8915178993145003, -5.801203960010585),
        *(0.3111643669578199, -0.1521609496625161, 0.20136540080403034, 0.04471061572777259),
    ),
)
"""Twelve stages of order 8 with small error constants; made for steps of adaptive length, used here with constant ones."""

EULER = ExplicitTableau(source="Euler 1768", order=1, A=((),), b=(1.0,))
MIDPOINT = ExplicitTableau(source="Runge 1895", order=2, A=((), (0.5,)), b=(0.0, 1.0))
HEUN = ExplicitTableau(source="Heun 1900", order=2, A=((), (1.0,)), b=(0.5, 0.5))
RALSTON = ExplicitTableau(source="Ralston 1962", order=2, A=((), (2 / 3,)), b=(0.25, 0.75))
KUTTA_3 = ExplicitTableau(source="Kutta 1901", order=3, A=((), (0.5,), (-1.0, 2.0)), b=(1 / 6, 2 / 3, 1 / 6))
HEUN_3 = ExplicitTableau(source="Heun 1900", order=3, A=((), (1 / 3,), (0.0, 2 / 3)), b=(0.25, 0.0, 0.75))
SHU_OSHER_3 = ExplicitTableau(source="Shu & Osher 1988", order=3, A=((), (1.0,), (0.25, 0.25)), b=(1 / 6, 1 / 6, 2 / 3))
RUNGE_KUTTA_4 = ExplicitTableau(
    source="Kutta 1901", order=4, A=((), (0.5,), (0.0, 0.5), (0.0, 0.0, 1.0)), b=(1 / 6, 1 / 3, 1 / 3, 1 / 6)
)
CROUCH_GROSSMAN_4 = ExplicitTableau(
    source="Jackiewicz, Marthinsen & Owren, Adv. Comput. Math. 13 (2000) 405; Hairer, Lubich & Wanner, IV.8.1",
    order=4,
    A=(
        (),
        (0.8177227988124852,),
        (0.3199876375476427, 0.0659864263556022),
        (0.9214417194464946, 0.4997857776773573, -1.0969984448371582),
        (0.3552358559023322, 0.2390958372307326, 1.3918565724203246, -1.1092979392113465),
    ),
    b=(0.1370831520630755, -0.0183698531564020, 0.7397813985370780, -0.1907142565505889, 0.3322195591068374),
)
