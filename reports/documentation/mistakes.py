"""The table of mistakes and where they are named: each mistake of the catalogue, planted in a recording of 200 rows.

    python -m conservative.reports.documentation.mistakes [KEY...]

writes mistakes.csv again, or the rows of some mistakes.
"""

from __future__ import annotations

import csv
import sys
import warnings
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

import conservative as cv
from conservative.attitude import Array, to_quaternion
from conservative.benchmarks.verification import programs
from conservative.benchmarks.verification.compare import SIGMAS, Compared
from conservative.benchmarks.verification.explain import PROGRAM_KINDS
from conservative.benchmarks.verification.explanation import Trial
from conservative.benchmarks.verification.find_steps import by_step
from conservative.benchmarks.verification.mistakes import BY_KEY
from conservative.benchmarks.verification.mistakes.attitudes import Drift, Rule
from conservative.benchmarks.verification.mistakes.bodies import (
    FILES,
    FITTED,
    LOADED,
    BodyMistake,
    FileMistake,
    FittedBodyMistake,
)
from conservative.benchmarks.verification.mistakes.equations import EquationsMistake
from conservative.benchmarks.verification.mistakes.habits import Habit, RowHabit, Standstill
from conservative.benchmarks.verification.mistakes.mistake import Mistake
from conservative.benchmarks.verification.mistakes.readings import Reading
from conservative.benchmarks.verification.mistakes.samples import RESAMPLED, Resampling
from conservative.benchmarks.verification.mistakes.scenes import SceneDigits, SceneMistake
from conservative.benchmarks.verification.mistakes.steps import Integrator
from conservative.benchmarks.verification.mistakes.times import RowTimes, Time
from conservative.benchmarks.verification.mistakes.wrapped import KEPT, SAVED, RoundedMistake
from conservative.benchmarks.verification.motions import files
from conservative.benchmarks.verification.motions.motion import load
from conservative.benchmarks.verification.recordings.table import Recording
from conservative.benchmarks.verification.recordings.verdict import verify_recording
from conservative.benchmarks.verification.solution import truth
from conservative.benchmarks.verification.trials import by_drift, by_habit, by_rule, compose
from conservative.errors import Unsupported
from conservative.grid import Grid
from conservative.scene import Scene
from conservative.trajectory import Trajectory

FILE = Path(__file__).with_name("mistakes.csv")
T = np.linspace(0, 6, 200)
"""Times of the rows, s."""
NAMED, WITH_OTHERS, NOT_NAMED, NOT_MEASURED = "named", "with others", "not named", "not measured"
SHOWS = 1e-8
"""Smallest error that makes a difference, rad or relative: ten times what is allowed."""
RATES = "recording, rates only"
DOORS = ("recording", RATES, "program, engine or gate", "test files", "model files")
COLUMNS = ("mistake", *DOORS)
"""The columns: a gate verifies both versions as programs. Programs are given exact motions, whose samples they answer."""
UNSEEN = {
    "rows": "a program writes no rows",
    "bodies": "a program gets its body in numbers",
    "steps": "an error of the method, which the order shows",
}
"""Kinds of mistakes that a program does not have, with the reason."""
LOADERS = {mistake.key for mistake in (*LOADED, *FITTED, *FILES)}
"""Keys of mistakes of model files and of their loaders, which are named there (test_bodies.py and test_links.py)."""
WRAPPED = {mistake.key for mistake in (*SAVED, *KEPT)}
"""Keys of mistakes of engines that save, set or scale a body, which pairs name (test_pairs.py)."""
OF_LOADERS, OF_FILES, NO_MOTION = "only a loader has it", "only a model file has it", "a model file has no motion"
OF_PAIRS = "named in pairs of files"
"""Reasons why a mistake cannot be seen in a motion, and in a model file."""
NO_CLOCK = "a program has no clock: its samples are after steps"
"""Reason why a program does not have a mistake of time stamps."""
OF_RECORDERS = "a recorder or a filter has it, which a program does not use"
"""Reason why a program does not have a mistake of the part of rows that is recorded."""
ALL_DIGITS = "a program gets numbers with all digits"
"""Reason why a program does not have a rounded scene."""
SAMPLED = 4
"""Rows from sample to sample of a recorder that repeats or interpolates samples."""
PARTS, MOTIONS = 2, 6
"""Steps between two rows, and exact motions that a mistake of a program is planted in."""


