"""What `conservative.benchmarks.verification.hostile_values` tries: calls of the public API with hostile arguments.

Each kind of call has arguments that work; some of them are replaced by hostile ones. Source: our own.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

import conservative as cv
from conservative import registry
from conservative.check import describe
from conservative.method import Method
from conservative.references.engines.model_files import body_from_mjcf, body_from_urdf
from conservative.references.exact.method import free_body, lagrange_top
from conservative.scene_files import scene_file

from .hostile_arguments import Try, draw_hostile, scramble
from .hostile_bodies import SEARCHED, try_body, try_truth
from .hostile_scales import OURS, REFERENCES, try_extremes, try_units

MODEL_FILES = 0.002
"""Share of the tries that read a model file, which takes a second."""
MODELS = {
    body_from_mjcf: '<mujoco><worldbody><body name="arm"><joint type="ball"/><geom size="0.1"/></body></worldbody></mujoco>',
    body_from_urdf: '<robot name="r"><link name="arm"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" '
    'ixz="0" iyz="0"/></inertial></link></robot>',
}


def make_try(rng: Random, folder: Path, part: str = "all") -> Try:
    """Return the next try of a part of `PARTS`; the files that it reads are written to a folder."""
    kinds = PARTS[part]
    if _model_file in kinds and rng.random() < MODEL_FILES:
        return _model_file(rng, folder)
    return rng.choice([kind for kind in kinds if kind is not _model_file])(rng, folder)


def warm_up() -> None:
    """Run every method once in each field, since compiling may take longer than a try."""
    scenes = [
        cv.scenes.brick_flip(),
        cv.scenes.lagrange_top(),
        cv.scenes.sprung_body(),
        cv.scenes.brick_flip().rename("in a gradient", potential=cv.GravityGradient(1.0, (1.0, 2.0, 2.5))),
        cv.scenes.brick_flip().rename("attracted", potential=cv.PointAttraction(1.0, (1, 0, 0), (0, 0, 3))),
        _scene_in(cv.FunctionPotential(_quartic, _quartic_gradient)),
    ]
    for method in (*SEARCHED, *REFERENCES):
        for scene in scenes:
            if method.unsupported(scene) is None:
                cv.integrate(scene, 0.005, method, t_end=0.01, on_failure="return")


def _scene_in(potential: cv.Potential | cv.Turning) -> cv.Scene:
    return cv.Scene("s", _body(), np.eye(3), (0.1, 0.2, 3.0), 1.0, potential)


def _swap(rng: Random, name: str, function: Callable[..., object], arguments: Mapping[str, Any]) -> Try:
    """Return a call in which one or more of the arguments are hostile."""
    swapped = rng.sample(list(arguments), k=min(len(arguments), rng.choice((1, 1, 1, 2, 3)))) if arguments else []
    given = {key: draw_hostile(rng, value) if key in swapped else value for key, value in arguments.items()}
    words = ", ".join(f"{key}={describe(given[key])}" for key in swapped)
    return Try(name, f"{name}({words})", lambda: function(**given))


def _body() -> cv.RigidBody:
    return cv.RigidBody((1.0, 2.0, 2.5))


def _quartic(R: Any) -> float:
    return float(R[2] @ (0.0, 0.1, 0.4)) ** 4


def _quartic_gradient(R: Any) -> Any:
    return np.outer([0, 0, 1], 4 * float(R[2] @ (0.0, 0.1, 0.4)) ** 3 * np.array((0.0, 0.1, 0.4)))


SCENE = {"name": "s", "R_WB0": np.eye(3), "w_WB_B0": (0.1, 0.2, 3.0), "t_end": 1.0, "potential": None}
DETAILS = {"dt": 0.05, "extra_invariants": (), "group": "g", "source": "s"}
CONSTRUCTORS: dict[Callable[..., object], dict[str, Any]] = {
    cv.RigidBody: {"inertia": (1.0, 2.0, 2.5)},
    cv.Scene: {**SCENE, "body": _body(), **DETAILS},
    cv.UniformGravity: {"weight": 1.0, "com_B": (0, 0, 0.1)},
    cv.LinearSpring: {"stiffness": 1.0, "point_B": (1, 0, 0), "anchor_W": (0, 0, 1), "rest_length": 0.5},
    cv.PointAttraction: {"strength": 1.0, "point_B": (1, 0, 0), "anchor_W": (0, 0, 2)},
    cv.GravityGradient: {"rate": 1.0, "inertia": (1.0, 2.0, 2.5), "direction_W": (0, 0, 1)},
    cv.FunctionPotential: {
        **{"energy": _quartic, "gradient": _quartic_gradient, "scale": 1.0, "axis_W": (0, 0, 1), "time_dependent": False}
    },
    cv.Orbit: {"rate": 1.0, "normal_W": (0, 0, 1)},
    cv.Turning: {"potential": cv.UniformGravity(1.0, (0, 0, 0.1)), "orbit": cv.Orbit(1.0, (1, 0, 0))},
    cv.Orbit(1.0, (0, 0, 1)).gravity_gradient: {"inertia": (1.0, 2.0, 2.5), "direction_W": (1, 0, 0)},
    cv.Invariant: {"name": "i", "unit": "J", "scale": 1.0, "evaluate": lambda R, w: w[:, 0]},
    cv.Grid: {"dt": 0.1, "n_steps": 10, "every": 2},
    cv.shapes.box: {"size": (1, 2, 3), "mass": 1.0, "density": None},
    cv.shapes.ellipsoid: {"semi_axes": (1, 2, 3), "mass": None, "density": 1.0},
    cv.shapes.cylinder: {"radius": 1.0, "height": 2.0, "mass": None, "density": 1.0},
    cv.shapes.cone: {"radius": 1.0, "height": 2.0, "mass": 1.0, "density": None},
    cv.shapes.MassDistribution: {"mass": 1.0, "com_B": (0, 0, 1), "inertia_com": (1, 2, 2.5)},
    cv.shapes.box((1, 2, 3), mass=1).rotate: {"R_BS": np.eye(3)},
    cv.shapes.box((1, 2, 3), mass=1).about: {"com_B": (0, 0, 1)},
    cv.shapes.box((1, 2, 3), mass=1).gravity: {"g": 9.81},
}


def _construct(rng: Random, folder: Path) -> Try:
    """Return a call of a constructor; of a scene it makes a run now and then, and of a shape its body."""
    function, arguments = rng.choice(list(CONSTRUCTORS.items()))
    made = _swap(rng, function.__name__, function, arguments)
    return Try(made.name, made.words, lambda: _use(made.call()))


def _use(value: object) -> object:
    """Return what follows from a value: of a mass its body, of a grid nothing more, of a potential a run in it."""
    if isinstance(value, cv.shapes.MassDistribution):
        return value.body
    if isinstance(value, cv.Grid):
        return value.n_samples < 10**6 and value.t
    if isinstance(value, cv.FunctionPotential | cv.Turning):
        return cv.integrate(_scene_in(value), 0.1, cv.Projected(), t_end=0.2)
    return value


def _set(rng: Random, folder: Path) -> Try:
    """Return a call of a method's class with hostile settings."""
    family: type[Method] = type(rng.choice(OURS + REFERENCES))
    settings = {name: p.default for name, p in inspect.signature(family).parameters.items()}
    return _swap(rng, family.__name__, family, settings)


