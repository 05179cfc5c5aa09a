"""Commands in processes of their own that attacks send signals to, and what they leave behind."""

from __future__ import annotations

import argparse
import os
import re
import select
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

COMMAND = "import sys; from conservative.reports.cli.launch import launch; sys.exit(launch())"
"""What the script `conservative` does."""
HANG = 600.0
"""Time, s, after which a process that should have ended is said to hang."""
TEMPORARY = re.compile(r"\..*-[0-9a-f]{12}(-old)?")


@dataclass(frozen=True)
class Ended:
    """How a process ended: its exit code, what it said, the time it took from a moment on, s, and whether others went on."""

    code: int
    out: str
    err: str
    seconds: float
    orphans: bool


class Started:
    """A command that runs in a session of its own, as in a terminal of its own; its output goes to files.

    All processes that it starts have the write end of a pipe open: the last of them is gone when reading meets the end.
    """

    def __init__(self, arguments: Sequence[str], folder: Path) -> None:
        self._outputs = [folder.with_name(f"{folder.name}.{name}") for name in ("out", "err")]
        self._alive, theirs = os.pipe()
        with self._outputs[0].open("wb") as out, self._outputs[1].open("wb") as err:
            self.process = subprocess.Popen(
                [sys.executable, "-c", COMMAND, *arguments],
                cwd=folder,
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=err,
                start_new_session=True,
                pass_fds=(theirs,),
            )
        os.close(theirs)

    def ended_within(self, seconds: float) -> bool:
        """Return whether the process ends by itself within a time, s."""
        try:
            self.process.wait(seconds)
        except subprocess.TimeoutExpired:
            return False
        return True

    def interrupt(self) -> None:
        """Send SIGINT to the process group, as a terminal does at Ctrl-C."""
        os.killpg(self.process.pid, signal.SIGINT)

    def end(self) -> Ended:
        """Wait for the process and all that it has started, and say how it ended; what hangs is killed."""
        start = time.monotonic()
        hangs = not self.ended_within(HANG)
        seconds = time.monotonic() - start
        if hangs:
            self.process.kill()
        orphans = not select.select([self._alive], [], [], HANG if hangs else 5.0)[0]
        os.close(self._alive)
        out, err = (path.read_text(errors="replace") for path in self._outputs)
        return Ended(self.process.wait(), out, err, seconds, orphans)


def temporaries(folder: Path) -> list[str]:
    """Return the names of what should have been removed from a folder."""
    return sorted(path.name for path in folder.rglob("*") if TEMPORARY.fullmatch(path.name))


def read_options(attack: str, description: str | None) -> argparse.Namespace:
    """Return how often to try, `count`, and the `seed` of what is tried, as the command line of an attack has them."""
    parser = argparse.ArgumentParser(prog=f"python -m {__package__}.{attack}", description=description)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=11)
    return parser.parse_args()


def quantile(values: Sequence[float], part: float) -> float:
    """Return the smallest value that a part of all do not exceed; nan of none."""
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(part * len(ordered)))] if ordered else float("nan")
