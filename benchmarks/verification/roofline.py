"""The roofline: operations and bytes of a body-step, what this processor could do with them, and what is reached.

    python -m conservative.benchmarks.verification.roofline --out benchmarks/roofline.md

Operations are counted (`operations`), those of Taylor's series by a formula (`count_series`). What the processor could do is
measured by loops of nothing else (`peak`), in the same process as the steps, in processor time of the thread: the fastest of
interleaved rounds. On a machine with other work, the shares mean more than the times. Nothing is asserted.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from conservative import files, registry
from conservative.kernels.lanes import REGISTER
from conservative.method import Grid

from ..studies.ensembles import draw
from . import operations
from .peak import find_bandwidth, find_peaks, spend

BODIES, STEPS, ROUNDS = 1024, 200, 15
ORDERS = (8, 12, 16)
SAMPLE = 96
"""Bytes of a sample: nine numbers of the attitude and three rates."""
DEAR = 10
"""FMAs that a division or a square root is taken for on a GPU, where both are sequences of them."""


Case = tuple[str, str, float]
"""Method, kind of bodies, and step, s."""


@dataclass(frozen=True)
class Device:
    """A graphics card: FMAs of doubles, and bytes, per second, and who says so."""

    name: str
    fmas: float
    bandwidth: float
    source: str


DEVICES = (
    Device("NVIDIA H100 SXM", 34e12 / 2, 3.35e12, "NVIDIA H100 Tensor Core GPU datasheet: FP64 34 TFLOPS, 3.35 TB/s"),
    Device(
        "NVIDIA GeForce RTX 4090",
        82.6e12 / 64 / 2,
        1.008e12,
        "NVIDIA Ada GPU Architecture, appendix A: FP32 82.6 TFLOPS, FP64 a 64th of it, 1008 GB/s",
    ),
)


@dataclass(frozen=True)
class Work:
    """Operations of a step of one body: multiplications and additions, of which pairs may be one FMA, and the dear ones."""

    multiplications: float
    additions: float
    divisions: float
    roots: float

    @property
    def fewest(self) -> float:
        """FMAs, multiplications and additions together, if every addition that can be were one with a multiplication."""
        return max(self.multiplications, self.additions)

    def bound(self, peaks: Mapping[str, float]) -> float:
        """Return the time, s, below which no step of a body gets."""
        dear = self.divisions * peaks["a division"] + self.roots * peaks["a square root"]
        return self.fewest * peaks["an FMA"] + dear


def read_work(found: Mapping[str, float]) -> Work:
    """Return what `operations` has counted."""
    return Work(found["multiplications"], found["additions"], found["divisions"], found["square roots"])


def count_series(order: int) -> Work:
    """Return the operations of a Taylor series of a body in uniform gravity.

    Coefficient k of two rows of the attitude's matrix (g x w, a x w) and of the rates (w w) has 6 + 6 + 3 products with each of
    the k + 1 pairs of earlier ones; the field 6 with the newest, the bodies' constants 3, the factor h / (k + 1) nine. The sum
    of all terms has nine additions a coefficient.
    """
    pairs = order * (order + 1) / 2
    return Work(15 * pairs + 18 * order, 15 * pairs + 15 * order, 0, 0)


def count_all() -> dict[Case, Work]:
    """Return the operations of each case: method, kind of bodies and step, s."""
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    command = [sys.executable, "-W", "ignore", "-m", operations.__name__]
    printed = subprocess.run(command, env=environment, check=True, capture_output=True, text=True).stdout
    found = {(name, kind, dt): read_work(counted) for name, kind, _, dt, counted in json.loads(printed)}
    ((_, kind, dt), rest) = found.popitem()  # of Taylor, without its series
    for order in ORDERS:
        series = count_series(order)
        found[f"taylor:order={order}", kind, dt] = Work(
            rest.multiplications + series.multiplications, rest.additions + series.additions, rest.divisions, rest.roots
        )
    return found


def reach(cases: Iterable[Case], every: int = STEPS) -> dict[Case, float]:
    """Return the time, s, of a body-step of each case among `BODIES`, samples every so many steps."""
    runs = {
        (name, kind, dt): registry.method(name).prepare_many(draw(kind, BODIES), Grid(dt, STEPS, every))
        for name, kind, dt in cases
    }
    least = dict.fromkeys(runs, math.inf)
    for _ in range(1 + ROUNDS):
        for case, run in runs.items():
            least[case] = min(least[case], spend(run))
    return {case: seconds / (BODIES * STEPS) for case, seconds in least.items()}


@dataclass(frozen=True, eq=False)
class Measured:
    """What a page shows: operations of each case, time of one double's, bytes per second, and times of steps and samples, s."""

    work: Mapping[Case, Work]
    peaks: Mapping[str, float]
    bandwidth: float
    steps: Mapping[Case, float]
    samples: Mapping[Case, float]


def measure() -> Measured:
    """Count and measure everything."""
    work, peaks, bandwidth = count_all(), find_peaks(), find_bandwidth()
    steps, sampled, again = reach(work), reach(work, every=1), find_peaks()
    least = {name: min(peaks[name], again[name]) for name in peaks}
    return Measured(work, least, bandwidth, steps, {case: sampled[case] - steps[case] for case in work})


