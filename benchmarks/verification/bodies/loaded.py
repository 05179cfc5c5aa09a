"""Verification of model files: engines load them, and the body that each has is compared with the body of the file."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, replace
from enum import Enum
from importlib.util import find_spec
from itertools import groupby
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np

from conservative import registry
from conservative.attitude import Array
from conservative.check import choice
from conservative.errors import BadInput
from conservative.programs import list_programs
from conservative.references.engine import version
from conservative.references.environments.environment import find_environment, list_environments
from conservative.references.model_files import loaders
from conservative.references.model_files.loaders import LOADERS, family
from conservative.references.model_files.pieces import QUANTITIES, Piece, differing, distance, errors
from conservative.references.model_files.readers import DIGITS, Model, read_files
from conservative.references.worker.calls import python_worker
from conservative.references.worker.client import EngineCrashed, EngineError, EngineTimeout, time_limit

from ..finding import Cause, Finding, Verdict, Verification
from .explain import find_causes
from .identify import accelerations, describe, identify, make_cases

LOCAL = {"mujoco": ("mujoco", "MuJoCo"), "pinocchio": ("pin", "Pinocchio")}
"""Engines that run in this interpreter if no version is named: package and name."""
SINGLE = ("mjwarp", "newton", "sapien", "genesis")
"""Engines in single precision."""
OTHERS = ("mujoco_js",)
"""Engines of this package whose program loads files itself, as programs of users do."""
LIMIT, MEMORY = 300.0, 2**33
"""Time in seconds and memory in bytes that a loader may take."""
ROUNDS = 4
"""Largest number of loads by which forces are adapted to the body that an engine has."""
CATALOGUE = Path(loaders.__file__).parent / "models"


class Answer(Enum):
    """The answer of an engine to a file."""

    LOADED = "loaded"
    REFUSED = "refused"
    CRASHED = "crashed"
    UNSUPPORTED = "no loader"


class NoBody(Enum):
    """Why no body has these accelerations."""

    NOT_FINITE = "accelerations that are not finite"
    NOT_RIGID = "its accelerations are those of no rigid body"
    RIGID = "no force or torque turns it, as if its inertia were infinite"
    HELD = "no force moves it: the engine holds the body, or has no mass for it"


class Opinion(NamedTuple):
    """A verdict with its reason, the mistakes that explain it, and the relative error of a body that was compared."""

    verdict: Verdict
    detail: str = ""
    causes: tuple[Cause, ...] = ()
    error: float = math.nan


class Loaded(NamedTuple):
    """The answer of an engine, its output or the reason of its refusal, and the body that it has, or why it has none."""

    answer: Answer
    text: str = ""
    seen: Piece | NoBody = NoBody.HELD


@dataclass(frozen=True)
class LoadedBody:
    """The details of a finding: a body by the readers of its file, the reference reader first, and in an engine.

    A reading is a dictionary of mass, kg, centre of mass, m, and inertia, kg m^2, or why a reader has none. `flaw` says why no
    body can be like the body of the file. `engine` is its name without a version.
    """

    subject: str
    case: str
    readings: dict[str, Any]
    flaw: str = ""
    seen: dict[str, Any] | None = None
    engine: str = ""


def verify_files(
    files: Sequence[Path] = (),
    engines: Sequence[str] = (),
    tell: Callable[[float, str], object] = lambda share, what: None,
    search: Sequence[Path] = (),
) -> list[Verification]:
    """Return a verification for each model file (URDF, SDF, MJCF or USD), with a finding for each engine and body.

    Each link of a robot is a body of its own. The details of a verification are a `LoadedBody` for each finding.

    Parameters
    ----------
    files
        By default the small models of this package, each with one trap.
    engines
        Names of engines or programs, with a version or not; by default the installed engines that have a loader.
    tell
        Is called with the share that is done and the next step.
    search
        Folders of meshes and packages, in addition to the folder of the file.

    Raises
    ------
    BadInput
        A file cannot be read, before any engine starts; or an engine is unknown, or a program does not load files.
    MissingEngine
        An engine is not installed.
    """
    names = dict.fromkeys(str(registry.read_name(name, "engines", settings=False)) for name in engines)
    paths = list(dict.fromkeys(files)) or sorted(path for path in CATALOGUE.iterdir() if path.suffix not in (".obj", ".md"))
    installed = installed_loaders()
    with ExitStack() as stack:
        folder = Path(stack.enter_context(TemporaryDirectory()))
        models = read_files(paths, folder, search)
        programs = [Program(name) for name in names or [name for name in LOADERS if name in installed]]
        for program in programs:
            stack.callback(program.worker.close)
        if any(model.kind == "sdf" for model in models) and "drake" in installed:
            reader = next((program for program in programs if program.engine == "drake"), None) or Program("drake")
            stack.callback(reader.worker.close)
            for model in models:
                if model.kind == "sdf" and model.own:
                    model.reader = f"libsdformat in {reader.label}"
                    model.reference, model.reference_refuses = reader.read(model)
        loaded: dict[str, list[tuple[Finding, LoadedBody]]] = {model.label: [] for model in models}
        for number, program in enumerate(programs):
            for done, model in enumerate(models):
                tell((number + done / len(models)) / len(programs), f"{program.label}: {model.label}")
                loaded[model.label].append(program.check(model))
        loaded = {model.label: weigh_votes(model, loaded[model.label]) for model in models}
    return [_join(file, list(same), loaded) for file, same in groupby(models, key=lambda model: model.file)]


def installed_loaders() -> set[str]:
    """Return the names of the installed engines that have a loader."""
    installed = {environment.engine for environment in list_environments()} | {name for name in LOCAL if find_spec(name)}
    return installed.intersection(LOADERS)


def _join(file: str, models: list[Model], loaded: dict[str, list[tuple[Finding, LoadedBody]]]) -> Verification:
    """Return the verification of a file from the verifications of its bodies."""
    pairs = [pair for model in models for pair in loaded[model.label]]
    notes = [note if len(models) == 1 else f"{model.body.name}: {note}" for model in models for note in model.notes]
    findings = [finding for finding, _ in pairs]
    tested = [finding for finding in findings if finding.verdict is not Verdict.NOT_TESTED]
    right = sum(finding.verdict is Verdict.RIGHT for finding in tested)
    wrong = dict.fromkeys(finding.subject for finding in tested if finding.verdict is Verdict.WRONG)
    reason = f"{right} of {len(tested)} answers of engines are right" if tested else "no engine loads files of this format"
    reason += f"; wrong in {', '.join(wrong)}" * bool(wrong)
    details = tuple(body for _, body in pairs)
    return Verification(file, "model file", tuple(findings), reason, tuple(dict.fromkeys(notes)), details)


def weigh_votes(model: Model, pairs: Sequence[tuple[Finding, LoadedBody]]) -> list[tuple[Finding, LoadedBody]]:
    """Return findings and details for a body, undecided instead of wrong where engines of different families agree.

    They agree if they have the same body within the tolerance of the less exact one, and no known mistake without a number
    explains it. Engines that read a format with the same parser are of one family (`loaders.FAMILIES`).
    """

    def unexplained(finding: Finding) -> bool:
        explained = any(not cause.numbers for cause in finding.causes)
        return finding.verdict is Verdict.WRONG and not (explained or model.flaw)

    against = [(finding, _piece(body.seen)) for finding, body in pairs if body.seen and unexplained(finding)]
    kinds = {finding.subject: family(body.engine, model.kind) for finding, body in pairs}
    votes: dict[str, list[str]] = {finding.subject: [] for finding, _ in against}
    for finding, seen in against:
        for other, its in against:
            same = distance(seen, its) < max(finding.allowed, other.allowed)
            if same and kinds[finding.subject] != kinds[other.subject]:
                votes[finding.subject].append(other.subject)

    def revise(finding: Finding) -> Finding:
        if not (others := votes.get(finding.subject)):
            return finding
        with_it = f"{', '.join(others)} {'has' if len(others) == 1 else 'have'} the same body, by another parser"
        return replace(
            finding, verdict=Verdict.UNDECIDED, detail=f"{with_it}, and both readers have another one; {finding.detail}"
        )

    return [(revise(finding), body) for finding, body in pairs]


def _piece(seen: dict[str, Any]) -> Piece:
    """Return the body in the details of a finding."""
    return Piece(seen["mass"], np.asarray(seen["com"]), np.asarray(seen["inertia"]))


def decide_refusal(model: Model, engine: str, reason: str) -> Opinion:
    """Return the verdict on an engine that refuses a file for a reason."""
    if wrong := model.flaw or "; ".join([*model.invalid, *model.bad]):
        return Opinion(Verdict.RIGHT, f"it refuses the file ({wrong}): {reason}")
    if open_ := model.doubt(engine) or model.lonely or (DIGITS if model.truth.excess else ""):
        return Opinion(Verdict.UNDECIDED, f"{open_}. It refuses the file: {reason}")
    return Opinion(Verdict.WRONG, f"it refuses a valid file: {reason}")


def decide_body(model: Model, engine: str, seen: Piece | NoBody, tolerance: float, prints: str = "") -> Opinion:
    """Return the verdict on the body that an engine has, or on its absence; it `prints` a sentence about mass or inertia.

    Nothing is said against an engine if the readers disagree, there is one only, or the file leaves something open.
    """
    wanted, flaw, body = model.truth, model.flaw, seen if isinstance(seen, Piece) else None
    far = errors(wanted, body) if body else dict.fromkeys(QUANTITIES, np.inf)
    if wanted.excess and not flaw:  # within the rounding of its moments
        far["inertia"] -= wanted.rounding / np.abs(wanted.inertia).max()
    differs = [name for name, distance in far.items() if not distance < tolerance]
    error = max(0.0, *far.values())
    doubt = model.doubt(engine, differs) or (DIGITS if wanted.excess and prints and not flaw else "")
    has = seen.value if isinstance(seen, NoBody) else f"it has {describe(seen)}"
    changes = f"in file and engine: {', '.join(differing(wanted, body, tolerance))}" if body else ""
    printed = f" (it prints: {prints})" if prints else ""
    if not differs and not (flaw or model.disagree or model.invalid):
        return Opinion(Verdict.RIGHT, error=error)
    if body and (options := model.asked_for(engine, body, tolerance)):
        return Opinion(Verdict.RIGHT, f"as the file asks: {options}")
    if doubt and not (flaw and not differs):
        return Opinion(Verdict.UNDECIDED, f"{doubt}; {has}{printed}")
    if flaw:
        impossible = body and body.flaw
        text = f"{flaw}, and it changes the body; {changes}" if body and not impossible else f"{flaw}; {has}"
        if prints and not (differs and impossible):  # a warning is enough, unless another impossible body follows it
            return Opinion(Verdict.RIGHT, f"{text}{printed}")
        warning = "" if prints else " without a warning"
        return Opinion(Verdict.WRONG, f"it accepts an impossible body{warning}: {text}{printed}")
    causes = find_causes(model.links, body, tolerance) if body else ()
    text = has if body is None else changes if causes else f"no known mistake explains the difference; {changes}"
    if model.lonely:
        return Opinion(Verdict.UNDECIDED, f"{model.lonely}; {text}{printed}", causes)
    return Opinion(Verdict.WRONG, f"{text}{printed}", causes, error)


def find_warning(output: str, names: Sequence[str]) -> str:
    """Return the first sentence of an engine's output about mass or inertia; "" if it has none.

    `names` are the names in the file, which may contain these words.
    """
    for name in sorted(names, key=len, reverse=True):
        output = output.replace(name, "...") if _ABOUT_MASS.search(name) else output
    output = re.sub(r"\x1b?\[[\d;]*m|\[\d{4}-\d\d-\d\d [\d:.]+\] ", "", output)  # colours and times
    return next(filter(_ABOUT_MASS.search, re.split(r"(?<=[.])\s", output)), "").strip()[:200]


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
        loaded = self._measure(model)
        if isinstance(loaded.seen, Piece):
            return loaded.seen, ""
        return None, (loaded.text or loaded.seen.value) if loaded.answer is not Answer.CRASHED else "it crashes"

    def check(self, model: Model) -> tuple[Finding, LoadedBody]:
        """Return the finding on the engine and a body of a file, and its details."""
        loaded, opinion = self._verify(model)
        seen = (
            {name: np.asarray(value).tolist() for name, value in vars(loaded.seen).items()}
            if isinstance(loaded.seen, Piece)
            else None
        )
        compared = math.isfinite(opinion.error)
        finding = Finding(
            self.label,
            "bodies",
            model.label,
            opinion.verdict,
            opinion.error,
            self.tolerance if compared else math.nan,
            "relative",
            ("single precision" if self.single else "double precision") if compared else "",
            opinion.causes,
            opinion.detail,
        )
        return finding, LoadedBody(self.label, model.label, model.readings(), model.flaw, seen, self.engine)

    def _verify(self, model: Model) -> tuple[Loaded, Opinion]:
        """Return the answer of the engine and the verdict. After a wrong one, a copy that has nothing but the mass is tried.

        What the engine does not accept may be a visual, a sensor or a floor of the file, which say nothing about its loader.
        """
        loaded = self._measure(model)
        opinion = self._decide(model, loaded)
        if opinion.verdict is Verdict.WRONG and model.body.bare and loaded.answer is not Answer.CRASHED:
            bare = replace(model, body=replace(model.body, path=model.body.bare, bare=None))
            if loaded.answer is Answer.REFUSED:
                again = self._verify(bare)
                if again[0].answer is not Answer.LOADED:
                    return again
                copy = "it loads a copy without visuals, sensors and all else beside the mass"
                return loaded, Opinion(Verdict.UNDECIDED, f"{copy}, and refuses the file: {loaded.text}")
            if isinstance(loaded.seen, NoBody):  # the body may touch a floor of the file
                return self._verify(bare)
        # Rounding to single precision can hide a body with very different moments.
        if opinion.verdict is Verdict.WRONG and loaded.seen is NoBody.NOT_RIGID and self.single:
            return loaded, Opinion(Verdict.UNDECIDED, f"{opinion.detail}, in single precision")
        return loaded, opinion

    def _decide(self, model: Model, loaded: Loaded) -> Opinion:
        if loaded.answer is Answer.UNSUPPORTED:
            return Opinion(Verdict.NOT_TESTED, loaded.text)
        if loaded.answer is Answer.CRASHED:
            return Opinion(Verdict.WRONG, loaded.text)
        if loaded.answer is Answer.REFUSED:
            return decide_refusal(model, self.engine, loaded.text)
        if model.alone(self.engine):
            alone = "it is the reference for this format, and there is no second reader"
            return Opinion(Verdict.NOT_TESTED, f"{alone}: {model.own_refuses}")
        names = [model.path.name, model.path.stem, *(link.name for link in model.links)]
        return decide_body(model, self.engine, loaded.seen, self.tolerance, find_warning(loaded.text, names))

    def _measure(self, model: Model) -> Loaded:
        cases = make_cases(model.truth)
        try:
            result = self._load(model, cases)
        except NotImplementedError as error:
            return Loaded(Answer.UNSUPPORTED, str(error))
        except (EngineCrashed, EngineTimeout) as failure:
            return Loaded(Answer.CRASHED, str(failure.outcome))
        if result["refused"]:
            return Loaded(Answer.REFUSED, result["refused"])
        measured = result["accelerations"]
        if seen := self._identify(model, cases, measured, model.truth):
            return Loaded(Answer.LOADED, result["output"], seen)
        if not measured.any():
            return Loaded(Answer.LOADED, result["output"], NoBody.HELD)
        if not np.isfinite(measured).all():
            return Loaded(Answer.LOADED, result["output"], NoBody.NOT_FINITE)
        return Loaded(Answer.LOADED, result["output"], NoBody.NOT_RIGID if measured[:, 3:].any() else NoBody.RIGID)

    def _identify(self, model: Model, cases: Array, measured: Array, near: Piece) -> Piece | None:
        """Return the body that explains the accelerations, or None if no body does.

        The forces suit the body of the file. In an engine with a very different body, their effect is lost in round-off. Then
        the forces for a unit body are tried, and each result gives the forces for the next load.
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
        """Return the answer of `loaders.probe`, or a program's answer to `load` in the same form. Raise as `Worker.ask`.

        The folder of the file is removed from its texts: findings do not depend on where a file is.
        """
        with time_limit(LIMIT):
            result = self._ask(str(model.path.resolve()), model.kind, cases)
        for name in ("refused", "output"):
            result[name] = str(result.get(name, ""))
            for folder in {str(path.parent) for path in (model.path.absolute(), model.path.resolve())} - {"/"}:
                result[name] = re.sub(rf"(?<![\w./-])/?{re.escape(folder)}/(?=[^\s/])", "", result[name])
        return result

    def _ask(self, path: str, kind: str, cases: Array) -> dict[str, Any]:
        if self.formats and kind not in self.formats:
            raise NotImplementedError(f"no loader for {kind.upper()}")
        request = {"adapter": self._adapter, "path": path, "kind": kind}
        try:
            if not self.formats:
                return self.worker.ask("call", **request, engine=self.engine, function="probe", cases=cases)
            result = self.worker.ask("load", **request, velocities=cases[:, 0], forces=cases[:, 1])
        except EngineError as error:  # it can also fail at the first step
            return {"refused": error.reason}
        try:
            measured = np.asarray(result["accelerations"], float)
        except (TypeError, ValueError):
            measured = np.empty(0)
        if measured.shape != (len(cases), 6):
            raise EngineCrashed(f"its `accelerations` are not numbers ({len(cases)}, 6)")
        return {"accelerations": measured, "output": str(result.get("output", ""))}
