"""Verification of anything: recordings, methods, engines, programs and model files, each by the checks that fit it."""

from __future__ import annotations

import os
import re
import shlex
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import partial
from pathlib import Path
from shutil import which
from typing import TYPE_CHECKING, Any

from conservative import registry
from conservative.check import choice
from conservative.errors import BadInput
from conservative.programs import list_programs
from conservative.scene import Scene

from .finding import CHECKS, Verification
from .recordings.formats import ENDINGS

if TYPE_CHECKING:
    from conservative.method import Method

Tell = Callable[[float, str], object]
"""Called with the share of the work that is done, 0 to 1, and the next piece of it."""


class Kind(StrEnum):
    """Kinds of subjects."""

    RECORDING = "recording"
    METHOD = "method"
    ENGINE = "engine"
    PROGRAM = "program"
    MODEL = "model file"


CHECKS_OF: dict[Kind, tuple[str, ...]] = {
    Kind.RECORDING: ("recording",),
    Kind.METHOD: ("motions", "order", "repeatability", "pairs"),
    Kind.ENGINE: ("motions", "order", "repeatability", "pairs"),
    Kind.PROGRAM: ("protocol", "motions", "order", "repeatability", "pairs", "times"),
    Kind.MODEL: ("links", "bodies"),
}
"""Checks of each kind of subject, in their order."""
MOTION_CHECKS = ("motions", "order", "repeatability")
"""Checks that run exact motions."""
MODELS = (".urdf", ".sdf", ".mjcf", ".xml", ".usd", ".usda", ".usdc", ".usdz")
"""Suffixes of model files."""


@dataclass(frozen=True)
class Subject:
    """A subject as the user wrote it, its kind, its file or None, and whether the user named its folder only."""

    text: str
    kind: Kind
    path: Path | None = None
    in_folder: bool = False


def kind_of(text: str) -> Kind:
    """Return the kind of a subject: a file, the name of a method or an engine, or a program. Raise `BadInput`."""
    path = Path(text)
    if path.is_file():
        if path.suffix.lower() in MODELS:
            return Kind.MODEL
        # Some file systems mark all files as executable, data too.
        return (
            Kind.PROGRAM
            if os.access(path, os.X_OK) and not path.suffix.lower().startswith((".csv", ".json"))
            else Kind.RECORDING
        )
    parts = _words(text)
    if len(parts) > 1 and which(parts[0]):
        return Kind.PROGRAM
    name = registry.read_name(text, "subject") if len(parts) == 1 and not set("/\\") & set(text) else None
    if name is not None and name.base in list_programs():
        return Kind.PROGRAM
    if name is not None and name.base in registry.list_engines():
        return Kind.ENGINE
    if name is not None and name.base in registry.list_methods():
        return Kind.METHOD
    if len(parts) == 1 and which(text):
        return Kind.PROGRAM
    allowed = "a file that exists, the name of an engine, a method or a program, or the command line of a program"
    raise BadInput("subject", repr(text), allowed)


def _words(text: str) -> list[str]:
    try:
        return shlex.split(text)
    except ValueError:
        return [text]


LAYERS = (".usd", ".usda", ".usdc", ".usdz")
"""Suffixes of files that may be parts of other files, so that the folders below a library are not searched for them."""
_WHOLE = {b"robot": b"<link", b"sdf": b"<link", b"mujoco": b"<body"}
"""Root elements of models, and what a whole model has."""


class Role(StrEnum):
    """The role of an XML file in a library of models."""

    MODEL = "model"
    PART = "a part of a model or a template"
    OTHER = "no model"


def role_of(path: Path) -> Role:
    """Return the role of an XML file. A file with the name of a model that is not XML counts as a model that cannot be read."""
    try:
        text = re.sub(rb"<!--.*?-->", b"", path.read_bytes(), flags=re.DOTALL)
    except OSError:
        text = b""
    root = re.search(rb"<(\w+)", text)
    name = root[1] if root else b""
    if name in _WHOLE:
        return Role.MODEL if _WHOLE[name] in text and b"<xacro:" not in text else Role.PART
    if name == b"mujocoinclude":
        return Role.PART
    return Role.OTHER if path.suffix.lower() == ".xml" else Role.MODEL


