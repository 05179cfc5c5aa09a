"""The bodies that engines have after loading model files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from ..document.model import Block, Emphasis, Item, Items, Paragraph, Table, filled

if TYPE_CHECKING:
    from conservative.benchmarks.verification.finding import Finding, Verification


def body_blocks(verifications: Sequence[Verification]) -> list[Block]:
    """Return the blocks for verifications of model files: the verdicts, what is not right, the bodies by all readers, notes."""
    from conservative.benchmarks.verification.finding import Verdict

    findings = [finding for verification in verifications for finding in verification.findings if finding.check == "bodies"]
    notes = [Item(note, verification.subject) for verification in verifications for note in verification.notes]
    if not findings:
        return filled(Items(notes))
    engines = list(dict.fromkeys(finding.subject for finding in findings))
    verdicts = {(finding.case, finding.subject): finding.verdict for finding in findings}
    cases = list(dict.fromkeys(finding.case for finding in findings))
    tested, right, wrong, undecided = (
        [finding for finding in findings if finding.verdict in kinds]
        for kinds in (set(Verdict) - {Verdict.NOT_TESTED}, {Verdict.RIGHT}, {Verdict.WRONG}, {Verdict.UNDECIDED})
    )
    count = f"{len(cases)} {'body' if len(cases) == 1 else 'bodies'}"
    lead = f"{len(right)} of {len(tested)} answers of {len(engines)} engines are right, for {count}."
    lead += f" {len(undecided)} are undecided." * bool(undecided)
    rows = [[case, *(str(verdicts[case, engine]) for engine in engines)] for case in cases]
    details: dict[tuple[str, str], Any] = {
        (body.case, body.subject): body for verification in verifications for body in _bodies(verification)
    }
    parties = [
        [finding.case, finding.subject, *_readings(body.readings), "–" if body.seen is None else _describe(body.seen)]
        for finding in [*wrong, *undecided]
        if (body := details.get((finding.case, finding.subject))) and (body.seen or finding in undecided)
    ]
    explained = [finding for finding in right if finding.detail]
    return filled(
        Paragraph(lead, Emphasis.LEAD),
        Table(["body", *engines], rows),
        Items([_item(finding, True) for finding in wrong]),
        Items([_item(finding) for finding in [*undecided, *explained]]),
        Table(["body", "engine", "by the reference reader", "by this package", "in the engine"], parties) if parties else None,
        Items(notes),
    )


def _bodies(verification: Verification) -> Sequence[Any]:
    details: Any = verification.details
    return details or ()


def _item(finding: Finding, marked: bool = False) -> Item:
    """Return the reason of a verdict, the mistakes first."""
    causes = ". Or: ".join(cause.sentence for cause in finding.causes)
    text = "; ".join(filter(None, [causes, finding.detail]))
    return Item(f"{finding.case}: {text}", f"{finding.subject} {finding.verdict}", marked)


def _readings(readings: Mapping[str, Any]) -> list[str]:
    """Return the bodies by the reference reader and by this package, which is the last one."""
    *reference, own = readings.items()
    shown = [f"{name}: {_describe(part)}" for name, part in reference] or ["–"]
    return [*shown, _describe(own[1])]


def _describe(part: Mapping[str, Any] | str) -> str:
    import numpy as np

    from conservative.benchmarks.verification.bodies.identify import describe
    from conservative.references.model_files.pieces import Piece

    if isinstance(part, str):
        return part[:120]
    return describe(Piece(part["mass"], np.array(part["com"]), np.array(part["inertia"])))
