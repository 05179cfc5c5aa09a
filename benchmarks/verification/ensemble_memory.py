"""Memory of a large ensemble whose samples go to a folder: is it under the limit, whatever the number of samples?

    python -m conservative.benchmarks.verification.ensemble_memory --bodies 1e6 --samples 100 --out FOLDER

FOLDER, which is removed again, takes 96 bytes a sample: 10 GB for these numbers. Exit code 1 if the limit is passed.
"""

from __future__ import annotations

import resource
import shutil
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import click
import numpy as np

import conservative as cv
from conservative.attitude import Array

LIMIT = 2**30
"""Bytes of memory that a run may take at its peak, all of Python and of compiled code included."""
STEP = 0.01
"""Step, s."""


@dataclass(frozen=True)
class Memory:
    """Peaks of memory of this process, bytes, before a run and after it, wall time of the run, s, and bytes on the disk."""

    before: int
    after: int
    wall: float
    disk: int


def measure(bodies: int, samples: int, place: Path, method: str | None) -> Memory:
    """Return what a run of free bodies takes that keeps so many samples of each."""
    rates = draw_rates(bodies)
    before, begun = read_peak(), time.perf_counter()
    found = cv.integrate_many(
        cv.scenes.brick_flip(), w_WB_B0=rates, dt=STEP, t_end=STEP * (samples - 1), method=method, path=place
    )
    wall = time.perf_counter() - begun
    if found.failures or len(found.t) != samples:
        raise cv.BadInput("samples", f"{len(found.failures)} failures and {len(found.t)} samples", f"0 and {samples}")
    return Memory(before, read_peak(), wall, sum(path.stat().st_size for path in place.rglob("*") if path.is_file()))


def draw_rates(bodies: int) -> Array:
    """Return rates (n, 3), rad/s, one after another of a fixed seed."""
    return np.random.default_rng(14).normal(size=(bodies, 3))


def read_peak() -> int:
    """Return the largest resident memory that this process had so far, bytes."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else peak * 1024


@click.command()
@click.option("--bodies", type=float, default=1e5, show_default=True)
@click.option("--samples", type=click.IntRange(2), default=100, show_default=True)
@click.option("--method", metavar="M", help="[default: that of integrate_many]")
@click.option("--out", type=click.Path(path_type=Path), required=True, help="A folder that is not there; it is removed again.")
def main(bodies: float, samples: int, method: str | None, out: Path) -> None:
    """Print the peak of memory of a run, and exit with 1 if it is above the limit."""
    try:
        found = measure(int(bodies), samples, out, method)
    finally:
        shutil.rmtree(out, ignore_errors=True)
    print(f"{bodies:g} bodies, {samples} samples: {found.wall:.1f} s, {found.disk / 2**30:.2f} GiB on the disk")
    print(
        f"memory {found.before / 2**20:.0f} MiB before, {found.after / 2**20:.0f} MiB at its peak; {LIMIT / 2**20:.0f} allowed"
    )
    sys.exit(found.after > LIMIT)


if __name__ == "__main__":
    main()
