"""Two recordings of one scene that disagree: which one is wrong, and by which mistake?"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from conservative.attitude import Array, angle_between
from conservative.errors import BadInput
from conservative.scene import Scene

from ..compare import Compared, differ
from ..finding import Finding, Verdict, Verification
from ..solution import States, truth
from ..which import Difference, Side, which
from .comparison import Rows, prepare
from .table import Recording
from .verdict import UNITS, verify_recording

GRID, NEAREST, SHIFTS, SMALL_SHIFT = 0.1, 8, 8, 1e-6
"""Distance of the shifts of time that are tried, rad, the number of the best that are improved, the steps of each, and the
shift for slopes, rad."""
ROWS = 60
"""Largest number of rows in which related motions are compared."""
RELATED, BESIDE = 3.0, 1.0
"""Largest errors of related motions, over the allowed ones: each has a start with an error of its own. Rows are `BESIDE` it."""
AS_GOOD = 2.0
"""Factor of errors within which the smaller shift of time is preferred: a periodic motion has several that are as good."""
START_DECIDES = ". --start scene decides, and tests the start too: if the scene has another one, both are wrong"
BODIES = {"another body", "other moments"}
"""Keys of mistakes of the body. If both recordings have one, `--body` names the wrong body, and the recordings may be right."""
APART = "their times do not overlap"
Named = tuple[str, Recording]
"""A recording and the name of its file."""


@dataclass(frozen=True)
class Two:
    """The verifications of two recordings, the difference between them, and what is assumed of their body; "" with a body."""

    first: Verification
    second: Verification
    difference: Difference
    assumed: str = ""


def verify_two(
    scene: Scene,
    first: Named,
    second: Named,
    from_row: bool = True,
    error: float | None = None,
    tell: Callable[[str], object] = lambda _: None,
) -> Verification:
    """Verify two recordings of one scene, and compare them with each other.

    They may have other columns, times and starts. The result has the findings of both and their difference, `Two` as details,
    and a sentence on which one is wrong, and by which mistake. The other arguments are arguments of `verify_recording`.

    Raises
    ------
    BadInput
        For the first recording that cannot be compared, with the name of its file.
    """
    return verify_both(scene, name_apart(first, second), from_row, error, tell)


def name_apart(first: Named, second: Named) -> tuple[Named, Named]:
    """Return two recordings with different names."""
    if first[0] != second[0]:
        return first, second
    return (f"{first[0]} (first)", first[1]), (f"{second[0]} (second)", second[1])


def verify_both(
    scene: Scene,
    pair: tuple[Named, Named],
    from_row: bool,
    error: float | None,
    tell: Callable[[str], object] = lambda _: None,
    decides: str = START_DECIDES,
) -> Verification:
    """Verify two recordings with different names, as `verify_two`.

    `decides` ends the reason if both are right, and differ.
    """
    first, second = pair
    rows, made = dict[str, Rows](), dict[str, Verification]()
    # First the recording with attitudes and rates: one without the other takes the missing part of its start from it.
    for name, recording in sorted(pair, key=_missing):
        started = _start(scene, recording, [*zip(rows.values(), made.values(), strict=True)]) if from_row else scene
        try:
            rows[name] = prepare(started.rotation_only, recording, from_row, error)
            made[name] = verify_recording(started, recording, from_row, error, _labelled(tell, name), name)
        except BadInput as refused:
            if refused.argument != "run" or name in str(refused.got):
                raise  # an option is wrong, or the message names the file already
            raise BadInput(refused.argument, f"{name}: {refused.got}", refused.allowed) from None
    tell("difference")
    a, b = made[first[0]], made[second[0]]
    both, recordings = (rows[first[0]], rows[second[0]]), (first[1], second[1])
    difference = find_difference(both, recordings, from_row)
    right = (a.verdict, b.verdict) == (Verdict.RIGHT, Verdict.RIGHT)
    relation = None
    if right and from_row and both[1].case.start == 0 and (_apart(both, recordings) or not difference.agrees):
        relation = find_relation(both, recordings)
        difference = find_difference(both, recordings, from_row, relation)
    verdicts = {a.verdict, b.verdict}
    verdict = Verdict.WRONG if Verdict.WRONG in verdicts else Verdict.UNDECIDED
    verdict = Verdict.NOT_TESTED if difference.missing else Verdict.RIGHT if difference.agrees else verdict
    made_of_both = join(a, b, difference, verdict, _reason(a, b, difference, decides), both[0].allowed.by)
    if relation is None or not relation.text:
        return made_of_both
    note = f"{b.subject} has the motion of {a.subject} {relation.text}, and is compared with it so."
    return replace(made_of_both, notes=[note, *made_of_both.notes])


def join(
    a: Verification, b: Verification, difference: Difference, verdict: Verdict, reason: str, by: tuple[str, str] = ("", "")
) -> Verification:
    """Return the verification of two recordings, with a `verdict` on the difference between them, and what allows it."""
    names = f"{a.subject} and {b.subject}"
    worse = 0 if difference.missing else difference.worse
    finding = Finding(
        names,
        "recording",
        "difference",
        verdict,
        difference.error[worse],
        difference.allowed[worse],
        UNITS[worse],
        by[worse],
        detail=difference.missing,
    )
    notes = [f"{verification.subject}: {note}" for verification in (a, b) for note in verification.notes]
    return Verification(names, "recordings", [*a.findings, *b.findings, finding], reason, notes, Two(a, b, difference))


def _reason(a: Verification, b: Verification, difference: Difference, decides: str) -> str:
    """Return which of two recordings is wrong, and by which mistake."""
    differ = (
        "both are motions of this body, from different starts: they differ by "
        f"{difference.size} at {difference.time:g} s{decides}"
    )
    check = (
        f"both have the same motion (they differ by at most {difference.size}), but not the motion of this body: check --body. "
        f"{a.subject}: {a.reason}"
    )
    return which(_side(a), _side(b), difference, differ, check, BODIES)


def _side(verification: Verification) -> Side:
    (finding,) = verification.findings
    sentence = finding.causes[0].sentence if finding.mistake else ""
    return Side(verification.subject, verification.verdict, verification.reason, finding.mistake, sentence)


def _labelled(tell: Callable[[str], object], name: str) -> Callable[[str], object]:
    return lambda what: tell(f"{name}: {what}")


def _missing(named: Named) -> int:
    """Return how many of attitudes and rates a recording does not have."""
    return sum(x is None for x in named[1].data)


def _start(scene: Scene, recording: Recording, before: list[tuple[Rows, Verification]]) -> Scene:
    """Return the scene whose start is the state of a right recording at the first time of this one, which lacks a part of it.

    Without a right recording `before`, or if this one has attitudes and rates, the scene is returned as it is.
    """
    for rows, verification in before:
        case, first = rows.case, float(recording.t[0])
        at = first + float(case.t[0] - rows.recording.t[0])  # the case may count its times from the first row
        if verification.verdict is Verdict.RIGHT and any(x is None for x in recording.data) and case.t[0] <= at <= case.t[-1]:
            R, w = truth(case.scene, case.start, np.array([case.start, at]))
            if not scene.loads:  # a scene with loads starts at t = 0, not in the first row
                return scene.rename(scene.name, R_WB0=R[1], w_WB_B0=w[1])
    return scene


@dataclass(frozen=True, eq=False)
class Relation:
    """How the second of two recordings follows from the first: with another clock, in another world, or both.

    Attributes
    ----------
    origin
        Time of the exact motion of the first one at which the second one starts, s.
    turn
        Attitudes of the second one are `turn @ R` for attitudes R of the first one.
    text
        The end of a sentence on it; "" if clock and world are the same.
    error, allowed
        Largest errors (2,) that it leaves between the exact motions of both, and the allowed ones.
    """

    origin: float
    turn: Array
    text: str
    error: Array
    allowed: Array

    @property
    def ratio(self) -> float:
        """The larger ratio of an error and the allowed one."""
        return float((self.error / self.allowed).max())


def _clock(rows: tuple[Rows, Rows], recordings: tuple[Recording, Recording]) -> tuple[float, float]:
    """Return the offset from times of files to times of the first one's exact motion, and the start of the second one."""
    shift = float(rows[0].case.t[0] - recordings[0].t[0])
    return shift, float(recordings[1].t[0]) + shift


