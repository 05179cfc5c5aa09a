"""The terms of a report. Measurements of two processes are combined only if their terms are equal."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from conservative.benchmarks.suite.points import define_scene

from .plan import Plan
from .provenance import Provenance

_ROOMS = (".", "references", "benchmarks")
"""Packages whose source determines measurements. `reports` only shows them."""


def terms(plan: Plan, source: Provenance) -> dict[str, dict[str, Any]]:
    """Return the terms of measurements as JSON values, in groups."""
    return {
        "studies": dict.fromkeys(plan.names, ""),
        "scenes": {scene.name: define_scene(scene) for scene in plan.scenes},
        "methods": {method.name: method.label for method in plan.methods},
        "engines": {method.name: method.label for method in plan.engines},
        "environments": {lock.name: ", ".join(lock.packages) for lock in plan.locks},
        "options": {
            "--quick": plan.quick,
            "--skip-missing": plan.skip_missing,
            "--time-limit": plan.time_limit,
            "--bodies": plan.bodies,
            "--seed": plan.seed,
        },
        "source": {"hash": _source_hash()},
        "machine": {key: source.machine[key] for key in ("processor", "cores")},
        "versions": {"python": source.python, **source.compared},
    }


def _source_hash() -> str:
    """Return the hash of all source that determines measurements. A commit does not show local changes and needs git."""
    root = Path(__file__).parents[2]
    digest = hashlib.sha256()
    for file in sorted({file for room in _ROOMS for file in (root / room).rglob("*.py")} - set((root / "reports").rglob("*"))):
        digest.update(f"{file.relative_to(root)}\n".encode() + file.read_bytes())
    return digest.hexdigest()[:12]


def differences(before: Mapping[str, Mapping[str, Any]], now: Mapping[str, Mapping[str, Any]]) -> Iterator[str]:
    """Yield the differences between two terms, in words."""
    for group in {**before, **now}:
        old, new = before.get(group, {}), now.get(group, {})
        for key in {**old, **new}:
            if key not in new:
                yield f"{group}: {key} (now without)"
            elif key not in old:
                yield f"{group}: {key} missing (now with)"
            elif old[key] != new[key]:
                yield f"{group}: {key} {old[key]}, now {new[key]}"
