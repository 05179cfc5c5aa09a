"""The study of twins: pairs of descriptions of one motion, which engines have to move equally.

No reference solution is used. The value of a row is the difference of a pair over what rounding explains; the detail says how a
reduced pair differs, and from which size on.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from conservative.check import choice
from conservative.errors import BadInput, MissingEngine
from conservative.method import Method
from conservative.outcome import OK, Outcome, OutcomeKind
from conservative.references.worker.client import time_limit
from conservative.scene import Scene

from ..measures.measure import Measure, Value
from ..measures.measurement import Measurement
from ..verification.pairs.differences import BODIES, Twins, count_twins, twins_of
from ..verification.pairs.pairs import PAIRS, Pair
from .case import Case
from .declaration import Declaration, Named
from .selection import Missing
from .study import Progress, Study

PATIENCE = 300.0
"""Time in s that each run may take: kernels of an engine may be compiled in it."""
KINDS = {"crashed": OutcomeKind.CRASHED, "lost": OutcomeKind.DIVERGED}
"""Outcomes of rows without a value; others are unsupported."""


def scenes() -> tuple[Scene, ...]:
    """Return the bodies as scenes, by their names."""
    return tuple(replace(one.scene, name=name.replace(" ", "_")) for name, one in BODIES.items())


def select_pairs(names: Sequence[str]) -> tuple[Pair, ...]:
    """Return pairs by name, by default all. Raise `BadInput`."""
    for name in names:
        choice("pairs", name, tuple(pair.name for pair in PAIRS))
    return tuple(pair for pair in PAIRS if not names or pair.name in names)


def compare_methods(
    methods: Sequence[Method], progress: Progress, pairs: Sequence[Pair] = PAIRS
) -> Iterator[tuple[Method, Twins]]:
    """Yield the result of every pair in every method. Raise `MissingEngine`."""
    done, total = 0, count_twins(pairs) * len(methods)
    with time_limit(PATIENCE):
        for method in methods:
            for twins in twins_of(method, lambda what: progress(done / total, what), pairs):  # noqa: B023  # called at once
                yield method, twins
                done += 1


def findings(study: Study, progress: Progress) -> Iterator[Measurement]:
    """Yield a row for each pair, body and engine. Raise `BadInput` for a scene that is not one of the bodies."""
    bodies = {scene.key: name for scene, name in zip(scenes(), BODIES, strict=True)}
    if others := [scene.name for scene in study.scenes if scene.key not in bodies]:
        raise BadInput("scenes", repr(others[0]), f"bodies of the study: {', '.join(scene.name for scene in scenes())}")
    by_name = {bodies[scene.key]: scene for scene in study.scenes}
    for method in study.competitors:
        cases = {name: Case(study.name, scene, method, BODIES[name].grid) for name, scene in by_name.items()}
        try:
            if isinstance(method, Missing):
                raise method.error
            for _, twins in compare_methods((method,), progress):
                if case := cases.get(twins.body):
                    yield replace(case, way=twins.pair).row(Value(Measure.ALLOWED, _ratio(twins)), *_outcome(twins))
        except MissingEngine as error:
            if not study.skip_missing:
                raise
            for case in cases.values():
                yield case.row(Value(Measure.ALLOWED, np.nan), Outcome(OutcomeKind.MISSING, str(error)))


def _ratio(twins: Twins) -> float:
    if twins.outcome == "same limit":  # which rounding need not explain
        return np.nan
    return 0.0 if twins.outcome == "same bits" else twins.factor


def _outcome(twins: Twins) -> tuple[Outcome, str]:
    detail = "; ".join(filter(None, (twins.outcome, twins.threshold, twins.detail)))
    if np.isnan(twins.difference):
        return Outcome(KINDS.get(twins.outcome, OutcomeKind.UNSUPPORTED), twins.detail), twins.outcome
    return OK, detail


STUDY = Declaration(findings, named=Named.ONLY, apart=True, scenes=scenes, options=("methods",))
