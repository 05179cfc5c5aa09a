"""Scenes from TOML files. Nothing in a file is executed.

`conservative new > my_body.toml` writes a file that explains every key. Commands accept `my_body.toml` instead of the name of a
scene. Units are SI: m, kg, s, rad. Unknown keys are errors, and every error contains its line.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib.resources import files
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..attitude import Array, from_quaternion, rotation_about
from ..body import RigidBody
from ..check import NAME, describe, finite_array, finite_number, rotation, unit_vector
from ..deferred_imports import BODY_FILES, list_entries, load_entry
from ..errors import BadInput
from ..potentials.gravity_gradient import GravityGradient
from ..potentials.load import Damping, Torque
from ..potentials.point_to_point import LinearSpring, PointAttraction
from ..potentials.potential import AnyPotential, Potential
from ..potentials.turning import Orbit, Turning
from ..potentials.uniform_gravity import UniformGravity
from ..scene import Scene
from ..shapes import SHAPES, MassDistribution
from ..toml_reader import TomlTable, keys_of, read

_TOP = ("name", "t_end", "dt", "body", "rotor", "potential", "orbit", "torque", "damping", "start")
# The keys of a potential or a shape are the parameters of its constructor.
_POTENTIALS: dict[str, Callable[..., Potential]] = {
    "uniform_gravity": UniformGravity,
    "linear_spring": LinearSpring,
    "point_attraction": PointAttraction,
    "gravity_gradient": GravityGradient,
}
_PLACEMENT = ("com_B", "R_BS")


def template() -> str:
    """Return a valid scene file that explains every key."""
    return files(__package__).joinpath("template.toml").read_text(encoding="utf-8")


def choices() -> dict[str, dict[str, list[str]]]:
    """Return the shapes, the kinds of potential and the forms of an attitude, each with its keys."""
    potentials = {name: keys_of(build) for name, build in _POTENTIALS.items()}
    potentials["uniform_gravity"].append("g")
    potentials["gravity_gradient"].remove("inertia")  # the body has it
    return {
        "shape": {name: keys_of(build) for name, build in SHAPES.items()},
        "kind": potentials,
        "R_WB": {name: keys_of(build) for name, build in _ATTITUDES.items()},
    }


def load(path: str | Path) -> Scene:
    """Return the scene in a TOML file.

    Parameters
    ----------
    path
        The file. Paths in it are relative to its folder. `template` shows the format.

    Raises
    ------
    BadFile
        The file cannot be read, or a key or value is invalid: a `BadInput` with the line.
    MissingEngine
        The body is defined in a file of an engine that is not installed.
    """
    if not isinstance(path, str | PathLike):
        raise BadInput("path", describe(path), "the path of a file")
    top = read(Path(path))
    top.only(_TOP)
    t_end = top.value("t_end", "a finite duration above 0, s")
    body, mass = _body(top.table("body", "inertia, a shape or another file; `conservative new` shows them"))
    potential = _field(top, body, mass)
    if "rotor" in top:
        table = top.table("rotor", "momentum (3,), kg m^2/s, body axes, or times, s, and values")
        build = _motor if "times" in table else _rotor
        table.only(keys_of(build))
        with table.blame(rotor_momentum="momentum"):
            body = RigidBody(body.inertia, table.call(build))
    R_WB0, w_WB_B0, flight = _start(top.table("start", "w_WB_B and, unless body and world axes agree, R_WB"))
    name = top.text("name", NAME) if "name" in top else top.path.stem
    dt = top.value("dt", "a finite step above 0, s") if "dt" in top else None
    if flight and mass is None:
        raise top.bad("body", "the inertia alone", "inertia_com, mass and com_B, or a shape, together with p_WB or v_WB")
    if flight and "rotor" in top:
        raise top.bad("rotor", "a rotor in free flight", "no rotor, or no p_WB and v_WB, for the rotation alone")
    loads = {key: _load(top, key) for key in ("torque", "damping")}
    with top.blame(p_WB0="start", v_WB0="start", factor="damping"):
        moving = mass if flight and mass else body
        return Scene(name, moving, R_WB0, w_WB_B0, t_end, potential, dt=dt, source=str(top.path), **loads, **flight)


def _body(table: TomlTable) -> tuple[RigidBody, MassDistribution | None]:
    """Return the body, and its mass and centre of mass if the file has them."""
    sources = ("inertia", "inertia_com", "shape", *list_entries(BODY_FILES))
    present = [key for key in table.values if key in sources]
    if not present:
        table.only({*sources, "name", *_PLACEMENT, *(key for shape in SHAPES.values() for key in keys_of(shape))})
        raise table.bad("inertia", "nothing: the body is missing", "one of " + ", ".join(sources))
    if len(present) > 1:
        raise table.bad(present[1], f"{present[1]} and {present[0]}", "one of " + ", ".join(sources))
    if present == ["inertia"]:
        table.only(("inertia",))
        return table.call(RigidBody), None
    (kind,) = present
    if kind == "inertia_com":
        table.only(keys_of(MassDistribution))
        mass = table.call(MassDistribution)
    elif kind == "shape":
        name = table.choice("shape", SHAPES)
        table.only(("shape", *keys_of(SHAPES[name]), *_PLACEMENT))
        mass = table.call(SHAPES[name]).rotate(_attitude(table, "R_BS"))
    else:
        table.only((kind, "name", "com_B"))
        path = table.path.parent / table.text(kind, "the path of a file, from this file's folder")
        name = table.text("name", f"the name of the body in {path}")
        with table.blame(path=kind):
            mass = load_entry(BODY_FILES, "kind of file", kind)(path, name)
    if "com_B" in table and kind != "inertia_com":
        mass = table.call(mass.about)
    with table.blame(inertia=kind):
        return mass.body, mass


def _field(top: TomlTable, body: RigidBody, mass: MassDistribution | None) -> AnyPotential | None:
    """Return the potential, turned with the orbit if there is one."""
    if "potential" not in top:
        if "orbit" in top:
            raise top.bad("orbit", "an orbit without a potential", "a table [potential] that turns with the orbit")
        return None
    table = top.table("potential", "kind and its keys")
    if "orbit" not in top:
        return _potential(table, body, mass)
    orbit_table = top.table("orbit", "rate, rad/s, and normal_W")
    orbit_table.only(keys_of(Orbit))
    orbit = orbit_table.call(Orbit)
    if table.choice("kind", _POTENTIALS) == "gravity_gradient":
        if "rate" in table:
            raise table.bad("rate", "a rate and an orbit", "no rate: a gravity gradient has the rate of the orbit")
        table.only(("kind", "direction_W"))
        return table.call(orbit.gravity_gradient, inertia=body.inertia)
    return Turning(_potential(table, body, mass), orbit)


def _potential(table: TomlTable, body: RigidBody, mass: MassDistribution | None) -> Potential:
    kind = table.choice("kind", _POTENTIALS)
    keys = {"kind", *keys_of(_POTENTIALS[kind])}
    if kind == "uniform_gravity":
        table.only({*keys, "g"})
        if "g" not in table:
            return table.call(UniformGravity)
        if mass is None:
            raise table.bad("g", "an acceleration, but only the inertia is known of the body", "weight, N, and com_B, m")
        if "weight" in table or "com_B" in table:
            raise table.bad("g", "g and weight or com_B", "g alone, or weight and com_B")
        return table.call(mass.gravity)
    if kind == "gravity_gradient":
        table.only(keys - {"inertia"})
        return table.call(GravityGradient, inertia=body.inertia)
    table.only(keys)
    return table.call(_POTENTIALS[kind])


def _rotor(momentum: ArrayLike) -> ArrayLike:
    return momentum


def _motor(times: ArrayLike, values: ArrayLike) -> tuple[ArrayLike, ArrayLike]:
    return times, values


def _torque_table(times: ArrayLike, values: ArrayLike, frame: str = "body") -> Torque:
    return Torque((times, values), frame)


def _damping_table(matrix: ArrayLike, times: ArrayLike, values: ArrayLike) -> Damping:
    return Damping(matrix, (times, values))


def _load(top: TomlTable, key: str) -> Any:
    """Return the torque or the damping under `key`, or None."""
    if key not in top:
        return None
    table = top.table(key, "value, N m, or times, s, and values" if key == "torque" else "matrix, N m s")
    kinds: dict[str, tuple[Callable[..., Any], ...]] = {"torque": (Torque, _torque_table), "damping": (Damping, _damping_table)}
    build = kinds[key]["times" in table]
    table.only(keys_of(build))
    return table.call(build)


def _start(table: TomlTable) -> tuple[Array, Array, dict[str, Any]]:
    """Return attitude, rates and, in free flight, position or velocity of the frame."""
    table.only(("R_WB", "w_WB_B", "p_WB", "v_WB"))
    vectors = {}
    for name, unit in (("w_WB_B", "rates (3,), rad/s"), ("p_WB", "numbers (3,), m"), ("v_WB", "numbers (3,), m/s")):
        if name in table or name == "w_WB_B":
            allowed = f"three finite {unit}"
            with table.blame():
                vectors[f"{name}0"] = finite_array(name, table.value(name, allowed), ((3,),), allowed)
    return _attitude(table, "R_WB"), vectors.pop("w_WB_B0"), vectors


def _attitude(table: TomlTable, key: str) -> Array:
    """Return the rotation (3, 3) under `key`: a matrix or a table with another form; by default the identity."""
    if key not in table:
        return np.eye(3)
    if not isinstance(table.values[key], dict):
        with table.blame():
            return rotation(key, table.value(key, "a rotation matrix (3, 3)"))
    forms = table.table(key, "one form of a rotation")
    forms.only({*_ATTITUDES, "angle"})
    used = {"axis" if form == "angle" else form for form in forms.values}
    if len(used) != 1:
        got = " and ".join(forms.values) or "an empty table"
        raise table.bad(key, got, "a matrix, or one of: quaternion_wxyz; quaternion_xyzw; rotation_vector; axis and angle")
    return forms.call(_ATTITUDES[used.pop()])


def _quaternion(quaternion_wxyz: ArrayLike) -> Array:
    allowed = "four finite numbers (4,), scalar first, not all 0"
    return from_quaternion(unit_vector("quaternion_wxyz", quaternion_wxyz, allowed, size=4))


def _quaternion_xyzw(quaternion_xyzw: ArrayLike) -> Array:
    allowed = "four finite numbers (4,), scalar last, not all 0"
    return from_quaternion(np.roll(unit_vector("quaternion_xyzw", quaternion_xyzw, allowed, size=4), 1))


def _vector(rotation_vector: ArrayLike) -> Array:
    allowed = "three finite numbers (3,): unit axis times angle, rad"
    v = finite_array("rotation_vector", rotation_vector, ((3,),), allowed)
    angle = float(np.linalg.norm(v))
    return rotation_about(v, angle) if angle > 0 else np.eye(3)


def _axis_angle(axis: ArrayLike, angle: float) -> Array:
    direction = unit_vector("axis", axis, "three finite numbers (3,), not all 0; their length does not matter")
    return rotation_about(direction, finite_number("angle", angle, "a finite angle, rad"))


_ATTITUDES: dict[str, Callable[..., Array]] = {
    "quaternion_wxyz": _quaternion,
    "quaternion_xyzw": _quaternion_xyzw,
    "rotation_vector": _vector,
    "axis": _axis_angle,
}
