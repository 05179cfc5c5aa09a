"""Compiled kernels. Importing this package imports numba; `import conservative` alone does not.

`protocol` says what a kernel that takes steps is given and what it returns.

Numba compares cached code with the file of the outermost function only, so an edit to an inner kernel would run stale code.
A digest of the files of this folder, of `conservative.potentials` and of `conservative.arithmetic` lies beside the cached code,
in `__pycache__` and under NUMBA_CACHE_DIR alike; where it is not that of the files as they are, the code is dropped on import.
Fields of other packages (`fields`) are not part of the digest: after an edit to one, clear the cache.

With NUMBA_DISABLE_JIT=1 nothing is compiled and all kernels run as plain Python, a thousand times slower, for a debugger or a
coverage report. Results then differ by round-off, as products are not fused with sums, and a division by zero raises.
"""

from __future__ import annotations

import hashlib
import warnings
from functools import partial
from pathlib import Path
from typing import Any

from numba import config, njit

from ..files import write_text

COMPILED = not config.DISABLE_JIT  # type: ignore[attr-defined]  # made from the environment
"""True if kernels are machine code, False if they are plain Python."""


def _can_cache() -> bool:
    """Return whether numba finds a folder for compiled code that can be written; warn if not."""
    try:
        njit(cache=True)(_can_cache)
    except RuntimeError:
        said = "No folder for compiled kernels can be written, so every process compiles them again. Set NUMBA_CACHE_DIR."
        warnings.warn(said, RuntimeWarning, stacklevel=2)
        return False
    return True


CACHED = COMPILED and _can_cache()
"""True if compiled code is stored for the next process."""

entry: Any = partial(njit, cache=CACHED, error_model="numpy", nogil=True)
"""Compile a function that Python calls and that runs long: without the interpreter's lock, so that other threads go on."""

brief: Any = partial(njit, cache=CACHED, error_model="numpy")
"""Compile a function that Python calls and that takes microseconds. It keeps the interpreter's lock: giving it up and taking it
again is expensive where many threads want it."""

SMALL: Any = {"forceinline": True, "fastmath": {"contract"}}
"""Options of small functions in inner loops: no calls, and a product that is added at once is rounded once (FMA)."""


def kernel(function: Any, **options: Any) -> Any:
    """Compile a function that only kernels call (`parts`).

    IEEE arithmetic as written: no fastmath, as compensated sums must survive.
    """
    if not COMPILED:
        return function
    from .parts import as_part

    return as_part(function, error_model="numpy", **options)


small: Any = partial(kernel, **SMALL)
"""Compile a small function in an inner loop. Contraction is safe in compensated sums: they have no product to contract with."""


def digest(package: Path) -> str:
    """Return a digest of all source files that kernels are compiled from."""
    found = hashlib.sha256()
    for file in (package / "arithmetic.py", *sorted(package.glob("kernels/*.py")), *sorted(package.glob("potentials/*.py"))):
        content = file.read_bytes()
        found.update(f"{file.name} {len(content)} ".encode() + content)
    return found.hexdigest()


def _drop_stale_code(cache: Path, sources: Path) -> None:
    """Delete numba's indices in `cache`, without which it finds nothing, unless they are of the `sources` as they are."""
    stamp, current = cache / "sources.sha256", digest(sources)
    if stamp.exists() and stamp.read_text() == current:
        return
    for index in cache.glob("*.nbi"):
        index.unlink(missing_ok=True)  # another process may be at it
    write_text(stamp, current, "NUMBA_CACHE_DIR")


_folder = Path(brief(lambda: None).stats.cache_path) if CACHED else None
if _folder:
    _drop_stale_code(_folder, Path(__file__).parents[1])


def is_first_use() -> bool:
    """Return whether compiled code can be stored, and none is stored yet."""
    return _folder is not None and not any(_folder.glob("*.nbi"))
