"""Compiled kernels. Importing this package imports numba; `import conservative` alone does not.

Numba keys its on-disk cache on the file of the outermost function only, so an edit to an inner kernel would leave stale
machine code behind. All kernels therefore live in this folder, and caches older than any of its files are dropped on import.
"""

from __future__ import annotations

from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

from numba import njit


def _drop_stale_caches(folder: Path) -> None:
    newest = max(file.stat().st_mtime for file in folder.glob("*.py"))
    for index in (folder / "__pycache__").glob("*.nbi"):
        with suppress(FileNotFoundError):  # another process may be at it
            if index.stat().st_mtime < newest:
                index.unlink()


_drop_stale_caches(Path(__file__).parent)

kernel: Any = partial(njit, cache=True, error_model="numpy")
"""The one way a kernel is compiled: cached, IEEE arithmetic as written (no fastmath: compensated sums must survive)."""

SMALL: Any = {"forceinline": True, "fastmath": {"contract"}}
"""Options of small functions in the inner loops: no calls, and a product that is added at once is rounded once (FMA)."""

small: Any = partial(kernel, **SMALL)
"""How those are compiled. Contraction is safe in compensated sums, which have no product to contract with."""
