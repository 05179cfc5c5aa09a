"""Pairs: a description of a body and its start, a second description of the same motion, and the map between both.

Symbols: W is the world, F the axes of the first description, G the axes of the second, whose motion is mapped back to F and W.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from types import MappingProxyType
from typing import Any

import numpy as np

from conservative.attitude import Array, rotation_about, to_quaternion
from conservative.body import RigidBody, is_impossible
from conservative.grid import Grid
from conservative.potentials.uniform_gravity import UniformGravity
from conservative.references.engine import principal_axes
from conservative.references.environments.plain_numbers import describe
from conservative.scene import Scene

USUAL = "body", "top"
"""Names of a free body and of one about a fixed point, with all pairs that are not about the inertia."""
Samples = tuple[Array, Array]
"""Attitudes (s, 3, 3), F to W, and rates (s, 3), rad/s, axes F."""


@cache
def _without_fields() -> dict[str, Any]:
    """Return the numbers of some request, in which the numbers of fields are 0."""
    return describe(principal_axes(Scene("pair", RigidBody((1, 1, 1)), np.eye(3), (1, 0, 0), 1.0)), Grid(1.0, 1, 1))


@dataclass(frozen=True, eq=False)
class Description:
    """A body, its start and its steps, as an engine gets them.

    Attributes
    ----------
    mass, com, inertia
        Mass, kg; centre of mass (3,), m; inertia (3, 3) about it, kg m^2, axes F.
    R0, w0
        Attitude (3, 3), F to W, and rates (3,), rad/s, axes F, at the start.
    gravity
        Downward acceleration, m/s^2. Without it the body is free, otherwise it turns about the origin of F.
    dt, n_steps, every
        Time step, s; number of steps; steps between samples.
    sign
        Sign of the quaternion of `R0`.
    variant
        How the engine gets the body; "" is the usual description of its adapter, others are in its `descriptions`.
    """

    mass: float
    com: Array
    inertia: Array
    R0: Array
    w0: Array
    gravity: float = 0.0
    dt: float = 0.01
    n_steps: int = 100
    every: int = 50
    sign: float = 1.0
    variant: str = ""

    @property
    def grid(self) -> Grid:
        return Grid(self.dt, self.n_steps, self.every)

    @property
    def joint_inertia(self) -> Array:
        """Inertia (3, 3), kg m^2, about the fixed point, the origin of F, or about the centre of mass of a free body."""
        arm = self.com if self.gravity else np.zeros(3)
        return self.inertia + self.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))

    @property
    def possible(self) -> bool:
        """True if a mass distribution has this inertia."""
        return not is_impossible(np.asarray(np.linalg.eigvalsh(self.inertia), dtype=float))

    @property
    def scene(self) -> Scene:
        """The same motion as a scene. The attitude of a free body does not depend on its mass and its centre."""
        field = UniformGravity(self.mass * self.gravity, self.com) if self.gravity else None
        return Scene("pair", RigidBody(self.joint_inertia), self.R0, self.w0, self.dt * self.n_steps, field)

    @property
    def numbers(self) -> dict[str, Any]:
        """The numbers of a `prepare` request, see PROTOCOL.md.

        `moments` are the diagonal of `joint_inertia`: with the variants `TURNED` only, they are not the principal moments.
        """
        w0_W, x0, grid = self.R0 @ self.w0, self.R0 @ self.com, self.grid
        moments, axes = np.diag(self.inertia).copy(), np.eye(3)
        if np.count_nonzero(self.inertia - np.diag(moments)):
            body = RigidBody(self.inertia)
            moments, axes = body.moments, body.R_BP
        return {
            **_without_fields(),
            **{"dt": grid.dt, "n_steps": grid.n_steps, "every": grid.every, "steps": grid.steps.astype(int)},
            **{"moments": np.diag(self.joint_inertia).copy(), "inertia_com": self.inertia},
            **{"moments_com": moments, "q_com": to_quaternion(axes)},
            **{"mass": self.mass, "com": self.com, "q0": self.sign * to_quaternion(self.R0), "R0": self.R0, "w0": self.w0},
            **{"w0_W": w0_W, "x0": x0, "v0": np.cross(w0_W, x0), "gravity": self.gravity, "free": not self.gravity},
            # `way` is the name in programs that were written for the first releases of the protocol.
            **({"description": self.variant, "way": self.variant} if self.variant else {}),
            **({} if self.gravity or not self.com.any() else {"p_WB0": np.zeros(3), "v_WB0": np.zeros(3)}),
        }


@dataclass(frozen=True)
class Pair:
    """A kind of second description.

    Attributes
    ----------
    name
        Name of the pair.
    second
        Function that returns the second description.
    back
        Function that maps samples of the second description to samples of the first; by default they are the same.
    run
        How the second description runs: "" by a new model, otherwise see `runner.run`.
    exact
        True if equal arithmetic gives equal bits. A difference then does not go away with the step.
    variant
        The variant of descriptions that the engine must have; a method of this package has only "frame".
    place
        The place of the second description in a batch, from 1, and the number of its bodies, if it runs "beside" others.
    quantity
        The quantity that is scaled: length, mass or time.
    scales
        Factors by which the second description is scaled, each tried. In an engine without thresholds, none changes the motion.
    relation
        How the second motion is related to the first, a sentence.
    bodies
        Names of the bodies that are described, in `BODIES`.
    """

    name: str
    second: Callable[..., Description] = lambda d: d
    back: Callable[..., Samples] = lambda samples, *_: samples
    run: str = ""
    place: tuple[int, int] = (1, 1)
    exact: bool = False
    variant: str = ""
    quantity: str = ""
    scales: tuple[float, ...] = ()
    relation: str = "Both motions should be equal."
    bodies: tuple[str, ...] = USUAL

    @property
    def same_bits(self) -> bool:
        """Whether any difference is a fault: the same numbers are integrated again."""
        return self.exact and not self.scales and not self.variant


TURN = rotation_about((0, 0, 1), 2.1)
"""About the vertical, so that it does not change the weight."""
OTHER = rotation_about((0.3, -0.5, 0.8), 1.3)
CYCLE = np.roll(np.eye(3), 1, axis=0)
MIRROR = np.diag((1.0, -1.0, 1.0))
OFFSET = np.array((0.3, -0.2, 0.5))


def reframe(body: Description, R_FG: Array, shift: Array | float = 0.0) -> Description:
    """Return the body in axes G, whose origin is `shift` (3,), m, axes F, away from the origin of F."""
    turned: dict[str, Any] = {"com": R_FG.T @ (body.com - shift), "inertia": _symmetric(R_FG.T @ body.inertia @ R_FG)}
    return replace(body, R0=body.R0 @ R_FG, w0=R_FG.T @ body.w0, **turned)


def _symmetric(J: Array) -> Array:
    return (J + J.T) / 2


def to_principal(body: Description) -> tuple[Description, Array]:
    """Return the description in axes G in which `joint_inertia` is diagonal, and the rotation (3, 3), G to F."""
    J = body.joint_inertia
    if np.abs(J - np.diag(np.diag(J))).max() <= 1e-12 * np.abs(J).max():  # the axes already are: measured up to 4e-16
        return body, np.eye(3)
    R_FG = RigidBody(J).R_BP
    turned = reframe(body, R_FG)
    round_off = np.abs(turned.com) < 1e-15 * np.linalg.norm(turned.com)
    return replace(turned, com=np.where(round_off, 0.0, turned.com)), R_FG


def frame_back(R_FG: Array) -> Callable[..., Samples]:
    """Return the map of samples in axes G to samples in axes F."""
    return lambda samples, *_: (samples[0] @ R_FG.T, samples[1] @ R_FG.T)


def _mirrored(body: Description) -> Description:
    # Rates are axial vectors: a mirror turns them by -M.
    mirrored: dict[str, Any] = {"inertia": MIRROR @ body.inertia @ MIRROR, "com": MIRROR @ body.com}
    return replace(body, R0=MIRROR @ body.R0 @ MIRROR, w0=-MIRROR @ body.w0, **mirrored)


def _lengths(body: Description, scale: float) -> Description:
    return replace(body, com=scale * body.com, inertia=scale**2 * body.inertia, gravity=scale * body.gravity)


def _masses(body: Description, scale: float) -> Description:
    return replace(body, mass=scale * body.mass, inertia=scale * body.inertia)


def _times(body: Description, scale: float) -> Description:
    return replace(body, w0=body.w0 / scale, gravity=body.gravity / scale**2, dt=body.dt * scale)


def _same_times(samples: Samples, scale: float) -> Samples:
    return samples[0], samples[1] * scale


def _without_moment(body: Description) -> Description:
    return replace(body, inertia=body.inertia * (np.arange(3)[:, None] != np.argmax(np.abs(body.w0))), variant="zero")


WRAPPED = MappingProxyType({"rewritten": "file loaded and saved", "mass": "mass set after loading", "scaled": "scaled"})
"""Names of pairs, by their variants, in which an engine changes a file that it has loaded. Their axes are not principal."""
TURNED = ("frame", *WRAPPED)
"""Variants whose axes F are not principal."""
LOADED = ("file", "setter", "saved", *WRAPPED)
"""Variants in which a mistake of a loader, a writer or a setter gives the engine another body."""
OF_INERTIA = ("frame", "offset", "file", "setter", "child", "joints", "saved", *WRAPPED)
"""Variants that are about the inertia."""
FREE = ("body", "needle", "thin rod")
"""Names of the free bodies with these variants."""

SCALED = "The second motion is the first one in other units."

PAIRS = (
    Pair("run again", run="again", exact=True),
    Pair("built again", exact=True),
    Pair("in a new process", run="process", exact=True),
    Pair("reset after another motion", run="reset", exact=True),
    Pair("saved and continued", run="continued"),
    Pair("n calls of one step", lambda d: replace(d, every=1), run="thinned"),
    Pair("body 3 of 7", run="beside", place=(3, 7)),
    Pair("body 40 of 64", run="beside", place=(40, 64)),
    Pair("q and -q", lambda d: replace(d, sign=-d.sign), exact=True, variant="quaternion"),
    Pair(
        "turned world",
        lambda d: replace(d, R0=TURN @ d.R0),
        lambda samples, *_: (TURN.T @ samples[0], samples[1]),
        relation="The second attitude is the first one turned by 2.1 rad about the vertical; rates in the body are equal.",
    ),
    Pair("permuted axes", lambda d: reframe(d, CYCLE), frame_back(CYCLE), relation="The axes 1, 2, 3 are now 3, 1, 2."),
    Pair(
        "mirrored",
        _mirrored,
        lambda samples, *_: (MIRROR @ samples[0] @ MIRROR, -samples[1] @ MIRROR),
        relation="The second motion is the mirror image of the first, along the second axis.",
    ),
    Pair("length x 2^k", _lengths, exact=True, scales=(2.0**-14, 2.0**14), quantity="length", relation=SCALED),
    Pair("length x 10^k", _lengths, scales=(1e-4, 1e4), quantity="length", relation=SCALED),
    Pair("mass x 2^k", _masses, exact=True, scales=(2.0**-30, 2.0**30), quantity="mass", relation=SCALED),
    Pair("mass x 10^k", _masses, scales=(1e-9, 1e9), quantity="mass", relation=SCALED),
    Pair("time x 2^k", _times, _same_times, exact=True, scales=(2.0**-14, 2.0**14), quantity="time", relation=SCALED),
    Pair("time x 10^k", _times, _same_times, scales=(1e-4, 1e4), quantity="time", relation=SCALED),
    Pair(
        "another body frame",
        lambda d: replace(reframe(d, OTHER), variant="frame"),
        frame_back(OTHER),
        variant="frame",
        bodies=(*FREE, "top"),
        relation="The body is the same in other axes, turned by 1.3 rad about (0.3, -0.5, 0.8).",
    ),
    Pair("offset frame", lambda d: replace(reframe(d, np.eye(3), OFFSET), variant="offset"), variant="offset", bodies=FREE),
    Pair("moment of 0 about the axis of rotation", _without_moment, variant="zero", bodies=("rod about its axis",)),
    *(
        Pair(
            name,
            lambda d, variant=variant: replace(reframe(d, OTHER), variant=variant),
            frame_back(OTHER),
            variant=variant,
            bodies=(*FREE, "top"),
            relation="The engine changes a file of the same body, in axes turned by 1.3 rad about (0.3, -0.5, 0.8).",
        )
        for variant, name in WRAPPED.items()
    ),
    *(
        Pair(
            name,
            lambda d, variant=variant: replace(d, variant=variant),
            variant=variant,
            bodies=(*FREE, "top") if variant in OF_INERTIA else USUAL,
        )
        for variant, name in {
            "file": "set by a file",
            "setter": "set by setters",
            "child": "inertia on a fixed child",
            "joints": "other joints",
            "world": "beside a far body",
            "time": "another initial time",
            "damping": "damping of 0 written",
            "saved": "model saved and loaded",
            "accelerator": "on an accelerator",
        }.items()
    ),
)
"""The pairs, in the order of tables."""
