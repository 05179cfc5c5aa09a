"""How a report was made: command, machine, versions."""

from __future__ import annotations

from collections.abc import Sequence

from ..document.model import Facts, Paragraph, Section, filled
from ..run.provenance import LockedEngine, Provenance


def section(source: Provenance) -> Section:
    """Return the section."""
    facts = [
        ("command", f"`{source.command}`"),
        ("date", source.date),
        *(("resumed", part) for part in source.resumed),
        ("commit", source.commit),
        *source.machine.items(),
        ("python", source.python),
        *source.compared.items(),
    ]
    others = Section("Every other package", [Paragraph(", ".join(source.others))], folded=True)
    locks = Section("Environments of engines", lock_sections(source.environments))
    return Section("How this was made", filled(Facts(facts), others, locks), "made")


def lock_sections(locks: Sequence[LockedEngine]) -> list[Section]:
    """Return the packages of each environment, folded."""
    return [
        Section(
            f"{lock.name}: Python {lock.python}, {len(lock.packages)} packages",
            [Paragraph(", ".join(lock.packages))],
            folded=True,
        )
        for lock in locks
    ]
