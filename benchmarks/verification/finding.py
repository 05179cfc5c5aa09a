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


class Standing(StrEnum):
    """How a finding compares with a file of known errors (`known`). Other findings agree with the file."""

    KNOWN = "known"
    """It is wrong or undecided as recorded."""
    NEW = "new"
    """It is worse than recorded, has another mistake, or is not tested any more."""
    BETTER = "better"
    """It was recorded as wrong, and its error is smaller now, or it is right."""


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
    standing, change
        How it compares with a file of known errors, and a sentence on what changed; None and "" if nothing did.
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
    standing: Standing | None = None
    change: str = ""

    @property
    def mistake(self) -> str:
        """The key of the mistake that explains the error; "" if there is none, or several explain it equally well."""
        return self.causes[0].key if len(self.causes) == 1 else ""


@dataclass(frozen=True)
class MotionFinding(Finding):
    """The finding on an exact motion that was run.

    Attributes
    ----------
    errors, tolerances
        Errors and tolerances of the attitude, rad, and of the rates, relative to the largest rate. `error` and `allowed` are
        those of the two with the larger ratio.
    """

    errors: tuple[float, float] = (math.nan, math.nan)
    tolerances: tuple[float, float] = (math.nan, math.nan)


@dataclass(frozen=True)
class Settings:
    """How the exact motions of a program, an engine or a method were run.

    Attributes
    ----------
    order
        The declared order; None for a subject that chooses its steps.
    angle
        |w| h, rad.
    precision
        "double" or "single".
    """

    order: int | None
    angle: float
    precision: str

    def __str__(self) -> str:
        return f"{'adaptive' if self.order is None else self.order},{self.angle:g},{self.precision}"


CHECKS: Mapping[str, str] = MappingProxyType(
    {
        "recording": "rows of a file are the motion of the scene",
        "protocol": "a program answers as PROTOCOL.md asks",
        "motions": "exact motions are within the tolerance of the declared order",
        "order": "the error falls with the step as the declared order says",
        "repeatability": "a second run has the same bits",
        "pairs": "two descriptions of one motion move equally",
        "parity": "two back ends have the same motion",
        "times": "measured times are honest",
        "links": "mass and inertia of the links of a model file fit its shapes, their twins, and what a body can have",
        "bodies": "engines load the body that a model file describes",
    }
)
"""The checks, and what each shows."""


OF_TWO = ("recordings", "back ends")
"""Kinds of verifications of two subjects: the reason says which one is wrong."""


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
        Name of the subject, and what it is: "recording", "recordings", "engine", "program", "method", "model file", or
        "back ends" for two of them.
    findings
        One for each case.
    reason
        What decides the verdict, without the verdict: "48 of 48 motions, order 2.00, 70 of 70 pairs".
    notes
        Sentences on data that was not used or not compared, and on assumptions.
    details
        Values that belong to the kind of the subject, such as the quantities of a recording.
    settings
        How exact motions were run; None for recordings, model files and programs that do not run.
    compared
        Whether the findings were compared with a file of known errors.
    change
        A sentence for a pull request on what changed since that file; "" if nothing did.
    """

    subject: str
    kind: str
    findings: Sequence[Finding]
    reason: str = ""
    notes: Sequence[str] = ()
    details: object = None
    settings: Settings | None = None
    compared: bool = False
    change: str = ""

    @property
    def verdict(self) -> Verdict:
        """The verdict on the subject."""
        return join_verdicts(finding.verdict for finding in self.findings)

    @property
    def exit_code(self) -> int:
        """The exit code of a command that verifies this subject.

        With a file of known errors, it is 1 if an error is new, and 3 if a case is undecided that was not.
        """
        if not self.compared:
            return EXIT_CODES[self.verdict]
        if self.new:
            return EXIT_CODES[Verdict.WRONG]
        undecided = any(finding.verdict is Verdict.UNDECIDED and finding.standing is None for finding in self.findings)
        return EXIT_CODES[Verdict.UNDECIDED if undecided else Verdict.RIGHT]

    @property
    def new(self) -> list[Finding]:
        """The findings that are new since the file of known errors was written."""
        return [finding for finding in self.findings if finding.standing is Standing.NEW]

    @property
    def known(self) -> list[Finding]:
        """The wrong findings that are not worse than the file of known errors says."""
        kept = (Standing.KNOWN, Standing.BETTER)
        return [finding for finding in self.findings if finding.verdict is Verdict.WRONG and finding.standing in kept]

    @property
    def sentence(self) -> str:
        """The verdict in one sentence."""
        if self.kind in OF_TWO:  # the reason says which one is wrong
            return f"{self.verdict}{self._standing}: {self.reason}"
        loaded = self.kind == "model file" and all(finding.check == "bodies" for finding in self.findings)
        subject = f"The loading of {self.subject}" if loaded else self.subject
        return f"{subject} is {self.verdict}{self._standing}" + (f": {self.reason}" if self.reason else "")

    @property
    def _standing(self) -> str:
        """How many errors are known and how many are new, as a part of the sentence."""
        known, new = (
            f"{len(some)} {name}{'s' * (len(some) != 1)}" if some else ""
            for some, name in ((self.known, "known error"), (self.new, "new failure"))
        )
        if new:
            return f", with {' and '.join(filter(None, (new, known)))}"
        return f" as recorded, with {known}" if known else ""


def uncapitalised(sentence: str) -> str:
    """Return a sentence as a part of another one."""
    return sentence[:1].lower() + sentence[1:] if sentence[1:2].islower() else sentence
