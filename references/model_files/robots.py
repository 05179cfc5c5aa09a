"""Robots as free bodies: one file for every link and what is fixed to it. Joints that move are left out, and not simulated.

A file with one free body stays as it is. Copies have no visuals, and no mesh where mass and inertia are written in the file.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from .description import EXTENSIONS, Description, is_true
from .files import Unread, find, guard_layers, inline, parse, refuse
from .mjcf import Document, within


@dataclass
class Body:
    """A free body of a file: its root link, the file that has it alone, and notes.

    `pivots` has the joints that move it or hold it, by their kinds, and where they are in its axes (3,), m. `bare` is a copy
    of the file that has nothing beside the mass of the body, if `path` is the file itself.
    """

    name: str = ""
    path: Path = Path()
    notes: Sequence[str] = ()
    pivots: Sequence[tuple[str, Any]] = ()
    bare: Path | None = None


Bodies = list[Body]
FREE = "the joints of {} are left out: it is checked as a free body"
"""Note on a body that joints move or hold."""
PLAIN = {"type": "free", **dict.fromkeys(("armature", "damping", "stiffness", "frictionloss"), "0"), "limited": "false"}
"""The joint of a free body in MJCF, against defaults of the file. More engines know it than <freejoint>."""
MOST = 1000
"""Largest number of bodies of a file."""


def split(path: Path, kind: str, folder: Path, search: Sequence[Path] = ()) -> Bodies:
    """Return the free bodies of a model file of a kind, as files of which copies are written into a folder.

    Raise `BadInput` if the joints form a circle or refer to links that are not there, and for a file without a body.
    """
    bodies = {"mjcf": _mjcf, "usd": _usd}.get(kind, _links)(path, folder, search)
    if not 0 < len(bodies) <= MOST:
        raise refuse(path, f"{len(bodies) or 'no'} bodies that have a mass", f"1 to {MOST} bodies")
    return bodies


def group(path: Path, names: Sequence[str], parents: Mapping[str, str]) -> dict[str, list[str]]:
    """Return the names that are fixed to each root, itself first; `parents` has the parents of those that are fixed."""
    groups: dict[str, list[str]] = {}
    for name in names:
        root, seen = name, {name}
        while root in parents:
            root = parents[root]
            if root in seen:
                raise refuse(path, f"joints that form a circle through {root!r}", "joints that form a tree")
            if root not in names:
                raise refuse(path, f"a joint to {root!r}, which is not there", "joints between links of the file")
            seen.add(root)
        groups.setdefault(root, []).append(name)
    return {root: [root, *(member for member in members if member != root)] for root, members in groups.items()}


def _links(path: Path, folder: Path, search: Sequence[Path]) -> Bodies:
    """Return the bodies of a URDF or SDF file."""
    root = parse(path)
    models = [root] if root.tag == "robot" else [*root.findall("model"), *root.findall("world/model")]
    bodies: Bodies = []
    for model in models:
        if model.find("include") is not None or model.find("model") is not None:
            raise refuse(path, "a model within another, or an include", "models without includes")
        prefix = f"{model.get('name')}: " if len(models) > 1 else ""
        bodies += [replace(body, name=prefix + body.name) for body in _links_of(path, model, folder, search, bool(prefix))]
    return bodies


def _links_of(path: Path, model: Any, folder: Path, search: Sequence[Path], several: bool) -> Bodies:
    urdf, frames = model.tag == "robot", Description(path, model, search)
    links = {link.get("name", ""): link for link in model.findall("link")}
    parents, moving = _tree(path, frames, links)
    groups = group(path, list(links), parents)
    held = is_true(model.findtext("static"))
    if urdf or held:  # links without inertia are frames, or scenery
        full = {name for name, link in links.items() if (inertial := link.find("inertial")) is not None and len(inertial)}
        groups = {name: members for name, members in groups.items() if full.intersection(members)}
    missing, elsewhere = dict[str, None](), False
    for shape in model.iterfind("link//geometry/*"):
        name = shape.get("filename") or shape.findtext("uri") or ""
        try:  # an engine does not know the search paths
            elsewhere |= bool(name) and find(path, name, search) != path.parent / name.removeprefix("file://")
        except Unread as error:
            missing[str(error)] = None
    meshes = ", ".join([*missing][:1] + [f"and {len(missing) - 1} more"] * (len(missing) > 1))
    # Engines get a copy of a body on a floating joint: with the file itself they would have a root without mass.
    one_free = set(groups) == {next(iter(links), "")} and not moving
    alone = one_free and not (several or held or elsewhere or meshes)
    notes = ["engines get a copy of the file without meshes: it needs " + meshes] if meshes else []
    bodies: Bodies = []
    for name, members in groups.items():
        joints = [joint for joint in frames.joints if joint.child == name and name in moving]
        base = np.linalg.inv(frames.place(name))
        pivots = [(joint.kind, np.zeros(3) if urdf else (base @ frames.place(joint.name))[:3, 3]) for joint in joints]
        copy = _write(folder, _copy(path, model, frames, members, search), path)
        loose = [FREE.format(repr(name))] if not alone and (moving or held) else []
        bodies.append(Body(name, path if alone else copy, notes + loose, pivots, copy if alone else None))
    return bodies


def _tree(path: Path, frames: Description, links: Mapping[str, Any]) -> tuple[dict[str, str], dict[str, str]]:
    """Return the parents of the links that are fixed, and of those that move or are held.

    Raise `BadInput` for a circle of fixed joints, and in URDF, where joints form a tree, for any.
    """
    parents, moving = dict[str, str](), dict[str, str]()
    for joint in frames.joints:
        if joint.child in parents or (frames.urdf and joint.child in moving):
            raise refuse(path, f"two joints to {joint.child!r}", "joints that form a tree")
        if joint.child not in links:
            raise refuse(path, f"a joint to {joint.child!r}, which is not there", "joints between links of the file")
        world = joint.parent == "world" and ("world" not in links or links["world"].find("inertial") is None)
        (parents if joint.kind == "fixed" and not world else moving)[joint.child] = joint.parent
    group(path, [*links, "world"], {**parents, **moving} if frames.urdf else parents)
    return parents, moving


def _copy(path: Path, model: Any, frames: Description, members: Sequence[str], search: Sequence[Path]) -> Any:
    """Return a copy of a model with the links of one body, the joints between them, and what is for one engine.

    Meshes are left out unless the mass follows from them; then they get their absolute path.
    """
    copy = deepcopy(model)
    for element in [element for element in copy if element.tag.partition(":")[0] not in EXTENSIONS]:
        if element.tag == "joint" and frames.urdf and element.find("child").get("link") in members[1:]:
            for child in [child for child in element if child.tag not in ("origin", "parent", "child")]:
                element.remove(child)  # such as <mimic>, which refers to other joints
        elif element.tag != "link" or element.get("name") not in members:
            copy.remove(element)
    for link in copy.findall("link"):
        inertial = link.find("inertial")
        auto = inertial is not None and is_true(inertial.get("auto"))
        for shape in [*link.findall("visual"), *link.findall("collision")]:
            mesh = shape.find("geometry/mesh")
            if shape.tag == "visual" or (mesh is not None and not auto):
                link.remove(shape)
            elif mesh is not None and mesh.find("uri") is not None:
                mesh.find("uri").text = str(find(path, mesh.findtext("uri"), search).resolve())
    if frames.urdf:
        return copy
    base = np.linalg.inv(frames.place(members[0]))
    for link in copy.findall("link"):  # poses and joints of SDF may refer to frames that are left out
        name = link.get("name")
        for collision in link.findall("collision"):
            _place(collision, frames.inside(name, collision))
        _place(link, base @ frames.place(name))
    for child in members[1:]:
        joint = copy.makeelement("joint", name=f"{child}_is_fixed", type="fixed")
        joint.extend([_text(copy, "parent", members[0]), _text(copy, "child", child)])
        copy.append(joint)
    outer = copy.makeelement("sdf", dict(model.getroottree().getroot().attrib))
    outer.append(copy)
    return outer


def _text(element: Any, tag: str, text: str) -> Any:
    made = element.makeelement(tag)
    made.text = text
    return made


def _place(element: Any, pose: Any) -> None:
    """Give an element of SDF its pose (4, 4) in its parent as numbers."""
    for old in element.findall("pose"):
        element.remove(old)
    if np.abs(pose - np.eye(4)).max() > 1e-15:
        angles = Rotation.from_matrix(pose[:3, :3]).as_euler("xyz")
        element.insert(0, _text(element, "pose", " ".join(map(repr, [*pose[:3, 3].tolist(), *angles.tolist()]))))


def _write(folder: Path, made: Any, path: Path) -> Path:
    """Write a model into a folder of its own, with the name of the file and the usual suffix. Return the path."""
    from lxml import etree

    place = _place_for(folder, path, {"robot": "urdf", "mujoco": "xml", "sdf": "sdf"}[made.tag])
    place.write_bytes(etree.tostring(made))
    return place


def _place_for(folder: Path, path: Path, suffix: str) -> Path:
    place = folder / str(len(list(folder.iterdir()))) / f"{path.stem}.{suffix}"
    place.parent.mkdir()
    return place


def _mjcf(path: Path, folder: Path, search: Sequence[Path]) -> Bodies:
    """Return the bodies of an MJCF file: bodies in the world, and bodies on joints."""
    root, missing, elsewhere = inline(path, search)
    document, entries = Document(path, root, search), list[tuple[Any, str]]()

    def walk(element: Any, inherited: str, world: bool) -> None:
        inherited = element.get("childclass", inherited)
        for child in element:
            if child.tag == "body":
                if world or _joints_of(child):
                    entries.append((child, child.get("childclass", inherited)))
                walk(child, inherited, False)
            elif child.tag in ("frame", "replicate"):
                walk(child, inherited, world)

    for worldbody in root.findall("worldbody"):
        walk(worldbody, "main", True)
    free = all(
        len(_joints_of(body)) <= 1 and all(joint.get("type") == "free" for joint in _joints_of(body)) for body, _ in entries
    )
    alone = len(entries) == 1 and free and bool(_joints_of(entries[0][0])) and not (missing or elsewhere)
    notes = [f"engines get a copy without {name!r}, which is not in the file's folder or a search path" for name in missing[:1]]
    for compiler in root.findall("compiler") * (not alone):
        if float(compiler.attrib.pop("settotalmass", "-1")) > 0:
            notes.append("settotalmass is left out: masses are those before they are scaled")
    bodies: Bodies = []
    for number, (body, inherited) in enumerate(entries):
        pivots = document.joints(body)
        name, copy = body.get("name") or f"body {number}", deepcopy(body)
        copy.attrib.update({"name": name} | ({"childclass": inherited} if inherited != "main" else {}))
        for key in ("pos", "quat", "axisangle", "euler", "xyaxes", "zaxis", "mocap"):
            copy.attrib.pop(key, None)
        made = root.makeelement("mujoco", {"model": path.stem, **root.attrib})  # Drake needs a name
        made.extend(deepcopy(child) for child in root if child.tag in {"compiler", "default", "asset"})
        _lighten(path, made, copy, root, search)
        if next(copy.iter("inertial", "geom"), None) is None:
            continue
        kept = alone and body.find("freejoint") is not None
        copy.insert(0, copy.makeelement("freejoint") if kept else copy.makeelement("joint", PLAIN))
        world = made.makeelement("worldbody")
        world.append(copy)
        made.append(world)
        place = _write(folder, made, path)
        if alone:
            return [Body(body.get("name", ""), path, [], pivots, place)]
        bodies.append(Body(name, place, [*notes, FREE.format(repr(name))], pivots))
    return bodies


def _joints_of(body: Any) -> list[Any]:
    """Return the joints of a body of MJCF, also in its frames; a <freejoint> gets its type."""
    joints = within(body, "joint", "freejoint")
    for joint in joints:
        if joint.tag == "freejoint":
            joint.set("type", "free")
    return joints


def _lighten(path: Path, made: Any, body: Any, root: Any, search: Sequence[Path]) -> None:
    """Remove the joints of a body, bodies below it that move, materials, and meshes that do not matter.

    The other meshes get their absolute path.
    """
    for part in list(body.iter("body", "joint", "freejoint", "site", "camera", "light")):
        if part is not body and (part.tag != "body" or _joints_of(part)):
            part.getparent().remove(part)
    options = {key: value for compiler in root.findall("compiler") for key, value in compiler.attrib.items()}
    for geom in list(body.iter("geom")):
        written = next(geom.iterancestors("body")).find("inertial") is not None and options.get("inertiafromgeom") != "true"
        if written and (geom.get("mesh") or geom.get("type") in (None, "mesh")):
            geom.getparent().remove(geom)
    for geom in [*made.iter("geom"), *body.iter("geom")]:
        geom.attrib.pop("material", None)
    used = {geom.get("mesh") for geom in body.iter("geom")}
    base = options.get("meshdir", options.get("assetdir", ""))
    for compiler in made.iter("compiler"):
        for key in ("assetdir", "meshdir", "texturedir"):
            compiler.attrib.pop(key, None)
    for asset in [asset for assets in made.findall("asset") for asset in assets]:
        name = asset.get("file", "")
        if asset.tag != "mesh" or (asset.get("name") or Path(name).stem) not in used:
            asset.getparent().remove(asset)
        elif name:
            asset.set("name", asset.get("name") or Path(name).stem)
            try:
                asset.set("file", str(find(path, f"{base}/{name}" if base else name, search).resolve()))
            except Unread as error:
                allowed = "the mesh in the folder of the file or in one of --search"
                raise refuse(path, f"a body whose mass follows from {error}", allowed) from None


def _usd(path: Path, folder: Path, search: Sequence[Path]) -> Bodies:
    """Return the bodies of a USD file. In a copy all other bodies and the joints that move are not active."""
    guard_layers(path, search)
    from pxr import Usd

    from .usd import Stage

    stage = Stage(path)
    names, parents, physics = [str(body.GetPath()) for body in stage.bodies], dict[str, str](), stage.physics
    pivots: dict[str, list[tuple[str, Any]]] = {name: [] for name in names}
    for joint in stage.joints:
        api = physics.Joint(joint)
        ends = [[str(target) for target in end.GetTargets()] for end in (api.GetBody0Rel(), api.GetBody1Rel())]
        if joint.IsA(physics.FixedJoint) and all(ends) and all(targets[0] in names for targets in ends):
            parents[ends[1][0]] = ends[0][0]
            continue
        number = 1 if ends[1] else 0
        for name in set(ends[number]).intersection(names):
            place = joint.GetAttribute(f"physics:localPos{number}").Get() or (0, 0, 0)
            place = stage.pose(stage.stage.GetPrimAtPath(name))[1] @ (stage.metre * np.array(place))
            pivots[name].append((joint.GetTypeName().removeprefix("Physics").removesuffix("Joint").lower(), place))
    groups = group(path, names, parents)
    if len(groups) == 1 and len(parents) == len(stage.joints):
        return [Body(next(iter(groups)), path)]
    bodies: Bodies = []
    for name, members in groups.items():
        copy = Usd.Stage.Open(stage.stage.Flatten())
        for joint in [prim for prim in copy.Traverse() if prim.IsA(physics.Joint)]:
            target = [str(target) for target in physics.Joint(joint).GetBody1Rel().GetTargets()]
            if not (joint.IsA(physics.FixedJoint) and set(target).intersection(members[1:])):
                joint.SetActive(False)
        for other in set(names) - set(members):
            prim = copy.GetPrimAtPath(other)
            if any(member.startswith(f"{other}/") for member in members):
                prim.RemoveAPI(physics.RigidBodyAPI)
            elif prim:
                prim.SetActive(False)
        place = _place_for(folder, path, "usda")
        copy.GetRootLayer().Export(str(place))
        bodies.append(Body(name, place, [FREE.format(repr(name))], pivots[name]))
    return bodies
