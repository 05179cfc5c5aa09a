"""Worlds: a body, what acts on it and how it starts, drawn at random, and their scene files.

Sizes are such that each part changes the motion by some radians within the run.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from dataclasses import field as member
from typing import Any

import numpy as np

from . import motion
from .motion import PLACES, SIZE

KINDS = ("none", "gravity", "spring", "attraction", "gradient")
NOTHING = np.array([0.0, 1e12]), np.zeros((2, 3))
"""The table of a torque or a wheel that is not there."""


class Draw:
    """Random numbers of one file."""

    def __init__(self, seed: int) -> None:
        self.random = np.random.default_rng((53, seed))

    def between(self, low: float, high: float) -> float:
        """Return a log-uniform number."""
        return float(low * (high / low) ** self.random.random())

    def chance(self, share: float) -> bool:
        """Return True with a probability."""
        return bool(self.random.random() < share)

    def vector(self, size: float = 1.0) -> Any:
        """Return a vector of a length in a random direction."""
        v = self.random.normal(size=3)
        return size * v / np.linalg.norm(v)

    def pick(self, names: Any, weights: Any = None) -> Any:
        """Return one of several names."""
        names = [*names]
        p = None if weights is None else np.array(weights, float) / np.sum(weights)
        return names[int(self.random.choice(len(names), p=p))]

    def sign(self) -> int:
        """Return 1 or -1."""
        return 1 if self.chance(0.5) else -1


@dataclass(frozen=True, eq=False)
class World:
    """A body and what acts on it, in SI units; and changes of its equations, which scene files cannot have.

    `field` is ("gravity", weight, centre), ("spring", stiffness, point, anchor, rest), ("attraction", strength, point, anchor)
    or ("gradient", rate, inertia, direction); `orbit` is (rate, normal). `wheel` and `torque` are vectors or tables (times,
    values). Changes: factors of the gyroscopic term, of the field, of the motor's reaction and of the rate of attitudes, the
    product of quaternions on the other side, a drag in 1/s, a tensor that is fixed in the world.
    """

    J: Any
    q0: Any
    w0: Any
    field: Any = None
    orbit: Any = None
    wheel: Any = None
    torque: Any = None
    axes: str = "body"
    damping: Any = None
    gyroscopic: float = 1.0
    pull: float = 1.0
    reaction: float = 1.0
    speed: float = 1.0
    side: bool = False
    drag: float = 0.0
    fixed: Any = None
    numbers: Any = member(init=False)
    tables: Any = member(init=False)
    breaks: Any = member(init=False)

    def __post_init__(self) -> None:
        p = np.zeros(SIZE)

        def put(name: str, value: Any) -> None:
            a, b = PLACES[name]
            p[a:b] = np.ravel(value)

        put("inertia", self.J)
        put("inverse", np.linalg.inv(self.J))
        put("gyroscopic", self.gyroscopic)
        put("field", self.pull)
        put("reaction", self.reaction)
        put("speed", self.speed)
        put("side", float(self.side))
        put("drag", self.drag)
        if self.field is not None:
            kind, size, *rest = self.field
            put("kind", float(KINDS.index(kind)))
            put("amount", size)
            if kind == "gradient":
                put("gradient", rest[0])
                put("anchor", rest[1] / np.linalg.norm(rest[1]))
            else:
                put("point", rest[0])
            if kind in ("spring", "attraction"):
                put("anchor", rest[1])
            if kind == "spring":
                put("rest", rest[2])
        if self.orbit is not None:
            put("orbit", self.orbit[0])
            put("normal", self.orbit[1] / np.linalg.norm(self.orbit[1]))
        if self.damping is not None:
            put("damping", self.damping)
        if self.fixed is not None:
            put("is_fixed", 1.0)
            put("fixed", self.fixed)
            put("unfixed", np.linalg.inv(self.fixed))
        put("in_world", float(self.axes == "world"))
        torque, wheel = table(self.torque), table(self.wheel)
        object.__setattr__(self, "numbers", p)
        object.__setattr__(self, "tables", (*torque, *wheel))
        corners = np.concatenate([torque[0][1:-1], wheel[0][1:-1]])
        object.__setattr__(self, "breaks", np.unique(corners))

    @property
    def start(self) -> Any:
        """The initial state (7,)."""
        return np.append(self.q0, self.w0)

    @property
    def given(self) -> Any:
        """The arguments of compiled functions."""
        return self.numbers, *self.tables

    def solve(self, t: Any, y0: Any = None, start: float = 0.0) -> Any:
        """Return the exact states (n, 7) at times t, s, from the state at `start`."""
        y0 = self.start if y0 is None else np.asarray(y0, float)
        longest = 0.7 / max(self.rate, 1e-300)
        return motion.solve(y0, start, np.asarray(t, float), self.breaks, self.given, longest)

    @property
    def rate(self) -> float:
        """A rate, rad/s, at which the motion goes on, for the length of stretches."""
        size = float(np.linalg.norm(self.w0))
        h = table(self.wheel)[1]
        wheel = float(np.linalg.norm(h, axis=1).max()) / float(np.linalg.eigvalsh((self.J + self.J.T) / 2)[0])
        orbit = 0.0 if self.orbit is None else abs(self.orbit[0])
        return max(size, 0.5 * min(wheel, 30 * size + wheel * (size == 0)), orbit)

    @property
    def free(self) -> bool:
        """Whether nothing acts on the body."""
        return self.field is None and self.torque is None and self.damping is None and not is_table(self.wheel)

    @property
    def in_time(self) -> bool:
        """Whether something depends on time."""
        return self.orbit is not None or self.torque is not None or is_table(self.wheel)

    def but(self, **changes: Any) -> World:
        """Return another world."""
        return replace(self, **changes)

    def with_inertia(self, J: Any) -> World:
        """Return the world with another inertia, also in the gravity gradient."""
        J = (J + J.T) / 2
        if self.field is not None and self.field[0] == "gradient":
            return replace(self, J=J, field=(*self.field[:2], J, *self.field[3:]))
        return replace(self, J=J)

    def toml(self, t_end: float) -> str:
        """Return the scene file."""
        lines = ['name = "planted"', f"t_end = {t_end!r}", "[body]", f"inertia = {text(self.J)}"]
        lines += ["[start]", f"R_WB.quaternion_wxyz = {text(self.q0)}", f"w_WB_B = {text(self.w0)}"]
        if self.wheel is not None:
            lines += ["[rotor]", *load("momentum", self.wheel, t_end)]
        if self.field is not None:
            kind, size, *rest = self.field
            names = {
                "gravity": ("uniform_gravity", "weight", "com_B"),
                "spring": ("linear_spring", "stiffness", "point_B", "anchor_W", "rest_length"),
                "attraction": ("point_attraction", "strength", "point_B", "anchor_W"),
                "gradient": ("gravity_gradient", "rate", "", "direction_W"),
            }[kind]
            lines += ["[potential]", f'kind = "{names[0]}"']
            values = zip(names[1:], (size, *rest), strict=False)
            turning = kind == "gradient" and self.orbit is not None
            lines += [f"{key} = {text(x)}" for key, x in values if key and not (turning and key == "rate")]
        if self.orbit is not None:
            lines += ["[orbit]", f"rate = {text(self.orbit[0])}", f"normal_W = {text(self.orbit[1])}"]
        if self.torque is not None:
            lines += ["[torque]", *load("value", self.torque, t_end), f'frame = "{self.axes}"']
        if self.damping is not None:
            lines += ["[damping]", f"matrix = {text(self.damping)}"]
        return "\n".join(lines) + "\n"


def is_table(given: Any) -> bool:
    """Return whether a wheel or a torque is a table (times, values)."""
    return isinstance(given, tuple)


def table(given: Any) -> Any:
    """Return a wheel or a torque as a table."""
    if given is None:
        return NOTHING
    if is_table(given):
        return np.asarray(given[0], float), np.asarray(given[1], float)
    return NOTHING[0], np.array([given, given], float)


def scaled(given: Any, factor: float) -> Any:
    """Return a wheel or a torque of another size."""
    return (given[0], factor * given[1]) if is_table(given) else factor * given


def text(x: Any) -> str:
    """Return a number, or lists of numbers, as TOML."""
    return repr(float(x)) if np.ndim(x) == 0 else "[" + ", ".join(text(part) for part in x) + "]"


def load(name: str, given: Any, t_end: float) -> list[str]:
    """Return the lines of a wheel or a torque. Tables end after the run."""
    if not is_table(given):
        return [f"{name} = {text(given)}"]
    return [f"times = {text(given[0])}", f"values = {text(given[1])}"]


SHAPES = ("any", "any", "any", "any", "any", "any", "principal", "principal", "symmetric", "symmetric about an axis", "ball")


def draw_body(draw: Draw, shape: str) -> tuple[Any, Any]:
    """Return inertia and principal axes (columns) of a body that can exist; its size is about 1."""
    moments = draw.random.uniform(0.6, 2, size=3)
    moments[2] = max(min(moments[2], 0.95 * moments[:2].sum()), 1.05 * abs(moments[0] - moments[1]))
    if draw.chance(0.15):  # a needle
        wider, thin = draw.random.uniform(0.0, 1.0), draw.between(0.01, 0.3)
        moments = np.array([1.0, 1.0 + 0.9 * wider * thin, thin])
    if shape.startswith("symmetric"):
        moments[1] = moments[0]
        moments[2] = min(moments[2], 1.9 * moments[0])
    if shape == "ball":
        moments[:] = moments[0]
    axes = np.eye(3)
    if shape in ("any", "symmetric"):
        q = draw.random.normal(size=4)
        axes = motion.spin(np.tile(q / np.linalg.norm(q), (3, 1)), np.eye(3)).T
    J = axes @ np.diag(draw.random.permutation(moments) if shape in ("any", "principal") else moments) @ axes.T
    return ((J + J.T) / 2 if shape != "ball" else moments[0] * np.eye(3)), axes


PARTS = ("field", "wheel", "motor", "torque", "torque table", "damping", "orbit")


def draw_world(draw: Draw, need: str = "", shape: str = "", length: float = 50.0) -> tuple[World, float, str]:
    """Return a world, its rate, rad/s, and the name of its body. `need` is a part that it has for certain."""
    mass, second = (draw.between(1e-6, 1e6), draw.between(1e-3, 1e3)) if draw.chance(0.3) else (1.0, 1.0)
    shape = shape or draw.pick(SHAPES)
    J, axes = draw_body(draw, shape)
    J, rate = J * mass, draw.between(0.5, 5) / second
    w0 = axes @ draw.vector(rate)
    q0 = draw.random.normal(size=4)
    q0 /= np.linalg.norm(q0)
    q0 = q0 if not draw.chance(0.1) else np.array([1.0, 0, 0, 0])
    energy, momentum = float(w0 @ J @ w0) / 2, float(np.linalg.norm(J @ w0))
    world = World(J, q0, w0)
    kind = draw.pick(["none", *KINDS], [3, 3, 1, 1, 1, 1])
    kind = draw.pick(KINDS[1:]) if need in ("field", "orbit") and kind == "none" else kind
    if kind != "none":
        size, arm, orbit = energy * draw.between(0.1, 1.5), draw.between(0.2, 1), rate * draw.between(0.1, 1)
        point, anchor = draw.vector(arm), draw.vector(arm * (1.5 + draw.between(0.2, 2)))
        far, normal = arm + float(np.linalg.norm(anchor)), draw.vector()
        direction = np.cross(normal, draw.vector())
        fields: dict[str, tuple[Any, ...]] = {
            "gravity": ("gravity", size / arm, point),
            "spring": ("spring", size / far**2, point, anchor, 0.0 if draw.chance(0.5) else draw.random.uniform(0, 0.5 * far)),
            "attraction": ("attraction", size * (far - 2 * arm), point, anchor),
            "gradient": ("gradient", orbit, J, direction / np.linalg.norm(direction)),
        }
        turning = need == "orbit" or draw.chance(0.8 if kind == "gradient" else 0.15)
        world = world.but(field=fields[kind], orbit=(orbit, normal) if turning else None)
    if need in ("wheel", "motor") or draw.chance(0.25):
        h, slope = draw.vector(momentum * draw.between(0.1, 1)), draw.vector(momentum * rate * draw.between(0.005, 0.05))
        wheel: Any = h
        if need == "motor" or (need != "wheel" and draw.chance(0.3)):
            span = draw.between(10, 60) / rate
            ends = np.array([0.0, span, 2.1 * span, 1e4 / rate])
            values = np.array([h, h + slope * span, h + slope * span * 0.3, h + slope * span * 0.5])
            wheel = (ends, values)
        world = world.but(wheel=wheel)
    if need.startswith("torque") or draw.chance(0.25):
        size = momentum * rate * draw.between(0.003, 0.1)
        if need == "torque table" or draw.chance(0.4):
            times = np.append(np.arange(12.0) * draw.between(2, 20), 1e4) / rate
            torque: Any = (times, size * draw.random.normal(size=(13, 3)))
        else:
            torque = draw.vector(size)
        world = world.but(torque=torque, axes=draw.pick(("body", "world")))
    if need == "damping" or draw.chance(0.2):
        half = draw.random.normal(size=(3, 3)) / 2
        size = float(np.trace(J)) / 3 * rate * min(draw.between(0.003, 0.05), 1.0 / length)
        world = world.but(damping=size * (half @ half.T + 0.3 * np.eye(3)))
    return world, rate, shape