def _integrate(rng: Random, folder: Path) -> Try:
    """Return a short run with hostile arguments."""
    scene = rng.choice((cv.scenes.brick_flip(), cv.scenes.lagrange_top(), cv.scenes.sprung_body()))
    arguments = {"scene": scene, "dt": 0.05, "method": rng.choice((*OURS, None)), "t_end": 0.3, "sample_every": 2}
    more: dict[str, Any] = rng.choice(({"error": None}, {"on_failure": "return"}, {}))
    if rng.random() < 0.1:
        more, arguments["method"] = {"error": 1e-6}, None
    return _swap(rng, "integrate", cv.integrate, {**arguments, **more})


def _name(rng: Random, folder: Path) -> Try:
    """Return a look-up of a scrambled name."""
    look = rng.choice((registry.scene, registry.method))
    names = registry.list_scenes() if look is registry.scene else registry.list_methods()
    setting = rng.choice(
        ("", ":", ":1e400", ":none", ":true", f":{'9' * 400}", ":nan", ":x=1", ":-1", ":0", ":[]", ":\0", ":1,2,3,4")
    )
    text: Any = rng.choice(names) + setting
    text = draw_hostile(rng, "s") if rng.random() < 0.2 else scramble(rng, text) if rng.random() < 0.3 else text
    return Try(look.__name__, f"registry.{look.__name__}({describe(text)})", lambda: look(text))


