"""Workers in copies of the tree, each of which judges one mutant at a time."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue
from typing import Any

from .mutants import Mutant

WORKER = Path(__file__).with_name("worker.py")
FIRST_LIMIT, SLACK, SPARE = 300, 3, 5
"""Processor's time, s, allowed to the code as it is; to a mutant SLACK times what that took, and SPARE s."""
ENVIRONMENT = {"NUMBA_DISABLE_JIT": "1", "PYTHONDONTWRITEBYTECODE": ""}
FEWER = 5
"""Code of a mutant without a failure, of which fewer tests passed than without it; pytest says 5 where it ran none."""
NOT_COPIED = shutil.ignore_patterns(".[!g]*", ".git", "__pycache__", "build", "dist")


@dataclass(frozen=True)
class Verdict:
    """How a mutant ended: `survived` where all tests passed, `late` where the time was up, else killed."""

    mutant: Mutant
    code: int | None

    @property
    def survived(self) -> bool:
        """Whether all tests passed."""
        return self.code == 0

    @property
    def late(self) -> bool:
        """Whether the tests did not end."""
        return self.code is None


class Judge:
    """A worker with a copy of the tree of its own."""

    def __init__(self, root: Path, folder: Path) -> None:
        self.tree = folder
        shutil.copytree(root, folder, symlinks=True, ignore=NOT_COPIED, dirs_exist_ok=True)
        self.process = subprocess.Popen(
            [sys.executable, "-P", str(WORKER), str(folder)],
            env={**os.environ, **ENVIRONMENT, "PYTHONPATH": os.pathsep.join([str(folder), os.environ.get("PYTHONPATH", "")])},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def judge(self, file: str, text: str, tests: list[str], limit: float) -> dict[str, Any]:
        """Return exit status, time and last words of the tests with another text of a file."""
        assert self.process.stdin
        assert self.process.stdout
        print(json.dumps({"file": file, "text": text, "tests": tests, "limit": limit}), file=self.process.stdin, flush=True)
        found: dict[str, Any] = json.loads(self.process.stdout.readline())
        return found

    def close(self) -> None:
        """End the worker."""
        self.process.communicate()


class Judges:
    """Several of them; what is handed in waits for one that is free."""

    def __init__(self, judges: list[Judge]) -> None:
        self.free: SimpleQueue[Judge] = SimpleQueue()
        self.count = len(judges)
        for judge in judges:
            self.free.put(judge)

    def judge(self, file: str, text: str, tests: list[str], limit: float) -> dict[str, Any]:
        """Return what the first judge that is free finds."""
        judge = self.free.get()
        try:
            return judge.judge(file, text, tests, limit)
        finally:
            self.free.put(judge)

    def find_limit(self, root: Path, file: str, tests: list[str]) -> tuple[float, int]:
        """Return the time, s, that mutants of a file get, and how many tests pass without one; `RuntimeError` if any fails."""
        found = self.judge(file, (root / file).read_text(encoding="utf-8"), tests, FIRST_LIMIT)
        if found["code"] != 0:
            raise RuntimeError(f"{' '.join(tests)}: fails without a mutant\n{found['said']}")
        return SLACK * found["spent"] + SPARE, found["passed"]

    def judge_all(self, root: Path, mutants: list[tuple[Mutant, list[str]]]) -> Iterator[Verdict]:
        """Yield the verdicts, in the order of the mutants; each with the tests that have to notice it."""
        with ThreadPoolExecutor(self.count) as pool:
            sets = {tuple(tests): mutant.file for mutant, tests in mutants}
            limits = dict(zip(sets, pool.map(lambda one: self.find_limit(root, sets[one], list(one)), sets), strict=True))
            yield from pool.map(lambda each: self._verdict(each[0], each[1], *limits[tuple(each[1])]), mutants)

    def _verdict(self, mutant: Mutant, tests: list[str], limit: float, passed: int) -> Verdict:
        found = self.judge(mutant.file, mutant.text, tests, limit)
        return Verdict(mutant, FEWER if found["code"] == 0 and found["passed"] < passed else found["code"])


@contextmanager
def start_judges(root: Path, count: int) -> Iterator[Judges]:
    """Start workers, each with a copy of the tree at `root`; they end with the block, and the copies are removed."""
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder, ExitStack() as stack:
        judges = [Judge(root, Path(folder) / str(number)) for number in range(count)]
        for judge in judges:
            stack.callback(judge.close)
        yield Judges(judges)
