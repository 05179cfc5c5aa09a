"""Small faults, planted one at a time into a copy of a checkout: the tests named beside each must fail.

    python -m conservative.benchmarks.verification.planted_faults                        # all of planted_faults.toml
    python -m conservative.benchmarks.verification.planted_faults --only 3,17 --jobs 2
    python -m conservative.benchmarks.verification.planted_faults --table my_faults.toml

Tests run first without a fault, as those that fail anyway catch nothing; then with one fault at a time. A fault that no test
sees SURVIVED. Kernels with a fault run as plain Python (NUMBA_DISABLE_JIT=1) unless the table says `compiled = true`; all
others run on the machine code that this installation has. Nothing is changed in the checkout itself. Source: our own.
"""

from __future__ import annotations

import argparse
import os
import shutil
import signal
import subprocess
import sys
import tomllib
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from queue import SimpleQueue
from tempfile import TemporaryDirectory
from time import monotonic

from ..measures.origin import git

TABLE = Path(__file__).with_suffix(".toml")
LIMIT = 900.0
"""Time, s, after which tests that hang count as failed."""
KERNELS = Path("conservative") / "kernels"


@dataclass(frozen=True)
class Fault:
    """A fault: `old`, which `file` has exactly once, becomes `new`; one of `tests` must fail, and `why` says what is wrong.

    `compiled` has a fault of a kernel compiled, which takes minutes, instead of run as plain Python.
    """

    file: str
    old: str
    new: str
    tests: tuple[str, ...]
    why: str
    compiled: bool = False

    @property
    def plain(self) -> bool:
        """Whether tests run kernels as plain Python."""
        return Path(self.file).parent == KERNELS and not self.compiled


class Verdict(StrEnum):
    """What became of a fault."""

    CAUGHT = "caught"
    SURVIVED = "SURVIVED"
    ABSENT = "text not found"
    UNFIT = "tests fail without it"


def read_faults(path: Path = TABLE) -> tuple[Fault, ...]:
    """Return the faults of a table, in their order."""
    content = tomllib.loads(path.read_text(encoding="utf-8"))
    return tuple(Fault(**{**fault, "tests": tuple(fault["tests"])}) for fault in content["fault"])


def find_checkout() -> Path | None:
    """Return the folder of the checkout that this file is from; None where there are no tests beside it, as once installed."""
    root = Path(__file__).resolve().parents[2]
    return root if (root / "tests").is_dir() and git(root, "rev-parse", "--git-dir") else None


