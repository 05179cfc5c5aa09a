"""The body that an engine has after loading a file, from its accelerations, and the mistake that explains it."""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field, replace
from functools import partial
from importlib.util import find_spec
from itertools import combinations, permutations, product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from conservative import registry
from conservative.attitude import Array, hat
from conservative.check import choice
from conservative.errors import BadInput
from conservative.programs import list_programs
from conservative.references.engine import version
from conservative.references.environments.environment import find_environment, list_environments
from conservative.references.model_files import loaders
from conservative.references.model_files.loaders import LOADERS
from conservative.references.model_files.pieces import (
    QUANTITIES,
    Link,
    Piece,
    differing,
    distance,
    errors,
    join_links,
    list_numbers,
    make_pose,
    steiner,
)
from conservative.references.model_files.readers import DIGITS, Model, read_files
from conservative.references.worker.calls import python_worker
from conservative.references.worker.client import EngineCrashed, EngineError, EngineTimeout, time_limit

LOCAL = {"mujoco": ("mujoco", "MuJoCo"), "pinocchio": ("pin", "Pinocchio")}
"""Engines that run in this interpreter if no version is named: package and name."""
SINGLE = ("mjwarp", "newton", "sapien", "genesis")
"""Engines in single precision."""
OTHERS = ("mujoco_js",)
"""Engines of this package whose program loads files itself, as programs of users do."""
LIMIT, MEMORY = 300.0, 2**33
"""Time in seconds and memory in bytes that a loader may take."""
NOT_FINITE = "accelerations that are not finite"
NO_BODY = "its accelerations are those of no rigid body"
RIGID = "no force or torque turns it, as if its inertia were infinite"
HELD = "no force moves it: the engine holds the body, or has no mass for it"
BARE = "it loads a copy without visuals, sensors and all else beside the mass"
ROUNDS = 4
"""Largest number of loads by which forces are adapted to the body that an engine has."""
CASES = 24
RATE = 3.0
"""Number of cases, half of them without force and torque, and their typical rate, rad/s."""
Mistake = Callable[[list[Link]], list[Link]]
CATALOGUE = Path(loaders.__file__).parent / "models"


@dataclass(frozen=True, eq=False)
class FileAnswer:
    """The answer of an engine for a file.

    The outcome is "right", "wrong", "refused", "crashed", "accepted" or "undecided", which the README explains, or "" if the
    engine has no loader for the format. `seen` has mass, com and inertia that explain the accelerations best, and `error` is
    their largest relative error if they are right. `readers` has the body of the file by its readers, the reference reader
    first, or why a reader has none. `notes` are about the file.
    """

    engine: str
    file: str
    outcome: str
    words: str = ""
    seen: dict[str, Any] | None = None
    error: float = 0.0
    readers: dict[str, Any] = field(default_factory=dict)
    notes: Sequence[str] = ()


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


def _steiner(links: list[Link], outer: float, sign: float = 1.0) -> list[Link]:
    """Join links by a parallel axis theorem of another sign, or with another factor of d d'."""
    whole, parts = join_links(links), [join_links([link]) for link in links]
    away = [(part.mass, part.com - whole.com) for part in parts]
    terms = [sign * steiner(mass, d) + outer * mass * np.outer(d, d) for mass, d in away]
    inertia = sum((part.inertia + term for part, term in zip(parts, terms, strict=True)), np.zeros((3, 3)))
    return [Link(np.eye(4)).filled(replace(whole, inertia=inertia))]


def _other_angles(factor: float) -> Mistake:
    """Return the mistake that multiplies the angles about fixed axes of all poses, as far as a rotation tells them."""

    def turn(pose: Array) -> Array:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of two axes that coincide
            angles = Rotation.from_matrix(pose[:3, :3]).as_euler("xyz")
        return make_pose(pose[:3, 3], Rotation.from_euler("xyz", factor * angles))

    return _all(lambda k: {"frame": turn(k.frame), "pose": turn(k.pose)})


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
    "d d' has the wrong sign in the parallel axis theorem": lambda links: _steiner(links, 2.0),
    "the term of the parallel axis theorem has the wrong sign": lambda links: _steiner(links, 0.0, -1.0),
    "links without inertia have mass 1 and the unit inertia": _all(
        lambda k: {} if k.mass else {"mass": 1.0, "inertia": np.eye(3)}
    ),
    "the inertia is lost": _all(lambda k: {"inertia": np.zeros((3, 3))}),
    "the inertia is the unit matrix": _all(lambda k: {"inertia": np.eye(3)}),
    "mass and inertia are 1": _all(lambda k: {"mass": 1.0, "inertia": np.eye(3)}),
    "the three moments are made equal": _all(lambda k: {"inertia": np.trace(k.inertia) / 3 * np.eye(3)}),
    "degrees are read as radians": _other_angles(180 / math.pi),
    "radians are read as degrees": _other_angles(math.pi / 180),
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
    size = np.sqrt(abs(np.trace(part.inertia) / part.mass)) or 1.0
    units = RATE * np.array((1, part.mass * size * RATE, part.mass * size**2 * RATE))
    w, force, torque = np.random.default_rng(2026).normal(size=(3, CASES, 3)) * units[:, None, None]
    force[::2] = torque[::2] = 0
    return np.hstack([-np.cross(w, part.com), w, force, torque + np.cross(part.com, force)]).reshape(-1, 2, 6)


