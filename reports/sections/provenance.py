"""Origin of a report: command, machine, versions."""

from __future__ import annotations

from collections.abc import Sequence

from conservative.method import Role

from ..document.model import Block, Facts, Paragraph, Section, filled
from ..run.provenance import LockedEngine
from .measured import Measured


def section(measured: Measured, details: Sequence[Block]) -> Section:
    """Return the section, with the other sections of a report folded."""
    source, plan = measured.source, measured.plan
    packages = [f"{name} {version}" for name, version in source.packages.items() if name not in source.compared]
    others = Section("Every other package", [Paragraph(", ".join(packages))], folded=True)
    locks = Section("Environments of engines", lock_sections(source.environments), folded=True)
    processes = max((study.processes for study in plan.studies), default=1)
    kind = "A quick report has fewer steps and fewer rounds of timing. " if plan.quick else ""
    timing = f"{processes} processes in turn" if processes > 1 else "one process, so ratios are rough"
    resumed = " It was interrupted and resumed: compare times only within one study." if source.resumed else ""
    text = (
        f"{kind}A time is the shortest of several rounds, in which methods take turns. The method's own loop is timed, "
        f"final state only, in {timing}.{resumed} Errors are relative to a reference solution that an independent one "
        "confirms."
    )
    facts = [("command", f"`{source.command}`"), ("date", source.date), ("commit", source.commit)]
    facts += [("machine", ", ".join(f"{name} {value}" for name, value in source.machine.items())), ("python", source.python)]
    facts += [("versions", ", ".join(f"{name} {version}" for name, version in source.compared.items()))]
    versions = Facts([*facts, *(("resumed", part) for part in source.resumed)])
    ours = [method for method in plan.methods if method.role not in (Role.ENGINE, Role.TRUTH)]
    about = {method.family: (type(method).__doc__ or "").partition("\n")[0] for method in ours}
    methods = Section("Methods of this package", [Facts(list(about.items()))] if about else [], folded=True)
    blocks = filled(Paragraph(text), versions, *details, methods, others, locks)
    return Section("How it was measured", blocks, "made", "Measured")


def repeat(measured: Measured) -> Paragraph:
    """Return the command that makes the report again."""
    return Paragraph(f"Repeat with: `{measured.source.command}`")


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
