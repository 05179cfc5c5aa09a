"""Many bodies of one kind of scene, as methods take them, and what a run of them gives. Source: definitions; our own layout."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..attitude import Array, to_quaternion
from ..body import RigidBody
from ..check import build_unchecked
from ..potentials.potential import AnyPotential
from ..potentials.turning import Turning, static_part
from ..potentials.varied import OneByOne, Varied
from ..scene import Scene


@dataclass(frozen=True, eq=False)
class Bodies:
    """n bodies, each of which moves by itself in one kind of scene. Nothing is checked here.

    Attributes
    ----------
    scene
        What all of them share: everything that is not said here.
    R_WB0, w_WB_B0
        Attitudes (n, 3, 3), body to world, and angular velocities (n, 3), rad/s, body axes, at the start.
    inertia
        Tensors (n, 3, 3), kg m^2, body axes; None where all have the scene's.
    parameters
        Numbers (n, ...) of the scene's potential by the names of its fields, where they differ from body to body; of one that
        turns, those of the field in its axes.
    """

    scene: Scene
    R_WB0: Array
    w_WB_B0: Array
    inertia: Array | None
    parameters: Mapping[str, Array]

    def __len__(self) -> int:
        return len(self.R_WB0)

    def __getitem__(self, part: slice) -> Bodies:
        inertia = None if self.inertia is None else self.inertia[part]
        parameters = {name: values[part] for name, values in self.parameters.items()}
        return Bodies(self.scene, self.R_WB0[part], self.w_WB_B0[part], inertia, parameters)

    @cached_property
    def first(self) -> Scene:
        """The scene of body number 0, with what it keeps where it is the scene itself."""
        scene = self.scene
        same = self.R_WB0.base is scene.R_WB0 and self.w_WB_B0.base is scene.w_WB_B0
        return scene if same and self.inertia is None and not self.parameters else self.take(0)

    def take(self, i: int) -> Scene:
        """Return the scene of body number i."""
        inertia = None if self.inertia is None else self.inertia[i]
        body = self.scene.body if inertia is None else build_unchecked(RigidBody, inertia=inertia)
        potential = self.take_potential(i)
        return replace_unchecked(self.scene, body=body, potential=potential, R_WB0=self.R_WB0[i], w_WB_B0=self.w_WB_B0[i])

    def take_potential(self, i: int) -> AnyPotential | None:
        """Return the potential of body number i."""
        potential: Any = self.scene.potential
        if not self.parameters:
            return potential
        numbers = {name: values[i].item() if values[i].ndim == 0 else values[i] for name, values in self.parameters.items()}
        own = replace(static_part(potential), **numbers)
        return Turning(own, potential.orbit) if isinstance(potential, Turning) else own

    @cached_property
    def varied(self) -> Varied:
        """The fields of all bodies, where they have numbers of their own: those that turn as they are in their axes."""
        vary = getattr(static_part(self.scene.potential), "vary", None)
        if vary is not None:
            return vary(self.parameters)
        return OneByOne([static_part(self.take_potential(i)) for i in range(len(self))])

    @cached_property
    def principal(self) -> tuple[Array, Array]:
        """Principal moments (n, 3), kg m^2, and rotations R_BP (n, 3, 3), as `RigidBody` has them, body by body."""
        n = len(self)
        if self.inertia is None:
            body = self.scene.body
            return np.broadcast_to(body.moments, (n, 3)), np.broadcast_to(body.R_BP, (n, 3, 3))
        return principal_axes(self.inertia)

    @cached_property
    def q_WP0(self) -> Array:
        """Attitudes (n, 4) of the principal axes at the start, scalar first."""
        return to_quaternion(self.R_WB0 @ self.principal[1])

    @cached_property
    def L_P0(self) -> Array:
        """Angular momenta (n, 3) at the start, kg m^2/s, principal axes."""
        moments, R_BP = self.principal
        return np.asarray((self.w_WB_B0[:, None, :] @ R_BP)[:, 0, :] * moments)


def principal_axes(inertia: Array) -> tuple[Array, Array]:
    """Return moments (n, 3), kg m^2, and right-handed axes (n, 3, 3) of tensors; diagonal ones keep their own axes."""
    diagonal = np.diagonal(inertia, axis1=-2, axis2=-1)
    plain = np.count_nonzero(inertia - diagonal[..., None] * np.eye(3), axis=(-2, -1)) == 0
    moments, axes = np.linalg.eigh(inertia)
    axes[:, :, 2] *= np.sign(np.linalg.det(axes))[:, None]
    moments[plain], axes[plain] = diagonal[plain], np.eye(3)
    return moments, axes


def replace_unchecked(scene: Scene, **changes: Any) -> Scene:
    """Return the scene with other fields, which are known to be right, and nothing derived from the old ones."""
    kept = ("name", "t_end", "dt", "extra_invariants", "group", "source")
    return build_unchecked(Scene, **{name: getattr(scene, name) for name in kept}, **changes)


@dataclass(frozen=True, eq=False)
class Block:
    """What a run of n bodies gives, of s samples each.

    Attributes
    ----------
    R_WB, w_WB_B
        Attitudes (n, s, 3, 3), body to world, and angular velocities (n, s, 3), rad/s, body axes.
    finished
        Whether each body (n,) was finished here. Those that were not are run again, each alone, and their samples replaced.
    """

    R_WB: Array
    w_WB_B: Array
    finished: Any


RunMany = Callable[[], Block]


class GivenUp(BaseException):
    """Nobody waits for this block any more: whoever asked for it was interrupted, or another block failed."""


_of_thread = threading.local()


def watch(given_up: threading.Event) -> None:
    """Let `pause` of this thread raise `GivenUp` once the event is set."""
    _of_thread.given_up = given_up


def pause() -> None:
    """Raise `GivenUp` if nobody waits for this thread's block any more.

    Called between two pieces of a block, every 20 to 50 ms. In the main thread, Ctrl-C needs no call: Python raises it by
    itself.
    """
    given_up = getattr(_of_thread, "given_up", None)
    if given_up is not None and given_up.is_set():
        raise GivenUp
