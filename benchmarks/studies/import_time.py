"""The study of imports: seconds from a fresh interpreter to the library ready, the interpreter's own start taken off."""

from __future__ import annotations

import math
import subprocess
import sys
import time
from collections.abc import Iterator

from conservative import registry
from conservative.method import Role
from conservative.outcome import OK, Outcome, OutcomeKind

from ..measures.measure import Measure
from ..measures.measurement import Measurement
from .study import Progress, Study

ROUNDS = 3
OURS = "conservative.integration.one"
"""What our own first run imports; `import conservative` alone imports nothing until a name is used."""


def modules() -> dict[str, Role]:
    """Return the modules that are timed: our own, and those that registered engines name."""
    engines = [family for family in registry.list_families().values() if family.role is Role.ENGINE and family.module]
    return {OURS: Role.OURS} | {family.module: Role.ENGINE for family in engines}


def findings(study: Study, progress: Progress) -> Iterator[Measurement]:
    """Yield a row for each library: the least of some rounds, of a quick study of one; its name stands for the method."""
    bare, roles = math.inf, modules()
    found = dict.fromkeys(roles, math.inf)
    rounds = 1 if study.quick else ROUNDS
    for number in range(rounds):  # interleaved, so that a slow spell of the machine hits all alike
        progress(number, rounds, "fresh interpreters")
        bare = min(bare, import_time(""))
        found = {name: min(seconds, import_time(name)) for name, seconds in found.items()}
    yield from (row(study, name, roles[name], seconds - bare) for name, seconds in found.items())


def row(study: Study, module: str, role: Role, seconds: float) -> Measurement:
    """Return the row of a library that took so long, s; inf stands for one that cannot be imported."""
    known = math.isfinite(seconds)
    return Measurement(
        study=study.name,
        scene="",
        method=module,
        label=module,
        role=role,
        series=module,
        dt=math.nan,
        measure=Measure.IMPORT,
        value=max(seconds, 0.0) if known else math.nan,
        outcome=OK if known else Outcome(OutcomeKind.MISSING, f"{module} cannot be imported"),
    )


def import_time(module: str) -> float:
    """Return how long, s, an interpreter that imports `module` lives; inf where that fails."""
    start = time.perf_counter()
    done = subprocess.run([sys.executable, "-c", f"import {module}" if module else ""], capture_output=True, check=False)
    return time.perf_counter() - start if done.returncode == 0 else math.inf