def identify(cases: Array, measured: Array, near: Piece) -> Piece:
    """Return the body that explains accelerations (n, 6) best, by least squares about the centre of mass of a body `near` it.

    With a the acceleration of the point P, d = c - P, and L = m d: F = m a + w' x L + w x (w x L), and
    T = L x a + J_P w' + w x J_P w. All nine entries of J_P are free, because a wrong loader may make it unsymmetric.
    """
    rows, right = [], []
    size = np.sqrt(abs(np.trace(near.inertia) / near.mass)) or 1.0
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


def explain(model: Model, seen: Piece, tolerance: float) -> str:
    """Return the mistake, or the pair of mistakes, that turns the links of a file into the body that an engine has; or ""."""
    links, wanted = model.links, join_links(model.links)
    for names in [*combinations(MISTAKES, 1), *combinations(MISTAKES, 2)]:
        changed = links
        for name in names:
            changed = MISTAKES[name](changed)
        part = join_links(changed)
        if part.mass and distance(wanted, part) > tolerance > distance(part, seen, wanted):
            return ", and ".join(names)
    ratio = np.trace(seen.inertia) / np.trace(wanted.inertia)
    if distance(replace(wanted, mass=seen.mass, inertia=ratio * wanted.inertia), seen) < tolerance:
        return f"mass times {seen.mass / wanted.mass:.6g}, inertia times {ratio:.6g}"
    moments, axes = np.linalg.eigh(wanted.inertia)
    raised = np.maximum(moments, np.diag(axes.T @ seen.inertia @ axes))
    if distance(replace(wanted, inertia=(axes * raised) @ axes.T), seen) < tolerance:
        return f"small principal moments are raised: {list_numbers(raised)} instead of {list_numbers(moments)} kg m^2"
    return ""


def describe(part: Piece) -> str:
    """Return mass, kg, centre of mass, m, and the six numbers of the inertia, kg m^2, as text."""
    inertia = list_numbers(part.inertia[(0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)])
    size = math.sqrt(abs(np.trace(part.inertia) / part.mass))
    return f"mass {part.mass:.4g}, centre of mass {list_numbers(part.com, size)}, inertia {inertia}"


def compare_files(
    files: Sequence[Path], engines: Sequence[str], tell: Callable[[float, str], None], search: Sequence[Path] = ()
) -> list[FileAnswer]:
    """Return the answers of engines, by default of those that are installed, for files, by default for the catalogue.

    Each link of a robot is a body of its own. Meshes may lie in the folders of `search`.

    Raise `BadInput` for a file that cannot be read, before any engine starts, and `MissingEngine`.
    """
    names = dict.fromkeys(str(registry.read_name(name, "engines", settings=False)) for name in engines)
    paths = list(files) or sorted(path for path in CATALOGUE.iterdir() if path.suffix not in (".obj", ".md"))
    installed = {each.engine for each in list_environments()} | {name for name in LOCAL if find_spec(name)}
    findings: list[FileAnswer] = []
    with ExitStack() as stack:
        folder = Path(stack.enter_context(TemporaryDirectory()))
        models = read_files(paths, folder, search)
        programs = [Program(name) for name in names or [name for name in LOADERS if name in installed]]
        if any(model.kind == "sdf" for model in models) and "drake" in installed:
            reader = next((each for each in programs if each.engine == "drake"), None) or Program("drake")
            stack.callback(reader.worker.close)
            for model in models:
                if model.kind == "sdf" and model.own:
                    model.reader = f"libsdformat in {reader.label}"
                    model.reference, model.reference_refuses = reader.read(model)
        for program in programs:
            stack.callback(program.worker.close)
        for program, model in product(programs, models):
            tell(len(findings) / len(programs) / len(models), f"{program.label}: {model.label}")
            findings.append(program.check(model))
    return findings


