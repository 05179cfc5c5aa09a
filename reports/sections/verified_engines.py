"""The verification of engines: how many cases of each check are right, and the mistakes that explain the others."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import pairwise

from conservative.benchmarks.verification.finding import Finding, Verdict

from ..document.cells import DASH
from ..document.model import Paragraph, Row, Section, Table
from ..rows.names import display_name
from ..run.verification import Verified
from .verification import SIGNS, TERMS, explanation, grouped, numbers


def section(verified: Sequence[Verified]) -> Section:
    """Return the section of a report or of the page of an engine: a row for each setting and check."""
    body = list[Row]()
    for setting in verified:
        name = display_name(setting.names["family"], setting.names["version"], setting.names["setting"])
        for check, findings in grouped(setting.findings, lambda finding: finding.check):
            body.append([name, check, *numbers(findings), _mistakes(findings)])
    table = Table(["engine", "check", *SIGNS, "mistakes, with the cases that each explains"], body, "Cases of each check")
    return Section("Verification", [Paragraph(TERMS), table], "verification")


def _mistakes(findings: Sequence[Finding]) -> str:
    """Return the three mistakes that explain the most of some findings, with their numbers of cases."""
    counts = Counter(finding.mistake for finding in findings if finding.verdict is Verdict.WRONG and finding.mistake)
    return ", ".join(f"{key} ({count})" for key, count in counts.most_common(3)) or DASH


def changes(versions: Sequence[tuple[str, Sequence[Verified]]]) -> list[str]:
    """Return a sentence for each case that changed between right and wrong from one version of an engine to the next.

    `versions` are names, and the findings on the same settings in the same order.
    """
    sentences = []
    for (before, old), (after, new) in pairwise(versions):
        for was, now in zip(old, new, strict=True):
            verdicts = {(finding.check, finding.case): finding.verdict for finding in was.findings}
            for finding in now.findings:
                pair = {verdicts.get((finding.check, finding.case)), finding.verdict}
                if pair == {Verdict.RIGHT, Verdict.WRONG}:
                    why = f": {text}" if (text := explanation(finding)) and finding.verdict is Verdict.WRONG else ""
                    setting = now.names["setting"] or "default"
                    sentences.append(f"{setting}: {finding.check}, {finding.case}, {before} → {after}: {finding.verdict}{why}")
    return sentences
