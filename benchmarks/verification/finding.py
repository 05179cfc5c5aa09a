"""Findings: what was verified, the verdict on it, and the mistakes that explain what is wrong."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from types import MappingProxyType


class Verdict(StrEnum):
    """The verdict on a subject or on a part of it."""

    RIGHT = "right"
    WRONG = "wrong"
    UNDECIDED = "undecided"
    NOT_TESTED = "not tested"


EXIT_CODES = {Verdict.RIGHT: 0, Verdict.WRONG: 1, Verdict.UNDECIDED: 3, Verdict.NOT_TESTED: 3}
"""Exit code of a command by its verdict; bad input is 2."""


@dataclass(frozen=True)
class Cause:
    """A mistake, or several at once, that explains an error.

    Attributes
    ----------
    keys
        Keys of the mistakes in the catalogue (`mistakes.BY_KEY`).
    sentence
        What is wrong, with the fitted numbers.
    left, of
        Error that the mistake leaves, and error without it, in the unit of the finding.
    numbers
        Fitted numbers by name, SI units.
    remedy
        What to change; "" if the sentence says it.
    """

    keys: tuple[str, ...]
    sentence: str
    left: float = math.nan
    of: float = math.nan
    numbers: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    remedy: str = ""

    @property
    def key(self) -> str:
        """The keys as one text."""
        return " + ".join(self.keys)


@dataclass(frozen=True)
class Finding:
    """The verdict on one case of a subject: a recording, a motion of a program, a pair of descriptions, a loaded body.

    Attributes
    ----------
    subject
        Name of the file, engine, program or method.
    check
        Kind of check: a name in `CHECKS`.
    case
        Name of the motion, pair or body; "" for a check with one case.
    verdict
        Right, wrong, undecided or not tested.
    error, allowed, unit
        Largest error and the largest error that is allowed, rad, relative, a factor ("times") or a density, kg/m^3; nan if
        nothing was measured.
    by
        What decides the allowed error: digits, noise, order, rounding, shapes, the option --error.
    causes
        Mistakes that explain the error; several if they explain it equally well, none if no mistake of the catalogue does.
    detail
        What decides an undecided case, why a case was not tested, or what a wrong case does.
    """

    subject: str
    check: str
    case: str
    verdict: Verdict
    error: float = math.nan
    allowed: float = math.nan
    unit: str = "rad"
    by: str = ""
    causes: tuple[Cause, ...] = ()
    detail: str = ""

    @property
    def mistake(self) -> str:
        """The key of the mistake that explains the error; "" if there is none, or several explain it equally well."""
        return self.causes[0].key if len(self.causes) == 1 else ""


CHECKS: Mapping[str, str] = MappingProxyType(
    {
        "recording": "rows of a file are the motion of the scene",
        "protocol": "a program answers as PROTOCOL.md asks",
        "motions": "exact motions are within the tolerance of the declared order",
        "order": "the error falls with the step as the declared order says",
        "repeatability": "a second run has the same bits",
        "pairs": "two descriptions of one motion move equally",
        "times": "measured times are honest",
        "links": "mass and inertia of the links of a model file fit its shapes, their twins, and what a body can have",
        "bodies": "engines load the body that a model file describes",
    }
)
"""The checks, and what each shows."""


def join_verdicts(verdicts: Iterable[Verdict]) -> Verdict:
    """Return the verdict on a whole: wrong if a part is wrong, undecided if a part is, right if a part is right."""
    present = set(verdicts)
    for verdict in (Verdict.WRONG, Verdict.UNDECIDED, Verdict.RIGHT):
        if verdict in present:
            return verdict
    return Verdict.NOT_TESTED


@dataclass(frozen=True)
class Verification:
    """All findings on one subject.

    Attributes
    ----------
    subject, kind
        Name of the subject, and what it is: "recording", "recordings", "engine", "program", "method" or "model file".
    findings
        One for each case.
    reason
        What decides the verdict, without the verdict: "48 of 48 motions, order 2.00, 70 of 70 pairs".
    notes
        Sentences on data that was not used or not compared, and on assumptions.
    details
        Values that belong to the kind of the subject, such as the quantities of a recording.
    """

    subject: str
    kind: str
    findings: Sequence[Finding]
    reason: str = ""
    notes: Sequence[str] = ()
    details: object = None

    @property
    def verdict(self) -> Verdict:
        """The verdict on the subject."""
        return join_verdicts(finding.verdict for finding in self.findings)

    @property
    def exit_code(self) -> int:
        """The exit code of a command that verifies this subject."""
        return EXIT_CODES[self.verdict]

    @property
    def sentence(self) -> str:
        """The verdict in one sentence."""
        if self.kind == "recordings":  # the reason says which one is wrong
            return f"{self.verdict}: {self.reason}"
        loaded = self.kind == "model file" and all(finding.check == "bodies" for finding in self.findings)
        subject = f"The loading of {self.subject}" if loaded else self.subject
        return f"{subject} is {self.verdict}" + (f": {self.reason}" if self.reason else "")


def uncapitalised(sentence: str) -> str:
    """Return a sentence as a part of another one."""
    return sentence[:1].lower() + sentence[1:] if sentence[1:2].islower() else sentence