WITH_DIGITS = "digits"
"""Name of the scene with numbers that may have been rounded."""


def scenes() -> list[Scene]:
    """Return scenes that have all parts which mistakes are about, the simplest first."""
    body = cv.RigidBody([[3.0, 0.4, -0.2], [0.4, 2.0, 0.3], [-0.2, 0.3, 4.0]])
    start = Rotation.from_rotvec([0.4, -0.7, 0.3]).as_matrix(), np.array([0.7, -1.1, 1.6])
    field = cv.UniformGravity(5.0, [0.1, -0.3, 0.6])
    free = Scene("free", body, *start, float(T[-1]))
    heavy = free.rename("heavy", potential=field)
    torque = cv.Torque([0.4, -0.3, 0.5])
    rotor = free.rename("rotor", body=cv.RigidBody(body.inertia, rotor_momentum=[0.5, -0.3, 0.8]))
    damped = free.rename("damped", damping=cv.Damping(0.2 * np.eye(3)))
    turning = free.rename("turning", potential=cv.Turning(field, cv.Orbit(0.4, [0.3, 0.2, 0.9])))
    tiny = Scene("tiny", cv.RigidBody([4e-7, 9e-7, 1.2e-6]), *start, float(T[-1]))
    motor = cv.RigidBody(body.inertia, rotor_momentum=([0.0, 6.0], [[0.0, 0.0, 0.2], [0.0, 0.3, 0.9]]))
    digits = free.rename(WITH_DIGITS, body=cv.RigidBody(body.inertia, rotor_momentum=[0.51234, -0.31234, 0.81234]))
    driven = [free.rename("torque", torque=torque), damped, turning, tiny, free.rename("motor", body=motor)]
    return [free, heavy, rotor, *driven, digits]


NUMBERS: Mapping[str, float] = {
    **{
        "shift": 0.013,
        "rate": 0.01,
        "late": 0.011,
        "turn_1": 0.3,
        "turn_2": -0.2,
        "turn_3": 0.4,
        "factor": 0.9,
        "mass share": 0.9,
        "damping": 0.1,
        "bias_1": 0.02,
        "bias_2": -0.03,
        "bias_3": 0.01,
        "drift_1": 0.02,
        "drift_2": -0.05,
        "drift_3": 0.03,
        "drift": 0.1,
    },
    **{"limit": 1.9, "band": 0.3, "time": 3.01},
}
"""Values of the numbers that are planted, SI units."""
OF_KEY: Mapping[str, Mapping[str, float]] = {"rate limit per component": {"limit": 1.4}, "size of the field": {"factor": 1.1}}
"""Other values, for mistakes that these numbers do not show."""


Rows = tuple[Array, Array]
"""Attitudes (n, 3, 3) and rates (n, 3)."""


def case_of(scene: Scene, t: Array, step: float | None = None) -> Compared:
    """Return the exact motion of a scene, from its start at t = 0, as a case of the search."""
    R, w = truth(scene, 0.0, t)
    allowed = np.full(2, 1e-9)
    scale = float(np.linalg.norm(w, axis=1).max())
    return Compared(scene, t, (R, w), 0.0, scale, allowed, allowed / SIGMAS, rounded=(1e-13, 1e-13), step=step)


