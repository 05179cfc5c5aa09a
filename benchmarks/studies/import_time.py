"""What it costs to import a library: seconds from a fresh interpreter to the library ready, its own start taken off."""

from __future__ import annotations

import math
import subprocess
import sys
import time
from dataclasses import dataclass

MODULES = {"conservative": "ours", "mujoco": "engine", "pinocchio": "engine", "heyoka": "engine", "scipy.integrate": "engine"}
ROUNDS = 3


@dataclass(frozen=True)
class ImportCost:
    """Seconds of an import, the smallest of some rounds; nan where the module cannot be imported."""

    module: str
    role: str
    seconds: float


def costs(rounds: int = ROUNDS) -> list[ImportCost]:
    """Return the cost of importing each library, in interleaved rounds of fresh interpreters with warm file caches."""
    found = dict.fromkeys(("", *MODULES), math.inf)
    for _ in range(rounds):
        for name in found:
            found[name] = min(found[name], _seconds(name))
    return [ImportCost(name, role, _above(found[""], found[name])) for name, role in MODULES.items()]


def _above(bare: float, seconds: float) -> float:
    return max(seconds - bare, 0.0) if math.isfinite(seconds) else math.nan


def _seconds(module: str) -> float:
    """Return how long an interpreter that imports `module` lives; inf where that fails."""
    start = time.perf_counter()
    done = subprocess.run([sys.executable, "-c", f"import {module}" if module else ""], capture_output=True, check=False)
    return time.perf_counter() - start if done.returncode == 0 else math.inf
