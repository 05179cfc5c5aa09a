"""What a stored ensemble is: the attributes of its group, and whether they are those of a run.

Source: our own format.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import BadInput
from ..method import Grid
from ..methods.many import Bodies
from ..version import VERSION
from .blocks import count_bodies
from .digests import find_digest
from .scene_record import record_scene

if TYPE_CHECKING:
    import zarr

FORMAT, FORMAT_VERSION = "conservative ensemble", 1
"""What the attributes of the group say that it is."""
NEW_FOLDER = "a folder that is not there yet, in one that can be written, on a disk with room for it"
_COMPARED = ("version", "method", "dt", "n_steps", "sample_every", "bodies", "scene")
"""What is the same in two parts of one run, and can be shown; what else has to be has digests."""


def describe_run(label: str, bodies: Bodies, grid: Grid) -> dict[str, Any]:
    """Return the attributes of the group of a run: what it is, and digests of all numbers that it begins with."""
    scene = bodies.scene
    return {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "version": VERSION,
        "method": label,
        "dt": grid.dt,
        "n_steps": grid.n_steps,
        "sample_every": grid.every,
        "bodies": len(bodies),
        "block": min(count_bodies(grid), len(bodies)),
        "scene": scene.name,
        "scene_record": record_scene(scene),
        "digests": {
            "R_WB0": find_digest(bodies.R_WB0),
            "w_WB_B0": find_digest(bodies.w_WB_B0),
            "inertia": find_digest(scene.body.inertia if bodies.inertia is None else bodies.inertia),
            "potential": find_digest(scene.potential),
            "parameters": find_digest(bodies.parameters),
        },
    }


def read_record(place: Path, allowed: str = NEW_FOLDER) -> dict[str, Any]:
    """Return the attributes of a stored ensemble.

    Raises
    ------
    BadInput
        There is none in this folder, or one of another version of the format.
    """
    try:
        found = open_group(place, "r").attrs.asdict()
    except Exception:  # no Zarr, or one that cannot be read
        found = {}
    if found.get("format") != FORMAT:
        raise BadInput("path", f"{str(place)!r}, which is no ensemble", allowed)
    if found.get("format_version") != FORMAT_VERSION:
        got = f"{str(place)!r}, an ensemble in version {found.get('format_version')} of its format"
        raise BadInput("path", got, f"version {FORMAT_VERSION}")
    return found


def open_group(place: Path, mode: Any) -> zarr.Group:
    """Return the Zarr group in a folder, to read with mode "r", or to write, too, with "r+"."""
    import zarr

    return zarr.open_group(place, mode=mode, zarr_format=3)


def list_differences(there: Mapping[str, Any], wanted: Mapping[str, Any]) -> list[str]:
    """Return in words in what the attributes of an ensemble that is there differ from those wanted."""
    plain = [name for name in _COMPARED if there.get(name) != wanted[name]]
    found = [f"{name} {there.get(name)!r} there, {wanted[name]!r} here" for name in plain]
    known = there.get("digests", {})
    return found + [f"another {name}" for name, digest in wanted["digests"].items() if known.get(name) != digest]
