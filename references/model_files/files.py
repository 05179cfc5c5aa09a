"""Model files that others wrote: XML without entities, meshes of known types, and nothing outside the given folders.

Call these functions in a worker with limits. lxml refuses deep nesting and endless expansion, trimesh reads meshes from bytes.
"""

from __future__ import annotations

import re
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
_NAMESPACE = re.compile(rb"""\sxmlns(:[\w.-]+)?\s*=\s*("[^"]*"|'[^']*')""")
"""Declarations of namespaces. Parsers of models know none; one without a prefix becomes an attribute, which is named."""
_SCHEMES = ("package://", "model://", "file://")


class Unread(ValueError):
    """Something in a file that no reader takes. The message is a part of a sentence."""


class RefusedFile(BadInput):
    """A file that is refused because `what` is in it."""

    def __init__(self, path: Path, what: str, allowed: str) -> None:
        super().__init__("file", f"{str(path)!r} with {what}", allowed)
        self.what = what


def refuse(path: Path, what: str, allowed: str) -> BadInput:
    """Return the exception for a file with `what`."""
    return RefusedFile(path, what, allowed)


def reason(error: BadInput) -> str:
    """Return the mistake of a file, without its path."""
    return error.what if isinstance(error, RefusedFile) else str(error.got)


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
    # Undeclared prefixes such as <drake:...> are common, and parsers of models know no namespaces.
    parser = etree.XMLParser(resolve_entities=False, no_network=True, remove_comments=True, remove_pis=True, recover=True)
    try:
        root = etree.fromstring(_NAMESPACE.sub(_keep_default, read_bytes(path)), parser)
    except (OSError, ValueError, etree.XMLSyntaxError) as error:
        raise BadInput(
            "file", f"{str(path)!r}: {' '.join(str(getattr(error, 'strerror', None) or error).split())}", allowed
        ) from None
    wrong = [f"XML line {error.line}: {error.message}" for error in parser.error_log if error.domain_name != "NAMESPACE"]
    if root is None or wrong:
        raise BadInput("file", f"{str(path)!r}: {' '.join((wrong or ['no XML'])[0].split())}", allowed)
    if root.getroottree().docinfo.doctype:
        raise BadInput("file", f"{str(path)!r} with a DOCTYPE, which may define entities", f"{allowed} and without a DOCTYPE")
    if root.tag not in names:
        raise BadInput("file", f"{str(path)!r}: root element <{root.tag}>", allowed)
    return root


def _keep_default(match: re.Match[bytes]) -> bytes:
    return b"" if match[1] else b" namespace=" + match[2]


def read_bytes(path: Path) -> bytes:
    """Return the content of an ordinary file. Raise `Unread` for another one and for one larger than `LARGEST`."""
    if path.exists() and not path.is_file():
        raise Unread("it is not an ordinary file")
    if (size := path.stat().st_size) > LARGEST:
        raise Unread(f"{size / 2**20:.0f} MiB, more than {LARGEST / 2**20:.0f} MiB")
    return path.read_bytes()


def find(path: Path, name: str, search: Sequence[Path], what: str = "file") -> Path:
    """Return the file that a model refers to by a relative path or URI, in the model's folder or a search path.

    Raise `Unread` with the reason if it is not there, or elsewhere after links are followed.
    """
    scheme = next((candidate for candidate in _SCHEMES if name.startswith(candidate)), "")
    plain = name.removeprefix(scheme)
    folders = [path.parent, *search]
    tails = [plain] if scheme in ("", "file://") else [plain, plain.partition("/")[2]]
    present = [place for folder in folders for tail in tails if tail and (place := folder / tail).is_file()]
    if not present:
        raise Unread(f"the {what} {name!r}, which is not there")
    inside = [place for place in present if any(place.resolve().is_relative_to(folder.resolve()) for folder in folders)]
    if not inside:
        raise Unread(f"the {what} {name!r}, which is outside the folder of the model and the search paths")
    return inside[0]


