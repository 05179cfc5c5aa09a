"""The base class of all methods, including engines."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from functools import partial, wraps
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from .drifts import drifts_of
from .errors import InvalidResult, RemovedAttribute, Unsupported
from .features import Features, lacking
from .grid import Grid, grid_for
from .invariants import AXIAL_MOMENTUM
from .method_info import Maker, MethodInfo, Purpose, call_with_settings, maker_of, setting_texts, settings_text
from .method_info import Role as Role
from .scene import Scene
from .starts import with_starts
from .trajectory import Bounds, Trajectory, cut_at_failure, find_misplaced, find_mistake

Run = Callable[..., Trajectory]
"""The run of a scene on a grid, `run()`, and of other starts of its body, `run(R_WB0, w_WB_B0)`: see `Method.prepare`."""


def _ask_features(unsupported: Callable[[Any, Scene], str | None]) -> Callable[[Any, Scene], str | None]:
    """Extend `Method.unsupported` by a comparison of the scene's features with those that the method supports."""

    @wraps(unsupported)
    def reason(method: Method, scene: Scene) -> str | None:
        supports, features = method.supports, scene.features
        return unsupported(method, scene) if features <= supports else lacking(supports, features, method.lacks)

    return reason


def _refuse(prepare: Callable[[Any, Scene, Grid], Run]) -> Callable[[Any, Scene, Grid], Run]:
    """Extend `Method.prepare` by its checks of the scene: nothing is computed with a part left out."""

    @wraps(prepare)
    def checked(method: Method, scene: Scene, grid: Grid) -> Run:
        if reason := method.unsupported(scene):
            got = f"{method.name} for the scene {scene.name!r}"
            raise Unsupported("method", got, f"a scene that it supports ({reason})")
        return with_starts(prepare(method, scene, grid), partial(checked, method), scene, grid)

    return checked


def _leave_alone(prepare_many: Callable[[Any, Any, Grid], Any]) -> Callable[[Any, Any, Grid], Any]:
    """Extend `Method.prepare_many`: bodies with loads, and those that `prepare` refuses, run one by one."""

    @wraps(prepare_many)
    def checked(method: Method, bodies: Any, grid: Grid) -> Any:
        scene = bodies.scene
        taken = scene.features <= method.supports and not scene.loaded
        return prepare_many(method, bodies, grid) if taken else None

    return checked


