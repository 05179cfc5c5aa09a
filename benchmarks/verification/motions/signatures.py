"""Signatures: the errors that programs with a mistake of the catalogue make on a motion.

The motion is the exact solution with the mistake, so that a signature does not depend on the method of a program. Numbers of a
mistake that are fitted to a recording have some typical values here.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from typing import Any

import numpy as np

from conservative.attitude import Array

from ..mistakes import BY_KEY
from ..mistakes.attitudes import Rule, integrate
from ..mistakes.equations import EquationsMistake
from ..mistakes.habits import Habit, Standstill
from ..mistakes.mistake import Mistake
from ..mistakes.readings import Reading
from ..mistakes.scenes import SceneMistake
from ..mistakes.times import Time
from ..solution import Equations
from .integrators import Design
from .motion import Motion
from .programs import PARTS

VALUES: dict[str, tuple[float, ...]] = {
    "damping": (0.01, 0.02, 0.05, 0.1, 0.2),
    "rate limit": (7.0, 47.0, 100.0),
    "dead band": (0.001, 0.01),
    "size of the rotor": (0.98,),
}
"""Typical numbers of mistakes, SI units. Others with numbers have no signature."""
OWN = {"sleep": 0.0, "stale rates": 0.01, "attitude by normalisation": 0.01}
"""Mistakes whose number is the first step or the step of the program, and an example of it, s."""
NOT_OF_PROGRAMS = {"order wxyz", "body rates", "rates in radians"}
"""Readings of files by other conventions than PROTOCOL.md has."""
EXACT = Design(4, "RK4", "quaternion", "rates", True)
BOTH = ("no gyroscopic term", "damping", 0.05)
"""Two mistakes that many engines have at once, as installed."""
_BOTH = f"{BOTH[0]} + {BOTH[1]} {BOTH[2]:g}"
Samples = tuple[Array, Array]


def names() -> dict[str, str]:
    """Return the sentences of mistakes by the names in the files: a key, and a number if the signature depends on it."""
    sentences = {
        name: mistake.sentence.format(**{number.name: value for number, value in zip(mistake.numbers, numbers, strict=True)})
        for name, mistake, numbers in _all()
    }
    return sentences | {_BOTH: f"{sentences[BOTH[0]]}. {sentences[f'{BOTH[1]} {BOTH[2]:g}']}"}


def remedies() -> dict[str, str]:
    """Return the change that mends each mistake of a program, by the names in the files."""
    changes = {name: mistake.remedy for name, mistake, _ in _all()}
    return changes | {_BOTH: f"{changes[BOTH[0]]}; {changes[f'{BOTH[1]} {BOTH[2]:g}']}"}


def _all() -> Iterator[tuple[str, Mistake, tuple[float, ...]]]:
    """Yield the name of each signature, its mistake and the numbers of the mistake."""
    for key, mistake in BY_KEY.items():
        of_program = isinstance(mistake, Reading | Time | SceneMistake | EquationsMistake | Habit | Standstill | Rule)
        if not of_program or key in NOT_OF_PROGRAMS or (isinstance(mistake, Time) and not mistake.of_step):
            continue
        if key in OWN or not mistake.numbers:
            yield key, mistake, (OWN[key],) if key in OWN else ()
        for value in VALUES.get(key, ()):
            yield f"{key} {value:g}", mistake, (value,)


def signatures(motions: Sequence[Motion], only: Collection[str] | None = None) -> list[dict[str, Samples]]:
    """Return, for each motion, the attitudes and rates at the samples by the names of mistakes that change it.

    `only` has the names that are wanted, by default all.
    """
    out: list[dict[str, Samples]] = [{} for _ in motions]
    for name, mistake, numbers in _all():
        if only is not None and name not in only:
            continue
        if isinstance(mistake, Habit):
            for made, samples in zip(out, EXACT.run(motions, PARTS[-1], _keep(mistake, numbers)), strict=True):
                made[name] = samples
            continue
        for motion, made in zip(motions, out, strict=True):
            if (changed := _with(motion, mistake, numbers)) is not None:
                made[name] = changed
    for motion, made in zip(motions, out, strict=True) if only is None or _BOTH in only else ():
        made[_BOTH] = _solve(Equations(motion.scene, gyroscopic=0.0, damping=BOTH[2]), motion.t)
    return out


def _keep(habit: Habit, numbers: Sequence[float]) -> Callable[[Array], Array]:
    return lambda w: habit.after(w.T, *numbers).T


def _with(motion: Motion, mistake: Mistake, numbers: tuple[float, ...]) -> Samples | None:
    """Return the samples of a motion with a mistake; None if it has no effect."""
    scene, t, exact = motion.scene, np.array(motion.t), (motion.exact["R_WB"][1:], motion.exact["w_WB_B"][1:])
    h = motion.step / PARTS[-1]
    if isinstance(mistake, Reading):
        return mistake.write(*exact)  # type: ignore[return-value]  # both are known
    if isinstance(mistake, Time):
        (R, _), (_, w) = (_solve(Equations(scene), times) for times in mistake.at(t, h))
        return R, w
    if isinstance(mistake, SceneMistake):
        other = mistake.change(scene, *numbers)
        return None if other is None else _solve(Equations(other), t)
    if isinstance(mistake, EquationsMistake):
        equations = mistake.build(scene, *numbers)
        return None if equations is None else _solve(equations, t)
    if isinstance(mistake, Standstill):
        return np.repeat(scene.R_WB0[None], len(t), axis=0), np.tile(mistake.rest * scene.w_WB_B0, (len(t), 1))
    if isinstance(mistake, Rule):
        every = motion.steps * PARTS[-1]
        n = every * motion.samples
        _, w = _solve(Equations(scene), h * np.arange(n + 1))
        return integrate(mistake.matrices, scene.R_WB0, w, np.full(n, h), every)[1:], exact[1]
    return None


def _solve(equations: Equations, t: Any) -> Samples:
    scene = equations.scene
    R, w = equations.solve(0.0, scene.R_WB0[None], scene.w_WB_B0[None], np.array(t))
    return R[0], w[0]
