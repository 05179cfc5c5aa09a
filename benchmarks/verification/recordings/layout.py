"""Which columns of a file are read as what, and the options that say so."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from conservative.attitude import Array

from .names import LETTERS, parse

ATTITUDES: Mapping[str, int] = {
    "quaternion": 4,
    "matrix": 9,
    "angles": 3,
    "aircraft angles": 3,
    "axis and angle": 4,
    "rotation vector": 3,
    "modified Rodrigues": 3,
    "Rodrigues": 3,
}
"""Kinds of attitudes, best first, with their numbers of columns."""
ORDERS = "wxyz", "xyzw"
"""Orders of quaternions."""


@dataclass(frozen=True)
class Options:
    """How the columns are to be read; None where header and numbers decide.

    `quaternion`, "wxyz" or "xyzw", is the order of numbered columns. `euler`, such as zyx, is the sequence of angles about axes
    that turn along. `world` is True for rates in world axes, and `units`, "deg" or "rad", belong to columns that name
    none; "deg/s" or "rad/s" belong to rates only. `columns`, such as `time=1,w=2:3:4`, names columns by their names or
    numbers from 1. Rows before `start_time` and after `end_time`, s, times of the file, are left out.
    """

    quaternion: str | None = None
    euler: str | None = None
    world: bool = False
    units: str | None = None
    columns: str | None = None
    start_time: float | None = None
    end_time: float | None = None


@dataclass
class Layout:
    """How a file is read: the names of its columns, and the units of those that are used.

    `unused` has a reason for every other column, and `doubtful` the columns among them that look like attitudes or rates.
    `also` has other sets of columns, each with its kind, which should be the same motion. `decided` are columns that the data
    left out. `steps` are units of times that an option names. `open` are quantities whose unit only the motion of the scene
    shows. `order` is the order of quaternions that rates show. `origin` is subtracted from times in two columns, seconds and
    their fractions.
    """

    names: list[str]
    used: dict[str, dict[str, float]] = field(default_factory=dict)
    unused: dict[str, str] = field(default_factory=dict)
    doubtful: list[str] = field(default_factory=list)
    also: list[tuple[str, list[str]]] = field(default_factory=list)
    decided: list[str] = field(default_factory=list)
    steps: dict[str, float] = field(default_factory=dict)
    open: list[str] = field(default_factory=list)
    order: str | None = None
    notes: list[str] = field(default_factory=list)
    origin: float = 0.0

    @property
    def attitude(self) -> str | None:
        """The kind of the attitudes in the file, None without them."""
        return next((kind for kind in ATTITUDES if kind in self.used), None)

    @property
    def doubt(self) -> str:
        """The sentence on columns that look like attitudes or rates and are not compared; "" without them."""
        if not self.doubtful:
            return ""
        reasons = dict.fromkeys(self.unused[name] for name in self.doubtful)
        few = ", ".join(self.doubtful[:9]) + ", ..." * (len(self.doubtful) > 9)
        return f"{few} look like attitudes or rates and are not compared ({'; '.join(reasons)}). --columns decides"

    @property
    def numbered(self) -> bool:
        """Whether the quaternion's columns are numbered, so that their order is open. MuJoCo's qpos are scalar first."""
        first = next((parse(name) for name in self.used.get("quaternion", ())), None)
        if first is None:
            return False
        return first.label not in (*LETTERS, *"ijkrs", "real", "scalar") and not {"qpos", *ORDERS}.intersection(first.words)

    @property
    def columns(self) -> list[str]:
        """The names of the columns that are used: time, rates, attitude."""
        return [name for part in self.used.values() for name in part]

    @property
    def sizes(self) -> Array:
        """The units of rows in SI units: of the time, which is one number, rates and attitude."""
        time, *rest = ([*part.values()] for part in self.used.values())
        return np.array([time[0] if len(time) == 1 else 1.0, *(size for part in rest for size in part)])

    def join_time(self, values: Array) -> Array:
        """Return rows whose time is one number: in the unit of its column, or in s from `origin` on for two columns."""
        sizes = [*self.used["time"].values()]
        if len(sizes) == 1:
            return values
        t = (values[:, 0] * sizes[0] - self.origin) + values[:, 1] * sizes[1]
        return np.column_stack([t, values[:, 2:]])