class Method(ABC):
    """An integration method, ours or an engine. These nine sentences are its contract:

    1. A method is a frozen dataclass, registered by one entry point with the name `family`; its fields are its settings, which
       have defaults, and its constructor raises `BadInput` for a wrong value.
    2. `role` is its role in comparisons, `order` its order of convergence in dt, None if the accuracy does not depend on dt.
    3. `supports` has the features of scenes that it supports, and `unsupported` returns a reason that depends on numbers: no
       other scene reaches `prepare` and `prepare_many`.
    4. `prepare(scene, grid)` does all work that is needed once, compiles, raises `BadInput` for a step that is too long, and
       returns a function, the run, which is what studies time, without arguments.
    5. A run starts from the initial state in each call and depends on nothing but scene, grid and settings; runs of separate
       calls of `prepare` can execute in parallel threads, the same run cannot.
    6. A run returns a `Trajectory` of the scene with all samples of the grid, the first of which is the initial state, in body
       axes and SI units, with `label`; attitudes are as computed, without orthonormalization.
    7. A run that fails raises nothing: it returns the samples before the failure, with `failure`.
    8. Invariants in `conserves` stay within `bounds` at all samples, as does orthonormality: `check` rejects other runs.
    9. `prepare_many(bodies, grid)` is optional; the numbers of a body then do not depend on the bodies beside it.

    Required are `family`, `role`, `order` and `prepare`. `method_info` declares settings for tables and benchmarks, the place
    in the automatic choice and the colour, and each entry has a default.
    """

    family: ClassVar[str]
    role: ClassVar[Role]
    method_info: ClassVar[MethodInfo] = MethodInfo()
    takes, card = RemovedAttribute(), RemovedAttribute()
    if TYPE_CHECKING:
        __dataclass_fields__: ClassVar[dict[str, Any]]  # subclasses are dataclasses

    def __init_subclass__(cls) -> None:
        for name in ("colour", "variants", "suite", "rank", "candidates"):
            if name in vars(cls):  # these were class attributes in earlier versions
                raise TypeError(f"{cls.__name__}.{name} has no effect. Write: method_info = MethodInfo({name}=...)")
        for former, name in (("card", "method_info = MethodInfo(...)"), ("takes", "supports")):
            if former in vars(cls):
                raise TypeError(f"{cls.__name__}.{former} has another name now. Write: {name}")
        for name, extend in (("unsupported", _ask_features), ("prepare", _refuse), ("prepare_many", _leave_alone)):
            if name in vars(cls):
                setattr(cls, name, extend(vars(cls)[name]))

    @property
    def name(self) -> str:
        """Registered name with the settings that differ from the defaults; `conservative.registry.method` parses it."""
        settings = settings_text(self)
        return f"{self.family}:{settings}" if settings else self.family

    @property
    def label(self) -> str:
        """Maker and setting, such as `mujoco==4.0.0/RK4`. For our methods, maker and name."""
        setting = "" if self.role in (Role.OURS, Role.BASELINE) else self.setting()
        return f"{self.maker}/{setting or self.name}"

    @property
    def supports(self) -> Features:
        """Features of scenes that it supports; default: `method_info.supports`."""
        return self.method_info.supports

    @property
    def lacks(self) -> str:
        """The reason why it supports no more, for messages; default: none is given."""
        return ""

    @property
    def maker(self) -> Maker:
        """The package that computes, with its version; default: the package of the class."""
        return maker_of(type(self))

    @property
    def setting_parts(self) -> Mapping[str, str]:
        """The text of each setting that tables show, by its name; default: the settings that are not defaults."""
        return setting_texts(self)

    def setting(self, without: str | None = None) -> str:
        """Return the setting as tables show it, such as `tol=1e-06,body`; `without` leaves out one part."""
        return ",".join(text for name, text in self.setting_parts.items() if name != without)

    @property
    @abstractmethod
    def order(self) -> int | None:
        """Order of convergence in dt; None if the accuracy does not depend on dt."""

    @property
    def conserves(self) -> frozenset[str]:
        """Names of the invariants that it conserves by construction, to round-off or to its solver's tolerance."""
        return frozenset()

    def bounds(self, scene: Scene, grid: Grid) -> Bounds:
        """Return the limits on the drift of the invariants in `conserves`, on orthonormality, and on the drift of the energy.

        The defaults of the first two, 0.001 and 0.1, are meant for engines with loose tolerances. Methods that conserve
        something should return tighter limits. An energy that is wrong by more than its reference scale ends a run. Engines
        have no such limit, because comparisons show their drift.
        """
        return Bounds(drift=1e-3, orthonormality=0.1, energy=math.inf if self.role == Role.ENGINE else 1.0)

    @_ask_features
    def unsupported(self, scene: Scene) -> str | None:
        """Return the reason why the scene is not supported, or None.

        A feature that `supports` lacks is reported before an override is asked: overrides are for numbers, such as a symmetry.
        """
        return None

    def program(self, scene: Scene) -> object:
        """Return a key of the program that a run executes, apart from a tolerance. Studies time equal programs once."""
        return self.name

    def longest_step(self, scene: Scene) -> float:
        """Return the longest step size for the scene, s; inf without a limit."""
        return math.inf

    def follows_fastest(self, scene: Scene) -> bool:
        """Return whether steps have to resolve the fastest rotation that the energy allows, also if the exact motion has none.

        Default: in fields, unless body and field are symmetric about one axis and the method conserves the momentum about it.
        The error of a step is otherwise a momentum about the axis of a rod, whose small moment makes it a fast rotation.
        """
        return not scene.free and (scene.symmetry_axis_B is None or AXIAL_MOMENTUM not in self.conserves)

    @abstractmethod
    def prepare(self, scene: Scene, grid: Grid) -> Run:
        """Return the run of a scene on a grid: sentences 4 to 7 of the contract.

        It is not checked; use `check(scene, grid, run())`. Every override raises `Unsupported` for a scene that is not
        supported. The run can have an attribute `own_loop`, a function that integrates and makes no `Trajectory`.

        For loops over initial states, every run can also be called as `run(R_WB0, w_WB_B0)`, with another attitude (3, 3) or
        SciPy `Rotation`, and other rates (3,), rad/s, body axes; everything else of the scene stays. The trajectory is that of
        `prepare` for the scene with this start, to round-off. The next such call of the same run may overwrite its arrays and
        its scene: copy what has to stay. `run()` starts from the scene's initial state as before. With `Taylor`, such a call
        takes 3 us beside the compiled code. All other methods prepare the run again, and so does `Taylor` in other units than
        SI. `BadInput` is raised for a start that `Scene` does not accept.
        """

    def prepare_many(self, bodies: Any, grid: Grid) -> Any:
        """Return the run of a `Batch`, which returns a `Block`; None if bodies have to run one by one.

        Overrides are not asked for scenes with loads, or with features that the method does not support.
        """
        return None

    def check(self, scene: Scene, grid: Grid, result: Any) -> Trajectory:
        """Return the trajectory if it passes every check, otherwise its valid samples and the failure.

        Every run is checked here: the result is a `Trajectory` of the scene with all samples of the grid, with the right
        shapes, types and times, finite, and within `bounds`. If the method has a kernel, a compiled check runs first. If that
        passes, no other check is made.
        """
        mistake, conserved, bounds = find_mistake(result, scene, grid), self.conserves, self.bounds(scene, grid)
        if mistake is None and result.failure is None and self.method_info.kernel and not scene.loaded:
            measure = scene.derive(drifts_of, conserved)
            drifts = measure(grid, result.t, result.R_WB[None], result.w_WB_B[None])[0]
            if drifts[0] <= bounds.orthonormality and drifts[4] <= bounds.drift and drifts[1] <= bounds.energy:
                return result
        mistake = mistake or find_misplaced(result, grid)
        if mistake is None:
            return cut_at_failure(result, conserved, bounds)
        nothing = np.empty(0), np.empty((0, 3, 3)), np.empty((0, 3))
        return Trajectory(scene, *nothing, self.label, failure=InvalidResult(self.label, mistake))

    def solve(self, scene: Scene, grid: Grid) -> Trajectory:
        """Return the checked trajectory on a grid, whatever its outcome."""
        return self.check(scene, grid, self.prepare(scene, grid)())

    @classmethod
    def settings_for(cls, purpose: Purpose) -> tuple[Self, ...]:
        """Return the methods that `method_info` lists for a purpose, such as "variants" or "suite"; see `MethodInfo`."""
        return tuple(cls.configure(text) for text in cls.method_info.settings(purpose))

    @classmethod
    def settings_in_tables(cls) -> tuple[Self, ...]:
        """Return the methods that a name without settings stands for in tables: as installed, then the variants."""
        return tuple(dict.fromkeys((*cls.settings_for("as_installed"), *cls.settings_for("variants"))))

    @classmethod
    def configure(cls, settings: str) -> Self:
        """Return the method with settings as in a name, such as "RK4,threads=2".

        Raises
        ------
        BadInput
            A setting is unknown or has a wrong value.
        """
        return call_with_settings(cls, f"method {cls.family}", settings, cls.method_info.removed)

    def run(self, scene: Scene, dt: float | None = None, t_end: float | None = None, sample_every: int = 1) -> Trajectory:
        """Return the trajectory with step size dt to t_end, s, whatever its outcome. `integrate` raises exceptions instead.

        Both are by default the scene's.

        Raises
        ------
        BadInput
            dt or t_end is not a finite number above 0, dt is larger than t_end, or sample_every is not an integer of 1 or more.
        """
        scene = scene.now()
        return self.solve(scene, grid_for(scene, dt, t_end, sample_every))