@dataclass(frozen=True)
class Folder:
    """The recordings and model files of a folder and of the folders below it, and sentences on files that are left out."""

    files: Sequence[Path]
    notes: Sequence[str]


def look_into(folder: Path) -> Folder:
    """Return the files of a folder that are subjects: its recordings and models, and the models in the folders below it.

    XML that is no model is left out, such as the package.xml of a ROS package; in folders below, parts of models and layers of
    USD are, too. Files in folders whose name begins with a dot do not count.
    """
    own = sorted(path for path in folder.iterdir() if path.is_file() and path.name.lower().endswith((*ENDINGS, *MODELS)))
    below = sorted(
        path
        for path in folder.rglob("*")
        if path.parent != folder and path.suffix.lower() in MODELS and path.is_file() and not _is_hidden(path, folder)
    )
    roles = {path: role_of(path) for path in (*own, *below) if path.suffix.lower() in set(MODELS) - set(LAYERS)}
    files = [path for path in own if roles.get(path) is not Role.OTHER]
    files += [path for path in below if roles.get(path) is Role.MODEL]
    left = {
        "other files are not tested, because they are no models": [path for path in roles if roles[path] is Role.OTHER],
        "other files are not tested, because they are parts or templates of models": [
            path for path in below if roles.get(path) is Role.PART
        ],
        "USD files in folders below are not tested, because they may be layers of others": [p for p in below if p not in roles],
    }
    notes = [f"{reason}: {_names(paths, folder)}" for reason, paths in left.items() if paths]
    return Folder(files, notes)


def _is_hidden(path: Path, folder: Path) -> bool:
    return any(part.startswith(".") for part in path.relative_to(folder).parts[:-1])


def _names(paths: Sequence[Path], folder: Path) -> str:
    names = [path.relative_to(folder).as_posix() for path in paths]
    return ", ".join(names[:MOST_NAMES]) + (f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else "")


MOST_NAMES = 20
"""Largest number of names in a sentence."""


def expand(texts: Sequence[str]) -> list[Subject]:
    """Return the subjects of texts. Raise `BadInput`.

    A folder stands for its recordings and model files, by name, and for the model files in the folders below it.
    """
    subjects = []
    for text in texts:
        if (folder := Path(text)).is_dir():
            files = look_into(folder).files
            if not files:
                allowed = f"a folder with files that end in {', '.join((*ENDINGS, *MODELS))}"
                raise BadInput("subject", f"the folder {text!r}", allowed)
            kinds = [Kind.MODEL if path.suffix.lower() in MODELS else Kind.RECORDING for path in files]
            subjects += [Subject(str(path), kind, path, in_folder=True) for path, kind in zip(files, kinds, strict=True)]
        else:
            kind = kind_of(text)
            subjects.append(Subject(text, kind, Path(text) if kind in (Kind.RECORDING, Kind.MODEL) else None))
    return subjects


def _leave_out(subjects: Sequence[Subject], only: Sequence[str], body: object) -> tuple[list[Subject], list[str]]:
    """Return the subjects without files of folders that no check uses, and sentences on these.

    In a folder of models, files that the user did not name are left out: of a kind for which `only` has no check, and, without
    a body, those that are no recordings, such as CMakeLists.txt.
    """
    if not any(subject.kind is Kind.MODEL for subject in subjects):
        return list(subjects), []
    kept, unchecked, others = list[Subject](), list[str](), list[str]()
    for subject in subjects:
        if not subject.in_folder or not subject.path:
            kept.append(subject)
        elif only and not set(only) & set(CHECKS_OF[subject.kind]):
            unchecked.append(subject.path.name)
        elif subject.kind is Kind.RECORDING and body is None and not _is_recording(subject.path):
            others.append(subject.path.name)
        else:
            kept.append(subject)
    left = {f"other files are not tested, because --only {','.join(only)} has no check for them": unchecked}
    left["other files are not tested, because they are neither models nor recordings"] = others
    notes = [f"{reason}: {', '.join(names[:MOST_NAMES])}" for reason, names in left.items() if names]
    return kept, notes


