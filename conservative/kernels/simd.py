"""Four floats at once, so that stage loops are vector code by construction and not by a compiler's mood.

`four(a, i)` loads a[i:i+4] and `put(a, i, v)` stores it; + - * / work between fours, and * also with a float; `fuse(a, b, c)`
is a b + c with one rounding. Compiled they are LLVM's vectors (`simd_llvm`), in plain Python arrays (`simd_numpy`).
"""

from __future__ import annotations

from . import COMPILED

if COMPILED:
    from .simd_llvm import LANES, four, fuse, join, lane, put, splat, spread
else:
    from .simd_numpy import LANES, four, fuse, join, lane, put, splat, spread  # type: ignore[assignment]

__all__ = ["LANES", "four", "fuse", "join", "lane", "put", "splat", "spread"]
