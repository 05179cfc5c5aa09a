"""Findings: the verdict on each subject in one sentence, the mistakes that explain what is wrong, and all cases."""

from __future__ import annotations

import csv
import io
import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, TypeVar

from conservative.benchmarks.verification.finding import EXIT_CODES, OF_TWO, Cause, Finding, Standing, Verdict, Verification

from ..document.cells import DASH, bound, listed
from ..document.model import Block, Cell, Check, Document, Emphasis, Grade, Item, Items, Paragraph, Row, Section, Table, filled
from .bodies import body_blocks
from .links import link_blocks
from .recording import described, recording_blocks, two_blocks

Key = TypeVar("Key")
SIGNS = {
    Verdict.RIGHT: ("✓", Grade.GOOD),
    Verdict.WRONG: ("✗", Grade.BAD),
    Verdict.UNDECIDED: ("?", Grade.FAIR),
    Verdict.NOT_TESTED: (DASH, Grade.NONE),
}
"""Symbol and grade of each verdict."""
DECIDING = (Verdict.WRONG, Verdict.UNDECIDED, Verdict.NOT_TESTED, Verdict.RIGHT)
"""Verdicts in the order in which they decide the verdict on several subjects: only right ones together are right."""
LISTED = 4
"""Cases that an item of a list names."""
UNKNOWN = "no known mistake"
TERMS = (
    "Right: the error is at most what is allowed. Undecided: the data does not decide. Not tested: the subject does not have "
    "what the case needs. A mistake explains an error if it leaves at most what is allowed."
)
"""Explanation of the tables."""
COLUMNS = (
    "subject",
    "check",
    "case",
    "verdict",
    "error",
    "allowed",
    "unit",
    "by",
    "mistakes",
    "explanation",
    "standing",
    "change",
)
"""Columns of findings as CSV."""
OWN: Mapping[str, Callable[[Verification], Sequence[Block]]] = {
    "recording": recording_blocks,
    "recordings": two_blocks,
    "back ends": lambda verification: _back_end_blocks(verification),
}
"""Blocks of kinds of subjects that have other data than cases, by `Verification.kind`."""
MODEL = "model file"
"""The kind of subjects that are shown together, in a table of files and engines."""


def build(verifications: Sequence[Verification], made: Mapping[str, str] | None = None) -> Document:
    """Return the document of verifications, which were made with the versions in `made`.

    Its first line is the verdict. Two lines on what a recording is precede the verdict on one. The terminal shows what decides;
    other formats also have every case.
    """
    order = sorted(verifications, key=lambda verification: DECIDING.index(verification.verdict))
    models, others = (
        [verification for verification in order if (verification.kind == MODEL) is is_model] for is_model in (True, False)
    )
    listed_alone = [*others, *(models if len(models) == 1 else ())]
    sentences = [
        Item(
            f"{verification.sentence}.",
            verification.subject * (verification.kind in OF_TWO),
            verification.verdict is Verdict.WRONG,
        )
        for verification in listed_alone
    ]
    before = described(order[0]) if len(order) == 1 and order[0].kind == "recording" else []
    lead = filled(*before, Paragraph(_sentence(order), Emphasis.LEAD), Items(sentences) if len(order) > 1 else None)

    def blocks(make: Callable[[Verification], list[Block]], shown: Sequence[Verification], brief: bool) -> list[Block]:
        parts = [
            *(
                [("Model files", filled(_standings(models), *link_blocks(models, brief), *body_blocks(models)))]
                if models
                else []
            ),
            *((verification.subject, make(verification)) for verification in shown),
        ]
        return [*lead, *(parts[0][1] if len(order) == 1 or not others else filled(*(Section(*part) for part in parts)))]

    return Document(
        "conservative verify",
        f"Verified: {named(verification.subject for verification in verifications)}",
        [*blocks(details, others, False), Paragraph(TERMS, Emphasis.NOTE)],
        brief=blocks(summary, [other for other in others if len(order) == 1 or _has_news(other)], True),
        data={
            "verified": [verification.subject for verification in verifications],
            "verdict": order[0].verdict,
            "made": dict(made or {}),
            "subjects": [content(verification) for verification in verifications],
        },
        checks=[
            _check(finding.subject if verification.kind in OF_TWO else verification.subject, finding)
            for verification in verifications
            for finding in verification.findings
        ],
        failures=[f"{verification.sentence}." for verification in order if verification.exit_code == EXIT_CODES[Verdict.WRONG]],
    )


def named(subjects: Iterable[str]) -> str:
    """Return the names of subjects for a title, at most `LISTED` of them."""
    names = list(subjects)
    more = len(names) - LISTED
    return ", ".join(names) if more <= 1 else f"{', '.join(names[:LISTED])} and {more} more"


