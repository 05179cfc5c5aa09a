"""The search for digits that the numbers of a scene do not have: the file is the motion of a scene before it was rounded."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from decimal import Decimal
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import lsq_linear

from conservative.attitude import Array
from conservative.check import read_only
from conservative.errors import BadInput
from conservative.potentials.turning import Orbit, Turning
from conservative.potentials.uniform_gravity import UniformGravity
from conservative.scene import Scene

from .compare import HOPELESS, LINEAR, Compared, exact
from .explanation import Explanation, Trial, explain
from .mistakes import BY_KEY
from .mistakes.scenes import body_of, with_inertia

FEWEST_DIGITS, MOST_DIGITS = 4, 12
"""Digits of a number that was rounded. Numbers with fewer digits are meant as they are, and more digits are exact."""
ROUNDING = 0.51
"""Largest change of a number, in units of its last digit."""
ROWS, FEW_ROWS, EFFORT = 300, 30, 200
"""Rows from which the digits are found, rows that show whether they can be, and the work of a search."""
SMALL = 1e-6
"""Change of the initial state for slopes."""
TWICE = 2
"""Number of fits: the second one begins with the numbers of the first."""


class Group(NamedTuple):
    """Numbers of a scene: their name, their values (n,), and the scene with other ones."""

    name: str
    values: Array
    build: Callable[[Array], Scene | None]


def last_digit(value: float) -> float:
    """Return the unit of the last digit of a number; 0 if it was not rounded."""
    written = Decimal(repr(float(value))).normalize()
    digits = len(written.as_tuple().digits)
    return float(Decimal(1).scaleb(int(written.as_tuple().exponent))) if FEWEST_DIGITS <= digits <= MOST_DIGITS else 0.0


def find_scene_digits(case: Compared) -> Iterator[Explanation | None]:
    """Yield the motion of a scene whose numbers differ by less than their last digit: of one part of it, or else of all."""
    if case.step is not None or case.error.max() > LINEAR:
        return
    groups = [group for group in _groups(case) if any(map(last_digit, group.values.tolist()))]
    if not groups or not _Digits(case.take(_some_rows(case, FEW_ROWS)), groups).suffice():
        return
    for some in (*([group] for group in groups), *([groups] if len(groups) > 1 else ())):
        explanation = _by_digits(case, some)
        yield explanation
        if explanation is not None and explanation.explains:
            return


def _some_rows(case: Compared, count: int) -> Any:
    """Return rows that are evenly chosen."""
    return np.unique(np.linspace(0, len(case.t) - 1, count).astype(int))


def _groups(case: Compared) -> list[Group]:
    """Return the numbers of a scene that the motion depends on."""
    scene = case.scene
    body, field = scene.body, scene.potential
    upper = np.triu_indices(3)

    def inertia(x: Array) -> Scene | None:
        J = np.zeros((3, 3))
        J[upper] = x
        return with_inertia(scene, J + np.triu(J, 1).T)

    groups = [Group("the inertia", body.inertia[upper], inertia)]
    if body.rotor_momentum is not None:
        groups.append(Group("the wheel's momentum", body.rotor_momentum, lambda x: _with(scene, body=body_of(body.inertia, x))))
    if isinstance(field, UniformGravity):
        groups.append(
            Group(
                "the weight and the centre of mass",
                np.append(field.com_B, field.weight),
                lambda x: _with(scene, potential=UniformGravity(float(x[3]), x[:3])),
            )
        )
    if isinstance(field, Turning):
        groups.append(
            Group(
                "the rate of the orbit",
                np.array([field.orbit.rate]),
                lambda x: _with(scene, potential=replace(field, orbit=Orbit(float(x[0]), field.orbit.normal_W))),
            )
        )
    if not case.from_row:
        groups.append(Group("the initial rates", scene.w_WB_B0, lambda x: _with(scene, w_WB_B0=x)))
    return groups


def _with(scene: Scene, **changes: Any) -> Scene:
    return scene.rename(scene.name, **{name: read_only(x) if isinstance(x, np.ndarray) else x for name, x in changes.items()})


def _by_digits(case: Compared, groups: Sequence[Group]) -> Explanation | None:
    """Return the explanation by digits of some numbers."""
    case.effort.spend(EFFORT)
    digits = _Digits(case.take(_some_rows(case, ROWS)), groups)
    for _ in range(TWICE):
        digits.fit()
    made = digits.motion(case, digits.changes, digits.initial)
    if made is None:
        return None
    mistake = BY_KEY["digits of the scene"]
    explanation = explain(case, Trial((mistake,), lambda _: None), made, {"text": 0.0}, numbers=0)
    values = {
        f"{group.name} {j + 1}": float(x)
        for group, change in zip(groups, digits.changes, strict=True)
        for j, x in enumerate(group.values + change)
    }
    sentence = mistake.sentence.format(text=" and ".join(group.name for group in groups))
    return replace(explanation, sentence=sentence, values=values, trial=None)


class _Digits:
    """Changes of numbers by less than their last digit, and of the initial state, that fit rows to first order."""

    def __init__(self, case: Compared, groups: Sequence[Group]) -> None:
        self.case, self.groups = case, groups
        self.units = [np.array([last_digit(x) for x in group.values.tolist()]) for group in groups]
        self.places = [(i, j) for i, unit in enumerate(self.units) for j in np.flatnonzero(unit).tolist()]
        self.changes, self.initial = [0.0 * unit for unit in self.units], np.zeros(6)

    def scene(self, changes: Sequence[Array]) -> Scene | None:
        """Return the scene with changed numbers; None if there is none."""
        scene = self.case.scene
        for group, change in zip(self.groups, changes, strict=True):
            made = group.build(group.values + change) if change.any() else self.case.scene
            if made is None:
                return None
            fields = {name: getattr(made, name) for name in ("body", "potential", "w_WB_B0")}
            different = {name: x for name, x in fields.items() if x is not getattr(self.case.scene, name)}
            if "body" in different and scene.body is not self.case.scene.body:  # both the inertia and the wheel
                different["body"] = body_of(scene.body.inertia, made.body.rotor_momentum)
            scene = _with(scene, **different)
        return scene

    def motion(self, case: Compared, changes: Sequence[Array], initial: Array) -> tuple[Array, Array] | None:
        """Return the motion with changed numbers and a changed initial state, at the times of a case."""
        try:
            scene = self.scene(changes)
        except BadInput:  # digits that no scene has
            return None
        if scene is None:
            return None
        moved = replace(case, scene=scene).at(initial)
        R, w = exact(moved)(moved.scene.R_WB0[None], moved.scene.w_WB_B0[None], np.zeros((1, 0)), len(case.t))
        return R[0], w[0]

    def beside(self, changes: Sequence[Array], initial: Array) -> Array:
        """Return weighted differences (12 n,) of a motion from the rows; nan without one."""
        made = self.motion(self.case, changes, initial)
        if made is None:
            return np.full(12 * len(self.case.t), np.nan)
        return (self.case.differences(*made) / np.repeat(self.case.noise, [9, 3])).ravel()

    def slopes(self, now: Array) -> tuple[Array, Array]:
        """Return the changes of differences by half a digit of each number, and by the noise of the initial state."""
        halves, starts = [], []
        for i, j in self.places:
            moved = [change.copy() for change in self.changes]
            moved[i][j] += self.units[i][j] / 2
            halves.append(self.beside(moved, self.initial) - now)
        for k in self.case.free:
            start = self.beside(self.changes, self.initial + SMALL * np.eye(6)[k])
            starts.append((start - now) / SMALL * self.case.noise[k // 3])
        return np.array(halves).reshape(-1, len(now)), np.array(starts).reshape(-1, len(now))

    def suffice(self) -> bool:
        """Return whether the last digits of all numbers can make differences as large as those of the rows."""
        now = self.beside(self.changes, self.initial)
        halves, starts = self.slopes(now)
        most = 2 * ROUNDING * np.abs(halves).sum(axis=0) + HOPELESS * np.abs(starts).sum(axis=0)
        allowed = np.tile(np.repeat(self.case.allowed / self.case.noise, [9, 3]), len(self.case.t))
        return bool((np.abs(now) <= 1.1 * most + allowed).all())

    def fit(self) -> None:
        """Find the changes that fit best."""
        now = self.beside(self.changes, self.initial)
        columns = np.vstack(self.slopes(now))
        if not np.isfinite(columns).all():
            return
        done = np.array([2 * self.changes[i][j] / self.units[i][j] for i, j in self.places] + [0.0] * len(self.case.free))
        limits = np.array([2 * ROUNDING] * len(self.places) + [np.inf] * len(self.case.free))
        found = lsq_linear(columns.T, -now, (-limits - done, limits - done)).x
        for (i, j), x in zip(self.places, found, strict=False):
            self.changes[i][j] += x * self.units[i][j] / 2
        for k, x in zip(self.case.free, found[len(self.places) :], strict=True):
            self.initial[k] += x * self.case.noise[k // 3]
