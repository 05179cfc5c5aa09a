"""What one version's methods do on the scenes of a comparison, all but time, as rows of the gate.

Errors of both versions are against one truth, that of this process, and drifts are computed here: what one of them says of
itself counts for nothing but how it ends.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import Any

import numpy as np

from conservative import registry
from conservative.errors import IntegrationFailed
from conservative.scene import Scene

from ..gate.results import Row, Status, find_runaway
from ..studies.study import Truths
from ..suite import points
from . import inside
from .side import Remote, Setting, Side


@dataclass(frozen=True)
class Place:
    """A scene of a comparison: the name it is asked for by, the scene in this process, and what defines it here."""

    name: str
    scene: Scene
    definition: str
    truths: Truths = field(repr=False, compare=False)

    @classmethod
    def of(cls, name: str) -> Place:
        """Return the place of a name. Raises `BadInput` where this process knows no such scene."""
        here = inside.describe_scene(SimpleNamespace(**_asked(name)))()
        return cls(name, registry.scene(name), _define(name, here), Truths())

    def row_id(self, method: str) -> str:
        """Return what both versions call a row."""
        return f"{self.name} / {method}"


def _asked(name: str) -> dict[str, Any]:
    return {"scene": name, "probes": np.array(points.PROBES)}


def _define(name: str, found: Mapping[str, Any]) -> str:
    numbers = [found[each] for each in ("inertia", "R_WB0", "w_WB_B0", "ends", "energies")]
    return points.define([name, *found["invariants"]], numbers)


@dataclass(frozen=True)
class Found:
    """A row, and why it has no values; empty if it has."""

    row: Row
    reason: str = ""


def measure_rows(side: Side, place: Place, settings: Sequence[Setting]) -> Iterator[Found]:
    """Yield a row for each setting on one scene; whatever fails is in its row."""
    try:
        definition = _define(place.name, side.ask("scene", **_asked(place.name)))
    except IntegrationFailed as failure:
        yield from (Found(_row(place, setting, Status.ERROR), str(failure.outcome)) for setting in settings)
        return
    for setting in settings:
        if definition == place.definition:
            yield _measure(side, place, setting)
        else:  # there is no truth for its motion, and the gate says that the definitions differ
            yield Found(replace(_row(place, setting, Status.PASSED), definition=definition), "another motion")


def _row(place: Place, setting: Setting, status: Status) -> Row:
    return Row(place.row_id(setting.name), place.name, setting.name, status, setting.engine, place.definition)


def _measure(side: Side, place: Place, setting: Setting) -> Found:
    try:
        pair = side.ask("pair", scene=place.name, method=setting.name)
        if pair["unsupported"]:
            return Found(_row(place, setting, Status.SKIPPED), pair["unsupported"])
        point = points.Point(place.scene, Remote(side, setting, place.name, pair["longest_step"]), place.truths)
        first = point.method.solve(place.scene, point.grid)
        if not first.ok:
            return Found(_row(place, setting, Status.FAILED), str(first.outcome))
        return judge_values(_row(place, setting, Status.PASSED), points.measure(point))
    except IntegrationFailed as failure:
        return Found(_row(place, setting, Status.FAILED), str(failure.outcome))


def judge_values(row: Row, values: Mapping[str, points.GatedValue]) -> Found:
    """Return a row with its values; it failed where one is no number, or says that the run ran away."""
    plain = {name: each.value for name, each in values.items()}
    nonsense = [f"{name} is {value}" for name, value in plain.items() if not math.isfinite(value)]
    if reason := "; ".join(filter(None, [find_runaway(plain), *nonsense])):
        return Found(replace(row, status=Status.FAILED), reason)
    return Found(replace(row, values=plain, spreads={name: each.spread for name, each in values.items()}))
