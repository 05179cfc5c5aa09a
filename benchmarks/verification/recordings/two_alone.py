"""Two recordings without a description of their body: find the wrong one and its mistake, if the body rotates freely."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from conservative.number_text import number

from ..compare import LONGEST, UNITS_OF_DIGITS
from ..explain import FEWEST
from ..finding import Finding, Verdict, Verification, uncapitalised
from ..which import Difference
from .comparison import prepare
from .free_body import FreeBody, Freedom, fit_free_body
from .kinematics import CLEARLY, TURN, Contradiction, find_contradiction
from .table import Recording
from .two import Named, Two, find_difference, join, name_apart, verify_both

ASSUMED = "Without --body, the body is assumed to rotate freely: no field, torque or damping acts on it"
NEGLIGIBLE = 0.1
"""Errors by the interval of a fitted body, over the allowed errors, that widen no limit."""
Pair = tuple[Named, Named]


def verify_two_alone(
    first: Named, second: Named, error: float | None = None, tell: Callable[[str], object] = lambda _: None
) -> Verification:
    """Verify two recordings of one body without its description, under the assumption that it rotates freely.

    The body of each recording is fitted to its rows (`fit_free_body`), and both are verified with it. A recording is wrong if
    it is not a free rotation of any body, while the other one is, and determines the body, or if its attitudes do not turn by
    its rates. If each is a free rotation of another body, both are undecided, with the mistakes that turn one into the other.
    The result has the details `Two`.

    Parameters
    ----------
    first, second
        Names and recordings.
    error
        Allowed error, rad and relative to the largest rate. By default digits and noise decide.
    tell
        Receives the name of the next piece of work.

    Raises
    ------
    BadInput
        For the first recording that cannot be compared, with the name of its file.
    """
    first, second = name_apart(first, second)
    fits = list[FreeBody]()
    for name, recording in (first, second):
        tell(f"{name}: free rotation")
        fits.append(fit_free_body(recording, error, [fit.scene.body.inertia for fit in fits if fit.determined]))
    pair = (first[0], fits[0].recording), (second[0], fits[1].recording)
    if not any(fit.determined for fit in fits):  # otherwise the body decides, and shows more
        contradictions = [find_contradiction(recording) for _, recording in pair]
        if any(found is not None and found.proven for found in contradictions):
            return _assuming(_contradicting(pair, fits, contradictions, error))
    made = dict[int, Verification]()
    # The recording that determines its body better first: if both are right, its body explains both.
    for i in sorted((0, 1), key=lambda i: (not fits[i].determined, float(fits[i].sizes.max()))):
        if fits[i].freedom is Freedom.FREE:
            widened = [(name, recording if i == j else _widen(fits[i], recording)) for j, (name, recording) in enumerate(pair)]
            made[i] = verify_both(fits[i].scene, (widened[0], widened[1]), True, error, tell, "")
            if all(verification.verdict is Verdict.RIGHT for verification in _parts(made[i])):
                return _assuming(replace(made[i], reason=f"{made[i].reason}; {_body(fits[i])}"))
    decisive = [i for i in made if fits[i].determined]
    if not decisive:
        return _assuming(_undecided(pair, fits, error))
    i = decisive[0]
    j, other = 1 - i, _parts(made[i])[1 - i]
    if other.verdict is not Verdict.WRONG:
        return _assuming(replace(made[i], reason=f"{made[i].reason}; {_body(fits[i], pair[i][0])}"))
    if fits[j].freedom is Freedom.NOT_FREE:
        reason = (
            f"{other.subject} is wrong, if the body rotates freely: {other.reason}. {pair[i][0]} is a free rotation of a body "
            f"with the moments {fits[i].ratios}, and {other.subject} of none"
        )
        return _assuming(replace(made[i], reason=reason))
    return _assuming(_either(pair, fits, made, i))


def _widen(fit: FreeBody, recording: Recording) -> Recording:
    """Return a recording with fewer digits: beside the motion of a body whose inertia is known within its intervals only."""
    if not fit.determined:
        return recording
    rows = prepare(fit.scene, recording, True, None)
    some = rows.case.take(np.unique(np.linspace(0, len(rows.case.t) - 1, FEWEST).astype(int)))
    off = fit.uncertainty(some.first(LONGEST, FEWEST))
    if not (off > NEGLIGIBLE * rows.allowed.errors).any():
        return recording
    time, attitude, rate = recording.digits
    off = off / UNITS_OF_DIGITS * [1.0, rows.case.scale]
    return replace(recording, digits=(time, attitude + float(off[0]), rate + float(off[1])))


def _parts(verification: Verification) -> tuple[Verification, Verification]:
    """Return the verifications of both recordings."""
    assert isinstance(verification.details, Two)
    return verification.details.first, verification.details.second


def _assuming(verification: Verification) -> Verification:
    """Return a verification with the assumption."""
    assert isinstance(verification.details, Two)
    details = replace(verification.details, assumed=f"{ASSUMED}.")
    return replace(verification, notes=[details.assumed, *verification.notes], details=details)


def _body(fit: FreeBody, name: str = "") -> str:
    """Return the end of a sentence on the fitted body."""
    if not fit.determined:
        return "they do not determine the body, which was fitted to them"
    return f"the body was fitted to {name or 'them'}, with the moments {fit.ratios}"


def _mistake(verification: Verification, fit: FreeBody) -> str:
    """Return the mistakes of a recording, for a sentence; `fit` is the body of its own."""
    sentences = [uncapitalised(cause.sentence) for finding in verification.findings for cause in finding.causes]
    unknown = "it is the motion of another body" if fit.determined else "no known mistake explains it"
    return " or ".join(sentences) or unknown


def _either(pair: Pair, fits: list[FreeBody], made: dict[int, Verification], i: int) -> Verification:
    """Return that one of two recordings is wrong, and the files do not tell which: the first direction is from recording i."""
    j = 1 - i
    names, parts, texts = [name for name, _ in pair], list(_parts(made[i])), list[str]()
    texts.append(f"If {names[i]} is right, {names[j]} is wrong: {_mistake(parts[j], fits[j])}")
    if j in made and fits[j].determined:
        parts[i] = _parts(made[j])[i]
        texts.append(f"If {names[j]} is right, {names[i]} is wrong: {_mistake(parts[i], fits[i])}")
        which = f"each is a free rotation of a body of its own, with the moments {fits[0].ratios} and {fits[1].ratios}"
    else:
        own = "is one of another body, which it does not determine"
        own = own if j in made else "does not show whether it is one of another body"
        which = f"{names[i]} is a free rotation of a body with the moments {fits[i].ratios}, and {names[j]} {own}"
    undecided = [_as_undecided(part, f"if {names[1 - k]} is right") for k, part in enumerate(parts)]
    reason = f"the files cannot tell which one is wrong: {which}. {'. '.join(texts)}. --body decides"
    details = made[i].details
    assert isinstance(details, Two)
    return join(undecided[0], undecided[1], details.difference, Verdict.UNDECIDED, reason)


def _as_undecided(verification: Verification, detail: str) -> Verification:
    findings = [replace(finding, verdict=Verdict.UNDECIDED, detail=detail) for finding in verification.findings]
    return replace(verification, findings=findings)


def _contradicting(
    pair: Pair, fits: list[FreeBody], contradictions: Sequence[Contradiction | None], error: float | None
) -> Verification:
    """Return that a recording is wrong because it contradicts itself, with the mistakes that explain it."""
    parts, repaired = list[Verification](), list[Recording | None]()
    for (name, recording), found in zip(pair, contradictions, strict=True):
        repaired.append(recording if found is None else found.repaired)
        if found is None or not found.proven:
            why = "it does not contradict itself, and without --body it is not tested further"
            parts.append(Verification(name, "recording", [Finding(name, "recording", "", Verdict.UNDECIDED, detail=why)], why))
            continue
        finding = Finding(name, "recording", "", Verdict.WRONG, found.size, CLEARLY * TURN, by="rates", causes=found.causes)
        causes = " or ".join(f"{uncapitalised(cause.sentence)} (leaves {number(cause.left)} rad)" for cause in found.causes)
        why = (
            f"{causes or 'no known mistake explains it'}; its attitudes and rates contradict each other, for any body and "
            f"field: over {TURN} rad they differ by {number(found.size)} rad"
        )
        parts.append(Verification(name, "recording", [finding], why))
    difference = _difference(pair, fits, (pair[0][1], pair[1][1]), error)
    reasons = [
        f"{part.subject} is {part.verdict}: {part.reason}"
        for part in sorted(parts, key=lambda part: part.verdict is not Verdict.WRONG)
    ]
    if (first := repaired[0]) is not None and (second := repaired[1]) is not None:
        without = _difference(pair, fits, (first, second), error)
        if without.agrees:
            reasons.append(f"Without the mistake they agree: they differ by at most {without.size}")
    verdict = Verdict.NOT_TESTED if difference.missing else Verdict.RIGHT if difference.agrees else Verdict.WRONG
    return join(parts[0], parts[1], difference, verdict, ". ".join(reasons))


def _difference(pair: Pair, fits: list[FreeBody], recordings: tuple[Recording, Recording], error: float | None) -> Difference:
    """Return the difference between two recordings of a body that is not known, as departures from a free rotation."""
    rows = [prepare(fits[0].scene, recording, True, error) for recording in recordings]
    return find_difference((rows[0], rows[1]), recordings, True)


def _undecided(pair: Pair, fits: list[FreeBody], error: float | None) -> Verification:
    """Return that two recordings are undecided, because neither determines a body, and the difference between them."""
    names = [name for name, _ in pair]
    difference = _difference(pair, fits, (pair[0][1], pair[1][1]), error)
    free = [name for name, fit in zip(names, fits, strict=True) if fit.freedom is Freedom.FREE]
    open_ = [name for name, fit in zip(names, fits, strict=True) if fit.freedom is Freedom.OPEN]
    if free:
        why = (
            f"{' and '.join(free)} {'is a free rotation that does' if len(free) == 1 else 'are free rotations that do'} not "
            "determine the moments of the body: it turns about one axis, the body is symmetric, or the recording is short"
        )
    elif open_:
        why = f"the rows of {' and '.join(open_)} are too few or too far apart to determine a body"
    else:
        left = [f"{number(fit.left)} rad of {name}" for name, fit in zip(names, fits, strict=True) if math.isfinite(fit.left)]
        size = f" (the best free rotation leaves {' and '.join(left)})" * bool(left)
        why = (
            "neither recording is a free rotation of any body as exactly as its digits: a field, a torque or damping acts, or "
            f"both have errors, such as those of an integrator{size}"
        )
    agree = "" if difference.missing else f"they {'agree' if difference.agrees else 'differ'}, and "
    parts = [
        Verification(name, "recording", [Finding(name, "recording", "", Verdict.UNDECIDED, detail=why)], why) for name in names
    ]
    verdict = Verdict.NOT_TESTED if difference.missing else Verdict.RIGHT if difference.agrees else Verdict.UNDECIDED
    return join(parts[0], parts[1], difference, verdict, f"{agree}{why}. --body decides")