def _is_recording(path: Path) -> bool:
    """Return True if a file has a table with the time and three rates at least."""
    from .recordings.formats import open_table

    try:
        return len(open_table(path).names) >= 4
    except BadInput:
        return False


def verify(
    subjects: str | os.PathLike[str] | Method | Sequence[str | os.PathLike[str] | Method],
    body: str | os.PathLike[str] | Scene | None = None,
    *,
    engines: str | Sequence[str] = (),
    only: str | Sequence[str] = (),
    pairs: str | Sequence[str] = (),
    search: Sequence[Path] = (),
    start: str = "row",
    error: float | None = None,
    rates: str | None = None,
    seed: int | None = None,
    record: str | os.PathLike[str] | None = None,
    known: str | os.PathLike[str] | None = None,
    tell: Tell = lambda share, what: None,
    **reading: Any,
) -> list[Verification]:
    """Verify subjects, and name the mistakes that explain what is wrong.

    Parameters
    ----------
    subjects
        Files of recorded motions, names of methods, engines or programs, command lines of programs, model files, folders of
        files, or methods themselves. Two recordings are also compared with each other.
    body
        Scene, its name or its file, for recordings. Two recordings of a body that rotates freely can do without one: its
        inertia is fitted to them, up to a factor.
    engines
        Engines that load model files; by default those that are installed. Without one, only links are checked.
    only
        Names of checks, see `finding.CHECKS`; by default all that fit a subject.
    pairs
        Names of pairs of descriptions; by default all.
    search
        Folders of meshes and packages, for model files.
    start, error, rates, **reading
        For recordings: "row" or "scene", the allowed error, "body" or "world" for the axes of rates, and the other options of
        `recordings.table.Options`.
    seed
        For methods, engines and programs: the fresh motions of this seed instead of the published ones.
    record
        File of known errors to write (`known`): all errors of this run are known. A file of another kind is not replaced.
    known
        File of known errors to compare with: the `standing` of each finding is known, new or better.
    tell
        Called with the share of the work that is done and the next piece of it.

    Returns
    -------
    list of Verification
        One for each subject; one for two recordings.

    Raises
    ------
    BadInput
        A subject, a body or an option is unknown, or an option is not used by any subject. Or a file of known errors has
        another form, other subjects or other settings, or a subject that does not run would be recorded.
    MissingEngine
        An engine is not installed.
    NotWritten
        The file of known errors cannot be written.
    """
    listed = [subjects] if isinstance(subjects, str | os.PathLike) or not isinstance(subjects, Sequence) else list(subjects)
    if not listed:
        raise BadInput("subjects", "an empty list", "a path, a name, a method, or a list of them")
    methods: list[Any] = [subject for subject in listed if not isinstance(subject, str | os.PathLike)]
    for subject in methods:
        from conservative.method import Method  # here: recordings need no kernels

        if not isinstance(subject, Method):
            raise BadInput("subjects", repr(subject), "a path, a name, a method, or a list of them")
    engines, only, pairs = ([names] if isinstance(names, str) else names for names in (engines, only, pairs))
    choice("start", start, ("row", "scene"))
    if rates is not None:
        choice("rates", rates, ("body", "world"))
        reading["world"] = rates == "world"
    paths = [os.fspath(subject) for subject in listed if isinstance(subject, str | os.PathLike)]
    expanded = expand(paths)
    for name in only:
        choice("only", name, tuple(CHECKS))
    expanded, notes = _leave_out(expanded, only, body)
    notes += [note for path in map(Path, paths) if path.is_dir() for note in look_into(path).notes]
    kinds = {subject.kind for subject in expanded} | ({Kind.METHOD} if methods else set())
    begin = None if start == "row" else start
    _refuse_unused(
        kinds, body=body, engines=engines, search=search, pairs=pairs, start=begin, error=error, seed=seed, **reading
    )
    if unused := set(only) - {check for kind in kinds for check in CHECKS_OF[kind]}:
        allowed = ", ".join(dict.fromkeys(check for kind in kinds for check in CHECKS_OF[kind]))
        raise BadInput("only", repr(sorted(unused)[0]), f"checks of {' and '.join(sorted(kinds))}: {allowed}")
    _refuse_left_out(only, bodies=("engines", engines), pairs=("pairs", pairs))
    require_motions(seed, only, record or known)
    from . import known as known_errors  # here: most commands have no such file

    with known_errors.comparing(record, known, only, bool(pairs)) as compare:
        folders = [*search, *_packages(listed)]
        verified = _verify_all(expanded, methods, body, engines, only, pairs, folders, start, error, seed, tell, reading)
        return compare(_with_notes(verified, notes))