def _apart(rows: tuple[Rows, Rows], recordings: tuple[Recording, Recording]) -> bool:
    """Return whether the times of two files do not overlap."""
    a, b = (row.case for row in rows)
    _, origin = _clock(rows, recordings)
    return bool(origin > a.t[-1] or a.t[0] > origin + (b.t[-1] - b.t[0]))


def find_difference(
    rows: tuple[Rows, Rows], recordings: tuple[Recording, Recording], from_row: bool, relation: Relation | None = None
) -> Difference:
    """Return the largest difference between two recordings at common times, after a `relation` between them.

    Without common times, the second one is interpolated: not its rows, which change quickly, but their departures from an
    exact motion. An error of this interpolation is allowed. If their clocks do not overlap and no relation is known, the first
    rows are compared with each other. If related recordings do not overlap, their exact motions are compared.
    """
    a, b = (row.case for row in rows)
    shift, origin = _clock(rows, recordings)
    times = (relation.origin if relation else origin) + (b.t - b.t[0])
    if times[0] > a.t[-1] or a.t[0] > times[-1]:
        if relation:  # such as two parts of one recording
            errors, limits = relation.error.tolist(), relation.allowed.tolist()
            return Difference((errors[0], errors[1]), (limits[0], limits[1]), float(a.t[-1]) - shift, min(ROWS, len(b.t)))
        if not from_row or b.start != 0:
            return Difference(missing=APART)
        times = a.t[0] + (b.t - b.t[0])  # two clocks
    data = b.data if relation is None or b.data[0] is None else (relation.turn.T @ b.data[0], b.data[1])
    have = [x is not None and y is not None for x, y in zip(a.data, b.data, strict=True)]
    if not any(have):
        return Difference(missing="one has attitudes, the other one rates")
    inside = np.flatnonzero((a.t >= times[0]) & (a.t <= times[-1]))
    later = np.clip(np.searchsorted(times, a.t), 1, len(times) - 1)
    nearest = np.where(np.abs(times[later] - a.t) < np.abs(times[later - 1] - a.t), later, later - 1)
    near = sum(recording.digits[0] for recording in recordings) + 4 * np.spacing(max(abs(a.t[-1]), abs(times[-1])))
    common = np.flatnonzero(np.abs(times[nearest] - a.t) <= near)
    direct = len(common) >= max(2, 0.1 * min(len(inside), len(times)))  # a few coincidences are too small a sample
    picked, off = common if direct else inside, np.zeros(2)
    if not len(picked):
        return Difference(missing="no row of one is between rows of the other one")
    ours, theirs = _depart(a, a.t, a.data)[picked], _depart(a, times, data)
    if direct:
        theirs = theirs[nearest[picked]]
    else:
        if len(times) > 2:  # what interpolation from both neighbours misses in each row, over a gap that is twice as long
            share = ((times[1:-1] - times[:-2]) / (times[2:] - times[:-2]))[:, None]
            missed = theirs[1:-1] - (1 - share) * theirs[:-2] - share * theirs[2:]
            off = np.array([np.linalg.norm(missed[:, part], axis=1).max() for part in (slice(3), slice(3, 6))])
        theirs = np.stack([np.interp(a.t[picked], times, column) for column in theirs.T], axis=1)
    turned = (Rotation.from_rotvec(ours[:, :3]).inv() * Rotation.from_rotvec(theirs[:, :3])).magnitude()
    errors = np.stack([turned, np.linalg.norm(ours[:, 3:] - theirs[:, 3:], axis=1)])
    allowed = _allowed(rows) * (RELATED + BESIDE if relation else 1) + off
    largest = np.where(have, errors.max(axis=1), np.nan)
    at = int(np.argmax(errors[int(np.nanargmax(largest / allowed))]))
    return Difference(
        (float(largest[0]), float(largest[1])),
        (float(allowed[0]), float(allowed[1])),
        float(a.t[picked][at]) - shift,
        len(picked),
        direct,
    )


