"""Files of known errors: later runs fail only if a case is worse than recorded, has another mistake, or is not tested any more.

A file has a block for each subject, of lines with values between commas:

    subject,jolt
    settings,1,0.01,single
    order,0.98
    motions,separatrix,0.231,0.262,no gyroscopic term
    pairs,needle: mass x 10^k,0.12,,
    repeatability,golden_0,,,right

A case has its check, its name, its errors and its mistakes. Motions have two errors: of the attitude, rad, and of the rates,
relative. Other checks have one, or none if nothing is measured. Mistakes that explain an error equally well are separated by
"; ". In their place is `right` if the errors alone would not show that a case is right, and `undecided` for such a case. Cases
that were not tested have no line. The tests of references/motions write and read lines of the same form, without `subject`.
"""

from __future__ import annotations

import csv
import math
import os
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TextIO

from conservative import registry
from conservative.errors import BadInput
from conservative.files import read_bytes, text_file

from ..measures.sentence import SAME_ERROR, SAME_ORDER, change_of
from .finding import CHECKS, Finding, MotionFinding, Settings, Standing, Verdict, Verification

HEAD = "# Known errors on exact motions. A later run fails if a motion is worse or has another mistake. Written by --record."
"""First line of a file."""
MARK = "# Known errors on exact motions."
"""The beginning of every file, by which files of others are recognized."""
LARGEST = 1 << 24
"""Largest size of a file, bytes."""
SHARE = SAME_ERROR
"""Share of a recorded error that three digits and another machine may change."""
ROUNDING = 1e-9
"""Allowed increase of an error if the same bits are expected: the size of rounding shows nothing."""
RANDOM = 2.0
"""Factor of recorded errors that a subject may reach whose second run has other samples. Its mistake may be named or not."""
SKIPPED = "was tested, is skipped now: record again"
UNKNOWN = "no known mistake"
SEPARATOR = "; "
RIGHT, UNDECIDED = str(Verdict.RIGHT), str(Verdict.UNDECIDED)
WORDS = frozenset({RIGHT, UNDECIDED})
"""Words in the place of mistakes."""


@dataclass(frozen=True)
class Case:
    """A case as recorded: its errors, its mistakes, or the word `right` or `undecided`, and the line."""

    errors: tuple[float, ...]
    mistakes: frozenset[str] = frozenset()
    line: int = 0


@dataclass
class Block:
    """The record of a subject: its settings, measured order, and cases by check and name."""

    subject: str
    line: int = 0
    settings: Settings | None = None
    order: float = math.nan
    cases: dict[tuple[str, str], Case] = field(default_factory=dict)


def read(path: Path) -> list[Block]:
    """Return the blocks of a file. Raise `BadInput`, with the number of the line, for a file of another form."""
    try:
        text = read_bytes(path, LARGEST).decode()
    except (OSError, UnicodeDecodeError) as error:
        raise BadInput("known", f"{str(path)!r}, which cannot be read ({error})", "a file written by --record") from None
    blocks = list[Block]()
    for number, line in enumerate(text.splitlines(), 1):
        if not line.strip() or line.startswith("#"):
            continue
        try:
            _add(blocks, _fields(line), number)
        except ValueError as problem:
            raise BadInput("known", f"{line!r} in line {number} of {str(path)!r}", f"{problem}; --record writes it") from None
    if not blocks:
        raise BadInput("known", f"{str(path)!r} without a subject", "a file written by conservative verify --record")
    return blocks


def _fields(line: str) -> list[str]:
    try:
        (fields,) = csv.reader([line], strict=True)
    except csv.Error as error:
        raise ValueError(f"values between commas ({error})") from None
    return fields


