"""Fields with an axis as functions of g, the direction of that axis in principal axes: V(g), dV/dg and the recurrence of T.

The torque is T = g x dV/dg, so that one gradient serves the projection of a state and, order by order, the series of its
motion. A field that `taylor` can move a body in registers the three functions below, next to its torque: without branches, of
floats or what stands for them, with the vectors of `traced`. The recurrence is a class such as `series.FreeSeries`.
"""

from __future__ import annotations

from functools import singledispatch


@singledispatch
def axial_constants(field, J_inverse):
    """Return what the other two functions are given, any tuple: all that depends on field and body alone."""
    raise TypeError(f"no recurrence: {field!r}")


@singledispatch
def axial_energy(field, constants, g):
    """Return V in J and dV/dg, three floats in J, at a direction g whose length is 1 but for the error of a step."""
    raise TypeError(f"no recurrence: {field!r}")


@singledispatch
def start_series(field, constants, g):
    """Return the class of the recurrence and what it is made of, floats and fours in a tuple, for a step that starts at g."""
    raise TypeError(f"no recurrence: {field!r}")
