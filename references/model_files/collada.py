"""Points of COLLADA meshes, which most visuals of robots are: enough for a convex hull, not for a volume."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from conservative.attitude import Array

from .files import Unread
from .pieces import make_pose

DEEPEST = 50
"""Largest depth of nodes."""


def read_collada(data: bytes) -> Array:
    """Return the points (n, 3) of the scene in a COLLADA file, m.

    The unit of the file is applied. Its up axis is not, because ROS does not turn meshes either. Raise `Unread` for a file that
    is not XML or has no points.
    """
    from lxml import etree

    parser = etree.XMLParser(resolve_entities=False, no_network=True, remove_comments=True, remove_pis=True, huge_tree=True)
    try:
        root = etree.fromstring(data, parser)
    except etree.XMLSyntaxError as error:
        raise Unread(f"a mesh that is not XML ({error})") from None
    for element in root.iter():
        if isinstance(element.tag, str):
            element.tag = element.tag.rpartition("}")[2]
    unit = root.find("asset/unit")
    metre = 1.0 if unit is None else float(unit.get("meter", "1"))
    by_id = {element.get("id"): element for element in root.iter("geometry", "source", "node")}
    scenes = [points for scene in root.iter("visual_scene") for points in _walk(scene, np.eye(4), by_id)]
    points = scenes or [points for geometry in root.iter("geometry") for points in _points(geometry, np.eye(4), by_id)]
    whole = metre * np.vstack(points) if points else np.zeros((0, 3))
    if not len(whole) or not np.isfinite(whole).all():
        raise Unread("a mesh without points, or with points that are not finite")
    return whole


def _walk(node: Any, pose: Array, by_id: Mapping[str, Any], depth: int = 0) -> Iterator[Array]:
    """Yield the points (n, 3) of the geometries below a node of a scene."""
    if depth > DEEPEST:
        raise Unread("a mesh whose nodes are nested too deep")
    for child in node:
        other = by_id.get(child.get("url", "")[1:])
        if child.tag in ("matrix", "translate", "rotate", "scale"):
            pose = pose @ _transform(child)
        elif child.tag == "node":
            yield from _walk(child, pose, by_id, depth + 1)
        elif child.tag == "instance_node" and other is not None:
            yield from _walk(other, pose, by_id, depth + 1)
        elif child.tag == "instance_geometry" and other is not None:
            yield from _points(other, pose, by_id)


def _points(geometry: Any, pose: Array, by_id: Mapping[str, Any]) -> Iterator[Array]:
    """Yield the vertices (n, 3) of a geometry after a map `pose` (4, 4)."""
    for entry in geometry.iterfind(".//vertices/input[@semantic='POSITION']"):
        source = by_id.get(entry.get("source", "")[1:])
        values = None if source is None else source.find("float_array")
        if values is not None and values.text:
            numbers = np.array(values.text.split(), float)
            xyz = numbers[: len(numbers) // 3 * 3].reshape(-1, 3)
            yield xyz @ pose[:3, :3].T + pose[:3, 3]


def _transform(element: Any) -> Array:
    values = np.array((element.text or "").split(), float)
    if element.tag == "matrix":
        return values.reshape(4, 4)
    if element.tag == "translate":
        return make_pose(values)
    if element.tag == "scale":
        return np.diag([*values, 1.0])
    axis = values[:3] / np.linalg.norm(values[:3])
    return make_pose(R=Rotation.from_rotvec(np.radians(values[3]) * axis))
