"""A version of a project (a git ref, a folder or a wheel) or a release of an engine, and its environment."""

from __future__ import annotations

import hashlib
import io
import shutil
import subprocess
import tarfile
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from conservative.errors import BadInput
from conservative.programs import project_file, read_programs
from conservative.references.environments.environment import Environment
from conservative.references.environments.kind import Source
from conservative.references.environments.projects import build_project, environment_of, keep_wheel
from conservative.references.worker.calls import python_worker
from conservative.references.worker.client import Worker
from conservative.version import VERSION

from ..measures.origin import commit, commit_title, git

_ALLOWED = "a git ref of the project's repository, a wheel, or a folder with pyproject.toml or setup.py"


@dataclass(frozen=True)
class Version:
    """A version of a project or of an engine, and the environment in which it runs.

    `name` is the ref, the release, or the name of the folder or of the wheel. `commit` has "+changes" for a folder with changes
    that are not committed, and is "" for a wheel or a release. `pushed` is its short hash and its subject.
    """

    name: str
    commit: str
    environment: Environment
    pushed: str = ""

    @property
    def packages(self) -> tuple[str, ...]:
        """Installed packages, as `name==version` or the file of a wheel."""
        return tuple(text.rpartition("/")[2] for text in self.environment.packages)

    @property
    def headline(self) -> str:
        """Name in headings: the commit of its author, if it has one."""
        return self.pushed or self.title

    @property
    def title(self) -> str:
        """Name in tables."""
        head, plus, changes = self.commit.partition("+")
        return f"{self.name} ({head[:9]}{plus}{changes})" if head and self.name[:9] != head[:9] else self.name


def install_version(name: str, project: Path, source: Source, requirements: Sequence[str] = ()) -> Version:
    """Return a version, and make its environment if it does not exist.

    Parameters
    ----------
    name
        A wheel, a folder of sources, or a ref of the git repository that the project is in.
    project
        Folder of the project, which need not be the top of its repository.
    source, requirements
        Source of packages, and additional ones for its environment.

    Raises
    ------
    BadInput
        There is no such version, it does not build, or a package that it needs is not available.
    """
    path = Path(name)
    if path.suffix == ".whl" and path.is_file():
        return Version(path.name, "", environment_of(keep_wheel("", lambda folder: path), requirements, source))
    if name and path.is_dir():
        environment = environment_of(keep_wheel("", build_project(path, source)), requirements, source)
        here = commit(path, mark_changes=True)
        return Version(path.resolve().name, here, environment, commit_title(path, here))
    commit_hash = _find_commit(name, project)
    environment = environment_of(_wheel_of_commit(commit_hash, project, source), requirements, source)
    return Version(name, commit_hash, environment, commit_title(project, commit_hash))


def _wheel_of_commit(commit_hash: str, project: Path, source: Source) -> Path:
    """Return the wheel of a commit: a stored one, or a new one built from the files of the commit."""
    inside = git(project, "rev-parse", "--show-prefix")

    def make_wheel(folder: Path) -> Path:
        sources = _take_out(commit_hash, project, folder / "sources")
        # setuptools-scm, and tools built on it, would look for a version in a repository
        return build_project(sources, source, SETUPTOOLS_SCM_PRETEND_VERSION=f"0+g{commit_hash[:12]}")(folder)

    return keep_wheel(f"{commit_hash}{'-' + hashlib.sha256(inside.encode()).hexdigest()[:8] if inside else ''}", make_wheel)


def _find_commit(name: str, project: Path) -> str:
    commit_hash = git(project, "rev-parse", "--verify", "--quiet", "--end-of-options", f"{name}^{{commit}}")
    if not commit_hash:
        raise BadInput("against", repr(name), _ALLOWED)
    return commit_hash


def _take_out(commit_hash: str, project: Path, folder: Path) -> Path:
    """Put the files of a commit into a folder, and return the folder of the project, which need not be at the top."""
    archive = ["git", "-C", git(project, "rev-parse", "--show-toplevel"), "archive", "--format=tar", commit_hash]
    try:
        done = subprocess.run(archive, capture_output=True, check=True, timeout=600)
    except (OSError, subprocess.SubprocessError) as error:
        raise BadInput("against", f"{commit_hash}, which git cannot take out ({type(error).__name__})", _ALLOWED) from None
    with tarfile.open(fileobj=io.BytesIO(done.stdout)) as files:
        if hasattr(tarfile, "data_filter"):  # not before 3.11.4
            files.extraction_filter = tarfile.data_filter
        files.extractall(folder)
    return folder / git(project, "rev-parse", "--show-prefix")


class Checkout(Environment):
    """A folder in which a project in any language was built. Its file names the programs that this package runs."""

    def start_worker(self, variables: Mapping[str, str] | None = None, memory: int = 0) -> Worker:
        return python_worker({"CONSERVATIVE_PROJECT": str(self.folder)}, memory)

    def programs(self) -> dict[str, tuple[str, ...]]:
        """Return the hashes of the files in the command line of each program."""
        programs = read_programs(self.folder / "conservative.toml").values()
        files = {program.name: [Path(word) for word in program.words if Path(word).is_file()] for program in programs}
        return {name: tuple(hashlib.sha256(file.read_bytes()).hexdigest() for file in parts) for name, parts in files.items()}


def build_version(name: str, command: str, folder: Path) -> Version:
    """Return a version of the programs of a project, which a shell command builds: in its own folder, or a commit in `folder`.

    Raises
    ------
    BadInput
        There is no such version, or the command fails.
    """
    project, place, key = project_file().parent, Path(name).resolve(), ""
    if not place.is_dir():
        key = _find_commit(name, project)
        place = _take_out(key, project, Path(tempfile.mkdtemp(dir=folder)))
    done = subprocess.run(command, shell=True, cwd=place, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode:
        last = (done.stdout.split("\n")[-2:] or [""])[0]
        got = f"{command!r}, which ends with exit code {done.returncode} for {name} ({last})"
        raise BadInput("build", got, "a command that builds each version")
    if not (place / "conservative.toml").exists():  # a version from before the programs were registered
        shutil.copy(project_file(), place)
    environment = Checkout("conservative", VERSION, place, "", ())
    commit_hash = key or commit(place, mark_changes=True)
    return Version(name if key else place.name, commit_hash, environment, commit_title(project, commit_hash))
