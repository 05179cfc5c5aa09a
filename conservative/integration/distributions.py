"""Mean attitude and spread of many bodies, computed block by block, from memory or from a disk.

The mean attitude is the rotation nearest to the mean of all matrices (M. Moakher, Means and averaging in the group of
rotations, 2002). Quantiles are determined from a histogram with narrow bins.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from ..attitude import Array

QUANTILES = (0.05, 0.5, 0.95)
"""Quantiles of the angle between an attitude and the mean."""
_LEAST = 1e-9
"""Smaller angles, rad, are treated as 0: the round-off of a sum of a million attitudes."""
_WIDTH = 0.005
"""Width of a bin, relative to its angle. The error of a quantile is half of it."""
_BINS = math.ceil(math.log(math.pi / _LEAST) / _WIDTH)
_BLOCK = 1 << 24
"""Size of the attitudes that are read at once, bytes."""


def blocks(R_WB: Any, samples: Sequence[int] | None = None) -> Iterator[Array]:
    """Yield the attitudes (b, m, 3, 3) of each block of bodies, at all samples or at the given ones.

    R_WB (n, m, 3, 3) is a NumPy array, or an array of Zarr, which is read along its chunks.
    """
    n, count = R_WB.shape[:2]
    stored = getattr(R_WB, "chunks", None)
    fitting = max(1, _BLOCK // (72 * count))  # a matrix has 72 bytes
    size = stored[0] * max(1, fitting // stored[0]) if stored else fitting
    for start in range(0, n, size):
        block = np.asarray(R_WB[start : start + size])
        yield block if samples is None else block[:, list(samples)]


def mean_attitudes(R_WB: Any, samples: Sequence[int] | None = None) -> Array:
    """Return the mean attitudes (m, 3, 3) of bodies (n, m, 3, 3) at each sample, without those that are not finite."""
    total = sum(np.nansum(block, axis=0) for block in blocks(R_WB, samples))
    U, _, Vt = np.linalg.svd(np.asarray(total))
    U[:, :, 2] *= np.linalg.det(U @ Vt)[:, None]
    return np.asarray(U @ Vt)


def angle_quantiles(R_WB: Any, centre: Array, samples: Sequence[int] | None = None) -> Array:
    """Return `QUANTILES` (m, 3) of the angles, rad, of bodies (n, m, 3, 3) from attitudes (m, 3, 3), one for each sample.

    The relative error is a quarter of a percent, or 1e-9 rad. Bodies that are not finite are left out; without bodies the
    result is nan.
    """
    counts = np.zeros((len(centre), _BINS + 1), dtype=np.int64)  # the first bin has the angles below `_LEAST`
    for block in blocks(R_WB, samples):
        off = block - centre
        square = np.einsum("nsij,nsij->ns", off, off)
        with np.errstate(divide="ignore", invalid="ignore"):
            angle = 2 * np.arcsin(np.sqrt(np.minimum(square / 8, 1.0)))
            bins = np.ceil(np.log(angle / _LEAST) / _WIDTH)
        sample, finite = np.broadcast_to(np.arange(len(centre)), bins.shape), ~np.isnan(bins)
        places = sample[finite] * (_BINS + 1) + np.clip(bins[finite], 0, _BINS).astype(np.int64)
        counts += np.bincount(places, minlength=counts.size).reshape(counts.shape)
    reached = counts.cumsum(axis=1)
    ranks = np.array(QUANTILES) * reached[:, -1:]
    bins = (reached[:, None, :] < np.maximum(ranks, 0.5)[:, :, None]).sum(axis=2)
    angles = np.where(bins == 0, 0.0, np.minimum(_LEAST * np.exp(_WIDTH * (bins - 0.5)), math.pi))
    return np.where(reached[:, -1:] > 0, angles, math.nan)


def directions(R_WB: Any, axis_B: Array, samples: Sequence[int]) -> Array:
    """Return a unit vector (3,) of the body in world axes: (k, n, 3) for k given samples of attitudes (n, m, 3, 3).

    Bodies that are not finite at one of these samples are left out.
    """
    vectors_W = np.concatenate([block @ axis_B for block in blocks(R_WB, samples)])
    return np.asarray(np.moveaxis(vectors_W[np.isfinite(vectors_W).all(axis=(1, 2))], 1, 0))


def project(directions_W: Array) -> tuple[Array, Array]:
    """Return unit vectors (n, 3) as points (n, 2) of a disc, and their mean direction (3,), which is its centre.

    The disc is Lambert's equal-area projection of the sphere, seen from outside with the world's z axis up, or the x axis if
    the mean is near z. A point at an angle a from the mean is 2 sin(a/2) from the centre, dimensionless.
    """
    mean = directions_W.sum(axis=0)
    size = np.linalg.norm(mean)
    mean = mean / size if size > 0 else np.array([0.0, 0.0, 1.0])
    other = np.eye(3)[2 if abs(mean[2]) < 0.99 else 0]
    up = other - other @ mean * mean
    up /= np.linalg.norm(up)
    across = directions_W @ np.stack([np.cross(up, mean), up], axis=1)
    # 2 sin(a/2) / sin(a) is finite except opposite the centre
    return across / np.sqrt(np.maximum((1 + directions_W @ mean) / 2, 1e-30))[:, None], mean
