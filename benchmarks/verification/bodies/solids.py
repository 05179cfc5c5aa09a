"""Bounds of the inertia of a link from its shapes: the convex hull with uniform density, and bounds for any distribution."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from conservative.attitude import Array
from conservative.references.model_files.pieces import Piece, weigh

DENSEST = 22600.0
"""Density of osmium, kg/m^3, the densest material. Counterweights of tungsten have 19,250, motors at most 8,000."""


@dataclass(frozen=True, eq=False)
class Hull:
    """A convex hull: its corners (n, 3), its faces as n.x + d <= 0 (m, 4), m, and its solid with mass 1 kg."""

    points: Array
    faces: Array
    volume: float
    solid: Piece

    @property
    def size(self) -> float:
        """Diagonal of the bounding box, m."""
        return float(np.linalg.norm(np.ptp(self.points, axis=0)))

    def outside(self, place: Array) -> float:
        """Return the distance of a point (3,) from the nearest face, m; negative inside."""
        return float((self.faces[:, :3] @ place + self.faces[:, 3]).max())


def hull_of(shapes: Sequence[Array]) -> Hull | None:
    """Return the convex hull of points (n, 3), or None if they are in one plane."""
    if not shapes:
        return None
    points = np.vstack(shapes)
    middle = points.mean(axis=0)
    try:
        hull = ConvexHull(points - middle)
    except (QhullError, ValueError):
        return None
    corners = (points - middle)[hull.simplices]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inward = (normals * hull.equations[:, :3]).sum(axis=1) < 0
    faces = hull.simplices.copy()
    faces[inward] = faces[inward][:, ::-1]
    (solid,) = weigh("mesh", [points - middle, faces], np.eye(4), 1.0)
    if solid.mass < 1e-6 * np.linalg.norm(np.ptp(points, axis=0)) ** 3:  # a plate without thickness
        return None
    planes = hull.equations.copy()
    planes[:, 3] -= planes[:, :3] @ middle
    unit = Piece(1.0, solid.com + middle, solid.inertia / solid.mass)
    return Hull(points[hull.vertices], planes, float(solid.mass), unit)


def second_moments(part: Piece) -> tuple[Array, Array]:
    """Return integrals of x^2 about the centre of mass along three axes divided by the mass (3,), m^2, and the axes (3, 3)."""
    values, axes = np.linalg.eigh(np.trace(part.inertia) / 2 * np.eye(3) - part.inertia)
    return values / part.mass, axes


def reach(part: Piece, hull: Hull) -> float:
    """Return the largest second moment along an axis, relative to all mass at the point of the hull that is farthest along it.

    It is at most 1 for any mass distribution within the hull.
    """
    values, axes = second_moments(part)
    farthest = np.abs((hull.points - part.com) @ axes).max(axis=0)
    return float((values / np.maximum(farthest, 1e-12) ** 2).max())


def overhang(part: Piece, hull: Hull) -> float:
    """Return how far the radius of gyration along an axis is beyond twice the reach of the hull, relative to its size."""
    values, axes = second_moments(part)
    farthest = np.abs((hull.points - part.com) @ axes).max(axis=0)
    return float((np.sqrt(np.maximum(values, 0.0)) - 2 * farthest).max() / hull.size)


def density_of(part: Piece, hulls: Sequence[Hull]) -> float:
    """Return the density, kg/m^3, of a body with a mass and inertia that has the proportions of a ball or of one of the hulls.

    It is the smallest of these densities. A ball is the most compact body, so its density is a lower bound for any body.
    """
    moment = np.trace(part.inertia) / 2
    if not moment > 0:
        return math.inf
    radius = math.sqrt(moment / (0.6 * part.mass))
    ball = part.mass / (4 / 3 * math.pi * radius**3)
    scaled = [part.mass / hull.volume * ratio(part.inertia, hull.solid.inertia * part.mass) ** -1.5 for hull in hulls]
    return float(min(scaled, default=ball))


def spread_density(part: Piece) -> float:
    """Return the density, kg/m^3, of the solid ellipsoid with a mass and inertia; inf for a plane or a line."""
    values, _ = second_moments(part)
    volume = 4 / 3 * math.pi * float(np.prod(np.sqrt(5 * np.maximum(values, 0.0))))
    return part.mass / volume if volume > 0 else math.inf


def ratio(inertia: Array, other: Array) -> float:
    """Return the ratio of the traces of two inertias."""
    return float(np.trace(inertia) / np.trace(other))


def unlike(inertia: Array, other: Array) -> float:
    """Return the difference of two inertias (3, 3) of the same trace: 0 for the same proportions and axes."""
    if not (np.trace(inertia) > 0 and np.trace(other) > 0):
        return math.inf
    return float(np.linalg.norm(inertia / np.trace(inertia) - other / np.trace(other)))
