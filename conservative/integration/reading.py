"""Ensembles that are on disk, read where they are: arrays are those of Zarr, and a slice of one reads its own chunks.

Source: the layout of `conservative.integration.store`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..attitude import Array
from ..check import describe, read_only
from ..errors import BadInput, require_extra
from ..method import Grid
from ..methods.many import Bodies
from ..scene import Scene
from .digests import find_digest
from .ensemble import Ensemble
from .failure_columns import NOT_DONE, read_failures
from .run_record import open_group, read_record
from .scene_record import restore_scene

_WHOLE = "one that is whole: integrate_many with the same arguments and resume=True does the rest"


def open_ensemble(path: str | Path, scene: Scene | None = None) -> Ensemble:
    """Return the ensemble that `integrate_many(..., path=...)` or `Ensemble.to_zarr` has written.

    Samples stay on the disk: `ensemble.R_WB` and `ensemble.w_WB_B` are arrays of Zarr, of which `ensemble.R_WB[:1000, -1]`
    reads the blocks of 1000 bodies and no others. So does what the bodies begin with. Drifts and outcomes are read at once.

    Parameters
    ----------
    path
        The folder.
    scene
        What all bodies share; needed only where it has functions of its own, as `FunctionPotential` and `extra_invariants` do.

    Raises
    ------
    BadInput
        The folder is not there or no ensemble, or not all of its blocks are done; or the scene is missing, or another one.
    MissingExtra
        Zarr, of the extra `ensembles`, is not installed.
    """
    require_extra("open_ensemble", "ensembles")
    place = Path(path).absolute()
    record = read_record(place, "the folder of an ensemble that integrate_many has written")
    group: Any = open_group(place, "r")
    outcome = group["outcome"]
    kinds = np.asarray(outcome[:])
    if (left := int(np.count_nonzero(kinds == NOT_DONE))) > 0:
        raise BadInput("path", f"{str(place)!r}, an ensemble of {len(kinds)} bodies of which {left} have not been run", _WHOLE)
    label, names, drifts = record["method"], group["drifts"].attrs["names"], group["drifts"][:]
    failures = read_failures(kinds, outcome.attrs["kinds"], label, lambda name: group[f"failures/{name}"][:])
    return Ensemble(
        bodies=_read_bodies(group, _find_scene(record, scene), len(kinds)),
        grid=Grid(record["dt"], record["n_steps"], record["sample_every"]),
        R_WB=group["R_WB"],
        w_WB_B=group["w_WB_B"],
        drifts=dict(zip(names, drifts.T, strict=True)),
        label=label,
        failures=failures,
    )


def _find_scene(record: dict[str, Any], scene: object) -> Scene:
    """Return the scene of an ensemble, which is the one that is given, if one is."""
    if scene is None:
        return restore_scene(record["scene_record"])
    if not isinstance(scene, Scene):
        raise BadInput("scene", describe(scene), "None, or the Scene of the run")
    if scene.name != record["scene"] or find_digest(scene.potential) != record["digests"]["potential"]:
        raise BadInput("scene", repr(scene.name), f"the scene of the run, {record['scene']!r}")
    return scene


def _read_bodies(group: Any, scene: Scene, n: int) -> Bodies:
    start: dict[str, Any] = _read_members(group, "start")
    return Bodies(
        scene,
        start.get("R_WB0", np.broadcast_to(scene.R_WB0, (n, 3, 3))),
        start.get("w_WB_B0", np.broadcast_to(scene.w_WB_B0, (n, 3))),
        start.get("inertia"),
        _read_members(group, "parameters"),
    )


def _read_members(group: Any, name: str) -> dict[str, Any]:
    """Return the arrays of a group in the group, which is not there where it has none."""
    return {key: _OnDisk(array) for key, array in group[name].arrays()} if name in group else {}


class _OnDisk:
    """An array of Zarr whose parts are those of a NumPy array that is closed to writing: of a row of numbers, numbers."""

    def __init__(self, array: Any) -> None:
        self._array, self.shape = array, array.shape

    def __len__(self) -> int:
        return int(self.shape[0])

    def __getitem__(self, part: Any) -> Any:
        found = np.asarray(self._array[part])
        return read_only(found) if found.ndim else found[()]

    def __array__(self, *options: Any, **more: Any) -> Array:
        return np.asarray(self._array[:])
