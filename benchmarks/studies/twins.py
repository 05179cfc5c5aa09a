"""The study of twins: pairs of descriptions of one motion, which engines have to move equally.

No reference solution is used. The value of a row is the difference of a pair over what rounding explains; the detail says how a
reduced pair differs, and from which size on.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from conservative.errors import BadInput, MissingEngine
from conservative.method import Method
from conservative.outcome import OK, Outcome, OutcomeKind
from conservative.scene import Scene

from ..measures.measure import Measure, Value
from ..measures.measurement import Measurement
from ..verification.finding import Verdict
from ..verification.pairs.verify import BODIES, PairFinding, Relation, count_pairs, verify_pairs
from .case import Case
from .declaration import Declaration, Named
from .selection import Missing
from .study import Progress, Study


def scenes() -> tuple[Scene, ...]:
    """Return the bodies as scenes, by their names."""
    return tuple(replace(one.scene, name=name.replace(" ", "_")) for name, one in BODIES.items())


def compare_methods(
    methods: Sequence[Method], progress: Progress, names: Sequence[str] = ()
) -> Iterator[tuple[Method, PairFinding]]:
    """Yield the finding on every pair in every method. Raise `MissingEngine`."""
    done, total = 0, count_pairs(names) * len(methods)
    for method in methods:
        for found in verify_pairs(method, names, lambda what: progress(done / total, what)):  # noqa: B023  # called at once
            yield method, found
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
            for _, found in compare_methods((method,), progress):
                if case := cases.get(found.body):
                    yield replace(case, way=found.pair).row(Value(Measure.ALLOWED, _ratio(found)), *_outcome(found))
        except MissingEngine as error:
            if not study.skip_missing:
                raise
            for case in cases.values():
                yield case.row(Value(Measure.ALLOWED, np.nan), Outcome(OutcomeKind.MISSING, str(error)))


def _ratio(found: PairFinding) -> float:
    if found.relation is Relation.SAME_LIMIT:  # which rounding need not explain
        return np.nan
    return 0.0 if found.relation is Relation.SAME_BITS else found.factor


def _outcome(found: PairFinding) -> tuple[Outcome, str]:
    if found.verdict is Verdict.NOT_TESTED:
        return Outcome(OutcomeKind.UNSUPPORTED, found.detail), found.relation.value
    return OK, found.detail


STUDY = Declaration(findings, named=Named.ONLY, apart=True, scenes=scenes, options=("methods",))
