"""Judges mutants in a copy of the tree: a process that has imported other packages but none of ours, forked for each mutant.

Run by its path, with the folder of the copy. Each line of stdin is one order in JSON (file, text, tests, limit), and each line
of stdout its outcome: the exit status of pytest, or None past the limit, the number of tests that passed, the processor's
time, s, and the end of what was said.
"""

from __future__ import annotations

import json
import os
import re
import resource
import signal
import sys
import tempfile
import traceback
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from time import monotonic, sleep, time
from typing import IO, Any

HELD: tuple[str, ...] = (
    *("pytest", "numpy", "scipy.special", "scipy.spatial.transform", "scipy.integrate", "scipy.stats", "numba", "mpmath"),
    *("hypothesis", "pandas", "click.testing", "pytest_benchmark.plugin", "xdist.plugin"),
)
"""Imported once, before the fork; what is not installed is passed over."""
WALL_PER_CPU = 20
"""Wall time allowed per second of the processor's: other programs want it too."""
STAMPS: dict[Path, int] = {}
OPTIONS = ("-x", "-q", "-n0", "-p", "no:cacheprovider", "-W", "ignore::pytest.PytestAssertRewriteWarning")


def judge(order: dict[str, Any]) -> dict[str, Any]:
    """Return how the tests of one mutant ended; the file is as before afterwards."""
    path = Path(order["file"])
    before = path.read_bytes()
    replace(path, order["text"].encode())
    try:
        with tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace") as said:
            return _wait(_fork(order["tests"], order["limit"], said), order["limit"], said)
    finally:
        replace(path, before)


def replace(path: Path, content: bytes) -> None:
    """Write a file with a time, whole s, that it never had: Python takes cached code for that of a file as old and long."""
    path.write_bytes(content)
    STAMPS[path] = STAMPS.get(path, int(time())) + 1
    os.utime(path, (STAMPS[path], STAMPS[path]))


def _fork(tests: list[str], limit: float, said: IO[str]) -> int:
    child = os.fork()
    if child:
        return child
    os.setsid()
    code = 3
    try:
        resource.setrlimit(resource.RLIMIT_CPU, (int(limit) + 1, int(limit) + 2))
        for stream in (sys.stdout, sys.stderr):
            os.dup2(said.fileno(), stream.fileno())
        code = int(import_module("pytest").main([*OPTIONS, *tests]))
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        os._exit(code)


def _wait(child: int, limit: float, said: IO[str]) -> dict[str, Any]:
    end = monotonic() + WALL_PER_CPU * limit
    while not (found := os.wait4(child, os.WNOHANG))[0] and monotonic() < end:
        sleep(0.02)
    with suppress(ProcessLookupError):
        os.killpg(child, signal.SIGKILL)  # what the tests have started, too
    _, status, used = found if found[0] else os.wait4(child, 0)
    said.seek(0)
    return {
        "code": None if os.WIFSIGNALED(status) else os.WEXITSTATUS(status),
        "spent": used.ru_utime + used.ru_stime,
        "said": (end_of_text := said.read()[-2000:]),
        "passed": sum(map(int, re.findall(r"(\d+) passed", end_of_text)[-1:])),
    }


def main(tree: str) -> None:
    """Judge what stdin asks for."""
    os.chdir(tree)
    sys.path.insert(0, tree)
    for name in HELD:
        with suppress(ImportError):
            import_module(name)
    for line in sys.stdin:
        print(json.dumps(judge(json.loads(line))), flush=True)


if __name__ == "__main__":
    main(sys.argv[1])
