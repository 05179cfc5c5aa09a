"""Mistakes that simulators and their files have, each once: a key, a sentence, and an effect, typed by its kind.

Kind        Effect
readings    samples to samples
times       times to times of attitudes and of rates
scenes      a scene to the one that was simulated
equations   a scene to other equations of motion
steps       an integrator: the state after a step
attitudes   rates to the matrices that turn attitudes, or a rate at which attitudes drift
habits      the state after a step to the one that is kept, or the body stands still
rows        right rows to the ones that were written
bodies      a mass distribution to another one

Numbers of a mistake are fitted to a recording. Mistakes know nothing of files, fits and verdicts, and can be planted as well.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import MappingProxyType

from .attitudes import DRIFTS, RULES
from .bodies import FILES, FITTED, LOADED
from .equations import EQUATIONS
from .habits import HABITS, OTHER_ROWS, PART_STANDSTILLS, ROWS, STANDSTILLS
from .mistake import Mistake
from .readings import READINGS
from .samples import RESAMPLED
from .scenes import BODIES, DIGITS, SCENES
from .steps import INTEGRATORS
from .times import ROW_TIMES, TIMES
from .wrapped import KEPT, SAVED


def table_of(mistakes: Iterable[Mistake]) -> Mapping[str, Mistake]:
    """Return mistakes by key."""
    table: dict[str, Mistake] = {}
    for mistake in mistakes:
        if mistake.key in table:
            raise ValueError(f"key: got {mistake.key!r} twice; expected another key for each mistake")
        table[mistake.key] = mistake
    return MappingProxyType(table)


BY_KEY = table_of([
    *READINGS, *TIMES, *ROW_TIMES, *SCENES, DIGITS, *BODIES, *EQUATIONS, *INTEGRATORS, *RULES, *DRIFTS,
    *HABITS, *STANDSTILLS, *PART_STANDSTILLS, *ROWS, *OTHER_ROWS, *RESAMPLED, *FITTED, *SAVED, *KEPT,
    *(mistake for mistake in LOADED if mistake.key not in {scene_mistake.key for scene_mistake in SCENES}),
    *(mistake for mistake in FILES if mistake.key not in {other.key for other in (*SCENES, *LOADED)}),
])  # fmt: skip
"""All mistakes by key. Products of inertia are in `SCENES`, `LOADED` and `FILES`: one mistake with an effect on each kind."""