def _add(blocks: list[Block], fields: Sequence[str], number: int) -> None:
    """Add a line to the last block, or begin a block. Raise `ValueError` with what is expected."""
    kind, *values = fields
    if kind == "subject":
        if len(values) != 1 or values[0] in {block.subject for block in blocks}:
            raise ValueError("subject,NAME, once for each subject")
        blocks.append(Block(values[0], number))
        return
    if not blocks:
        raise ValueError("subject,NAME in the first line: a file of conservative verify, not of a test in another language")
    block = blocks[-1]
    if kind == "settings":
        block.settings = _settings(values)
    elif kind == "order":
        if len(values) != 1:
            raise ValueError("order,NUMBER")
        block.order = _number(values[0])
    elif kind in CHECKS:
        if len(values) != 4:
            raise ValueError("a check, a case, two errors and a mistake, five values")
        name, *errors, mistakes = values
        if (kind, name) in block.cases:
            raise ValueError(f"one line for each case; the first one is line {block.cases[kind, name].line}")
        read_errors = tuple(math.nan if error == "" else _number(error) for error in errors)
        kept = read_errors if kind == "motions" else read_errors[:1]
        block.cases[kind, name] = Case(kept, frozenset(filter(None, mistakes.split(SEPARATOR))), number)
    else:
        raise ValueError(f"a line that begins with subject, settings, {', '.join(CHECKS)}")


def _settings(values: Sequence[str]) -> Settings:
    try:
        order, angle, precision = values
        read_order = None if order == "adaptive" else int(order)
        if precision in ("double", "single"):
            return Settings(read_order, float(angle), precision)
    except ValueError:
        pass
    raise ValueError("settings,ORDER,ANGLE,PRECISION, such as settings,2,0.01,double")


