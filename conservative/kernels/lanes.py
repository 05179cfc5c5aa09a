"""Lanes are bodies: a number that kernels take for a float and that is one float for each of several bodies.

Compiled they are LLVM's vectors (`lanes_llvm`, which says what they can do); in plain Python a float is the only lane
(`lanes_plain`), and both widths are 1. `WIDTH` is two registers: the processor gets on with one while results of the other are
not there yet. Where two do not fit, `REGISTER` is the width to take.
"""

from __future__ import annotations

from . import COMPILED

if COMPILED:
    from .lanes_llvm import (  # type: ignore[attr-defined]
        REGISTER,
        choose,
        every,
        fill_like,
        fuse,
        lane_of,
        load,
        load_rows,
        save,
        save_columns,
        save_rows,
        some,
        with_lane,
    )
else:
    from .lanes_plain import (  # type: ignore[assignment]
        REGISTER,
        choose,
        every,
        fill_like,
        fuse,
        lane_of,
        load,
        load_rows,
        save,
        save_columns,
        save_rows,
        some,
        with_lane,
    )

WIDTH = 2 * REGISTER if COMPILED else 1
"""Bodies that most kernels take at once."""

__all__ = ["REGISTER", "WIDTH", "choose", "every", "fill_like", "fuse", "lane_of", "load", "load_rows", "save", "save_rows"]
__all__ += ["save_columns", "some", "with_lane"]
