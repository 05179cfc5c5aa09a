"""Compiled kernels. Importing this package imports numba; `import conservative` alone does not.

`protocol` says what a kernel that takes steps is given and what it returns. `compiler` contains numbers with one float per
body, and the recurrences of series.

Numba compares cached code with the file of the outermost function only, so an edit to an inner kernel would run stale code. A
digest is therefore stored next to the cached code, in `__pycache__` or in the folder NUMBA_CACHE_DIR. It is made from all files
of this folder and its subfolders, of `conservative.potentials`, and of `conservative.arithmetic`. If the files have another
digest at the time of import, all cached code of this folder is deleted. Fields of other packages are not part of the digest.
After an edit of one, clear the cache.

Processes that share a cache compile each kernel once: the first one holds a lock, and the others wait for its code. Code is
also written under a lock. Otherwise, two processes that compile a function for different types can choose the same free file,
and numba then finds the code of one under the types of the other.

With NUMBA_DISABLE_JIT=1 nothing is compiled and all kernels run as plain Python, a thousand times slower, for a debugger or a
coverage report. Results then differ by round-off, as products are not fused with sums, and a division by zero raises.
"""

from __future__ import annotations

import hashlib
import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache, partial
from itertools import chain
from pathlib import Path
from typing import Any

from numba import njit
from numba.core.compiler_lock import global_compiler_lock

from ..errors import NotWritten
from ..files import write_text
from ..posix import NO_LOCK, lock, release
from .compiler import COMPILED as COMPILED
from .compiler import SMALL as SMALL
from .compiler import kernel as kernel
from .compiler import small as small


@cache  # once
def _warn(reason: str) -> None:
    message = f"Compiled kernels cannot be stored ({reason}), so every process compiles them again. Set NUMBA_CACHE_DIR."
    warnings.warn(message, RuntimeWarning, stacklevel=3)


def _can_cache() -> bool:
    """Return whether numba finds a folder for compiled code that can be written; warn if not."""
    try:
        njit(cache=True)(_can_cache)
    except RuntimeError:
        _warn("no folder for them can be written")
        return False
    return True


PATIENCE = 60.0
"""Time for which a process waits until another one has compiled a kernel, s. Compiling takes 1 to 11 s."""
CACHED = COMPILED and _can_cache()
"""True if compiled code is stored for the next process."""


@contextmanager
def _alone(place: Path) -> Iterator[None]:
    """Wait until no other process is in a block with this file, which exists during the block only.

    On systems without file locks, processes do not wait for each other. They wait for `PATIENCE` at most: the other process may
    be stopped, and what is written twice is the same.
    """
    end = time.monotonic() + PATIENCE
    try:
        place.touch()
        while (handle := lock(place)) is None and time.monotonic() < end:
            time.sleep(0.01)
            place.touch()  # the other process removes it
    except OSError:
        handle = NO_LOCK
    try:
        yield
    finally:
        if handle is not None:
            with suppress(OSError):
                place.unlink()
            release(handle)


def _compile(function: Any, **options: Any) -> Any:
    compiled = njit(function, cache=CACHED, error_model="numpy", **options)
    if CACHED:
        folder = Path(compiled.stats.cache_path)
        constants = [cell.cell_contents for cell in function.__closure__ or ()]
        name = f"{function.__module__}.{function.__qualname__} {constants}"
        compiled.compile = partial(_compile_once, compiled.compile, folder, name)
        compiled._cache.save_overload = partial(_save, compiled._cache.save_overload, folder)
    return compiled


def _compile_once(compile_or_load: Any, folder: Path, name: str, types: Any) -> Any:
    """Compile a function for these types, or load its code if this or another process has stored it."""
    key = hashlib.sha256(f"{name} {types}".encode()).hexdigest()[:16]
    # A thread that compiles can need the code of another function: without numba's lock first, two threads would wait for ever.
    with global_compiler_lock, _alone(folder / f"{key}.lock"):
        return compile_or_load(types)


def _save(save: Any, folder: Path, *code: Any) -> None:
    """Store compiled code. Without room for it, as on a full disk, this process goes on with a warning."""
    try:
        with _alone(folder / "index.lock"):
            save(*code)
    except OSError as error:
        _warn(error.strerror)


entry: Any = partial(_compile, nogil=True)
"""Compile a function that Python calls and that runs long: without the interpreter's lock, so that other threads go on."""

brief: Any = _compile
"""Compile a function that Python calls and that takes microseconds. It keeps the interpreter's lock: giving it up and taking it
again is expensive where many threads want it."""


def digest(package: Path) -> str:
    """Return a digest of all source files that kernels are compiled from."""
    content_digest = hashlib.sha256()
    folders = (sorted((package / folder).rglob("*.py")) for folder in ("kernels", "potentials"))
    for file in (package / "arithmetic.py", *chain(*folders)):
        content = file.read_bytes()
        content_digest.update(f"{file.relative_to(package).as_posix()} {len(content)} ".encode() + content)
    return content_digest.hexdigest()


def _drop_stale_code(folder: Path, sources: Path) -> None:
    """Delete numba's indices in `folder`, without which it finds nothing, unless they are of the `sources` as they are."""
    stamp, current = folder / "sources.sha256", digest(sources)
    if stamp.exists() and stamp.read_text() == current:
        return
    for index in folder.glob("*.nbi"):
        index.unlink(missing_ok=True)  # another process may be at it
    try:
        write_text(stamp, current, "NUMBA_CACHE_DIR")
    except NotWritten as error:  # the next process deletes the indices again
        _warn(str(getattr(error.cause, "strerror", error.cause)))


_folder = Path(brief(lambda: None).stats.cache_path) if CACHED else None
if _folder:
    _drop_stale_code(_folder, Path(__file__).parents[1])


def is_first_use() -> bool:
    """Return whether compiled code can be stored, and none is stored yet."""
    return _folder is not None and not any(_folder.glob("*.nbi"))