def judge_refusal(model: Model, engine: str, words: str) -> tuple[str, str]:
    """Return outcome and words for an engine that refuses a file."""
    if wrong := model.flaw or "; ".join([*model.invalid, *model.bad]):
        return "right", f"it refuses the file ({wrong}): {words}"
    open_ = model.doubt(engine) or model.lonely or (DIGITS if model.truth.excess else "")
    return ("undecided", f"{open_}. It refuses the file: {words}") if open_ else ("refused", words)


def judge_body(model: Model, engine: str, seen: Piece | str, tolerance: float, prints: str = "") -> tuple[str, str]:
    """Return outcome and words for the body that an engine has, or why its motion has none; `prints` is about mass or inertia.

    Nothing is said against an engine if the readers disagree, there is one only, or the file leaves something open.
    """
    wanted, flaw, body = model.truth, model.flaw, seen if isinstance(seen, Piece) else None
    far = errors(wanted, body) if body else dict.fromkeys(QUANTITIES, np.inf)
    if wanted.excess and not flaw:  # within the rounding of its moments
        far["inertia"] -= wanted.rounding / np.abs(wanted.inertia).max()
    differs = [name for name, error in far.items() if not error < tolerance]
    doubt = model.doubt(engine, differs) or (DIGITS if wanted.excess and prints and not flaw else "")
    has = f"it has {describe(body)}" if body else f"{seen}"
    changes = f"(file and engine): {', '.join(differing(wanted, body, tolerance))}" if body else ""
    if not differs and not (flaw or model.disagree or model.invalid):
        return "right", ""
    if body and (asked := model.asked_for(engine, body, tolerance)):
        return "right", f"as the file asks: {asked}"
    if doubt and not (flaw and not differs):
        return "undecided", f"{doubt}; {has}{prints}"
    if flaw:
        broken = body and body.flaw
        said = f"{flaw}, and it changes that {changes}" if body and not broken else f"{flaw}; {has}"
        return "right" if prints and not (differs and broken) else "accepted", f"{said}{prints or ', without a word'}"
    words = (explain(model, body, tolerance) or f"no known mistake explains the difference {changes}") if body else has
    return ("undecided", f"{model.lonely}; {words}{prints}") if model.lonely else ("wrong", f"{words}{prints}")


def find_warning(output: str, names: Sequence[str]) -> str:
    """Return the first sentence of an engine's output about mass or inertia, in brackets; "" if it has none.

    `names` are those of the file, which may have these words.
    """
    for name in sorted(names, key=len, reverse=True):
        output = output.replace(name, "...") if _ABOUT_MASS.search(name) else output
    output = re.sub(r"\x1b?\[[\d;]*m|\[\d{4}-\d\d-\d\d [\d:.]+\] ", "", output)  # colours and times
    said = next(filter(_ABOUT_MASS.search, re.split(r"(?<=[.])\s", output)), "")
    return f" (it prints: {said.strip()[:200]})" if said else ""


_ABOUT_MASS = re.compile(r"(?<![a-z])(inertias?|inertial|mass|masses|moments?)(?![a-z])", re.IGNORECASE)