def _scene_function(rng: Random, folder: Path) -> Try:
    """Return a call of one of the scenes with hostile parameters."""
    name = rng.choice(registry.list_scenes())
    function = getattr(cv.scenes, name)
    parameters = {key: p.default for key, p in inspect.signature(function).parameters.items()}
    return _swap(rng, f"scenes.{name}", function, parameters)


def _scene_file(rng: Random, folder: Path) -> Try:
    """Return the reading of a scene file with a hostile value, or with scrambled text."""
    lines, path = scene_file.template().splitlines(), folder / "scene.toml"
    number = rng.choice([i for i, line in enumerate(lines) if "=" in line and not line.startswith("#")])
    values = (
        "1e400",
        "nan",
        "-inf",
        "9" * 400,
        "[1, 2]",
        '"text"',
        "true",
        "1979-05-27",
        '"\\u0000"',
        "{}",
        "1e-200",
        "[[1e300]]",
        "",
    )
    lines[number] = lines[number].partition("=")[0] + "= " + rng.choice(values)
    text = "\n".join(lines)
    text = scramble(rng, text) if rng.random() < 0.5 else text

    def load() -> object:
        path.write_text(text, encoding="utf-8", errors="surrogatepass")
        return scene_file.load(path)

    return Try("scene file", f"scene_file.load of {lines[number]!r}, scrambled or not", load)


def _model_file(rng: Random, folder: Path) -> Try:
    """Return the reading of a scrambled model file, or of one with a hostile path or name."""
    read, text = rng.choice(list(MODELS.items()))
    path, changed = folder / "model.xml", scramble(rng, text)

    def call(path: object, name: object) -> object:
        (folder / "model.xml").write_text(changed, encoding="utf-8", errors="surrogatepass")
        return read(path, name)  # type: ignore[arg-type]

    if rng.random() < 0.5:
        return _swap(rng, read.__name__, call, {"path": str(path), "name": "arm"})
    return Try(read.__name__, f"{read.__name__} of {changed!r}", lambda: call(path, "arm"))


def _closed_form(rng: Random, folder: Path) -> Try:
    """Return a call of a closed form with hostile arguments."""
    arguments = {"body": cv.RigidBody((1, 1, 2)), "R_WB0": np.eye(3), "w_WB_B0": (1, 2, 3), "t": [0.0, 1.0]}
    if rng.random() < 0.5:
        return _swap(rng, "free_body", free_body, arguments)
    return _swap(rng, "lagrange_top", lagrange_top, {**arguments, "potential": cv.UniformGravity(1, (0, 0, 1))})


_ARGUMENTS = (_construct, _construct, _set, _integrate, _name, _scene_function, _scene_file, _closed_form, _model_file)
_SCALES, _BODIES = (try_extremes, try_units), (try_body, try_body, try_truth)
PARTS = {"arguments": _ARGUMENTS, "scales": _SCALES, "bodies": _BODIES, "all": _ARGUMENTS + _SCALES + _BODIES}
"""Kinds of call: with hostile arguments, with numbers anywhere in the range that is allowed, and of random bodies."""
