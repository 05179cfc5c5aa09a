"""Points of COLLADA meshes, which most visuals of robots are: enough for a convex hull, not for a volume."""

from __future__ import annotations

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
    metre = float(unit.get("meter", "1")) if unit is not None else 1.0
    by_id = {element.get("id"): element for element in root.iter("geometry", "source", "float_array", "node", "vertices")}
    points: list[Array] = []

    def add(geometry: Any, pose: Array) -> None:
        for vertices in geometry.iter("vertices"):
            for entry in vertices.findall("input"):
                source = by_id.get(entry.get("source", "")[1:]) if entry.get("semantic") == "POSITION" else None
                values = None if source is None else source.find("float_array")
                if values is not None and values.text:
                    numbers = np.array(values.text.split(), float)
                    xyz = numbers[: len(numbers) // 3 * 3].reshape(-1, 3)
                    points.append(xyz @ pose[:3, :3].T + pose[:3, 3])

    def walk(node: Any, pose: Array, depth: int) -> None:
        if depth > DEEPEST:
            raise Unread("a mesh whose nodes are nested too deep")
        for child in node:
            if child.tag in ("matrix", "translate", "rotate", "scale"):
                pose = pose @ _transform(child)
            elif child.tag in ("instance_geometry", "instance_controller"):
                geometry = by_id.get(child.get("url", "")[1:])
                if geometry is not None:
                    add(geometry, pose)
            elif child.tag == "instance_node":
                other = by_id.get(child.get("url", "")[1:])
                if other is not None:
                    walk(other, pose, depth + 1)
            elif child.tag == "node":
                walk(child, pose, depth + 1)

    for scene in root.iter("visual_scene"):
        walk(scene, np.eye(4), 0)
    if not points:  # a file without a scene
        for geometry in root.iter("geometry"):
            add(geometry, np.eye(4))
    whole = metre * np.vstack(points) if points else np.zeros((0, 3))
    if not len(whole) or not np.isfinite(whole).all():
        raise Unread("a mesh without points, or with points that are not finite")
    return whole


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
