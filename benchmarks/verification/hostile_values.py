"""Hostile values over the public API: is anything but a clear refusal or a right result ever what comes of them?

    python -m conservative.benchmarks.verification.hostile_values --count 20000 --seed 0

A try is a call with arguments of which some are hostile: numbers beyond floats, texts, NUL bytes, nan, wrong shapes, functions
that fail. It passes if it gives a right and finite result, or raises what is documented: `BadInput`, `IntegrationFailed`,
`PotentialFailed`, `MissingEngine`. All else is a leak; so is a try that takes longer than `SECONDS`. What is tried stands in
`conservative.benchmarks.verification.hostile_calls`.
"""

from __future__ import annotations

import math
import signal
import sys
import traceback
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from types import FrameType

import click
import numpy as np

from conservative.attitude import angle_between, orthonormality
from conservative.body import RigidBody
from conservative.errors import AccuracyNotReached, BadInput, IntegrationFailed, MissingEngine, PotentialFailed
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from .hostile_arguments import Try
from .hostile_bodies import Comparison, Search
from .hostile_calls import PARTS, make_try, warm_up
from .hostile_scales import Pair

REFUSALS = (BadInput, IntegrationFailed, PotentialFailed, MissingEngine)
"""What a try may raise."""
SECONDS = 30.0
"""Time, s, from which on a try hangs: many times what the slowest takes, a model file that fills its reader's memory."""
ORTHONORMAL, ENERGY, SAME = 1e-6, 1e-6, 1e-5
"""Gross errors: of R'R - 1, of the energy of a method that conserves it, relative, and of attitudes in other units, rad."""


class Hang(BaseException):
    """A try takes too long; no `Exception`, so that nothing on the way takes it for its own."""


@dataclass
class Leak:
    """A kind of leak: how often it was seen, and the call of the first try that showed it."""

    count: int
    reproducer: str


def find_leaks(tries: Iterable[Try]) -> dict[str, Leak]:
    """Return the kinds of leak that tries show."""
    found: dict[str, Leak] = {}
    for attempt in tries:
        kind = judge(attempt)
        if kind:
            found.setdefault(kind, Leak(0, attempt.words)).count += 1
    return found


def draw_tries(count: int, seed: int, folder: Path, first: int = 0, part: str = "all") -> Iterator[Try]:
    """Return tries from number `first` on, each of its own seed; the files that some of them read are written to a folder."""
    return (make_try(Random(f"{seed} {number}"), folder, part) for number in range(first, first + count))


def judge(attempt: Try) -> str:
    """Return which kind of leak a try shows, "" if it passes."""
    try:
        with _alarm(), warnings.catch_warnings():
            warnings.simplefilter("error")
            warnings.simplefilter("ignore", AccuracyNotReached)
            return find_fault(attempt.call())
    except REFUSALS:
        return ""
    except Hang:
        return f"{attempt.name}: hangs for {SECONDS:g} s"
    except Exception as error:
        return f"{attempt.name}: {type(error).__name__} in {_place(error)}"


def find_fault(value: object) -> str:
    """Return what is wrong with a result, "" for nothing."""
    if isinstance(value, Pair):
        return find_fault(value.scaled) or _difference(value)
    if isinstance(value, Search | Comparison):
        return value.fault
    if isinstance(value, Trajectory):
        return _fault_of_trajectory(value) if value.ok else ""
    if isinstance(value, Scene):
        numbers = (value.energy_scale, value.dt, value.t_end, value.kinetic_energy0)
        return "" if all(map(math.isfinite, numbers)) else "a scene with numbers that are not finite"
    if isinstance(value, RigidBody):
        return "" if value.moments.min() > 0 and np.isfinite(value.inverse).all() else "a body with moments that are none"
    return ""


def _fault_of_trajectory(found: Trajectory) -> str:
    """Return what is wrong with a trajectory that is called ok, by nothing but its samples."""
    method = found.label.rpartition("/")[2].partition(":")[0]
    if not (len(found) >= 2 and found.t[0] == 0 and (np.diff(found.t) > 0).all()):
        return f"wrong ok: times of {method}"
    if not (np.isfinite(found.R_WB).all() and np.isfinite(found.w_WB_B).all()):
        return f"wrong ok: {method} is not finite"
    if orthonormality(found.R_WB).max() > ORTHONORMAL:
        return f"wrong ok: {method} is not orthonormal"
    if "==" in found.label and found.label.startswith("conservative"):
        off = np.abs(found.energy - found.energy[0]).max() / found.scene.energy_scale
        if not off <= ENERGY:
            return f"wrong ok: {method} loses energy"
    return ""


def _difference(pair: Pair) -> str:
    """Return whether a run in other units of time and inertia has other attitudes than the run in the usual ones."""
    if not (pair.scaled.ok and pair.plain.ok):
        return ""
    off = float(angle_between(pair.plain.R_WB, pair.scaled.R_WB).max())
    return "" if off <= SAME else f"wrong ok: {pair.scaled.label.rpartition('/')[2].partition(':')[0]} depends on units"


def _place(error: Exception) -> str:
    """Return the last place of a traceback that is ours, as `file.py:function`."""
    frames = [
        frame
        for frame in traceback.extract_tb(error.__traceback__)
        if "conservative" in frame.filename or "/references/" in frame.filename
    ]
    ours = [frame for frame in frames if "verification" not in frame.filename]
    return f"{Path(ours[-1].filename).name}:{ours[-1].name}" if ours else "the call itself"


@contextmanager
def _alarm() -> Iterator[None]:
    """Raise `Hang` after `SECONDS`, on systems that have alarms."""

    def ring(signum: int, frame: FrameType | None) -> None:
        raise Hang

    if not hasattr(signal, "setitimer"):
        yield
        return
    before = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, SECONDS)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


@click.command()
@click.option("--count", type=click.IntRange(1), default=20000, show_default=True, help="Tries.")
@click.option("--seed", type=int, default=0, show_default=True, help="Seed of what is tried.")
@click.option("--first", type=click.IntRange(0), default=0, show_default=True, help="Number of the first try.")
@click.option("--part", type=click.Choice(list(PARTS)), default="all", show_default=True, help="Kinds of call.")
def main(count: int, seed: int, first: int, part: str) -> None:
    """Try hostile values, and print each kind of leak with one call that shows it."""
    warm_up()
    with TemporaryDirectory() as folder:
        leaks = find_leaks(draw_tries(count, seed, Path(folder), first, part))
    for kind, leak in sorted(leaks.items()):
        click.echo(f"{leak.count:6} x {kind}\n         {leak.reproducer}")
    click.echo(f"{count} tries, {sum(leak.count for leak in leaks.values())} leaks of {len(leaks)} kinds")
    sys.exit(1 if leaks else 0)


if __name__ == "__main__":
    main()
