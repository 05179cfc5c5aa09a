"""The motion of a scene in numbers, by which baselines and versions of a project recognize it.

`Scene.key` is exact, but differs between interpreters and versions of this package. These numbers do not: two scenes have the
same motion if they agree but for the last digits. A worker loads this file in the environment of another version, so it uses
only parts of `conservative` that old versions have as well.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import Any

import numpy as np

from conservative import registry

Answer = dict[str, Any]
Array = np.ndarray[Any, Any]
TIMES = 101
"""Number of times at which functions of time are described; tables are described by their rows."""
_scene = lru_cache(maxsize=64)(registry.scene)


def describe_scene(scene: str, probes: Array) -> Answer:
    """Describe the motion of a registered scene."""
    return describe(_scene(scene), probes)


def describe(built: Any, probes: Array) -> Answer:
    """Describe the motion of a scene: its parts, and its energies in J at the attitudes `probes` (n, 3, 3)."""
    rotor, flight = getattr(built.body, "rotor_momentum", None), getattr(built, "flight", None)
    places = [] if flight is None else [flight.com_B.tolist(), flight.p_WB0.tolist(), flight.v_WB0.tolist()]
    loads: list[Any] = [getattr(built, "torque", None), getattr(built, "damping", None), getattr(built.body, "motor", None)]
    return {
        "parts": [
            [] if rotor is None else rotor.tolist(),
            *([] if flight is None else [[flight.mass, flight.g], *places]),
            *(values for load in loads for values in _describe_load(load, built.t_end, probes)),
        ],
        "inertia": built.body.inertia,
        "R_WB0": built.R_WB0,
        "w_WB_B0": built.w_WB_B0,
        "ends": [built.t_end, built.dt],
        "energies": list(_energies(built.potential, built.t_end, probes)),
        "invariants": [invariant.name for invariant in built.invariants],
    }


def _energies(potential: Any, t_end: float, probes: Array) -> Iterator[float]:
    """Yield the energies of a potential, J, which may be older than the protocols of potentials."""
    if potential is not None:
        timed = getattr(potential, "time_dependent", False)
        for R, t in zip(probes, np.linspace(0, t_end, len(probes)), strict=True):
            yield float(potential.energy_at(R, t) if timed else potential.energy(R))


def _describe_load(load: Any, t_end: float, probes: Array) -> Iterator[list[float]]:
    """Yield 1 for world axes, a table, and values at some times; values of a function of the attitude also at the probes."""
    if hasattr(load, "at"):
        yield [float(getattr(load, "frame", "body") == "world")]
        varying = getattr(load, "of_time", load)  # a damping can have a part of time
        value = getattr(varying, "value", None)
        if isinstance(value, tuple):
            yield from (np.ravel(item).tolist() for item in value)
        attitudes = [(R,) for R in probes] if getattr(varying, "of_attitude", False) else [()]
        for t in np.linspace(0.0, t_end, TIMES).tolist():
            yield from (np.ravel(load.at(t, *at)).tolist() for at in attitudes)