def _depart(reference: Compared, t: Array, data: States) -> Array:
    """Return the departures (n, 6) of samples from an exact motion: turns, rad, and rates, relative; 0 without data."""
    R, w = truth(reference.scene, reference.start, t)
    return differ(R, w, R if data[0] is None else data[0], w if data[1] is None else data[1], reference.scale)


def _allowed(rows: tuple[Rows, Rows]) -> Array:
    """Return the allowed differences (2,) between two recordings."""
    return rows[0].allowed.errors + rows[1].allowed.errors * [1, rows[1].case.scale / rows[0].case.scale]


def find_relation(rows: tuple[Rows, Rows], recordings: tuple[Recording, Recording]) -> Relation | None:
    """Return how the second of two motions of one body follows from the first; None if they are different motions.

    The same clock is tried first, then equal first rows, then other shifts of time, each in the same world and, for a free
    rotation, in another one. Motions in fields are not compared with other shifts, and not in other worlds.
    """
    a, b = (row.case for row in rows)
    scene = a.scene
    _, clock = _clock(rows, recordings)
    some = np.unique(np.linspace(0, len(b.t) - 1, ROWS).astype(int))
    later, (R, w) = b.t[some] - b.t[0], (x[some] for x in b.exact)
    allowed = RELATED * _allowed(rows)
    attitudes = a.data[0] is not None and b.data[0] is not None

    def related(origin: float, turned: bool) -> Relation:
        R_a, w_a = truth(scene, a.start, origin + later)
        turn = np.eye(3)
        if turned:
            U, _, V = np.linalg.svd((R @ np.swapaxes(R_a, 1, 2)).sum(axis=0))
            turn = U @ np.diag([1, 1, np.linalg.det(U @ V)]) @ V
        off = float(angle_between(turn @ R_a, R).max()) if attitudes else 0.0
        error = np.array([off, np.linalg.norm(w_a - w, axis=1).max() / a.scale])
        parts = list[str]()
        if (shift := origin - clock) and abs(shift) * a.scale > allowed.max() / RELATED:
            parts.append(f"{abs(shift):.6g} s {'later' if shift < 0 else 'earlier'}")
        if turned:
            parts.append(f"in a world that is turned by ({', '.join(f'{x:.5g}' for x in _vector(turn))}) rad")
        return Relation(origin, turn, " and ".join(parts), error, allowed)

    def best(origins: list[float], turned: bool) -> Relation | None:
        made = [made for origin in origins if (made := related(origin, turned)).ratio <= 1]
        least = min((made.ratio for made in made), default=0.0)
        good = [made for made in made if made.ratio <= AS_GOOD * least]
        return min(good, key=lambda made: abs(made.origin - clock), default=None)

    if not scene.free or scene.body.rotor_momentum is not None:
        return best([float(a.t[0])], False)
    aligned = [clock, float(a.t[0])]
    others = _nearby(a, (R, w), later, aligned, attitudes)
    for turned in (False, True)[: 1 + attitudes]:
        for origins in ([clock], [float(a.t[0])], others):
            if found := best(origins, turned):
                return found
    return None


