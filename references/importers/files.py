"""Model files that others wrote: XML without entities, meshes of known types, and nothing outside the given folders.

Call these functions in a worker with limits. lxml refuses deep nesting and endless expansion, trimesh reads meshes from bytes.
"""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from conservative.attitude import Array
from conservative.errors import BadInput, require_extra

ROOTS = {"robot": "urdf", "mujoco": "mjcf", "sdf": "sdf"}
USD = (".usd", ".usda", ".usdc")
MESHES = ("obj", "stl", "ply", "off")
"""Types of meshes that refer to no other file that matters."""
LARGEST = 2**26
"""Largest file of XML and largest mesh, bytes."""
_SCHEMES = ("package://", "model://", "file://")


def refuse(path: Path, what: str, allowed: str) -> BadInput:
    """Return the exception for a file with `what`."""
    return BadInput("file", f"{str(path)!r} with {what}", allowed)


def reason(error: BadInput) -> str:
    """Return what is wrong with a file, without its path."""
    text = str(error.got)
    return text.partition(" with ")[2] or text


def kind_of(path: Path) -> str:
    """Return "urdf", "mjcf", "sdf" or "usd". Raise `BadInput` for another file."""
    return "usd" if path.suffix.lower() in USD else ROOTS[parse(path).tag]


def parse(path: Path, *roots: str) -> Any:
    """Return the root element of a file of XML, an lxml element without comments.

    Raises
    ------
    BadInput
        The file cannot be read, is larger than `LARGEST`, is not XML, has a DOCTYPE, or none of the `roots`.
    MissingExtra
        lxml is not installed.
    """
    require_extra("a model file", "models", "lxml")
    from lxml import etree

    names = roots or tuple(ROOTS)
    allowed = f"a file of XML with the root element <{'>, <'.join(names)}>" + ("" if roots else f", or {', '.join(USD)}")
    # Undeclared prefixes such as <drake:...> are common, so only other errors count.
    parser = etree.XMLParser(resolve_entities=False, no_network=True, remove_comments=True, remove_pis=True, recover=True)
    try:
        root = etree.fromstring(read_bytes(path), parser)
    except (OSError, ValueError, etree.XMLSyntaxError) as error:
        raise BadInput(
            "file", f"{str(path)!r}: {' '.join(str(getattr(error, 'strerror', None) or error).split())}", allowed
        ) from None
    wrong = [f"XML line {each.line}: {each.message}" for each in parser.error_log if each.domain_name != "NAMESPACE"]
    if root is None or wrong:
        raise BadInput("file", f"{str(path)!r}: {' '.join((wrong or ['no XML'])[0].split())}", allowed)
    if root.getroottree().docinfo.doctype:
        raise BadInput("file", f"{str(path)!r} with a DOCTYPE, which may define entities", f"{allowed} and without a DOCTYPE")
    if root.tag not in names:
        raise BadInput("file", f"{str(path)!r}: root element <{root.tag}>", allowed)
    return root


def read_bytes(path: Path) -> bytes:
    """Return the content of an ordinary file. Raise ValueError for another one and for one larger than `LARGEST`."""
    if path.exists() and not path.is_file():
        raise ValueError("it is no ordinary file")
    if (size := path.stat().st_size) > LARGEST:
        raise ValueError(f"{size / 2**20:.0f} MiB, more than {LARGEST / 2**20:.0f} MiB")
    return path.read_bytes()


def qualified(element: Any, name: str) -> str:
    """Return a name as it stands in the file, "drake:mass" instead of "{uri}mass"."""
    uri, brace, plain = name.removeprefix("{").partition("}")
    prefix = next((key for key, value in element.nsmap.items() if value == uri and key), "") if brace else ""
    return f"{prefix}:{plain}" if brace else name


def find(path: Path, name: str, search: Sequence[Path]) -> Path:
    """Return the file that a model refers to by a relative path or URI, in the model's folder or a search path.

    Raise ValueError with the reason if it is not there, or elsewhere after links are followed.
    """
    scheme = next((each for each in _SCHEMES if name.startswith(each)), "")
    plain = name.removeprefix(scheme)
    folders = [path.parent, *search]
    tails = [plain] if scheme in ("", "file://") else [plain, plain.partition("/")[2]]
    found = [place for folder in folders for tail in tails if tail and (place := folder / tail).is_file()]
    if not found:
        raise ValueError(f"the file {name!r}, which is not there")
    inside = [each for each in found if any(each.resolve().is_relative_to(folder.resolve()) for folder in folders)]
    if not inside:
        raise ValueError(f"the file {name!r}, which is outside the folder of the model and the search paths")
    return inside[0]


def load_mesh(path: Path, name: str, search: Sequence[Path] = ()) -> tuple[Array, Array]:
    """Return vertices (n, 3) and triangles (m, 3) of the mesh of a model. Raise `BadInput` and `MissingExtra`."""
    allowed = f"meshes of the type {', '.join(MESHES)} in the folder of the file or in one of --search"
    try:
        place = find(path, name, search)
        data, kind = read_bytes(place), place.suffix.lower().removeprefix(".")
    except (OSError, ValueError) as error:
        raise refuse(path, f"{error}".replace("the file", "the mesh", 1), allowed) from None
    if kind not in MESHES:
        raise refuse(path, f"the mesh {name!r}", allowed)
    require_extra("a mesh", "models", "trimesh")
    import trimesh

    try:
        mesh: Any = trimesh.load_mesh(BytesIO(data), file_type=kind)  # without a resolver of other files
        vertices, faces = np.array(mesh.vertices, float), np.array(mesh.faces)
    except Exception as error:  # of trimesh, for which any bytes are a mesh
        raise refuse(path, f"the mesh {name!r}, which cannot be read ({type(error).__name__}: {error})", allowed) from None
    if not (len(faces) and np.isfinite(vertices).all()):
        raise refuse(path, f"the mesh {name!r} without triangles or with vertices that are not finite", allowed)
    return vertices, faces


def included(path: Path, search: Sequence[Path], depth: int = 0) -> list[str]:
    """Look at the files that an MJCF file reads, and return those that are not there or outside the folders.

    Raise `BadInput` if such a file is included, and for includes in a circle.
    """
    root, missing = parse(path, "mujoco", *["mujocoinclude"] * bool(depth)), list[str]()
    dirs = {
        key: each.get(key) for each in root.iter("compiler") for key in ("meshdir", "texturedir", "assetdir") if each.get(key)
    }
    if depth > 8:
        raise refuse(path, "files that include each other", "includes without a circle")
    for each in root.iter():
        folder = (
            dirs.get({"texture": "texturedir"}.get(each.tag, "meshdir"), dirs.get("assetdir", ""))
            if each.tag != "include"
            else ""
        )
        for name in [value for key, value in each.attrib.items() if key.startswith("file")]:
            try:
                place = find(path, f"{folder}/{name}" if folder else name, search)
            except (ValueError, OSError) as error:
                if each.tag in ("include", "model"):
                    raise refuse(path, str(error), "files in the folder of the model or in one of --search") from None
                missing.append(name)
                continue
            if each.tag == "include":
                missing += included(place, [path.parent, *search], depth + 1)
    return missing
