"""Bodies with a rotor, random and in any field."""

from __future__ import annotations

import numpy as np

import conservative as cv
from conservative.scenes.random_body import FIELDS


def gyrostat(kind: str, index: int, turn: float = 10.0, share: float | None = None) -> cv.Scene:
    """Return a random gyrostat, "free" or in a field of `FIELDS`, that turns by `turn` rad at its initial rate.

    Its tensor is not diagonal and its moments are not 1. The rotor's momentum is `share` of the body's, or 0.2 to 3 times it.
    """
    scene = cv.scenes.random_body(FIELDS[index % len(FIELDS)] if kind == "free" else kind, seed=26, index=index)
    draw, own = np.random.default_rng((26, index)), scene.body.momentum(scene.w_WB_B0)
    direction = draw.standard_normal(3)
    size = (draw.uniform(0.2, 3.0) if share is None else share) * np.linalg.norm(own) / np.linalg.norm(direction)
    return scene.rename(
        f"{kind} gyrostat {index}",
        body=cv.RigidBody(scene.body.inertia, size * direction),
        potential=None if kind == "free" else scene.potential,
        t_end=turn / float(np.linalg.norm(scene.w_WB_B0)),
    )
