"""The mistakes that explain why a method in another version is wrong: it runs the exact motions of the verification."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from conservative.benchmarks.verification.finding import Verdict
from conservative.benchmarks.verification.programs import UNKNOWN, motion_findings, run_motions
from conservative.benchmarks.versions.project import Explained
from conservative.errors import Unsupported
from conservative.grid import Grid
from conservative.scene import Scene
from conservative.trajectory import Trajectory

Solve = Callable[[Scene, Grid], Trajectory]


def find_causes(solve: Solve, setting: Mapping[str, Any]) -> tuple[Explained, Explained]:
    """Return the mistakes of a setting on free bodies, and its mistakes on other bodies.

    `solve` raises `Unsupported` for a scene that is not supported. Its trajectories are not checked. `setting` has the keys
    "order" and "precision".
    """
    free = _find(solve, setting, free=True)
    # A body with loads turns by the same code: a mistake that free bodies show need not be searched again.
    return free, free if free.key else _find(solve, setting, free=False)


def _find(solve: Solve, setting: Mapping[str, Any], free: bool) -> Explained:
    """Return the keys and sentences of the mistakes on free bodies, or on the others; empty if all of these are right."""

    def solve_some(scene: Scene, grid: Grid) -> Trajectory:
        if scene.free != free:
            raise Unsupported("scene", repr(scene.name), "a free body" if free else "a body that is not free")
        return solve(scene, grid)

    # In principal axes, because the request `probe` of `versions/inside.py` has principal moments only.
    answers = run_motions(solve_some, setting["order"], setting.get("precision") == "f32", principal=True)
    findings, named, _ = motion_findings("", answers)
    wrong = [finding for finding in findings if finding.verdict is Verdict.WRONG]
    if wrong and not named:
        sentence = next((finding.detail for finding in wrong if finding.detail), UNKNOWN)
        # Without any complete run there is no motion to explain, and the row of the version already shows that the run ended.
        moved = any(math.isfinite(finding.error) for finding in wrong)
        return Explained("unknown" if moved else "", sentence)
    causes = [[explanation.cause for explanation in group.explanations] for group in named]
    return Explained(
        "; ".join(" or ".join(cause.key for cause in same) for same in causes),
        "; ".join(" or ".join(cause.sentence for cause in same) for same in causes),
    )
