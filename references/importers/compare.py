"""The body that an engine has after loading a file, from its accelerations, and the mistake that explains it."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial
from importlib.util import find_spec
from itertools import combinations, permutations, product
from pathlib import Path
from typing import Any

import numpy as np

from conservative import registry
from conservative.attitude import Array, hat
from conservative.check import choice
from conservative.errors import BadInput
from conservative.programs import list_programs

from ..engine import version
from ..environments.environment import find_environment, list_environments
from ..worker.calls import python_worker
from ..worker.client import EngineCrashed, EngineError, EngineTimeout, time_limit
from . import loaders
from .description import Link, Piece, join_links, kind_of, make_pose, read_links, steiner
from .loaders import LOADERS

LOCAL = {"mujoco": ("mujoco", "MuJoCo"), "pinocchio": ("pin", "Pinocchio")}
"""Engines that run in this interpreter if no version is named: package and name."""
SINGLE = ("mjwarp", "newton", "sapien", "genesis")
"""Engines in single precision."""
OTHERS = ("mujoco_js",)
"""Engines of this package whose program loads files itself, as programs of users do."""
LIMIT, MEMORY = 300.0, 2**33
"""Time in seconds and memory in bytes that a loader may take."""
CASES = 24
RATE = 3.0
"""Number of cases, half of them without force and torque, and their typical rate, rad/s."""
Mistake = Callable[[list[Link]], list[Link]]
CATALOGUE = Path(__file__).parent / "models"


@dataclass(frozen=True, eq=False)
class FileAnswer:
    """The answer of an engine for a file.

    The outcome is "right", "wrong", "refused", "crashed", or "" if the engine has no loader for the format, with `words`.
    `seen` has mass, com and inertia that explain the accelerations best, and `error` is their largest relative error.
    """

    engine: str
    file: str
    outcome: str
    words: str = ""
    seen: dict[str, Any] | None = None
    error: float = 0.0


def _all(change: Callable[[Link], dict[str, Any]]) -> Mistake:
    return lambda links: [replace(link, **change(link)) for link in links]


def _children(change: Callable[[Link], dict[str, Any]]) -> Mistake:
    return lambda links: [links[0], *(replace(link, **change(link)) for link in links[1:])]


def _ordered(link: Link, order: Sequence[int]) -> dict[str, Any]:
    moments, axes = np.linalg.eigh(link.inertia)
    return {"inertia": (axes * moments[list(order)]) @ axes.T}


def _transposed(link: Link) -> dict[str, Any]:
    moments, axes = np.linalg.eigh(link.inertia)
    return {"inertia": (axes.T * moments) @ axes}


def _from_geometry(link: Link, mass: float, com: bool) -> dict[str, Any]:
    if not link.geometry.mass:
        return {}
    part = link.geometry.scale(mass / link.geometry.mass)
    return {"mass": mass, "frame": make_pose(part.com if com else link.frame[:3, 3]), "inertia": part.inertia}


def _moved(link: Link, sign: float) -> dict[str, Any]:
    return {"inertia": link.inertia + sign * steiner(link.mass, link.frame[:3, :3].T @ link.frame[:3, 3])}


def _collapsed(links: list[Link]) -> list[Link]:
    whole, root = join_links(links), join_links(links[:1])
    others = [replace(link, frame=make_pose(R=link.frame[:3, :3])) for link in links[1:]]
    moved = sum((join_links([link]).inertia + steiner(link.mass, link.pose[:3, 3]) for link in others), root.inertia)
    return [Link(np.eye(4)).filled(replace(whole, inertia=moved))]


MISTAKES: dict[str, Mistake] = {
    "the rotation of the inertial frame is ignored": _all(lambda k: {"frame": make_pose(k.frame[:3, 3])}),
    "R I instead of R I R'": _all(lambda k: {"frame": make_pose(k.frame[:3, 3]), "inertia": k.frame[:3, :3] @ k.inertia}),
    "the rotation of the inertial frame is inverted": _all(lambda k: {"frame": make_pose(k.frame[:3, 3], k.frame[:3, :3].T)}),
    "the products of inertia are dropped": _all(lambda k: {"inertia": np.diag(np.diag(k.inertia))}),
    "the products of inertia have the other sign": _all(lambda k: {"inertia": 2 * np.diag(np.diag(k.inertia)) - k.inertia}),
    "the principal axes are transposed": _all(_transposed),
    **{
        f"the principal moments are in another order, {order}": _all(partial(_ordered, order=order))
        for order in list(permutations(range(3)))[1:]
    },
    "the inertia is that of the geometry": _all(lambda k: _from_geometry(k, k.mass, False)),
    "inertia and centre of mass are those of the geometry": _all(lambda k: _from_geometry(k, k.mass, True)),
    "mass and inertia are those of the geometry at 1000 kg/m^3": _all(lambda k: _from_geometry(k, k.geometry.mass, True)),
    "the inertia is taken about the origin of the link": _all(lambda k: _moved(k, -1)),
    "the inertia is moved away from the centre of mass": _all(lambda k: _moved(k, 1)),
    "the centre of mass is at the origin of the link": _all(lambda k: {"frame": make_pose(R=k.frame[:3, :3])}),
    "the mass of fixed children is lost": _children(lambda k: {"mass": 0.0, "inertia": np.zeros((3, 3))}),
    "the inertia of fixed children is lost": _children(lambda k: {"inertia": np.zeros((3, 3))}),
    "the rotation of fixed children is ignored": _children(lambda k: {"pose": make_pose(k.pose[:3, 3])}),
    "the place of fixed children is ignored": _children(lambda k: {"pose": make_pose(R=k.pose[:3, :3])}),
    "fixed children are moved to the origin of the root link, not to the common centre of mass": _collapsed,
    "links without inertia have mass 1 and the unit inertia": _all(
        lambda k: {} if k.mass else {"mass": 1.0, "inertia": np.eye(3)}
    ),
    "the inertia is lost": _all(lambda k: {"inertia": np.zeros((3, 3))}),
    "the inertia is the unit matrix": _all(lambda k: {"inertia": np.eye(3)}),
    "mass and inertia are 1": _all(lambda k: {"mass": 1.0, "inertia": np.eye(3)}),
    "the three moments are made equal": _all(lambda k: {"inertia": np.trace(k.inertia) / 3 * np.eye(3)}),
}
"""Known mistakes of loaders, as functions from the links of a file to the links that a loader makes of them."""


def accelerations(part: Piece, cases: Array) -> Array:
    """Return the accelerations (n, 6) of a body for velocities and forces (n, 2, 6), as in `loaders`.

    Newton and Euler about the centre of mass c: m a_c = F, J w' = T - c x F - w x J w, a = a_c - w' x c - w x (w x c).
    """
    _, w, force, torque = np.moveaxis(np.reshape(cases, (-1, 4, 3)), 1, 0)
    moment = torque - np.cross(part.com, force) - np.cross(w, w @ part.inertia.T)
    turn = np.linalg.solve(part.inertia, moment.T).T
    return np.hstack([force / part.mass - np.cross(turn, part.com) - np.cross(w, np.cross(w, part.com)), turn])


def make_cases(part: Piece) -> Array:
    """Return generic rates, velocities, forces and torques (n, 2, 6) for a body, so that all terms are of one order."""
    rng, size = np.random.default_rng(2026), np.sqrt(np.trace(part.inertia) / part.mass)
    w, force, torque = (
        rng.normal(size=(3, CASES, 3))
        * RATE
        * np.array((1, part.mass * size * RATE, part.mass * size**2 * RATE))[:, None, None]
    )
    force[::2] = torque[::2] = 0
    return np.hstack([-np.cross(w, part.com), w, force, torque + np.cross(part.com, force)]).reshape(-1, 2, 6)


def identify(cases: Array, measured: Array, near: Piece) -> Piece:
    """Return the body that explains accelerations (n, 6) best, by least squares about the centre of mass of a body `near` it.

    With a the acceleration of the point P, d = c - P, and L = m d: F = m a + w' x L + w x (w x L), and
    T = L x a + J_P w' + w x J_P w. All nine entries of J_P are free, because a wrong loader may make it unsymmetric.
    """
    rows, right = [], []
    size = np.sqrt(abs(np.trace(near.inertia) / near.mass))
    units = near.mass, near.mass * size, near.mass * size**2
    for (_, w, force, torque), given in zip(np.reshape(cases, (-1, 4, 3)), measured, strict=True):
        turn, P = given[3:], near.com
        a = given[:3] + np.cross(turn, P) + np.cross(w, np.cross(w, P))
        W = hat(w)
        A = np.zeros((6, 13))
        A[:3, 0], A[:3, 1:4] = a * units[0] / units[1], hat(turn) + W @ W
        A[3:, 1:4] = -hat(a) * units[1] / units[2]
        A[3:, 4:] = np.kron(np.eye(3), turn) + W @ np.kron(np.eye(3), w)
        rows.append(A)
        right.append(np.concatenate([force / units[1], (torque - np.cross(P, force)) / units[2]]))
    x = np.linalg.lstsq(np.vstack(rows), np.concatenate(right), rcond=None)[0]
    mass, d = x[0] * units[0], x[1:4] / x[0] * size
    inertia = x[4:].reshape(3, 3) * units[2] - steiner(mass, d)
    return Piece(float(mass), near.com + d, inertia)


def distance(part: Piece, other: Piece, scale: Piece | None = None) -> float:
    """Return the largest difference of mass, centre of mass and inertia, relative to those of `scale`, by default `part`."""
    unit = scale or part
    size = np.sqrt(abs(np.trace(unit.inertia) / unit.mass))
    parts = (other.mass - part.mass) / unit.mass, (other.com - part.com) / size, other.inertia - part.inertia
    errors = [np.linalg.norm(parts[0]), np.linalg.norm(parts[1]), np.linalg.norm(parts[2]) / np.linalg.norm(unit.inertia)]
    return float(np.nan_to_num(max(errors), nan=np.inf))


def _list(values: Array) -> str:
    return ", ".join(f"{value:.3g}" for value in values.ravel())


def explain(path: Path, links: list[Link], seen: Piece, tolerance: float) -> str:
    """Return the mistake, or the pair of mistakes, that turns the links of a file into the body that an engine has."""
    wanted = join_links(links)
    for names in [*combinations(MISTAKES, 1), *combinations(MISTAKES, 2)]:
        changed = links
        for name in names:
            changed = MISTAKES[name](changed)
        part = join_links(changed)
        if part.mass and distance(wanted, part) > tolerance > distance(part, seen, wanted):
            return ", and ".join(names)
    for factor, name in ((np.pi / 180, "degrees are read as radians"), (180 / np.pi, "radians are read as degrees")):
        if kind_of(path) != "usd" and distance(join_links(read_links(path, 1 / factor)), seen) < tolerance:
            return name
    ratio = np.trace(seen.inertia) / np.trace(wanted.inertia)
    if distance(replace(wanted, mass=seen.mass, inertia=ratio * wanted.inertia), seen) < tolerance:
        return f"mass times {seen.mass / wanted.mass:.6g}, inertia times {ratio:.6g}"
    moments, axes = np.linalg.eigh(wanted.inertia)
    raised = np.maximum(moments, np.diag(axes.T @ seen.inertia @ axes))
    if distance(replace(wanted, inertia=(axes * raised) @ axes.T), seen) < tolerance:
        return f"small principal moments are raised: {_list(raised)} instead of {_list(moments)} kg m^2"
    found = f"mass {seen.mass:.4g}, centre of mass {_list(seen.com)}, inertia {_list(seen.inertia)}"
    return f"no known mistake explains {found} instead of {wanted.mass:.4g}, {_list(wanted.com)}, {_list(wanted.inertia)}"


def compare_files(files: Sequence[Path], engines: Sequence[str], tell: Callable[[float, str], None]) -> list[FileAnswer]:
    """Return the answers of engines, by default of those that are installed, for files, by default for the catalogue.

    Raise `BadInput` for a file that is not one rigid body, before any engine starts, and `MissingEngine`.
    """
    paths = list(files) or sorted(path for path in CATALOGUE.iterdir() if path.suffix != ".obj")
    models = [(path, read_links(path)) for path in paths]
    installed = {each.engine for each in list_environments()} | {name for name in LOCAL if find_spec(name)}
    findings: list[FileAnswer] = []
    with ExitStack() as stack:
        programs = [Program(name) for name in engines or [name for name in LOADERS if name in installed]]
        for program in programs:
            stack.callback(program.worker.close)
        for program, (path, links) in product(programs, models):
            tell(len(findings) / len(programs) / len(models), f"{program.label}: {path.name}")
            findings.append(program.check(path, links))
    return findings


class Program:
    """The process in which an engine loads files; a name such as "mujoco" or "newton@1.0.0". Raise `MissingEngine`."""

    def __init__(self, name: str) -> None:
        self.engine, _, wanted = registry.partition_version(name)
        choice("engines", self.engine, (*LOADERS, *OTHERS, *list_programs()))
        self.formats: tuple[str, ...] = ()
        self.single = self.engine in SINGLE
        if self.engine not in LOADERS:
            method = registry.engine(self.engine).at_version(wanted)()
            self.formats, self.single, environment = method.data.formats, method.precision == "f32", method.environment
            if not self.formats:
                got = f"{self.engine!r}, a program whose answer to `hello` names no `formats`"
                raise BadInput("engines", got, "a program with the request `load`, which PROTOCOL.md describes")
            self.label = f"{self.engine} {environment.version}"
            self.worker, self._adapter = environment.start_worker(memory=MEMORY), str(method.adapter.__file__)
        elif self.engine in LOCAL and not wanted:
            self.label = f"{self.engine} {version(*LOCAL[self.engine])}"
            self.worker, self._adapter = python_worker(memory=MEMORY), f"{__package__}.loaders"
        else:
            environment = find_environment(self.engine, wanted)
            self.label = f"{self.engine} {environment.version}"
            self.worker = environment.start_worker({"JAX_PLATFORMS": "cpu", "JAX_ENABLE_X64": "1"}, MEMORY)
            self._adapter = str(Path(loaders.__file__).resolve())

    def check(self, path: Path, links: list[Link]) -> FileAnswer:
        """Return the answer of the engine for a file, whose links are given."""
        wanted = join_links(links)
        cases, flaw, answer = make_cases(wanted), wanted.flaw, partial(FileAnswer, self.label, path.name)
        folder = f"{path.resolve().parent}/"  # which the words of engines may contain
        try:
            with time_limit(LIMIT):
                result = self._load(str(path.resolve()), kind_of(path), cases)
        except NotImplementedError as error:
            return answer("", str(error))
        except (EngineCrashed, EngineTimeout) as failure:
            return answer("crashed", str(failure.outcome))
        if words := result.get("refused", ""):
            return answer("right" if flaw else "refused", words.replace(folder, ""))
        measured = result["accelerations"]
        if not np.isfinite(measured).all():
            return answer("wrong", "accelerations that are not finite")
        seen = identify(cases, measured, wanted)
        expected = accelerations(wanted, cases)
        worst = float(np.abs(measured - expected).max() / np.abs(expected).max())
        answer = partial(answer, seen={name: np.asarray(value).tolist() for name, value in vars(seen).items()}, error=worst)
        tolerance = 1e-2 if self.single else 1e-4
        if distance(wanted, seen) < tolerance and not flaw:
            return answer("right")
        said = re.search(r"[^.:]*(inertia|mass|moment)[^.]*", result["output"].replace(folder, ""), re.IGNORECASE)
        prints = f" (it prints: {said[0].strip()[:200]})" if said else ""
        if flaw and said and not seen.flaw:
            return answer("right", f"it repairs the inertia{prints}")
        accepts = f"it accepts that {flaw}" if not said else f"{flaw}, and it does not repair that"
        return answer("wrong", (accepts if flaw else explain(path, links, seen, tolerance)) + prints)

    def _load(self, path: str, kind: str, cases: Array) -> dict[str, Any]:
        """Return the answer of `loaders.probe`, or that of a program to `load` in the same form. Raise as `Worker.ask`."""
        if not self.formats:
            given = {"engine": self.engine, "path": path, "kind": kind, "cases": cases}
            return self.worker.ask("call", adapter=self._adapter, function="probe", **given)
        if kind not in self.formats:
            raise NotImplementedError
        given = {"adapter": self._adapter, "path": path, "kind": kind}
        try:
            result = self.worker.ask("load", **given, velocities=cases[:, 0], forces=cases[:, 1])
        except EngineError as error:
            return {"refused": error.reason}
        try:
            measured = np.asarray(result["accelerations"], float)
        except (TypeError, ValueError):
            measured = np.empty(0)
        if measured.shape != (len(cases), 6):
            raise EngineCrashed(f"its `accelerations` are not numbers ({len(cases)}, 6)")
        return {"accelerations": measured, "output": str(result.get("output", ""))}
