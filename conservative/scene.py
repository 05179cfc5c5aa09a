"""A scene: body, potential, initial state and duration."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, fields, is_dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeVar, TypeVarTuple

import numpy as np
from numpy.typing import ArrayLike

from .attitude import Array
from .body import RigidBody
from .check import (
    SMALLEST,
    PickledByFields,
    describe,
    finite_array,
    name_text,
    positive_number,
    printable_text,
    replace_unchecked,
    require_size,
    rotation,
    set_fields,
)
from .errors import BadInput, RemovedAttribute
from .features import LOADS, Feature, Features, features_of
from .flight import Flight, read_flight
from .identity import NOT_OF_MOTION, Identity, equal_to_nothing, identify
from .invariants import Invariant, InvariantInTime, axial_direction, balance_of, in_time, invariants_of
from .potentials.load import Damping, OfTime, Torque
from .potentials.pointwise import EARLIER
from .potentials.potential import AnyPotential, Potential, PotentialInTime
from .potentials.smoothness import SMOOTH, Smoothness, examine
from .potentials.turning import Turning, static_part
from .shapes import MassDistribution

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

T = TypeVar("T")
Settings = TypeVarTuple("Settings")
MOST_DERIVATIONS = 64
"""Largest number of results in the cache of `Scene.derive`."""


@dataclass(frozen=True, eq=False, init=False)
class Scene(PickledByFields):
    """A rigid body that rotates about a fixed point, or flies freely: body, potential, initial state and duration.

    Numbers with units are 0 or of magnitude 1e-30 to 1e30 in SI units, of vectors the largest component; the inertia of a free
    body 1e-60 to 1e60. In that range our methods are correct or report a failure. Engines get the numbers unchanged.

    Parameters
    ----------
    name
        Name in tables and charts.
    body
        The body. In free flight a `MassDistribution`, whose inertia about the centre of mass becomes the attribute `body`.
    R_WB0
        Attitude at t = 0: a rotation matrix (3, 3), body to world, or a SciPy `Rotation`.
    w_WB_B0
        Angular velocity at t = 0 (3,), rad/s, body axes.
    t_end
        Duration, s.
    potential
        The field that acts on the body; None for a free body. `Turning` and functions of attitude and time depend on time. In
        free flight None or the gravity of the body; the attribute `potential` is then None, because it exerts no torque.
    torque, damping
        Loads that act beside the potential. Energy and momenta then obey balances with their work and impulse.
    dt
        Default step size of commands and studies, s; default: 0.05 rad at the initial rate, at most a hundredth of t_end, and a
        part of t_end if there are functions of time, which may have no value after it.
    extra_invariants
        Conserved quantities beyond those that follow from the body and the potential.
    group, source
        Heading of the scene in `conservative list` (default "your own"), and its source.
    p_WB0, v_WB0
        Position (3,), m, and velocity (3,), m/s, of the origin of the body frame at t = 0, world axes. They make the scene a
        free flight: the frame can be off the centre of mass, and trajectories have `p_WB` and `v_WB`. One alone means that
        the other is 0.
    flight
        The translation in free flight, as an earlier scene has it, for copies (`rename`).

    Raises
    ------
    BadInput
        An argument is not finite, out of range, not a rotation, or has the wrong shape.
    """

    name: str = field(metadata=NOT_OF_MOTION)
    body: RigidBody
    R_WB0: Array
    w_WB_B0: Array
    t_end: float
    potential: AnyPotential | None
    dt: float = field(metadata=NOT_OF_MOTION)
    torque: Torque | None = None
    damping: Damping | None = None
    extra_invariants: tuple[Invariant, ...] = ()
    group: str = field(default="your own", metadata=NOT_OF_MOTION)
    source: str = field(default="", metadata=NOT_OF_MOTION)
    flight: Flight | None = None

    def __init__(
        self,
        name: str,
        body: RigidBody | MassDistribution,
        R_WB0: ArrayLike | Rotation,
        w_WB_B0: ArrayLike,
        t_end: float,
        potential: AnyPotential | None = None,
        *,
        dt: float | None = None,
        torque: Torque | None = None,
        damping: Damping | None = None,
        extra_invariants: Iterable[Invariant] = (),
        group: str = "your own",
        source: str = "",
        p_WB0: ArrayLike | None = None,
        v_WB0: ArrayLike | None = None,
        flight: Flight | None = None,
    ) -> None:
        name = name_text(name)
        if p_WB0 is not None or v_WB0 is not None:
            (body, flight), potential = read_flight(body, potential, p_WB0, v_WB0), None
        if not isinstance(body, RigidBody):
            raise BadInput("body", describe(body), "a RigidBody, or a MassDistribution together with p_WB0 or v_WB0")
        if flight is not None and (not isinstance(flight, Flight) or potential is not None):
            raise BadInput("flight", describe(flight), "None, or the flight of a scene, and no potential")
        if isinstance(potential, type) or not isinstance(potential, Potential | PotentialInTime | None):
            raise BadInput("potential", describe(potential), "None or a Potential such as UniformGravity")
        for name_of_load, load, kind in (("torque", torque, Torque), ("damping", damping, Damping)):
            if load is not None and (flight is not None or not isinstance(load, kind)):
                raise BadInput(name_of_load, describe(load), f"None in free flight, otherwise None or a {kind.__name__}")
        rates = finite_array("w_WB_B0", w_WB_B0, ((3,),), "three finite rates (3,), rad/s")
        end = positive_number("t_end", t_end, "a finite duration above 0, s")
        try:
            invariants: tuple[Any, ...] = tuple(extra_invariants)
        except Exception:  # not an iterable, or one that fails
            invariants = (extra_invariants,)
        if not all(isinstance(invariant, Invariant) for invariant in invariants):
            raise BadInput("extra_invariants", describe(extra_invariants), "Invariants, in a tuple or a list")
        step = dt
        if step is None:
            # 0.05 rad per step at the initial rate, and at least 100 steps.
            speed = float(np.linalg.norm(rates))
            step = max(SMALLEST, min(end / 100, 0.05 / speed) if speed > 0 else end / 100)
        set_fields(
            self,
            name=name,
            body=body,
            R_WB0=rotation("R_WB0", R_WB0),
            w_WB_B0=rates,
            t_end=end,
            potential=potential,
            dt=positive_number("dt", step, "a finite step above 0, s"),
            torque=torque,
            damping=damping,
            extra_invariants=invariants,
            group=printable_text("group", group, "a text"),
            source=printable_text("source", source, "a text"),
            flight=flight,
        )
        if dt is None and self.asks_time:
            set_fields(self, dt=end / math.ceil(end / step))
        if self.features:
            require_size(body.inertia)
        self._call_loads()

    needs = RemovedAttribute()

    @cached_property
    def features(self) -> Features:
        """Features that a method has to support: the union of the features of all parts (`conservative.features`)."""
        parts = self.body, self.potential, self.torque, self.damping, self.flight
        return frozenset().union(*map(features_of, parts))

    @property
    def key(self) -> str:
        """A text that is equal for scenes with the same motion: a digest of all fields except name, dt, group and source.

        Functions are compared as they are now, with all that they read, such as global variables. A scene with a part that
        cannot be followed, such as an open file, has a key of its own: it equals itself only (`conservative.identity`).
        """
        return self.identity.text

    @property
    def identity(self) -> Identity:
        """The key, and the part that cannot be followed, if there is one."""
        identity: Identity | None = vars(self).get("_identity")
        if identity is not None:
            return identity
        now = identify(self)
        if now.fixed:
            vars(self)["_identity"] = now
        # `identify` returns another text each time if a part is unknown. The scene keeps the first, so that it equals itself.
        return replace(now, text=vars(self).setdefault("_alone", now.text)) if now.unknown else now

    @cached_property
    def changeable(self) -> bool:
        """True if functions or classes of a user act, which may change with what they read."""
        fields_of_users = {Feature.FIELD, Feature.FUNCTION, Feature.TIME}
        return not self.features.isdisjoint(fields_of_users) or any(callable(load.value) for load in self.loads)

    def _call_loads(self) -> None:
        """Raise `BadInput` unless the loads have values. Keep the key for `now`, unless calls change what functions read.

        `_current` is the key for which the caches are valid, and the copy with these caches; None for the scene itself.
        """
        before = self.key if self.changeable else ""
        for load in self.loads:
            load.require(self.t_end, self.R_WB0)
        if self.changeable and before != self.key:
            vars(self)["_identity"] = equal_to_nothing("a function that changes what it reads when it is called")
        elif self.changeable and not self.identity.unknown:
            vars(self)["_current"] = before, None

    def now(self) -> Scene:
        """Return the scene as its functions are now: itself, or a copy without caches if they changed, or may have.

        Break points, scales and compiled code are cached with a scene and its parts. A function that reads a global variable
        changes with it, and a function that cannot be followed may change with each call.
        """
        if not self.changeable:
            return self
        identity, (key, copy) = self.identity, vars(self).get("_current", ("", None))
        if key == identity.text:
            return copy or self
        fresh: Scene = _copy(self)
        if identity.unknown:
            vars(fresh)["_identity"] = identity
        else:
            vars(self)["_current"] = identity.text, fresh
            vars(fresh)["_current"] = identity.text, None
        return fresh

    @property
    def rotation_only(self) -> Scene:
        """The scene without free flight: the rotation about the centre of mass."""
        return self if self.flight is None else self.rename(self.name, flight=None)

    @property
    def free(self) -> bool:
        """True if neither a potential nor a torque, damping or motor acts."""
        return self.potential is None and not self.loaded

    @cached_property
    def loaded(self) -> bool:
        """True if a torque, a damping or the motor of a rotor acts beside the potential."""
        return bool(self.features & LOADS)

    @cached_property
    def loads(self) -> tuple[OfTime, ...]:
        """The torque, the damping and the momentum of the rotor, as far as they are not constant."""
        parts = self.torque, self.damping and self.damping.of_time, self.body.motor
        return tuple(load for load in parts if load and not load.constant)

    @property
    def calls_python(self) -> bool:
        """True if steps call Python functions, so that a step takes as long as the functions."""
        return bool(self.loads) or not self.features.isdisjoint((Feature.FUNCTION, Feature.TIME))

    @property
    def asks_time(self) -> bool:
        """True if functions of a user depend on time. They may have no value before the start and after the end."""
        return Feature.TIME in self.features or any(callable(load.value) for load in self.loads)

    @property
    def breaks(self) -> Array:
        """Times (n,) above 0 at which a load jumps or has a corner, s: of tables, declared, and jumps that a scan found."""
        return self.now().smoothness().breaks

    def smoothness(self, t_end: float = 0.0) -> Smoothness:
        """Return the break points of a run to t_end, s, at least to the scene's, and the step that resolves its loads."""
        end = self.t_end if t_end * EARLIER <= self.t_end else t_end  # rounding can put the last step after t_end
        return examine(self.loads, end) if self.loads else SMOOTH

    @property
    def integrable(self) -> bool:
        """True if three invariants of the scene are known, one for each degree of freedom, so that it is integrable.

        This holds for free bodies and for scenes with three invariants, including `extra_invariants` (Arnold, Mathematical
        Methods of Classical Mechanics, section 49, Liouville's theorem). False is no proof of the opposite: a body in a fixed
        gravity gradient has a third integral that `invariants` does not list (see `GravityGradient`).
        """
        return not self.loaded and (self.free or len(self.invariants) >= 3)

    @cached_property
    def kinetic_energy0(self) -> float:
        """Initial kinetic energy, J."""
        return float(self.w_WB_B0 @ self.body.inertia @ self.w_WB_B0) / 2

    @cached_property
    def energy_scale(self) -> float:
        """Reference scale of energy drifts, J: initial kinetic energy, magnitude of the potential, work of the torque in 1 rad,
        and the energy that a motor can give to the body.

        Unlike the energy itself, it does not vanish if kinetic and potential energy cancel.
        """
        return self.energies or 1.0

    @cached_property
    def energies(self) -> float:
        """The sum of the energies in `energy_scale`, J; 0 for a body at rest without a field and a load."""
        size = self.kinetic_energy0 + (self.potential.scale() if self.potential else 0.0)
        if self.body.motor is not None:
            size += self.body.motor.require(self.t_end) ** 2 / (2 * float(self.body.moments.min()))
        return size if self.torque is None else size + self.torque.require(self.t_end, self.R_WB0)

    @cached_property
    def steepness(self) -> float:
        """Factor by which the field magnifies the rounding of an attitude: its largest slope over `energy_scale`; 0 for fields
        without a singularity.
        """
        field = static_part(self.potential)
        return field.steepest() / self.energy_scale if hasattr(field, "steepest") else 0.0

    @cached_property
    def magnitudes(self) -> tuple[int, int | None]:
        """Binary exponents of the largest moment, kg m^2, and of the rate that all energy allows, 1/s; None without energy."""
        moment = math.frexp(float(self.body.moments.max()))[1]
        energy = self.energies
        return moment, (math.frexp(energy)[1] - moment) // 2 if energy > 0 else None

    @cached_property
    def invariants(self) -> tuple[Invariant, ...]:
        """Conserved quantities of the exact motion: energy, momenta or their balances, and `extra_invariants`.

        In free flight, energy and momentum belong to the rotation about the centre of mass. The invariants of `flight` follow.
        """
        own = invariants_of(self.body, self.potential, self.w_WB_B0, self.energy_scale, self.symmetry_axis_B)
        if self.loaded:
            own = tuple(balance_of(invariant, self.potential) for invariant in own)
        if self.body.motor is not None:  # its work is not part of the motion of the body
            own = tuple(in_time(invariant, self.body) for invariant in own if invariant.unit != "J")
        return (*own, *self.extra_invariants, *(self.flight.invariants(self) if self.flight else ()))

    def initial_value(self, invariant: Invariant) -> Array:
        """Return the value of an invariant in the initial state, (1,) or (1, 3)."""
        place = (self.flight.p_WB0[None], self.flight.v_WB0[None]) if self.flight else ()
        more = (*place, np.zeros(1)) if isinstance(invariant, InvariantInTime) else ()
        return invariant.evaluate(self.R_WB0[None], self.w_WB_B0[None], *more)

    def in_field_axes(self, R_WB: Array, t: Array) -> Array:
        """Return attitudes (n, 3, 3) at times (n,), s, relative to the axes in which the field is fixed."""
        return self.potential.in_orbit(R_WB, t) if isinstance(self.potential, Turning) else R_WB

    @cached_property
    def symmetry_axis_B(self) -> Array | None:
        """Unit vector (3,), body axes, of the common symmetry axis of body and field; None without one, or with loads."""
        return None if self.loaded else axial_direction(self.body, self.potential)

    @cached_property
    def _derivations(self) -> dict[Any, Any]:
        return {}

    def derive(self, function: Callable[[Scene, *Settings], T], *settings: *Settings) -> T:
        """Return `function(self, *settings)`, cached with the scene, which never changes. Settings are hashable."""
        cache, key = self._derivations, (function, settings)
        try:
            return cache[key]
        except KeyError:
            result = function(self, *settings)
            if len(cache) >= MOST_DERIVATIONS:
                cache.clear()
            cache[key] = result
        return result

    def forget(self) -> None:
        """Delete the cache of `derive`, for timing the complete preparation of a run."""
        self._derivations.clear()

    def rename(self, name: str, **changes: Any) -> Scene:
        """Return a copy with another name, and with the fields in `changes` replaced."""
        return replace(self, name=name, **changes)

    def __repr__(self) -> str:
        start = f"R_WB0={self.R_WB0.tolist()}, w_WB_B0={self.w_WB_B0.tolist()}"
        flight = f", flight={self.flight!r}" if self.flight else ""
        return f"Scene({self.name!r}, {self.body!r}, {start}, t_end={self.t_end:g}, potential={self.potential!r}{flight})"


def _copy(value: Any) -> Any:
    """Return a copy without caches of a frozen dataclass of this package and the dataclasses in it; other values unchanged."""
    if not is_dataclass(value) or not type(value).__module__.startswith(f"{__package__}."):
        return value
    return replace_unchecked(value, **{field.name: _copy(getattr(value, field.name)) for field in fields(value)})