def _is_folder(subject: Any) -> bool:
    return isinstance(subject, str | os.PathLike) and Path(subject).is_dir()


def _with_notes(verifications: Sequence[Verification], notes: Sequence[str]) -> list[Verification]:
    """Return verifications, the first one of them with notes on files that are left out."""
    if not verifications:
        return []
    first, *others = verifications
    return [replace(first, notes=(*first.notes, *notes)) if notes else first, *others]


def _verify_all(
    expanded: Sequence[Subject],
    methods: Sequence[Method],
    body: str | os.PathLike[str] | Scene | None,
    engines: Sequence[str],
    only: Sequence[str],
    pairs: Sequence[str],
    search: Sequence[Path],
    start: str,
    error: float | None,
    seed: int | None,
    tell: Tell,
    reading: Mapping[str, Any],
) -> list[Verification]:
    results: list[Verification] = []
    if files := [subject.path for subject in expanded if subject.kind is Kind.MODEL and subject.path]:
        from .bodies import verify_models

        checks = [check for check in CHECKS_OF[Kind.MODEL] if not only or check in only]
        results += verify_models(files, checks, engines, tell, search)
    recordings = [subject for subject in expanded if subject.kind is Kind.RECORDING]
    if tables := [recording.path for recording in recordings if recording.path]:
        together = len(tables) == 2 and not any(recording.in_folder for recording in recordings)
        results += _verify_recordings(tables, together, body, start, error, tell, reading)
    for subject in expanded:
        if subject.kind is Kind.PROGRAM:
            results += _verify_program(subject.text, only, pairs, tell, seed)
        elif subject.kind in (Kind.ENGINE, Kind.METHOD):
            from ..studies.selection import methods as select  # here: recordings need no kernels

            results += [_verify_method(method, subject.kind, only, pairs, tell, seed) for method in select([subject.text])]
    return results + [_verify_method(method, Kind.METHOD, only, pairs, tell, seed) for method in methods]


def _packages(subjects: Sequence[Any]) -> list[Path]:
    """Return the folders that are subjects, and the folders of ROS packages in them, for `package://`."""
    folders = [Path(text) for text in subjects if _is_folder(text)]
    inside = [file.parent.parent for folder in folders for file in sorted(folder.rglob("package.xml")) if file.parent != folder]
    return list(dict.fromkeys([*folders, *inside]))


def require_motions(seed: int | None, only: Sequence[str], known: str | os.PathLike[str] | None) -> None:
    """Raise `BadInput` for a seed that is not one, that no check uses, or that is given with a file of known errors."""
    if seed is None:
        return
    if only and not set(only) & set(MOTION_CHECKS):
        raise BadInput("seed", f"{seed!r} without a check by motions", f"{', '.join(MOTION_CHECKS)} in --only, or no --only")
    if known is not None:
        raise BadInput("seed", f"{seed!r} and known errors, which are of the published motions", "one of them")
    from .motions.search import require_seed  # here: recordings need no kernels

    require_seed(seed)


