"""Origin of a report: command, machine, versions."""

from __future__ import annotations

from collections.abc import Sequence

from ..document.model import Facts, Paragraph, Section, filled
from ..run.provenance import LockedEngine, Provenance


def section(source: Provenance) -> Section:
    """Return the section."""
    facts = {**source.facts, "command": f"`{source.command}`"}
    resumed = [("resumed", part) for part in source.resumed]
    packages = [f"{name} {version}" for name, version in source.packages.items() if name not in source.compared]
    others = Section("Every other package", [Paragraph(", ".join(packages))], folded=True)
    locks = Section("Environments of engines", lock_sections(source.environments))
    return Section("How this was made", filled(Facts([*facts.items(), *resumed]), others, locks), "made")


def lock_sections(locks: Sequence[LockedEngine]) -> list[Section]:
    """Return the packages of each environment, folded."""
    return [
        Section(
            f"{lock.name}: {lock.runtime}, {len(lock.packages)} packages",
            [Paragraph(", ".join(lock.packages))],
            folded=True,
        )
        for lock in locks
    ]
