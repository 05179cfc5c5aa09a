"""Ctrl-C at any moment: `python -m conservative.benchmarks.verification.interrupts --count 100`.

Each try starts a command, waits a random time, sends SIGINT to its process group as a terminal does, and looks at how it ends:
within 0.5 s, with exit code 130 and one line, without a process or a temporary file left. Every second one is sent in the first
two seconds, when libraries are loaded. Before its first line is run, Python itself answers Ctrl-C, by a traceback: such tries
are counted on their own, and only have to end.
"""

from __future__ import annotations

import os
import random
import signal
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from .processes import Ended, Started, quantile, read_options, temporaries

LIMIT = 0.5
"""Time, s, within which a command ends."""
COMMANDS = (
    ("run", "brick_flip", "--dt", "6e-9", "--csv", "samples.csv"),  # 1e9 steps
    ("report", "--quick", "--scenes", "brick_flip"),
    ("recommend", "brick_flip", "--out", "recommended"),
    ("run", "lagrange_top", "--method", "scipy", "--t-end", "10000"),
    ("gate", "--json"),
    ("list",),
)
FIRST, LATER = 2.0, 10.0
"""Latest moments, s, of the two halves of all tries."""


@dataclass(frozen=True)
class Try:
    """A command, the moment of its interrupt, s, how it ended, and what it left."""

    command: Sequence[str]
    moment: float
    ended: Ended
    left: Sequence[str]

    @property
    def before(self) -> bool:
        """Whether Python itself was still starting."""
        return self.ended.code in (1, -signal.SIGINT) and not self.ended.out and "/reports/" not in self.ended.err

    @property
    def complaints(self) -> Iterator[str]:
        """What is not as it should be, in words."""
        if self.ended.orphans:
            yield "processes went on"
        if self.left:
            yield f"left {', '.join(self.left)}"
        if self.before:
            return
        if self.ended.code != 130:
            yield f"exit code {self.ended.code}"
        # A command may have said already why it will end by itself.
        said = [line for line in self.ended.err.splitlines() if not line.startswith("Error: ")]
        if len(said) != 1 or not said[0].startswith("Interrupted"):
            yield f"said {self.ended.err!r}"

    def __str__(self) -> str:
        found = "; ".join(self.complaints) or ("Python was starting" if self.before else "ok")
        return f"{' '.join(self.command)}, after {self.moment:.3f} s: {self.ended.seconds:.3f} s, {found}"


def tries(count: int, seed: int) -> Iterator[Try]:
    """Yield so many tries; commands that end before their moment are tried again at another."""
    draw = random.Random(seed)
    done = 0
    while done < count:
        latest = FIRST if done % 2 == 0 else LATER
        found = attempt(COMMANDS[done % len(COMMANDS)], draw.uniform(0, latest))
        if found is not None:
            done += 1
            yield found


def attempt(command: Sequence[str], moment: float) -> Try | None:
    """Interrupt a command at a moment, s; None where it had ended before, or was just about to."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "work"
        folder.mkdir()
        started = Started(command, folder)
        late = started.ended_within(moment)
        if not late:
            started.interrupt()
        ended = started.end()
        return None if late or came_too_late(ended) else Try(command, moment, ended, temporaries(folder))


def came_too_late(ended: Ended) -> bool:
    """Return whether a command has ended as it does without a signal, and at once: one that goes on has lost its interrupt."""
    return ended.code in (0, 2) and ended.seconds <= LIMIT and "Traceback" not in ended.err


def summary(found: Sequence[Try]) -> str:
    """Return the closing line."""
    seconds = [each.ended.seconds for each in found]
    leaked = sum(bool(list(each.complaints)) for each in found)
    parts = {"median": 0.5, "90 %": 0.9, "longest": 1.0}
    return "; ".join(
        [
            f"{len(found)} interrupts: {leaked} leaked, {sum(time > LIMIT for time in seconds)} later than {LIMIT} s",
            ", ".join(f"{name} {quantile(seconds, part):.3f} s" for name, part in parts.items()),
            f"{sum(each.before for each in found)} while Python was starting",
            f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores",
        ]
    )


def main() -> None:
    """Print a line for each try and one with the counts; exit with 1 where something leaked or was late."""
    options = read_options("interrupts", __doc__)
    found = []
    for each in tries(options.count, options.seed):
        found.append(each)
        print(each, flush=True)
    print(summary(found))
    sys.exit(any(list(each.complaints) or each.ended.seconds > LIMIT for each in found))


if __name__ == "__main__":
    main()
