"""The judgement of a recorded motion: errors and drifts over time, and the diagnosis."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from conservative.attitude import Array, from_quaternion, to_quaternion
from conservative.flight import rotation_only
from conservative.invariants import kinetic_energy, sizes
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from .diagnose import FAR, diagnose
from .motion import Case
from .table import Recording

LONGEST = 1000.0
"""Angle, rad, over which rows are compared if no closed form is known."""


def judge(scene: Scene, recording: Recording, from_row: bool) -> tuple[dict[str, Any], pd.DataFrame]:
    """Return the summary of a recording as a motion of a scene, and rows of t, quantity and value.

    The exact motion starts in the first row, or as the scene does. The summary has the largest errors, of attitudes, rad, and
    of rates, relative to the largest; the unit of each in the file and its size, 0 if the file has none; and the diagnosis.
    """
    whole = Case(rotation_only(scene), recording.t, (None, None), from_row)
    case, notes = whole.read(*recording.data), [f"{len(recording.t):,} of {recording.rows:,} rows are compared."]
    if not recording.order_known and (R := recording.data[0]) is not None:
        other = whole.read(from_quaternion(np.roll(to_quaternion(R), 1, axis=1)), recording.data[1])
        case, order = min((case, "wxyz"), (other, "xyzw"), key=lambda each: float(each[0].error.max()))
        notes.append(f"The order of the quaternions is not named; {order} fits better.")
    if not case.closed:
        case = case.first(LONGEST, 2)
        notes.append(f"Rows to {case.t[-1]:g} s are compared with a numerical solution: no closed form is known.")
    if recording.ignored:
        names = ", ".join(recording.ignored)
        notes.append(f"{names} are not judged. If these angles turn body to world, name their sequence: --euler zyx.")
    named, tried = diagnose(case, recording.norm is not None)
    (R, w), body = case.data, scene.body
    rates = ("deg/s", float(np.degrees(case.scale))) if recording.degrees else ("rad/s", case.scale)
    units = [(unit, size * (data is not None)) for (unit, size), data in zip((("rad", 1.0), rates), case.data, strict=True)]
    of = zip(("attitude", "rate"), units, case.error, strict=True)
    series: dict[str, Array] = {f"{name} error, {unit}": errors * size for name, (unit, size), errors in of if size}
    if w is not None and (R is not None or scene.free):  # rates alone determine the energy of a free body
        recorded = Trajectory(case.scene, case.t, np.broadcast_to(np.eye(3), (len(w), 3, 3)) if R is None else R, w, "file")
        kept = [each for each in case.scene.invariants if R is not None or each.unit == "J"]
        series |= {f"drift of {each.name}": sizes(recorded.drift(each)) for each in kept}
    if w is not None and scene.free and case.error.max() > FAR:
        gap = np.abs(kinetic_energy(body, w) * 2 * np.sort(body.moments)[1] / np.sum(body.momentum(w) ** 2, axis=1) - 1)
        if gap[-len(gap) // 10 :].max() < 0.1 * gap[0]:
            notes.append("The energy approaches L^2/(2 I2): intermediate axis instability is created by the integrator.")
    if recording.norm is not None:
        series["quaternion norm, minus 1"] = np.abs(recording.norm - 1)[: len(case.t)]
    error, found = case.error.max(axis=1).tolist(), {"diagnosis": named, "tried": tried, "notes": notes}
    quantities = [{"quantity": name, "largest": float(x.max()), "final": float(x[-1])} for name, x in series.items()]
    rows = pd.concat(pd.DataFrame({"t": case.t, "quantity": name, "value": x}) for name, x in series.items())
    return {"error": error, "units": units, "quantities": quantities, **found}, rows