class Program:
    """The process in which an engine loads files; a name such as "mujoco" or "newton@1.0.0". Raise `MissingEngine`."""

    def __init__(self, name: str) -> None:
        self.engine, wanted, _ = registry.read_name(name, "engines", settings=False)
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
            self.worker, self._adapter = python_worker(memory=MEMORY), loaders.__name__
        else:
            environment = find_environment(self.engine, wanted)
            self.label = f"{self.engine} {environment.version}"
            self.worker = environment.start_worker({"JAX_PLATFORMS": "cpu", "JAX_ENABLE_X64": "1"}, MEMORY)
            self._adapter = str(Path(loaders.__file__).resolve())

    @property
    def tolerance(self) -> float:
        """Largest relative difference of two bodies that are the same."""
        return 1e-2 if self.single else 1e-4

    def read(self, model: Model) -> tuple[Piece | None, str]:
        """Return the body that the engine has after loading a file, or None and why it has none."""
        kind, words, seen, _ = self._measure(model, make_cases(model.truth))
        return seen, "" if seen else words or kind

    def check(self, model: Model) -> FileAnswer:
        """Return the answer of the engine for a body of a file."""
        answer = partial(FileAnswer, self.label, model.label, readers=model.readings(), notes=model.notes)
        kind, words, seen, measured = self._measure(model, cases := make_cases(model.truth))
        bare = replace(model, body=replace(model.body, path=model.body.bare, bare=None)) if model.body.bare else None
        if kind == "refused":
            outcome, words = judge_refusal(model, self.engine, words)
            if outcome == "refused" and bare:
                again = self.check(bare)
                loads = again.outcome not in ("refused", "crashed")
                outcome, words = ("undecided", f"{BARE}, and refuses the file: {words}") if loads else ("refused", again.words)
            return answer(outcome, words)
        if kind != "loaded":
            return answer(kind, words)
        if model.alone(self.engine):
            return answer("", f"it is the reference for this format, and there is no second reader: {model.own_refuses}")
        names = [model.path.name, model.path.stem, *(link.name for link in model.links)]
        why = NOT_FINITE if not np.isfinite(measured).all() else NO_BODY if measured[:, 3:].any() else RIGID
        why = why if measured.any() else HELD
        prints = find_warning(words, names)
        outcome, words = judge_body(model, self.engine, why if seen is None else seen, self.tolerance, prints)
        if seen is None and outcome == "wrong" and bare:  # the file may have a floor that the body touches
            return self.check(bare)
        if seen is None:
            noise = outcome == "wrong" and why == NO_BODY and self.single
            return answer("undecided", f"{words}, in single precision") if noise else answer(outcome, words)
        expected = accelerations(model.truth, cases) if outcome == "right" and not words else measured
        worst = float(np.abs(measured - expected).max() / np.abs(measured).max())
        return answer(outcome, words, {name: np.asarray(value).tolist() for name, value in vars(seen).items()}, worst)

    def _measure(self, model: Model, cases: Array) -> tuple[str, str, Piece | None, Array]:
        """Return "loaded", "refused", "crashed" or "", the engine's words, the body that it has and accelerations (n, 6)."""
        nothing = np.empty((0, 6))
        try:
            result = self._load(model, cases)
        except NotImplementedError as error:
            return "", str(error), None, nothing
        except (EngineCrashed, EngineTimeout) as failure:
            return "crashed", str(failure.outcome), None, nothing
        if result["refused"]:
            return "refused", result["refused"], None, nothing
        measured = result["accelerations"]
        return "loaded", result["output"], self._identify(model, cases, measured, model.truth), measured

    def _identify(self, model: Model, cases: Array, measured: Array, near: Piece) -> Piece | None:
        """Return the body that explains the accelerations, or None if no body does.

        Forces that suit the body of the file may be lost in the round-off of another one, so others are tried as well.
        """
        unit = Piece(1.0, np.zeros(3), np.eye(3))
        for start in (near, unit):
            for again in range(ROUNDS):  # from the body of one round to the forces of the next one
                if start is unit or again:
                    cases = make_cases(start)
                    try:
                        measured = self._load(model, cases).get("accelerations", np.full((1, 6), np.nan))
                    except (EngineCrashed, EngineTimeout):
                        return None
                if not np.isfinite(measured).all():
                    break
                with np.errstate(all="ignore"), suppress(np.linalg.LinAlgError):
                    part = identify(cases, measured, start)
                    residual = np.abs(accelerations(part, cases) - measured).max() / np.abs(measured).max()
                    if residual < self.tolerance and distance(part, start) < 0.5:
                        return part
                    if not residual < 0.5:
                        break
                    start = part
        return None

    def _load(self, model: Model, cases: Array) -> dict[str, Any]:
        """Return the answer of `loaders.probe`, or that of a program to `load` in the same form. Raise as `Worker.ask`."""
        with time_limit(LIMIT):
            result = self._ask(str(model.path.resolve()), model.kind, cases)
        for name in ("refused", "output"):
            result[name] = str(result.get(name, ""))
            for folder in {str(path.parent) for path in (model.path.absolute(), model.path.resolve())} - {"/"}:
                result[name] = re.sub(rf"(?<![\w./-])/?{re.escape(folder)}/(?=[^\s/])", "", result[name])
        return result

    def _ask(self, path: str, kind: str, cases: Array) -> dict[str, Any]:
        if self.formats and kind not in self.formats:
            raise NotImplementedError
        given = {"adapter": self._adapter, "path": path, "kind": kind}
        try:
            if not self.formats:
                return self.worker.ask("call", **given, engine=self.engine, function="probe", cases=cases)
            result = self.worker.ask("load", **given, velocities=cases[:, 0], forces=cases[:, 1])
        except EngineError as error:  # also at the first step
            return {"refused": error.reason}
        try:
            measured = np.asarray(result["accelerations"], float)
        except (TypeError, ValueError):
            measured = np.empty(0)
        if measured.shape != (len(cases), 6):
            raise EngineCrashed(f"its `accelerations` are not numbers ({len(cases)}, 6)")
        return {"accelerations": measured, "output": str(result.get("output", ""))}
