"""Engines that can have environments, and the environments that are there: lines and JSON."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

from conservative import registry
from conservative.references.environments.environment import Environment, list_environments
from conservative.references.environments.install import Installation


def lines() -> Iterator[str]:
    """Yield a line for each environment, and one for each engine that has none."""
    there = list_environments()
    for engine in registry.list_engines():
        mine = [environment for environment in there if environment.engine == engine]
        yield from map(_line, mine) if mine else [f"{engine}: no environment"]


def _line(environment: Environment) -> str:
    return f"{environment.engine}=={environment.version}: Python {environment.python}, {', '.join(environment.packages)}"


def json_text() -> str:
    """Return the same as JSON."""
    found = [as_plain(environment) for environment in list_environments()]
    return json.dumps({"engines": registry.list_engines(), "environments": found}, indent=2)


def as_plain(value: Environment | Installation) -> dict[str, Any]:
    """Return an environment, or its installation, as JSON has it."""
    plain: dict[str, Any] = json.loads(json.dumps(asdict(value), default=str))
    return plain


def installation_line(done: Installation) -> str:
    """Return how an installation went, in a line."""
    found, how = done.environment, "installed" if done.new else "was there"
    name = f"{found.engine}=={found.version}"
    trouble = f"; cannot be imported: {done.trouble}" if done.trouble else ""
    advice = f". Run: conservative engines install --force {name}" if done.trouble and not done.new else ""
    return f"{name}: {how}, {len(found.packages)} packages, Python {found.python}{trouble}{advice}"


def removal_line(environment: Environment) -> str:
    """Return that an environment is gone, in a line."""
    return f"{environment.engine}=={environment.version}: removed"