def _verify_method(
    method: Method, kind: Kind, only: Sequence[str], pairs: Sequence[str], tell: Tell, seed: int | None
) -> Verification:
    from .programs import verify_method

    return verify_method(
        method, kind, [check for check in CHECKS_OF[kind] if not only or check in only], pairs, tell, seed=seed
    )


def _verify_program(
    text: str, only: Sequence[str], pairs: Sequence[str], tell: Tell, seed: int | None
) -> Iterator[Verification]:
    """Yield the verification of a program with each of its settings; the protocol and the times are verified once."""
    from conservative.references.environments.programs import UnusableProgram, find_program, read_program

    from ..studies.selection import methods as select
    from .programs import verify_program

    checks = [check for check in CHECKS_OF[Kind.PROGRAM] if not only or check in only]
    program = find_program(text.partition(":")[0])
    if program is None:  # the command line of a program that is not registered
        yield verify_program(text, read_program(text, "program"), checks, pairs, tell, seed=seed)
        return
    try:
        first, *others = list[Any](select([text]))
    except UnusableProgram:  # it becomes a finding
        yield verify_program(text, program, checks, pairs, tell, seed=seed)
        return
    rest = [check for check in CHECKS_OF[Kind.METHOD] if check in checks]
    others = others if rest else []
    yield verify_program(first.name if others else text, program, checks, pairs, tell, first, seed)
    for method in others:
        yield _verify_method(method, Kind.PROGRAM, rest, pairs, tell, seed)


def _verify_recordings(
    files: Sequence[Path],
    together: bool,
    body: str | os.PathLike[str] | Scene | None,
    start: str,
    error: float | None,
    tell: Tell,
    reading: Mapping[str, Any],
) -> Iterator[Verification]:
    """Yield the verification of each recording, or of two together, which are also compared with each other."""
    from .recordings import table, verdict
    from .recordings.layout import Options

    if together and files[0].samefile(files[1]):
        raise BadInput("subjects", f"the file {str(files[0])!r} twice", "two recordings, or one")
    if body is None and not together:
        allowed = (
            "the scene of the recordings, by its name or file. Two files without a folder can also be compared without one"
        )
        raise BadInput("body", "no body", allowed)
    if body is None and start != "row":
        raise BadInput("start", "'scene' without a body", "row, or a body")
    from_row = start == "row"
    read = table.read_all(files, Options(**reading))
    recordings = [(path.name, recording) for path, recording in zip(files, read, strict=True)]
    if body is None:
        from .recordings.two_alone import verify_two_alone

        yield verify_two_alone(recordings[0], recordings[1], error, partial(tell, 0.0))
        return
    scene = body if isinstance(body, Scene) else registry.scene(os.fspath(body))
    if together:
        from .recordings.two import verify_two

        first, second = recordings
        yield verify_two(scene, first, second, from_row, error, partial(tell, 0.0))
        return
    for name, recording in recordings:
        yield verdict.verify_recording(scene, recording, from_row, error, partial(tell, 0.0), name)


USED_BY: dict[str, tuple[Kind, ...]] = {
    "engines": (Kind.MODEL,),
    "search": (Kind.MODEL,),
    "pairs": (Kind.METHOD, Kind.ENGINE, Kind.PROGRAM),
    "seed": (Kind.METHOD, Kind.ENGINE, Kind.PROGRAM),
}
"""Kinds of subjects that use an option; all others are of recordings."""


def _refuse_unused(kinds: set[Kind], **options: Any) -> None:
    for name, value in options.items():
        users = USED_BY.get(name, (Kind.RECORDING,))
        if value not in (None, (), [], "") and not kinds & set(users):
            raise BadInput(name, "an option that no subject uses", f"a subject that is a {' or a '.join(users)}")


def _refuse_left_out(only: Sequence[str], **options: tuple[str, Sequence[str]]) -> None:
    """Raise `BadInput` for an option with names that belongs to a check, by the name of the check, which is left out."""
    for check, (name, names) in options.items():
        if names and only and check not in only:
            got = f"{', '.join(names)!r} without the check of {check}"
            raise BadInput(name, got, f"{check} in --only, or no --only")