def load_mesh(path: Path, name: str, search: Sequence[Path] = ()) -> tuple[Array, Array]:
    """Return vertices (n, 3) and triangles (m, 3) of the mesh of a model. Raise `BadInput` and `MissingExtra`."""
    allowed = f"meshes of the type {', '.join(MESHES)} in the folder of the file or in one of --search"
    try:
        place = find(path, name, search, "mesh")
        data, kind = read_bytes(place), place.suffix.lower().removeprefix(".")
    except (OSError, ValueError) as error:
        raise refuse(path, str(error), allowed) from None
    if kind not in MESHES:
        raise refuse(path, f"the mesh {name!r}", allowed)
    require_extra("a mesh", "models", "trimesh")
    import trimesh

    try:
        mesh: Any = trimesh.load_mesh(BytesIO(data), file_type=kind)  # without a resolver of other files
        vertices, faces = np.array(mesh.vertices, float), np.array(mesh.faces)
    except Exception as error:  # trimesh takes any bytes for a mesh
        raise refuse(path, f"the mesh {name!r}, which cannot be read ({type(error).__name__}: {error})", allowed) from None
    if not (len(faces) and np.isfinite(vertices).all()):
        raise refuse(path, f"the mesh {name!r} without triangles or with vertices that are not finite", allowed)
    return vertices, faces


def guard_layers(path: Path, search: Sequence[Path] = ()) -> None:
    """Check the layers of a USD file before readers and engines open it.

    Raise `BadInput` if it refers to a file that is not there or outside the folders, or cannot be opened, and `MissingExtra`.
    """
    require_extra("a USD file", "models", "pxr")
    from pxr import Sdf, Tf, Usd

    seen = {path}

    def look(place: Path) -> None:
        layer = Sdf.Layer.FindOrOpen(str(place))
        for name in filter(None, layer.GetCompositionAssetDependencies() if layer else []):  # none within the file
            file = find(place, name, (path.parent, *search))
            if file not in seen:
                seen.add(file)
                look(file)

    try:
        look(path)
        Usd.Stage.Open(str(path))
    except (Tf.ErrorException, ValueError) as error:
        allowed = "a stage that usd-core opens, of layers in the folder of the file or in one of --search"
        raise refuse(path, f"an error ({' '.join(str(error).split())[:200]})", allowed) from None


def inline(path: Path, search: Sequence[Path]) -> tuple[Any, list[str], bool]:
    """Return the root of an MJCF file with the content of the files that it includes, and the names of missing files.

    The last value is True if an included file is in another folder, which engines do not know.

    Raise `BadInput` if an included file is not there or outside the folders, and if it is included twice.
    """
    root, seen, missing, elsewhere = parse(path, "mujoco"), {path.resolve()}, list[str](), False

    def look(name: str, needed: bool) -> Path | None:
        try:
            return find(path, name, search)
        except (ValueError, OSError) as error:
            if needed:
                raise refuse(path, str(error), "files in the folder of the model or in one of --search") from None
            missing.append(name)
            return None

    if "namespace" in root.attrib:
        raise refuse(path, "a namespace, which MJCF does not have", "a file of MJCF without xmlns")
    while (element := next(root.iter("include"), None)) is not None:
        place = look(element.get("file", ""), True) or path
        elsewhere |= place != path.parent / element.get("file", "")
        if place.resolve() in seen:
            raise refuse(path, "files that include each other, or one twice", "each file included once")
        seen.add(place.resolve())
        for child in reversed(parse(place, "mujoco", "mujocoinclude")):
            element.addnext(child)
        element.getparent().remove(element)
    folders = {key: value for node in root.iter("compiler") for key, value in node.attrib.items() if key.endswith("dir")}
    for element in root.iter():
        folder = folders.get({"texture": "texturedir"}.get(element.tag, "meshdir"), folders.get("assetdir", ""))
        for name in [value for key, value in element.attrib.items() if key.startswith("file")]:
            look(f"{folder}/{name}" if folder else name, element.tag == "model")
    return root, missing, elsewhere
