"""The compilation of kernels, which relies on internals of numba and llvmlite; README.md in this folder lists them."""

from __future__ import annotations

import re
import warnings

import numba
from numba import config

COMPILED = not config.DISABLE_JIT  # type: ignore[attr-defined]  # made from the environment
"""True if kernels are machine code, False if they are plain Python."""

TRIED = (0, 63), (0, 68)
"""Oldest and newest version of numba that the tests have passed with. A version of numba comes with one version of llvmlite."""

LINKED = COMPILED and TRIED[0] <= tuple(map(int, re.findall(r"\d+", numba.__version__)[:2])) <= TRIED[1]
"""True if kernels rely on parts of numba that it does not document, False if they are compiled by `njit` alone."""

if COMPILED and not LINKED:
    _oldest, _newest = (".".join(map(str, version)) for version in TRIED)
    warnings.warn(
        f"numba {numba.__version__} is not one of the tried versions {_oldest} to {_newest}. Results agree to "
        f"round-off, but compiling takes up to 2.2 times as long. To avoid this, run: pip install 'numba=={_newest}.*'",
        RuntimeWarning,
        stacklevel=2,
    )