def _vector(turn: Array) -> Array:
    return Rotation.from_matrix(turn).as_rotvec()


def _nearby(a: Compared, motion: tuple[Array, Array], later: Array, aligned: list[float], attitudes: bool) -> list[float]:
    """Return times of a free rotation at which the rates are those of a `motion` (R, w) at times `later` than its first row.

    They are near the times at which the first row has equal rates, or equal rates and attitudes. All shifts by which both
    could overlap are tried, from both `aligned` times of the first row on.
    """
    (R, w), rate = motion, a.scale
    longest = max(float(a.t[-1] - a.t[0]), float(later[-1]))
    grid = np.unique(np.concatenate([origin + np.arange(-longest, longest, GRID / rate) for origin in aligned]))
    R_a, w_a = truth(a.scene, a.start, grid)
    off = np.linalg.norm(w_a - w[0], axis=1) / rate
    begin = {0}
    for size in (off, np.hypot(off, angle_between(R_a, np.broadcast_to(R[0], R_a.shape)))) if attitudes else (off,):
        padded = np.concatenate([[np.inf], size, [np.inf]])
        lowest = np.flatnonzero((size <= padded[:-2]) & (size <= padded[2:]))
        begin |= set(lowest[np.argsort(size[lowest], kind="stable")[:NEAREST]].tolist())
    found = list[float]()
    for origin in grid[sorted(begin)].tolist():
        for _ in range(SHIFTS):
            w_a, moved = (truth(a.scene, a.start, origin + later + by)[1] for by in (0.0, SMALL_SHIFT / rate))
            slope = (moved - w_a) / (SMALL_SHIFT / rate)
            origin += float(((w - w_a) * slope).sum() / ((slope * slope).sum() or 1.0))
        found.append(origin)
    return found