class Tree:
    """A copy of a checkout, with the machine code of its kernels, in which faults are planted."""

    def __init__(self, checkout: Path, folder: Path) -> None:
        self.folder = folder
        for name in git(checkout, "ls-files", "-z", "--cached", "--others", "--exclude-standard").split("\0")[:-1]:
            if (checkout / name).exists():
                (folder / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(checkout / name, folder / name, follow_symlinks=False)
        self.copy_machine_code()

    def copy_machine_code(self) -> None:
        """Put the machine code that this process would run where the copy looks for it: numba compares the sources."""
        from conservative.kernels.samples import to_body_axes

        if hasattr(to_body_axes, "stats"):  # plain Python has none
            target = self.folder / KERNELS / "__pycache__"
            shutil.rmtree(target, ignore_errors=True)
            shutil.copytree(to_body_axes.stats.cache_path, target, ignore=shutil.ignore_patterns("*.pyc"))

    def passes(self, tests: Sequence[str], plain: bool) -> bool:
        """Return whether tests pass here; those that take longer than `LIMIT` do not."""
        command = [sys.executable, "-m", "pytest", "-n0", "-x", "-q", "-p", "no:cacheprovider", *tests]
        kept = {key: value for key, value in os.environ.items() if not key.startswith(("PYTEST", "NUMBA_"))}
        own = {"PYTHONPATH": str(self.folder), "PYTHONDONTWRITEBYTECODE": "1", "NUMBA_DISABLE_JIT": str(int(plain))}
        quiet = subprocess.DEVNULL
        with subprocess.Popen(
            command, cwd=self.folder, env=kept | own, stdin=quiet, stdout=quiet, stderr=quiet, start_new_session=True
        ) as process:
            try:
                return process.wait(LIMIT) == 0
            except subprocess.TimeoutExpired:
                return False
            finally:
                if process.returncode is None:
                    os.killpg(process.pid, signal.SIGKILL)

    @contextmanager
    def planted(self, fault: Fault) -> Iterator[None]:
        """Have the fault in the copy for the length of a block."""
        path = self.folder / fault.file
        text = path.read_text(encoding="utf-8")
        path.write_text(text.replace(fault.old, fault.new), encoding="utf-8")
        try:
            yield
        finally:
            path.write_text(text, encoding="utf-8")
            if fault.compiled:
                self.copy_machine_code()


def occurrences(root: Path, fault: Fault) -> int:
    """Return how often the text of a fault is in its file; 0 where there is no such file."""
    path = root / fault.file
    return path.read_text(encoding="utf-8").count(fault.old) if path.is_file() else 0


class Trial:
    """Faults and tests that are tried in several copies of a checkout at once."""

    def __init__(self, checkout: Path, folder: Path, jobs: int) -> None:
        self.checkout = checkout
        self.pool = ThreadPoolExecutor(jobs)
        self.trees: SimpleQueue[Tree] = SimpleQueue()
        for number in range(jobs):
            self.trees.put(Tree(checkout, folder / str(number)))

    @contextmanager
    def tree(self) -> Iterator[Tree]:
        """Lend a copy."""
        tree = self.trees.get()
        try:
            yield tree
        finally:
            self.trees.put(tree)

    def judge(self, faults: Sequence[Fault]) -> Iterator[tuple[Fault, Verdict, float]]:
        """Yield each fault with its verdict and the time, s, that it took."""
        wanted = sorted({(test, fault.plain) for fault in faults for test in fault.tests})
        passing = {item for item, passes in zip(wanted, self.pool.map(self.passes, wanted), strict=True) if passes}
        yield from self.pool.map(lambda fault: self.judge_one(fault, passing), faults)

    def passes(self, item: tuple[str, bool]) -> bool:
        """Return whether a test passes without a fault."""
        test, plain = item
        with self.tree() as tree:
            return tree.passes([test], plain)

    def judge_one(self, fault: Fault, passing: set[tuple[str, bool]]) -> tuple[Fault, Verdict, float]:
        """Return a fault with its verdict and the time, s, that it took."""
        begin = monotonic()
        if occurrences(self.checkout, fault) != 1:
            return fault, Verdict.ABSENT, 0.0
        if any((test, fault.plain) not in passing for test in fault.tests):
            return fault, Verdict.UNFIT, 0.0
        with self.tree() as tree, tree.planted(fault):
            survived = tree.passes(fault.tests, fault.plain)
        return fault, Verdict.SURVIVED if survived else Verdict.CAUGHT, monotonic() - begin


def main(arguments: list[str] | None = None) -> int:
    """Plant the faults; return 0 if all are caught, 1 if not, 2 where there is no checkout."""
    parser = argparse.ArgumentParser(
        prog="python -m conservative.benchmarks.verification.planted_faults", description=__doc__.split("\n")[0]
    )
    parser.add_argument("--only", metavar="N,M", help="numbers of faults, from 1 (default all)")
    parser.add_argument("--jobs", type=int, default=2, help="copies that work at once (default 2)")
    parser.add_argument("--table", type=Path, default=TABLE, help="faults, as in planted_faults.toml, the default")
    options = parser.parse_args(arguments)
    checkout = find_checkout()
    if checkout is None:
        parser.error("faults are planted into a checkout, as its tests are needed; this is an installation without them")
    numbered = dict(enumerate(read_faults(options.table), start=1))
    chosen = [int(number) for number in options.only.split(",")] if options.only else list(numbered)
    if unknown := set(chosen) - set(numbered):
        parser.error(f"--only: no fault {min(unknown)}; there are 1 to {len(numbered)}")
    return plant(checkout, {number: numbered[number] for number in chosen}, options.jobs)


def plant(checkout: Path, faults: dict[int, Fault], jobs: int) -> int:
    """Plant faults, print a line for each, by its number, and one at the end; return 0 if all are caught, else 1."""
    counts = dict.fromkeys(Verdict, 0)
    with TemporaryDirectory(prefix="planted-faults-") as folder:
        trial = Trial(checkout, Path(folder), jobs)
        for number, (fault, verdict, spent) in zip(faults, trial.judge(list(faults.values())), strict=True):
            counts[verdict] += 1
            print(f"{number:4} {verdict:22}{spent:6.1f} s  {fault.file}: {fault.why}", flush=True)
    print(f"{len(faults)} faults: " + ", ".join(f"{count} {verdict}" for verdict, count in counts.items()), flush=True)
    return 0 if counts[Verdict.CAUGHT] == len(faults) else 1


if __name__ == "__main__":
    raise SystemExit(main())