def plant(mistake: Mistake, case: Compared) -> Rows | None:
    """Return the rows that a mistake makes of an exact motion; None if it makes no difference."""
    trial, made = trial_of(mistake), None
    if isinstance(mistake, SceneMistake) and mistake.start:
        made = None if (other := mistake.change(case.scene)) is None else truth(other, 0.0, case.t)
    elif trial is None:
        made = BY_HAND[mistake.key](case) if mistake.key in BY_HAND else None
    elif (motion := trial.build(case)) is None:
        return None
    else:
        values = {**NUMBERS, **OF_KEY.get(mistake.key, {})}
        numbers = np.array([[values[number.name] for number in trial.numbers]])
        R, w = motion(case.scene.R_WB0[None], case.scene.w_WB_B0[None], numbers, len(case.t))
        made = R[0], w[0]
    return made if made is None or case.errors(*made).max() > SHOWS else None


def trial_of(mistake: Mistake) -> Trial | None:
    """Return the trial that makes the motion with a mistake; None for one that belongs to the rows of a file."""
    match mistake:
        case Integrator():
            return by_step(mistake, PARTS)
        case Rule():
            return by_rule(mistake, PARTS)
        case Drift():
            return by_drift(mistake)
        case Habit():
            return by_habit(mistake, T[1] / PARTS)
        case Reading() | Time() | SceneMistake() | EquationsMistake():
            return compose(mistake)
    return None


def _stands(time: float, rest: float) -> Callable[[Compared], Rows]:
    def change(case: Compared) -> Rows:
        t = np.minimum(case.t, time)
        at, place = np.unique(t, return_inverse=True)
        R, w = truth(case.scene, 0.0, at) if len(at) > 1 else (x[:1] for x in case.exact)
        return R[place], np.where((case.t > time)[:, None], rest, 1.0) * w[place]

    return change


def _some(off: Callable[[Compared], Array], key: str) -> Callable[[Compared], Rows]:
    def change(case: Compared) -> Rows:
        random = np.random.default_rng(0)
        turn = Rotation.from_rotvec(0.2 * random.normal(size=(len(case.t), 3))).as_matrix()
        R, w = case.exact
        other = R @ turn, w + 0.2 * random.normal(size=w.shape)
        mistake: Any = BY_KEY[key]  # a `RowHabit`
        return mistake.change(case.exact, other, off(case))

    return change


def _fifth(case: Compared) -> Array:
    return np.arange(len(case.t)) % 5 == 3


def _signs(case: Compared) -> Array:
    q = to_quaternion(case.exact[0])
    return np.append(False, (q[1:] * q[:-1]).sum(axis=1) < 0)


def _stands_alone(of: int, rest: float) -> Callable[[Compared], Rows]:
    def change(case: Compared) -> Rows:
        still = _stands(NUMBERS["time"], rest)(case)
        return (still[0], case.exact[1]) if of == 0 else (case.exact[0], still[1])

    return change


