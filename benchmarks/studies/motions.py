"""The study of motions: engines on the motions of references/motions, and the mistakes that explain their failures.

A program passes a motion if all its errors are within the tolerances of its order at |w| h = 0.01. Those of order 2 hold for
order 3, and for an engine that chooses its steps. The detail of a row is the mistake.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from conservative.errors import BadInput
from conservative.grid import Grid
from conservative.method import Method
from conservative.outcome import OK, Outcome
from conservative.scene import Scene

from ..measures.measure import Measure, Value
from ..measures.measurement import Measurement
from ..verification.motions import files
from ..verification.motions.motion import load
from ..verification.motions.programs import ANGLES, PARTS
from .case import Case
from .declaration import Declaration, Named
from .study import Progress, Study
from .time_limit import attempt_within


def scenes() -> tuple[Scene, ...]:
    """Return the motions as scenes."""
    return tuple(motion.scene for motion in load())


def declared_order(method: Method) -> int:
    """Return the order whose tolerances a method has to meet."""
    return {1: 1, 2: 2, 3: 2, None: 2}.get(method.order, 4)


def findings(study: Study, progress: Progress) -> Iterator[Measurement]:
    """Yield the largest error over its tolerance, of each engine on each motion.

    Raise `BadInput` for a scene that is not one of the motions.
    """
    tell, motions = study.count(progress, len(study.competitors)), {motion.scene.key: motion for motion in load()}
    if others := [scene.name for scene in study.scenes if scene.key not in motions]:
        raise BadInput("scenes", repr(others[0]), "motions of conservative/references/motions")
    for scene in study.scenes:
        motion = motions[scene.key]
        kept, every = files.read(motion.name), motion.steps * PARTS[-1]
        for method in study.competitors:
            tell(f"{scene.name}: {method.name}")
            case = Case(study.name, scene, method, Grid(motion.step / PARTS[-1], every * motion.samples, every))
            done = attempt_within(study.hang_limit, case, study.skip_missing, apart=True)
            if isinstance(done, Outcome):
                yield case.row(Value(Measure.ALLOWED, np.nan), done)
                continue
            single, R, w = getattr(method, "precision", "f64") == "f32", done.trajectory.R_WB, done.trajectory.w_WB_B
            ratio, mistake = files.verdict(kept, declared_order(method), ANGLES[-1], single, R[1:], w[1:])
            yield case.row(Value(Measure.ALLOWED, ratio), OK, mistake)


STUDY = Declaration(findings, named=Named.ONLY, apart=True, scenes=scenes, options=("methods",))
