"""The functions of `conservative.arithmetic` in compiled code: of floats, of lanes, and of both together."""

from __future__ import annotations

from .. import arithmetic
from ..arithmetic import Traced
from .traced import trace

accumulate = trace(arithmetic.accumulate)
add = trace(arithmetic.add)
apply = trace(arithmetic.apply)
choose = trace(arithmetic.choose)
cross = trace(arithmetic.cross)
dot = trace(arithmetic.dot)
fuse = trace(arithmetic.fuse)
in_body = trace(arithmetic.in_body)
inverse = trace(arithmetic.inverse)
invert = trace(arithmetic.invert)
product = trace(arithmetic.product)
scale = trace(arithmetic.scale)
subtract = trace(arithmetic.subtract)
times = trace(arithmetic.times)
turn = trace(arithmetic.turn)
vertical = trace(arithmetic.vertical)


@trace
def every(mask):
    """Return whether all lanes are true; of a plain truth value, itself."""
    return mask.reduce("and") if isinstance(mask, Traced) else mask


@trace
def some(mask):
    """Return whether any lane is true; of a plain truth value, itself."""
    return mask.reduce("or") if isinstance(mask, Traced) else mask


@trace
def fill_like(x, like):
    """Return x in every lane, with as many lanes as `like`."""
    return like.emit(lambda register, _: register, x, like) if isinstance(like, Traced) else x
