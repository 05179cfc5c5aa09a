"""Fields with an axis as functions of g, the direction of that axis in principal axes: V(g), dV/dg and the recurrence of T.

The torque is T = g x dV/dg, so that one gradient serves the projection of a state and, order by order, the series of its
motion. A field that `taylor` can move a body in implements the three functions below, next to its torque. The recurrence is a
class such as `series.FreeSeries`, of which `make_orders` makes code.
"""

from __future__ import annotations

from functools import singledispatch

from . import COMPILED

if COMPILED:
    from .series_llvm import make_orders
else:
    from .series_numpy import make_orders

__all__ = ["axial_constants", "axial_energy", "axial_orders", "make_orders"]


@singledispatch
def axial_constants(field, J_inverse):
    """Return what the other two functions are given, any tuple: all that depends on field and body alone."""
    raise TypeError(f"no recurrence: {field!r}")


@singledispatch
def axial_energy(field, constants, g):
    """Return V in J and dV/dg, three floats in J, at a direction g whose length is 1 but for the error of a step."""
    raise TypeError(f"no recurrence: {field!r}")


@singledispatch
def axial_orders(field, constants, order, h, g, a, w, K):
    """Return what a step adds to g, a and w, fours: `orders` of `make_orders` with the numbers of this field at g."""
    raise TypeError(f"no recurrence: {field!r}")
