"""Run the scripts in the interpreters that have the engines, and compare what they print with the rows."""

from __future__ import annotations

import datetime
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

from ..environments.environment import Environment, list_environments
from ..environments.kind import version_key
from ..environments.npm import find_program
from ..environments.pip import interpreter_of
from .rows import VERDICTS, Accusation, Result, read_accusations

LOCAL = {"mujoco": "mujoco", "pinocchio": "pin", "usd-core": "usd-core"}
"""Engines that extras of this package install into this interpreter, and their packages."""
LIMIT = 600.0
"""Time limit of a script, s. Newton compiles for minutes when it runs for the first time."""


@dataclass(frozen=True)
class Interpreter:
    """What runs the scripts of one version of an engine.

    Attributes
    ----------
    engine, version
        Name and version of the engine.
    environment
        Its environment; None if it is installed in this interpreter.
    """

    engine: str
    version: str
    environment: Environment | None = None

    def run(self, script: Path, file: Path | None) -> tuple[str, str]:
        """Return the verdict of a script and what it printed, as `run`."""
        if self.environment is None:
            return run([sys.executable, "-P", script], file)
        kind, folder = self.environment.kind, self.environment.folder
        variables = dict(kind.variables(folder) or os.environ)
        if kind.name == "npm":  # modules are looked for from the working directory, because the script is the input
            return run(
                [find_program("node"), "--input-type=module", "-"], file, folder, variables, script.read_text(encoding="utf-8")
            )
        return run([interpreter_of(folder), "-I", script], file, variables=variables)


def find_interpreters(engine: str) -> list[Interpreter]:
    """Return an interpreter for each installed version of an engine, older versions first."""
    environments = {each.version: Interpreter(engine, each.version, each) for each in list_environments(engine)}
    found = dict(environments)
    if engine in LOCAL:
        with suppress(metadata.PackageNotFoundError):
            here = metadata.version(LOCAL[engine])
            found[here] = Interpreter(engine, here)
    return [found[version] for version in sorted(found, key=version_key)]


def run(
    command: list[str | Path],
    file: Path | None,
    folder: Path | None = None,
    variables: dict[str, str] | None = None,
    text: str = "",
) -> tuple[str, str]:
    """Run a script, which gets the path of its file, in an empty folder or in `folder`.

    Return the last word of its output, right or wrong, and the line before that word. If the script ends otherwise, return
    "undecided" and the reason.
    """
    arguments = [*command, *([file] if file else [])]
    with tempfile.TemporaryDirectory() as empty:
        try:
            done = subprocess.run(
                arguments,
                cwd=folder or empty,
                env=variables,
                input=text,
                capture_output=True,
                text=True,
                errors="replace",
                timeout=LIMIT,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return "undecided", f"timeout (after {LIMIT:g} s)"
    lines = done.stdout.strip().splitlines() or [""]
    line, _, word = lines[-1].rpartition(" ")
    if done.returncode == 0 and word in VERDICTS[:2]:
        return word, line.rstrip(":").strip()
    reason = (done.stderr.strip().splitlines() or lines)[-1]
    return "undecided", f"exit code {done.returncode}: {reason}"


def measure(names: set[str] | None = None) -> Iterator[Result]:
    """Yield the result of each script in each installed version of its engine: scripts or engines by name, by default all."""
    today = datetime.date.today().isoformat()
    for accusation in read_accusations():
        if names is None or {accusation.engine, accusation.script} & names:
            for interpreter in find_interpreters(accusation.engine):
                verdict, printed = interpreter.run(accusation.path, accusation.file_path)
                yield Result(accusation.script, interpreter.version, verdict, printed, today)


def merge(old: list[Result], new: list[Result]) -> list[Result]:
    """Return the old results with the new ones, in the order of the sentences and versions.

    A result that says the same keeps its date. Results of scripts that are no longer there are left out, and results without a
    verdict, for example of an old version without a function that the script calls.
    """
    found: dict[tuple[str, str], Result] = {}
    for result in [*old, *new]:
        known = found.get((result.script, result.version))
        same = known is not None and (known.verdict, known.printed) == (result.verdict, result.printed)
        if result.verdict != "undecided" and not same:
            found[result.script, result.version] = result
    order = [accusation.script for accusation in read_accusations()]
    kept = [result for result in found.values() if result.script in order]
    return sorted(kept, key=lambda result: (order.index(result.script), version_key(result.version)))


def differences(old: list[Result], new: list[Result]) -> list[str]:
    """Return a sentence for each verdict that differs from the row of its version, or of the newest version if it has none."""
    sentences = []
    for result in new:
        rows = [row for row in old if row.script == result.script]
        same = [row for row in rows if row.version == result.version] or rows[-1:]
        if not same:
            sentences.append(f"{result.script}: {result.verdict} in {result.version}, no row")
        elif same[0].verdict != result.verdict:
            was = f"{same[0].verdict} in {same[0].version}"
            sentences.append(f"{result.script}: {was}, {result.verdict} in {result.version} ({result.printed})")
    return sentences


def missing_engines(accusations: list[Accusation]) -> list[str]:
    """Return the engines of scripts that are not installed."""
    return [name for name in dict.fromkeys(accusation.engine for accusation in accusations) if not find_interpreters(name)]
