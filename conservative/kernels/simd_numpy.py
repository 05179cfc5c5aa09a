"""Four floats at once in plain Python: arrays (4,). `fuse` rounds twice here."""

from __future__ import annotations

import numpy as np

LANES = 4


def splat(x):
    """The same float four times."""
    return np.full(LANES, x)


def four(array, index):
    """A copy of array[index : index + 4]."""
    return array[index : index + LANES].copy()


def spread(array, index):
    """array[index] four times"""
    return np.full(LANES, array[index])


def put(array, index, value):
    """array[index : index + 4] = value"""
    array[index : index + LANES] = value


def fuse(a, b, c):
    """a b + c"""
    return a * b + c


def lane(a, index):
    """One of the four floats."""
    return float(a[index])


def join(a, b, c, d):
    """Four floats as one value."""
    return np.array((a, b, c, d))
