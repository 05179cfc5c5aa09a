"""What the study of throughput is of: how many bodies, at which errors, in which steps and tolerances."""

from __future__ import annotations

from dataclasses import dataclass

from conservative.check import positive_integer
from conservative.errors import BadInput

from .study import Study

ERRORS = (1e-3, 1e-6, 1e-9)
"""Attitude errors, rad, at which methods are compared."""
SAMPLES = 12
"""Instants at which errors are read."""
STEPS = tuple(
    SAMPLES * k for k in (1, 2, 3, 4, 6, 8, 11, 16, 23, 32, 45, 64, 91, 128, 181, 256, 362, 512, 724, 1024, 1448, 2048)
)
"""Steps of the motion, long to short."""
EXACT_STEPS = 120
"""Steps of exact solutions, whose length is free."""
TOLERANCES = tuple(10.0**-k for k in range(1, 14))
FEW = slice(1, None, 3)
"""What a quick study takes of both."""
SIZES, QUICK_SIZES = tuple(10**k for k in range(7)), (1, 100)
"""Numbers of bodies."""
BODIES, QUICK_BODIES = 64, 8
"""Bodies whose errors are read."""
PREPARATION = 8.0
"""How many times longer than a call its preparation may take."""
ROUNDS, QUICK_ROUNDS = 5, 3
MEDIAN, MOST = "median", "95 %"
"""Which error of the bodies a value is of."""
EXACT = "closed form"
"""Detail of errors that do not depend on the step."""


@dataclass(frozen=True)
class ThroughputStudy(Study):
    """The study, of so many bodies.

    Attributes
    ----------
    sizes
        Numbers of bodies that are timed.
    bodies, seed
        Number of bodies whose errors are read, and where they are drawn from.

    Raises
    ------
    BadInput
        As `Study` does, and where a size or `bodies` is not an integer of 1 or more.
    """

    sizes: tuple[int, ...] = SIZES
    bodies: int = BODIES
    seed: int = 0

    @property
    def longest_errors(self) -> float:
        """Longest run, s, on the way to smaller errors."""
        return 4 * self.longest_run

    def __post_init__(self) -> None:
        super().__post_init__()
        for size in self.sizes:
            positive_integer("sizes", size)
        if not self.sizes:
            raise BadInput("sizes", "none", "one or more")
        positive_integer("bodies", self.bodies)