def exit_code(verifications: Iterable[Verification]) -> int:
    """Return the exit code of a command: of a wrong subject if there is one, otherwise of an undecided or untested one."""
    codes = [EXIT_CODES[verdict] for verdict in DECIDING]
    return min((verification.exit_code for verification in verifications), key=codes.index)


def _has_news(verification: Verification) -> bool:
    return verification.verdict is not Verdict.RIGHT or any(finding.standing for finding in verification.findings)


def content(verification: Verification) -> dict[str, Any]:
    """Return a verification for JSON: its fields, its verdict and its sentence."""
    code = verification.exit_code
    return {"sentence": verification.sentence, "verdict": verification.verdict, "exit_code": code, **vars(verification)}


def findings_text(verifications: Iterable[Verification]) -> str:
    """Return the findings as CSV."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(COLUMNS)
    for verification in verifications:
        for finding in verification.findings:
            plain = [getattr(finding, name) for name in COLUMNS[:-4]]
            writer.writerow([*plain, _keys(finding), explanation(finding), finding.standing or "", finding.change])
    return stream.getvalue()


def errors_text(verifications: Sequence[Verification]) -> str:
    """Return errors and drifts of a recording over time as CSV: t, quantity and value."""
    (recording,) = verifications
    details: Any = recording.details
    return "t,quantity,value\n" + "".join(f'{row["t"]!r},"{row["quantity"]}",{row["value"]!r}\n' for row in details.rows())


def summary(verification: Verification) -> list[Block]:
    """Return the reasons of the verdict on a subject: mistakes, open cases, the number of cases of each check, and notes."""
    if verification.kind in OWN:
        return filled(_standings([verification]), *OWN[verification.kind](verification))
    pairs, others = _pairs(verification)
    differ = _pair_blocks(pairs) if any(pair.verdict is Verdict.WRONG for pair in pairs) else []
    return filled(
        _standings([verification]),
        mistakes(others),
        _remarks(others),
        _counts(verification),
        *differ,
        Items.of(verification.notes),
    )


def details(verification: Verification) -> list[Block]:
    """Return the blocks of `summary`, and tables of the cases of each check."""
    if verification.kind in OWN:
        return summary(verification)
    pairs, others = _pairs(verification)
    tables = [_cases(check, some) for check, some in grouped(others, lambda finding: finding.check)]
    right = _pair_blocks(pairs) if all(pair.verdict is not Verdict.WRONG for pair in pairs) else []
    return filled(*summary(verification), *tables, *right)


def _back_end_blocks(verification: Verification) -> list[Block]:
    from .two_back_ends import back_end_blocks  # here: it needs kernels, which recordings do without

    return back_end_blocks(verification)


def _pair_blocks(findings: Sequence[Finding]) -> list[Block]:
    if not findings:
        return []
    from .pairs import pair_blocks  # here: it needs kernels, which recordings do without

    return pair_blocks(findings)


def _pairs(verification: Verification) -> tuple[list[Finding], list[Finding]]:
    """Return the findings on pairs, which have tables of their own, and the others."""
    pairs = [finding for finding in verification.findings if finding.check == "pairs"]
    return pairs, [finding for finding in verification.findings if finding.check != "pairs"]


def mistakes(findings: Iterable[Finding]) -> Items:
    """Return the wrong cases by their explanations, largest groups first."""
    wrong = [finding for finding in findings if finding.verdict is Verdict.WRONG]
    groups = sorted(grouped(wrong, lambda finding: (finding.check, named_by(finding))), key=lambda group: -len(group[1]))
    items = [Item(explanation(some[0]), _named(check, _cases_of(some)), True) for (check, _), some in groups]
    return Items(items)


def _standings(verifications: Iterable[Verification]) -> Items:
    """Return what is new and what is better than a file of known errors, and how many errors are known by which mistakes."""
    items = list[Item]()
    for verification in verifications:
        for standing in (Standing.NEW, Standing.BETTER):
            changed = [finding for finding in verification.findings if finding.standing is standing]
            groups = grouped(changed, lambda finding: (finding.check, finding.change))
            items += [
                Item(_named(_named(check, _cases_of(some)), change), str(standing), standing is Standing.NEW)
                for (check, change), some in groups
            ]
        if verification.known:
            counts = Counter((_keys(finding) or UNKNOWN, finding.check) for finding in verification.known)
            causes = [f"{cause} ({check}: {count})" for (cause, check), count in counts.most_common()]
            items.append(Item(", ".join(causes), f"{len(verification.known)} known"))
    return Items(items)


def _named(name: str, detail: str) -> str:
    return f"{name}: {detail}" if detail else name


def explanation(finding: Finding) -> str:
    """Return the mistakes that explain a finding, or else its detail."""
    causes = [_cause(cause, finding.unit) for cause in finding.causes]
    if len(causes) > 1:
        return f"{len(causes)} mistakes explain it equally well: {'; '.join(causes)}"
    if causes:
        return "; ".join(filter(None, (causes[0], finding.detail)))
    unknown = "no known mistake explains it" if finding.verdict is Verdict.WRONG and not math.isnan(finding.error) else ""
    return finding.detail or unknown


def _cause(cause: Cause, unit: str) -> str:
    left = "" if math.isnan(cause.left) else f" (leaves {bound(cause.left)} of {_amount(cause.of, unit)})"
    return f"{cause.sentence}{left}" + (f": {cause.remedy}" if cause.remedy else "")


def _amount(error: float, unit: str) -> str:
    return DASH if math.isnan(error) else f"{bound(error)} {unit}".rstrip()


def _sentence(verifications: Sequence[Verification]) -> str:
    if len(verifications) == 1:
        return f"{verifications[0].sentence}."
    counts = Counter(verification.verdict for verification in verifications)
    if len(counts) == 1:
        return f"All {len(verifications)} subjects are {verifications[0].verdict}."
    counted = [f"{counts[verdict]} {'is' if counts[verdict] == 1 else 'are'} {verdict}" for verdict in SIGNS if counts[verdict]]
    return f"Of {len(verifications)} subjects, {listed(counted)}."


def grouped(findings: Iterable[Finding], key: Callable[[Finding], Key]) -> list[tuple[Key, list[Finding]]]:
    """Return findings by their keys, in their order."""
    groups: dict[Key, list[Finding]] = {}
    for finding in findings:
        groups.setdefault(key(finding), []).append(finding)
    return list(groups.items())


def named_by(finding: Finding) -> str:
    """Return the keys of the mistakes that explain a finding, or else its detail."""
    return _keys(finding) or finding.detail


def _keys(finding: Finding) -> str:
    return "; ".join(cause.key for cause in finding.causes)


def _cases_of(findings: Sequence[Finding]) -> str:
    names = [finding.case for finding in findings if finding.case]
    more = f" and {len(names) - LISTED} more" * (len(names) > LISTED)
    return ", ".join(names[:LISTED]) + more


def _remarks(findings: Sequence[Finding]) -> Items:
    """Return why cases are undecided, and remarks on right ones. The order is in the sentence of the verdict instead."""
    remarkable = (
        finding for finding in findings if finding.verdict is Verdict.RIGHT and finding.detail and finding.check != "order"
    )
    undecided = (finding for finding in findings if finding.verdict is Verdict.UNDECIDED)
    groups = grouped((*undecided, *remarkable), lambda finding: (finding.check, explanation(finding)))
    return Items([Item(text, _named(check, _cases_of(some))) for (check, text), some in groups])


def numbers(findings: Sequence[Finding]) -> list[str]:
    """Return the numbers of findings with each verdict, in the order of `SIGNS`."""
    return [str(sum(finding.verdict is verdict for finding in findings)) for verdict in SIGNS]


def _counts(verification: Verification) -> Table | None:
    """Return the number of cases by check and verdict; None for a subject with one case."""
    body = [[check, *numbers(some)] for check, some in grouped(verification.findings, lambda finding: finding.check)]
    return Table(["check", *SIGNS], body, "Cases") if len(verification.findings) > 1 else None


def _cases(check: str, findings: Sequence[Finding]) -> Table:
    compared = any(finding.standing for finding in findings)
    body: list[Row] = [
        [
            finding.case or finding.subject,
            _verdict(finding.verdict),
            Cell(_amount(finding.error, finding.unit), value=finding.error),
            Cell(_amount(finding.allowed, finding.unit), value=finding.allowed),
            finding.by or DASH,
            explanation(finding) or DASH,
            *([_named(str(finding.standing or DASH), finding.change)] if compared else []),
        ]
        for finding in findings
    ]
    header = ["case", "verdict", "error", "allowed", "allowed by", "explanation", *(["known errors"] if compared else [])]
    return Table(header, body, check.capitalize())


def _verdict(verdict: Verdict) -> Cell:
    sign, grade = SIGNS[verdict]
    return Cell(f"{sign} {verdict}", grade)


def _check(subject: str, finding: Finding) -> Check:
    """Return a finding as a test case.

    A case that is undecided or not tested is skipped, and so is a known error, with the reason.
    """
    why = explanation(finding)
    name = _named(finding.check, finding.case)
    if finding.standing is Standing.NEW:
        return Check(
            subject, name, failure=finding.change if finding.verdict is Verdict.NOT_TESTED else _named(finding.change, why)
        )
    if finding.standing is not None and finding.verdict is not Verdict.RIGHT:
        return Check(subject, name, skipped=_named(_named(str(finding.standing), finding.change), why))
    if finding.verdict is Verdict.WRONG:
        return Check(subject, name, failure=why or str(finding.verdict))
    if finding.verdict is Verdict.RIGHT:
        return Check(
            subject, name, output="; ".join(filter(None, (_named("better", finding.change) * bool(finding.change), why)))
        )
    return Check(subject, name, skipped=_named(finding.verdict, why))
