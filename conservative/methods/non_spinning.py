"""The non-spinning frame: a symmetric body is integrated without its spin, which is added in closed form.

For J1 = J2 and a torque without component along the axis, L3 is constant and the frame R_WS with

    R_WB = R_WS Rot(axis, rate t)        rate = (1/J3 - 1/J1) L3

turns with L/J1. It moves like a spherical body of inertia J1 in the same field, with the same initial momentum. Nutation limits
the steps then, and spin does not. `principal_start(scene, "non_spinning")` returns the initial state of that slow motion.
Klein and Sommerfeld, Theorie des Kreisels, call it the spherical top.
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from ..scene import Scene

Frame = Literal["auto", "body", "non_spinning"]
Resolved = Literal["body", "non_spinning"]
FRAMES: tuple[Frame, ...] = ("auto", "body", "non_spinning")


def resolve_frame(frame: Frame, scene: Scene) -> Resolved:
    """Return the frame that "auto" stands for: non-spinning if body and field share an axis of symmetry."""
    if frame != "auto":
        return frame
    moments = scene.body.moments
    spherical = np.ptp(moments) <= 1e-14 * moments.max()
    return "body" if spherical or scene.symmetry_axis_B is None else "non_spinning"


def frame_unsupported(method: Any, scene: Scene) -> str | None:
    """Return why the scene cannot be integrated in the `frame` of a method, None if it can: as its `unsupported`."""
    if method.frame == "non_spinning" and scene.symmetry_axis_B is None:
        return "frame non_spinning needs body and field symmetric about one axis"
    return None