def _resampled(mistake: Resampling) -> Callable[[Compared], Rows]:
    def change(case: Compared) -> Rows:
        spacing = SAMPLED * float(case.t[1])
        k, times = (
            np.floor(case.t / spacing + 1e-9).astype(int),
            np.array(spacing * np.arange(len(case.t) // SAMPLED + 3), float),
        )
        samples, share = truth(case.scene.rename("longer", t_end=2 * float(times[-1])), 0.0, times), case.t / spacing - k
        made = []
        for law, x, right in zip((mistake.attitudes, mistake.rates), samples, case.exact, strict=True):
            made.append(right if law is None else law(share, x[k], x[k + 1]))
        return made[0], made[1]

    return change


def _rounded_scene(case: Compared) -> Rows:
    """Return the motion of the scene with a rotor of five digits, before it was rounded; of other scenes the right motion."""
    rotor = case.scene.body.rotor_momentum
    if case.scene.name != WITH_DIGITS or rotor is None:
        return case.exact
    before = cv.RigidBody(case.scene.body.inertia, rotor + np.array([4e-6, -3e-6, 2e-6]))
    return truth(case.scene.rename("before", body=before), 0.0, case.t)


def _other_times(change: Callable[[Array], Array]) -> Callable[[Compared], Rows]:
    return lambda case: truth(case.scene, 0.0, change(case.t))


def _with_inertia(case: Compared, inertia: Array) -> Rows:
    return truth(case.scene.rename("other", body=cv.RigidBody(inertia)), 0.0, case.t)


def _first_row(case: Compared) -> Rows:
    R, w = (x.copy() for x in case.exact)
    R[0], w[0] = R[0] @ Rotation.from_rotvec([0.01, 0.02, -0.01]).as_matrix(), w[0] * 1.01
    return R, w


def _single_rows(case: Compared) -> Rows:
    R, w = (x.copy() for x in case.exact)
    w[77] *= 1.1
    R[77] = R[77] @ Rotation.from_rotvec([0.1, 0.2, -0.1]).as_matrix()
    return R, w


BY_HAND: Mapping[str, Callable[[Compared], Rows]] = {
    "sleep": _stands(NUMBERS["time"], 0.0),
    "halt": _stands(NUMBERS["time"], 1.0),
    "frozen attitudes": _stands_alone(0, 1.0),
    "frozen rates": _stands_alone(1, 1.0),
    "rates of 0": _stands_alone(1, 0.0),
    **{mistake.key: _resampled(mistake) for mistake in RESAMPLED},
    "digits of the scene": _rounded_scene,
    "frozen motion": lambda case: (np.repeat(case.exact[0][:1], len(case.t), 0), np.repeat(case.exact[1][:1], len(case.t), 0)),
    **{name: _some(_fifth, name) for name, mistake in BY_KEY.items() if isinstance(mistake, RowHabit) and mistake.periodic},
    "rates at sign changes": _some(_signs, "rates at sign changes"),
    "single rows": _single_rows,
    "first row": _first_row,
    "dropped rows": _other_times(lambda t: np.where(np.arange(len(t)) < 90, t, t + 3 * (t[1] - t[0]))),
    "jittered times": _other_times(lambda t: t + np.append(0, 1e-3 * np.random.default_rng(1).normal(size=len(t) - 1))),
    "other moments": lambda case: _with_inertia(
        case, np.diag([1.0, 1.1, 0.95]) @ case.scene.body.inertia @ np.diag([1.0, 1.1, 0.95])
    ),
    "another body": lambda case: _with_inertia(case, np.diag([3.1, 2.2, 4.3])),
}
"""Rows of the mistakes that belong to one file."""


def times_of(key: str) -> Array:
    """Return the times of the rows. A recording without its start shows that another one was simulated."""
    return T[1:] if getattr(BY_KEY[key], "start", False) else T


@cache
def planted(key: str) -> tuple[Scene, Rows] | None:
    """Return the first scene on which a mistake makes a difference, and the rows; None if there is none."""
    for scene in scenes():
        case = case_of(scene, times_of(key), T[1] / PARTS if getattr(BY_KEY[key], "of_step", False) else None)
        if (made := plant(BY_KEY[key], case)) is not None:
            return scene, made
    return None


def is_of_loaders(key: str) -> bool:
    """Return whether only loaders of model files have a mistake. Dropped products of inertia are also a mistake of a motion."""
    return isinstance(BY_KEY[key], BodyMistake | FittedBodyMistake | RoundedMistake)


def in_recording(key: str, attitudes: bool = True) -> str:
    """Return in words how the verification of a recording with rates names a planted mistake, or why it does not."""
    if is_of_loaders(key):
        return OF_LOADERS
    if isinstance(BY_KEY[key], FileMistake):
        return OF_FILES
    if (example := planted(key)) is None:
        return NOT_NAMED
    scene, (R, w) = example
    t = times_of(key)
    case = case_of(scene, t)
    if not attitudes and (case.errors(case.exact[0], w)[1] < 1e-6).all():
        return "it does not change the rates"
    if not attitudes and not scene.free:
        return "rates of a body in a field do not determine its motion"
    recording = Recording(t, (R if attitudes else None, w), rows=len(t))
    with warnings.catch_warnings(action="ignore"):
        result = verify_recording(scene, recording, from_row=t[0] == 0)
    (finding,) = result.findings
    keys = [cause.keys for cause in finding.causes]
    if (key,) in keys:
        return NAMED if len(keys) == 1 else WITH_OTHERS
    if len(keys) == 1:
        return f"as {' + '.join(keys[0])}"
    return NOT_NAMED if finding.verdict == "wrong" else str(finding.verdict)


def not_of_programs(mistake: Mistake) -> str:
    """Return why a program does not have a mistake; "" if it can."""
    if is_of_loaders(mistake.key):
        return OF_LOADERS
    if isinstance(mistake, FileMistake):
        return OF_FILES
    if mistake.kind not in PROGRAM_KINDS:
        return UNSEEN[mistake.kind]
    if isinstance(mistake, Drift) or (isinstance(mistake, Standstill) and mistake.of is not None):
        return OF_RECORDERS
    if isinstance(mistake, SceneDigits):
        return ALL_DIGITS
    of_clock = isinstance(mistake, RowTimes) or (isinstance(mistake, Time) and not mistake.of_step and not mistake.unit)
    return NO_CLOCK if of_clock else ""


def in_program(key: str) -> str:
    """Return in words how the verification of a program names a mistake, planted in up to `MOTIONS` exact motions."""
    mistake = BY_KEY[key]
    if reason := not_of_programs(mistake):
        return reason

    done = list[str]()

    def solve(scene: Scene, grid: Grid) -> Trajectory:
        made = plant(mistake, case_of(scene, grid.t, grid.dt)) if len(done) < MOTIONS or scene.name in done else None
        if made is None:
            raise Unsupported("scene", repr(scene.name), "a scene on which the mistake makes a difference")
        done.append(scene.name)
        return Trajectory(scene, grid.t, *made, "planted")

    findings, named, _ = programs.motion_findings("planted", programs.run_motions(solve, 2))
    if not any(finding.verdict == "wrong" for finding in findings):
        return "no exact motion shows it"
    keys = [[explanation.keys for explanation in group.explanations] for group in named]
    if keys and (key,) in keys[0]:
        return NAMED if len(keys[0]) == 1 else WITH_OTHERS
    return f"as {' + '.join(keys[0][0])}" if keys and len(keys[0]) == 1 else NOT_NAMED


def in_test_files(key: str) -> str:
    """Return in words whether the test files of references/motions have the signature of a mistake."""
    if reason := not_of_programs(BY_KEY[key]):
        return reason
    return NAMED if key in _caught() else NOT_NAMED


@cache
def _caught() -> frozenset[str]:
    return frozenset(caught["mistake"] for motion in load() for caught in files.read(motion.name)["catches"])


def row_of(key: str) -> dict[str, str]:
    """Return the row of a mistake: its key, and the answer of each door."""
    motions = in_recording(key), in_recording(key, attitudes=False), in_program(key), in_test_files(key)
    return dict(
        zip(COLUMNS, [key, *motions, NAMED if key in LOADERS else OF_PAIRS if key in WRAPPED else NO_MOTION], strict=True)
    )


def read_rows() -> dict[str, dict[str, str]]:
    """Return the rows of the table by key."""
    with FILE.open(encoding="utf-8", newline="") as file:
        return {row["mistake"]: row for row in csv.DictReader(file)}


def write_rows(rows: Mapping[str, dict[str, str]]) -> None:
    """Write rows in the order of the catalogue."""
    with FILE.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, restval=NOT_MEASURED, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows.get(key, {"mistake": key}) for key in BY_KEY)


def main(keys: Iterable[str]) -> None:
    """Write the table again, or the rows of some mistakes."""
    rows = read_rows()
    for key in keys or BY_KEY:
        rows[key] = row_of(key)
        print(*rows[key].values(), sep=" | ", flush=True)
    write_rows(rows)


if __name__ == "__main__":
    main(sys.argv[1:])