def write_page(found: Measured) -> str:
    """Return the page."""
    head = HEAD.format(**machine(), width=REGISTER), _peak_table(found.peaks, found.bandwidth)
    reached = REACHED, _step_table(found.work, found.peaks, found.steps)
    samples = SAMPLES.format(bytes=SAMPLE, bound=SAMPLE / found.bandwidth * 1e9), _sample_table(found.samples)
    sources = "\n".join(f"* {device.name}: {device.source}." for device in DEVICES)
    return "\n\n".join([*head, *reached, *samples, GPU.format(dear=DEAR), _gpu_table(found.work), sources]) + "\n"


def _table(header: list[str], rows: list[list[str]]) -> str:
    lines = [header, ["---", *["---:"] * (len(header) - 1)], *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def _peak_table(peaks: Mapping[str, float], bandwidth: float) -> str:
    rows = [[name, f"{seconds * 1e9 * REGISTER:.3f}", f"{1e-9 / seconds:.2f}"] for name, seconds in peaks.items()]
    writing = f"Writing to memory: {bandwidth / 1e9:.1f} GB/s on one core."
    return _table(["operation", "ns a register", "10^9 doubles/s"], rows) + "\n\n" + writing


def _step_table(work: Mapping[Case, Work], peaks: Mapping[str, float], steps: Mapping[Case, float]) -> str:
    rows = []
    for (name, kind, dt), each in work.items():
        bound, reached = each.bound(peaks), steps[name, kind, dt]
        counted = [f"{n:.0f}" for n in (each.multiplications, each.additions, each.divisions, each.roots)]
        times = [f"{bound * 1e9:.2f}", f"{reached * 1e9:.2f}", f"{bound / reached:.0%}"]
        rows.append([f"`{name}`", kind.replace("_", " "), f"{dt:g}", *counted, *times])
    return _table(["method", "bodies", "step, s", "×", "+", "÷", "√", "bound, ns", "reached, ns", "share"], rows)


def _sample_table(samples: Mapping[Case, float]) -> str:
    rows = [[f"`{name}`", kind.replace("_", " "), f"{seconds * 1e9:.1f}"] for (name, kind, _), seconds in samples.items()]
    return _table(["method", "bodies", "ns a sample"], rows)


def _gpu_table(work: Mapping[Case, Work]) -> str:
    rows = []
    for (name, kind, _), each in work.items():
        fmas = each.fewest + DEAR * (each.divisions + each.roots)
        times = [f"{fmas / device.fmas * 1e12:.2f}" for device in DEVICES]
        rows.append([f"`{name}`", kind.replace("_", " "), f"{fmas:.0f}", *times])
    rows.append(["a sample", "", "", *(f"{SAMPLE / device.bandwidth * 1e12:.1f}" for device in DEVICES)])
    return _table(["method", "bodies", "FMAs", *(f"{device.name}, ps" for device in DEVICES)], rows)


def machine() -> dict[str, str]:
    """Return date, processor, and how busy it is."""
    lines = Path("/proc/cpuinfo").read_text().splitlines() if Path("/proc/cpuinfo").exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    load = os.getloadavg()[0]
    date = datetime.now(UTC).date().isoformat()
    return {"date": date, "processor": names[0] if names else "unknown", "load": f"{load:.1f}", "cores": str(os.cpu_count())}


HEAD = """# The roofline of a body-step

Operations of one step of one body among many, what this processor could do with them, and what is reached. Made by

    python -m conservative.benchmarks.verification.roofline --out benchmarks/roofline.md

on {date}, on one of {cores} cores of a processor that calls itself {processor}, {width} doubles a register, while the load of
the machine was {load}. Times are processor time of one thread, the fastest of interleaved rounds; on a busy machine the shares
mean more than the times.

## What the processor could do

Loops of nothing but one operation, on ten registers:"""

REACHED = f"""## What a step needs, and what it takes

Multiplications (×), additions (+), divisions (÷) and square roots (√) of a step of one body, counted by running the kernels as
plain Python on numbers that count; those of Taylor's series, in uniform gravity, by a formula: 15 products for each of the
p (p + 1)/2 pairs of orders, and 18 an order. The bound is the time of as many FMAs as there are multiplications or additions,
whichever are more, and of the divisions and square roots, as if nothing waited for anything, nothing was loaded or stored, and
every addition went with a multiplication. Reached: {BODIES} bodies, {STEPS} steps, of which start and end are kept."""

SAMPLES = """## Samples

A sample is {bytes} bytes, nine numbers of the attitude and three rates; writing them takes at least {bound:.1f} ns, by the
bandwidth above. What keeping every step takes beside the step, which is a small difference where steps are long:"""

GPU = """## What a GPU would give, on paper

The same count at the published peak of two cards in double precision, in picoseconds a body-step, and, by their bandwidth, a
sample. A division or a square root is taken for {dear} FMAs. Nothing of this was run: it leaves out what limits such cards in
practice, bodies that need more corrections than their neighbours above all. A consumer card does one operation in double
precision for 64 in single. Where every sample is kept, the limit is whichever takes longer, the step or the sample."""


def main() -> None:
    """Write the page, or print it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, help="file to write  [default: stdout]")
    out, page = parser.parse_args().out, write_page(measure())
    if out is None:
        print(page)
    else:
        files.write_text(out, page, "out")


if __name__ == "__main__":
    main()
