"""The verification of the engines of a report, with the checks that need no other input."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

from conservative.benchmarks.studies.case import names_of
from conservative.benchmarks.studies.selection import Missing
from conservative.benchmarks.verification.finding import Cause, Finding, Verdict
from conservative.benchmarks.verification.verify import verify
from conservative.method import Method

from ..terminal.progress import Tell

CHECKS = ("motions", "order", "repeatability", "pairs")
"""Checks of engines in a report; see `conservative verify --only`."""


@dataclass(frozen=True)
class Verified:
    """A method, by its names in tables (see `names_of`), and the findings on it."""

    names: Mapping[str, str]
    findings: tuple[Finding, ...]


def verify_methods(methods: Sequence[Method], tell: Tell, checks: Sequence[str] = CHECKS) -> Iterator[Verified]:
    """Yield the findings on each method; a missing engine was not tested."""
    for i, method in enumerate(methods):

        def tell_part(share: float, what: str, i: int = i) -> None:
            tell((i + share) / len(methods), what)

        findings: tuple[Finding, ...]
        if isinstance(method, Missing):
            findings = (Finding(method.name, checks[0], "", Verdict.NOT_TESTED, detail=str(method.error)),)
        else:
            findings = tuple(
                finding for verification in verify(method, only=checks, tell=tell_part) for finding in verification.findings
            )
        yield Verified(names_of(method), findings)


def to_plain(verified: Iterable[Verified]) -> list[dict[str, Any]]:
    """Return findings as JSON values, which `from_plain` reads."""
    return [
        {"names": dict(setting.names), "findings": [_plain(finding) for finding in setting.findings]} for setting in verified
    ]


def from_plain(values: Iterable[Mapping[str, Any]]) -> tuple[Verified, ...]:
    """Return the findings of `to_plain`. Raise `KeyError`, `TypeError` or `ValueError` for other values."""
    return tuple(Verified(dict(value["names"]), tuple(map(_finding, value["findings"]))) for value in values)


def _plain(finding: Finding) -> dict[str, Any]:
    causes = [{**vars(cause), "keys": list(cause.keys), "numbers": dict(cause.numbers)} for cause in finding.causes]
    return {**{field.name: getattr(finding, field.name) for field in fields(Finding)}, "causes": causes}


def _finding(values: Mapping[str, Any]) -> Finding:
    causes = tuple(Cause(**{**cause, "keys": tuple(cause["keys"])}) for cause in values["causes"])
    return Finding(**{**values, "verdict": Verdict(values["verdict"]), "causes": causes})
