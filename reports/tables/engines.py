"""Engines that can have environments, and the environments that are there: lines and JSON."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict

from conservative import registry
from conservative.references.environments.environment import Environment, list_environments


def lines() -> Iterator[str]:
    """Yield a line for each environment, and one for each engine that has none."""
    there = list_environments()
    for engine in registry.list_engines():
        mine = [environment for environment in there if environment.engine == engine]
        yield from map(_line, mine) if mine else [f"{engine}: not installed"]


def _line(environment: Environment) -> str:
    return f"{environment.engine}=={environment.version}: Python {environment.python}, {', '.join(environment.packages)}"


def json_text() -> str:
    """Return the same as JSON."""
    found = [asdict(environment) | {"folder": str(environment.folder)} for environment in list_environments()]
    return json.dumps({"engines": registry.list_engines(), "environments": found}, indent=2)
