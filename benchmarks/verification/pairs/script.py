"""A pair that differs, as a short script in the engine's own language.

The authors of an engine can run it without this package. It is a template of `scripts/`, filled with the numbers of both
descriptions.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from string import Template
from types import SimpleNamespace
from typing import Any

from conservative.method import Method
from conservative.references.engines import shared
from conservative.references.environments.adapter import AdapterMethod
from conservative.registry import read_name

from .pairs import WRAPPED, Description, Pair

MARK = "conservative pairs: "
"""Text in the first line of every script, by which an earlier one is recognized."""
SCRIPTS_OF_NODE = ("rapier_js", "jolt")
"""Templates in JavaScript; the others are in Python."""
FOLDER = Path(__file__).with_name("scripts")
SAME = {"rapier_deterministic": "rapier_js"}
"""Engines that have the script of another one."""
IN_THE_NUMBERS = ("", "quaternion", "frame", "zero")
"""Variants that change numbers only, so that every template has them."""
ALSO = {"mujoco": ("offset", "file", "child", "joints", "world", "damping", *WRAPPED), "rapier_js": ("setter",)}
"""Further variants that a template has, by its name."""
OF_FILES = {"pybullet": tuple(WRAPPED)}
"""Variants with a template of their own, by engine: it shows the body that the engine has, not its motion."""
THEN = {
    ("mujoco", "rewritten"): (
        'mujoco.mj_saveLastXML("saved.xml", second)\nsecond = mujoco.MjModel.from_xml_path("saved.xml")\n'
    ),
    ("mujoco", "mass"): "mujoco.mj_setTotalmass(second, $mass)\n",
    ("pybullet", "rewritten"): (
        "editor = UrdfEditor()\neditor.initializeFromBulletBody(body, 0)\neditor.saveUrdf('saved.urdf')\n"
        "body = p.loadURDF('saved.urdf', **options)\n"
    ),
    ("pybullet", "mass"): "p.changeDynamics(body, $part, mass=$mass)\n",
}
"""The ways in which an engine saves, sets or scales a loaded file, by engine and variant."""


def script_of(method: Method, pair: Pair, first: Description, scale: float | None) -> str:
    """Return the script of a pair that differs, for the engine's own language; "" if the engine has none for it."""
    family = read_name(method.family).base
    engine = SAME.get(family, family)
    of_file = pair.variant in OF_FILES.get(engine, ())
    file = FOLDER / f"{engine}{'.files' * of_file}.txt"
    variants = IN_THE_NUMBERS + (OF_FILES if of_file else ALSO).get(engine, ())
    # A template makes one run of each description, from its start.
    if not isinstance(method, AdapterMethod) or not file.is_file() or pair.run or pair.variant not in variants:
        return ""
    # Only MuJoCo's template has weight and a fixed point. Those with motions switch off sleep and damping, which `as_installed`
    # keeps.
    if not of_file and ((first.gravity and file.stem != "mujoco") or method.settings.get("as_installed")):
        return ""
    second = pair.second(first) if scale is None else pair.second(first, scale)
    texts: dict[str, Any] = {"n_steps": first.n_steps, "package": method.data.package}
    for name, description in (("first", first), ("second", second)):
        numbers = _numbers(description)
        text = json.dumps(numbers) if file.stem in SCRIPTS_OF_NODE else repr(numbers)
        texts |= {name: text, f"{name}_q": numbers["q"], f"{name}_w": numbers["w"]}
        if file.stem == "mujoco":
            texts[f"{name}_mjcf"] = _mjcf(method, description)
        if of_file:
            texts[f"{name}_file"] = method.adapter.write_file(SimpleNamespace(**description.numbers))
    texts |= {"mass": first.mass, "moments": first.numbers["moments_com"].tolist(), "held": bool(first.gravity)}
    texts |= {"part": 0 if first.gravity else -1, "size": shared.OTHER_SIZE if pair.variant == "scaled" else 1.0}
    texts["then"] = Template(THEN.get((engine, pair.variant), "")).substitute(texts)
    # Newton's settings are names of its solvers; MuJoCo_rk4 is its solver MuJoCo with an option.
    solver, _, integrator = str(method.settings.get("solver", "")).partition("_")
    options = f', integrator="{integrator}", disable_contacts=True' if integrator else ", angular_damping=0.0"
    texts |= {"solver": solver, "options": options if integrator or solver in ("SemiImplicit", "Featherstone") else ""}
    title = f"{'//' if file.stem in SCRIPTS_OF_NODE else '#'} {MARK}{method.label}: {pair.name}. {pair.relation}\n"
    return title + Template(file.read_text(encoding="utf-8")).substitute(texts)


def script_name(method: Method, pair: str) -> str:
    """Return the name of the file of a script."""
    family = read_name(method.family).base
    return re.sub(r"\W+", "_", f"{method.name} {pair}") + (".mjs" if SAME.get(family, family) in SCRIPTS_OF_NODE else ".py")


def _numbers(description: Description) -> dict[str, Any]:
    """Return the numbers of a description by their names in the templates, as plain lists."""
    names = {"mass": "mass", "com": "com", "moments": "moments_com", "axes": "q_com", "inertia": "inertia_com", "q": "q0"}
    names |= {"R": "R0", "w": "w0", "w_W": "w0_W", "dt": "dt"}
    numbers = description.numbers
    values = {name: numbers[key] for name, key in names.items()}
    plain = {name: value.tolist() if hasattr(value, "tolist") else value for name, value in values.items()}
    return plain | ({"description": description.variant} if description.variant else {})


def _mjcf(method: AdapterMethod, body: Description) -> str:
    option = f'<option gravity="0 0 {-body.gravity!r}" integrator="{method.settings["integrator"]}" timestep="{body.dt!r}"/>'
    write: Any = shared.write_mjcf  # it runs in environments too, without types
    lines = write(SimpleNamespace(**body.numbers), option).splitlines()
    return "\n".join(line.strip() for line in lines if line.strip())