def _number(text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not number >= 0:
        raise ValueError(f"a number of 0 or more instead of {text!r}")
    return number


@contextmanager
def comparing(
    record: str | os.PathLike[str] | None, known: str | os.PathLike[str] | None, only: Collection[str], some_pairs: bool = False
) -> Iterator[Callable[[list[Verification]], list[Verification]]]:
    """Yield the comparison of results with a file of known errors, which is read, or opened for writing, before any work.

    Without a file, results stay as they are. `only` and `some_pairs` are arguments of `compare`.
    """
    if record is not None and known is not None:
        raise BadInput("record", "a file to write and a file to compare with", "one of them")
    if known is not None:
        blocks = read(Path(known))
        yield lambda results: compare(results, blocks, only, some_pairs)
    elif record is not None:
        require_own(Path(record))
        with text_file(Path(record), "record") as stream:

            def write_all(results: list[Verification]) -> list[Verification]:
                new = blocks_of(results)
                write(stream, new)
                return compare(results, new, only, some_pairs)

            yield write_all
    else:
        yield lambda results: results


def require_own(path: Path) -> None:
    """Raise `BadInput` if a file exists that is not a file of known errors."""
    if not path.is_file() or not path.stat().st_size:
        return
    with path.open("rb") as stream:
        if not stream.read(len(MARK) + 3).decode(errors="replace").lstrip("\ufeff").startswith(MARK):
            allowed = "a new file, or a file of known errors, which is replaced"
            raise BadInput("record", f"{str(path)!r}, which is not a file of known errors", allowed)


def write(stream: TextIO, blocks: Iterable[Block]) -> None:
    """Write a file of known errors. Numbers have three digits."""
    stream.write(f"{HEAD}\n")
    writer = csv.writer(stream, lineterminator="\n")
    for block in blocks:
        writer.writerow(("subject", block.subject))
        if block.settings is not None:
            stream.write(f"settings,{block.settings}\n")
        if not math.isnan(block.order):
            writer.writerow(("order", _digits(block.order)))
        for (check, name), case in block.cases.items():
            errors = [_digits(error) for error in case.errors] + [""] * (2 - len(case.errors))
            writer.writerow((check, name, *errors, SEPARATOR.join(sorted(case.mistakes))))


def _digits(number: float) -> str:
    return "" if math.isnan(number) else f"{number:#.3g}"


def blocks_of(verifications: Sequence[Verification]) -> list[Block]:
    """Return the blocks of verifications. Raise `BadInput` for subjects that cannot be recorded."""
    _require_names("record", verifications)
    return [_block(verification) for verification in verifications]


def _block(verification: Verification) -> Block:
    ran = [finding for finding in verification.findings if isinstance(finding, MotionFinding)]
    if ran and all(math.isinf(finding.error) for finding in ran):
        raise BadInput("record", f"{verification.subject!r}, whose runs all end early: {ran[0].detail}", _RUNS)
    block = Block(verification.subject, settings=verification.settings)
    for finding in verification.findings:
        if finding.verdict is Verdict.NOT_TESTED:
            continue
        if finding.check == "protocol" and _is_wrong(finding):
            raise BadInput("record", f"{verification.subject!r}, which does not answer: {finding.detail}", _RUNS)
        if finding.check == "order":
            if finding.subject == verification.subject:  # two back ends have two orders, and are compared by their motions
                block.order = finding.error
            continue
        key, case = key_of(verification, finding), Case(_errors(finding), _mistakes(finding))
        if finding.verdict is Verdict.RIGHT and not _is_right(case, _allowed(finding)):
            case = replace(case, mistakes=frozenset({RIGHT}))
        if len(key[1].splitlines()) > 1 or key in block.cases:
            raise BadInput("record", f"the case {key[1]!r} of {key[0]}", "a name in one line, once in a subject")
        block.cases[key] = case
    return block


_RUNS = "a subject that runs: verify it without --record"


def _require_names(option: str, verifications: Sequence[Verification]) -> None:
    """Raise `BadInput` for names that are not different, or have more than one line."""
    for name, count in Counter(verification.subject for verification in verifications).items():
        if count > 1 or len(name.splitlines()) != 1:
            raise BadInput(option, f"{count} subjects of the name {name!r}", "subjects with different names in one line")


def key_of(verification: Verification, finding: Finding) -> tuple[str, str]:
    """Return the check and the name of a case. A model file has cases for each engine."""
    own = finding.subject == verification.subject
    return finding.check, finding.case if own else ": ".join(filter(None, (finding.subject, finding.case)))


def _is_wrong(finding: Finding) -> bool:
    return finding.verdict is Verdict.WRONG


def _errors(finding: Finding) -> tuple[float, ...]:
    return finding.errors if isinstance(finding, MotionFinding) else (finding.error,)


def _allowed(finding: Finding) -> tuple[float, ...]:
    return finding.tolerances if isinstance(finding, MotionFinding) else (finding.allowed,)


def _mistakes(finding: Finding) -> frozenset[str]:
    if finding.verdict is Verdict.RIGHT:
        return frozenset()
    return frozenset({UNDECIDED} if finding.verdict is Verdict.UNDECIDED else (cause.key for cause in finding.causes))


def _is_right(case: Case, allowed: Sequence[float]) -> bool:
    """Return whether a recorded case was right, which its errors decide if no word does."""
    if case.mistakes:
        return case.mistakes == {RIGHT}
    return all(error <= most for error, most in zip(case.errors, allowed, strict=True))  # False for nan


def compare(
    verifications: Sequence[Verification], blocks: Sequence[Block], only: Collection[str] = (), some_pairs: bool = False
) -> list[Verification]:
    """Return verifications with the standing of each finding against the blocks of a file.

    Parameters
    ----------
    verifications, blocks
        The results of this run and of the recorded one.
    only
        Checks of this run; empty for all. Recorded cases of other checks are ignored.
    some_pairs
        Whether this run has selected pairs only, so that other recorded pairs are ignored.

    Raises
    ------
    BadInput
        A subject is not in the file or is not verified, or was recorded with other settings.
    """
    _require_names("known", verifications)
    found = {block.subject: block for block in blocks}
    matched = [_match(verification, found) for verification in verifications]
    used = {block.subject for block in matched}
    for block in blocks:
        if block.subject not in used:
            got = f"the subject {block.subject!r} in line {block.line}, which is not verified"
            raise BadInput("known", got, f"only {', '.join(sorted(used))}: verify the same subjects, or record again")
    several, compared = len(verifications) > 1, list[Verification]()
    for verification, block in zip(verifications, matched, strict=True):
        _require_settings(verification, block)
        findings = _compare_all(verification, block, only, some_pairs)
        change = _change(findings, block, verification.subject if several else "")
        compared.append(replace(verification, findings=findings, compared=True, change=change))
    return compared


def _match(verification: Verification, blocks: Mapping[str, Block]) -> Block:
    """Return the block of a subject; an engine can have another version than it had."""
    if verification.subject in blocks:
        return blocks[verification.subject]
    if verification.kind == "engine":
        name = _without_version(verification.subject)
        same = [block for block in blocks.values() if _without_version(block.subject) == name]
        if len(same) == 1:
            return same[0]
    got = f"no subject {verification.subject!r} among {', '.join(blocks)}"
    raise BadInput("known", got, "a file with a record of each subject: record again")


def _without_version(text: str) -> str:
    try:
        return str(registry.read_name(text)._replace(version=""))
    except BadInput:
        return text


def _require_settings(verification: Verification, block: Block) -> None:
    now, was = verification.settings, block.settings
    if None not in (now, was) and now != was:
        got = f"settings {was} of {block.subject!r} (line {block.line})"
        raise BadInput("known", got, f"the settings of this run, {now}: record again")


def _compare_all(verification: Verification, block: Block, only: Collection[str], some_pairs: bool) -> list[Finding]:
    """Return the findings with their standings, and a finding for each case that is not tested any more."""
    findings, left = list[Finding](), dict(block.cases)
    random = any(
        check == "repeatability" and not _is_right(case, (math.nan,)) for (check, _), case in block.cases.items()
    ) or any(finding.check == "repeatability" and _is_wrong(finding) for finding in verification.findings)
    for finding in verification.findings:
        was = left.pop(key_of(verification, finding), None)
        if finding.check == "order":
            findings.append(_compare_order(finding, block.order) if finding.subject == verification.subject else finding)
        else:
            findings.append(_compare(finding, was, random))
    if any(finding.check == "protocol" and _is_wrong(finding) for finding in findings):  # nothing else was tested
        return findings
    for check, name in left:
        if (not only or check in only) and not (some_pairs and check == "pairs"):
            skipped = Finding(verification.subject, check, name, Verdict.NOT_TESTED, detail=SKIPPED)
            findings.append(replace(skipped, standing=Standing.NEW, change=SKIPPED))
    return findings


def _compare(finding: Finding, was: Case | None, random: bool) -> Finding:
    """Return a finding with its standing against the recorded case. `random` is True if errors differ from run to run."""
    if finding.verdict is Verdict.NOT_TESTED:
        why = f"{finding.detail}; {SKIPPED}" if finding.detail else SKIPPED  # such as an engine that does not answer in time
        return finding if was is None else replace(finding, standing=Standing.NEW, change=why)
    mistakes = _mistakes(finding)
    if finding.verdict is Verdict.UNDECIDED:
        as_recorded = was is not None and was.mistakes == mistakes
        return replace(finding, standing=Standing.KNOWN) if as_recorded else finding
    if finding.check == "protocol" or was is None:  # a program that does not run has no known errors
        return _new(finding, was, ()) if _is_wrong(finding) else finding
    allowed = [most if most > 0 else ROUNDING for most in _allowed(finding)]  # False for nan
    limits, worse = [], []
    for k, (error, before) in enumerate(zip(_errors(finding), was.errors, strict=True)):
        limits.append(allowed[k] + SHARE * _size(before))
        if not _size(error) <= (RANDOM if random else 1.0) * _size(before) + limits[k]:
            worse.append(k)
    better = [k for k, limit in enumerate(limits) if _size(was.errors[k]) - _size(_errors(finding)[k]) > limit]
    improved = bool(better) and not worse and not random and not _is_right(was, allowed)
    same = _is_same(was.mistakes, mistakes, random)
    # A mistake that a larger one has hidden shows when that one is gone: a smaller error is no failure.
    if _is_wrong(finding) and (worse or not (same or improved)):
        return _new(finding, was, worse)
    if improved:
        k = better[0]
        change = f"{_phrase(was.errors[k])} to {_phrase(_errors(finding)[k])} {_unit(finding, k)}".rstrip()
        change += "" if same or not _is_wrong(finding) else f", now {_named(mistakes, finding)}"
        return replace(finding, standing=Standing.BETTER, change=f"{change}: record again to tighten")
    if not _is_wrong(finding) and not _is_right(was, allowed) and was.mistakes != {UNDECIDED} and math.isnan(finding.error):
        return replace(finding, standing=Standing.BETTER, change="wrong to right: record again to tighten")
    return replace(finding, standing=Standing.KNOWN) if _is_wrong(finding) else finding


def _is_same(was: frozenset[str], now: frozenset[str], random: bool) -> bool:
    """Return whether the mistakes of a wrong case are the recorded ones: of several that explain it, one is enough."""
    if was & WORDS:
        return False
    return was == now or bool(was & now) or (random and not (was and now))


def _size(error: float) -> float:
    """Return an error to compare: without a measured error, a wrong case is as wrong as can be."""
    return math.inf if math.isnan(error) else error


def _new(finding: Finding, was: Case | None, worse: Sequence[int]) -> Finding:
    """Return a new failure with its errors and mistakes now and as recorded."""
    parts = list[str]()
    for k in worse or (0,):
        now, before = _errors(finding)[k], math.nan if was is None else was.errors[k]
        if not math.isnan(now):
            parts.append(f"{_name(finding, k)} {_phrase(now)} {_unit(finding, k)}".rstrip())
            parts[-1] += "" if math.isnan(before) else f", was {_phrase(before)}"
    mistakes = _mistakes(finding)
    now_named = finding.detail if not mistakes and math.isnan(finding.error) else _named(mistakes, finding)
    if was is None or _is_same(was.mistakes, mistakes, random=False):
        parts.append(now_named)
    else:
        parts.append(f"{now_named}, was {_named(was.mistakes)}")
    return replace(finding, standing=Standing.NEW, change="; ".join(filter(None, parts)))


def _named(mistakes: Collection[str], finding: Finding | None = None) -> str:
    ended = finding.detail if finding is not None and math.isinf(finding.error) else ""
    return " or ".join(sorted(mistakes)) or ended or UNKNOWN


def _phrase(error: float) -> str:
    return "no error" if math.isnan(error) else f"{error:.1e}"


def _name(finding: Finding, k: int) -> str:
    return ("attitude error", "rates error")[k] if isinstance(finding, MotionFinding) else "error"


def _unit(finding: Finding, k: int) -> str:
    return ("rad", "")[k] if isinstance(finding, MotionFinding) else finding.unit


def _compare_order(finding: Finding, was: float) -> Finding:
    """Return the finding on the order with its standing: a wrong order may not be lower than the recorded one."""
    if _is_wrong(finding):
        if finding.error >= was - SAME_ORDER:  # False for nan
            return replace(finding, standing=Standing.KNOWN)
        before = "" if math.isnan(was) else f", was {was:.1f}"
        return replace(finding, standing=Standing.NEW, change=f"order {finding.error:.1f}{before}")
    return finding


def _change(findings: Sequence[Finding], block: Block, subject: str) -> str:
    """Return the sentence for a pull request, "" if nothing changed that it says."""
    order = next((finding.error for finding in findings if finding.check == "order"), math.nan)
    first = next((finding for finding in findings if finding.check == "motions" and finding.standing is Standing.NEW), None)
    first_bad = ""
    if first is not None:
        reason = SKIPPED if first.verdict is Verdict.NOT_TESTED else _named(_mistakes(first), first)
        first_bad = f"{first.case} ({reason})"
    return change_of(_largest_errors(findings, block), (block.order, order), first_bad, subject)


def _largest_errors(findings: Sequence[Finding], block: Block) -> tuple[float, float]:
    """Return the largest attitude errors of free motions, rad, before and now. Runs that ended early have none."""
    from .motions.motion import load  # here: recordings and model files need no motions

    free = {motion.name for motion in load() if not motion.features}
    before = [case.errors[0] for (check, name), case in block.cases.items() if check == "motions" and name in free]
    now = [finding.errors[0] for finding in findings if isinstance(finding, MotionFinding) and finding.case in free]
    was, largest = (max(filter(math.isfinite, errors), default=math.nan) for errors in (before, now))
    return was, largest
