"""The functions of `conservative.arithmetic` for floats and lanes in compiled code."""

from __future__ import annotations

from ...arithmetic import Traced as _Traced
from ...arithmetic import (
    accumulate,
    add,
    apply,
    choose,
    cross,
    dot,
    fuse,
    in_body,
    inverse,
    invert,
    product,
    scale,
    subtract,
    times,
    turn,
    vertical,
)
from .traced import trace


def every(mask):
    """Return whether all lanes are true; a plain truth value is returned unchanged."""
    return mask.reduce("and") if isinstance(mask, _Traced) else mask


def some(mask):
    """Return whether any lane is true; a plain truth value is returned unchanged."""
    return mask.reduce("or") if isinstance(mask, _Traced) else mask


def fill_like(x, like):
    """Return x in every lane, with as many lanes as `like`."""
    return like.emit(lambda register, _: register, x, like) if isinstance(like, _Traced) else x


__all__ = ["accumulate", "add", "apply", "choose", "cross", "dot", "every", "fill_like", "fuse", "in_body", "inverse", "invert"]
__all__ += ["product", "scale", "some", "subtract", "times", "turn", "vertical"]

for _name in __all__:
    trace(globals()[_name])
