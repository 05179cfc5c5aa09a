"""Attitudes and rates of rows, from each kind of column."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from conservative.attitude import Array
from conservative.check import SMALLEST

from ..solution import States
from .layout import Layout, Options


def convert(values: Array, layout: Layout, options: Options) -> tuple[Array, States, Array | None]:
    """Return times, motion and `unit_errors` of rows in SI units.

    `unit_errors` (n,) are measured before attitudes are repaired: norms of quaternions minus 1, or |R'R - 1| of matrices.
    """
    count = 1 + len(layout.used["rates"])
    w, (R, unit_errors) = values[:, 1:4] if count > 1 else None, to_matrices(values[:, count:], layout.attitude, options)
    if w is not None:
        w = np.where(np.abs(w) < SMALLEST, 0.0, w)  # no scene has such rates
        if options.world and R is not None:
            w = (w[:, None] @ R)[:, 0]
    return values[:, 0], (R, w), unit_errors


def find_flips(values: Array, layout: Layout) -> Array | None:
    """Return which rows (n,) have a quaternion of the other sign than the row before; None without quaternions."""
    if layout.attitude != "quaternion":
        return None
    q = values[:, -4:]
    return np.append(False, (q[1:] * q[:-1]).sum(axis=1) < 0)


def to_matrices(x: Array, kind: str | None, options: Options) -> tuple[Array | None, Array | None]:
    """Return matrices (n, 3, 3) and `unit_errors` (n,) of attitudes of a kind; None without them."""
    if kind is None:
        return None, None
    if kind == "quaternion":
        turns = Rotation.from_quat(x, scalar_first=options.quaternion != "xyzw")
        return turns.as_matrix(), np.linalg.norm(x, axis=1) - 1
    if kind == "matrix":
        R = x.reshape(-1, 3, 3)
        U, _, V = np.linalg.svd(R)
        return U @ V, np.abs(np.swapaxes(R, 1, 2) @ R - np.eye(3)).max(axis=(1, 2))
    if kind in ("angles", "aircraft angles"):
        sequence = (options.euler or "zyx") if kind == "angles" else "zyx"
        turns = Rotation.from_euler(sequence.upper(), x)
    elif kind == "rotation vector":
        turns = Rotation.from_rotvec(x)
    elif kind == "axis and angle":
        size = np.linalg.norm(x[:, :3], axis=1, keepdims=True)  # an angle of 0 may have an axis of 0
        turns = Rotation.from_rotvec(x[:, 3:] * x[:, :3] / np.where(size == 0, 1, size))
    elif kind == "modified Rodrigues":
        turns = Rotation.from_mrp(x)
    else:
        turns = Rotation.from_quat(np.column_stack([np.ones(len(x)), x]), scalar_first=True)
    return turns.as_matrix(), None
