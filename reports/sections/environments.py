"""Environments of engines: the list, and what `install` and `remove` did."""

from __future__ import annotations

from conservative import registry
from conservative.programs import Program, list_programs
from conservative.references.environments.environment import Environment, list_environments
from conservative.references.environments.install import Installation

from ..document.model import Document, Paragraph


def build() -> Document:
    """Return a line for each program and each environment, and one for each engine without any."""
    environments, programs = list_environments(), list_programs()
    lines = [str(program) for program in programs.values()]
    for engine in (name for name in registry.list_engines() if name not in programs):
        mine = [environment for environment in environments if environment.engine == engine]
        installed = [f"{environment.name}: {environment.runtime}, {', '.join(environment.packages)}" for environment in mine]
        lines += installed or [f"{engine}: no environment"]
    data = {"engines": registry.list_engines(), "environments": environments, "programs": programs}
    return Document("conservative engines", "Engines and environments", [Paragraph(line) for line in lines], data=data)


def installation_line(done: Installation) -> str:
    """Return the result of an installation in one line."""
    environment, how = done.environment, "installed" if done.new else "already installed"
    trouble = f"; cannot be imported: {done.trouble}" if done.trouble else ""
    advice = f". Run: conservative engines install --force {environment.name}" if done.trouble and not done.new else ""
    return f"{environment.name}: {how}, {len(environment.packages)} packages, {environment.runtime}{trouble}{advice}"


def removal_line(gone: Environment | Program) -> str:
    """Return one line about a removed environment or program."""
    return f"{gone if isinstance(gone, Program) else gone.name}: removed"
