"""What a recommendation is asked: a scene, an error, a duration, engines; checked."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from conservative.check import positive_number
from conservative.errors import BadInput, nearest
from conservative.method import Method, Role
from conservative.scene import Scene

from ..studies import selection
from ..studies.study import HANG_LIMIT

COST_LIMIT = 1.0
"""Wall time per simulated second, s/s, that a setting may cost: as fast as the body itself."""


def list_engines(names: Iterable[str] | None = None) -> tuple[Method, ...]:
    """Return a method for each line of the engines named, of all by default: variants that differ in tolerance are one line.

    Engines named have to be installed; of all, a `Missing` method stands for one that is not.

    Raises
    ------
    BadInput
        A name is not that of an engine.
    MissingEngine
        An engine that is named is not installed.
    """
    everything = [method for method in selection.methods(skip_missing=True) if method.role == Role.ENGINE]
    if names is None:
        wanted: Iterable[Method] = everything
    else:
        known = {method.name.partition(":")[0] for method in everything}
        for name in names:
            if name.partition(":")[0] not in known:
                raise BadInput("engine", repr(name), nearest(name, known))
        wanted = selection.methods(names)
    lines = {selection.series(method): method for method in reversed(tuple(wanted))}
    return tuple(reversed(lines.values()))


@dataclass(frozen=True, eq=False)
class Question:
    """What is asked, checked: see `ask`. `missing` are engines that are not installed."""

    scene: Scene
    error: float
    duration: float
    methods: tuple[Method, ...]
    missing: tuple[str, ...]
    cost_limit: float
    time_limit: float = HANG_LIMIT


def ask(
    scene: Scene,
    error: float = 1e-6,
    duration: float | None = None,
    engine_names: Iterable[str] | None = None,
    cost_limit: float = COST_LIMIT,
    time_limit: float = HANG_LIMIT,
) -> Question:
    """Return what is asked, or say what is wrong with it.

    Parameters
    ----------
    scene
        What moves.
    error
        Largest attitude error over the duration, rad.
    duration
        s; default the scene's.
    engine_names
        Engines, such as `("mujoco",)`; default all that are installed.
    cost_limit
        Wall time per simulated second, s/s, that a setting may cost.
    time_limit
        Wall time, s, after which the run of an engine is ended.

    Raises
    ------
    BadInput
        An argument cannot be used.
    MissingEngine
        An engine that is named is not installed.
    """
    positive_number("error", error, "a finite attitude error above 0, rad")
    end = scene.t_end if duration is None else positive_number("duration", duration, "a finite duration above 0, s")
    positive_number("cost_limit", cost_limit, "a finite wall time per simulated second above 0, s/s")
    positive_number("time_limit", time_limit, "a finite duration above 0, s")
    found = list_engines(engine_names)
    missing = tuple(method.name for method in found if isinstance(method, selection.Missing))
    methods = tuple(method for method in found if not isinstance(method, selection.Missing))
    return Question(scene, error, end, methods, missing, cost_limit, time_limit)
