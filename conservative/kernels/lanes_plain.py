"""One body a lane and one lane a number, in plain Python: a float is all there is. `fuse` rounds twice here."""

from __future__ import annotations

REGISTER = 1


def choose(mask, a, b):
    """a where the mask is true, b elsewhere."""
    return a if mask else b


def every(mask):
    """Whether all lanes are true."""
    return bool(mask)


def some(mask):
    """Whether any lane is true."""
    return bool(mask)


def fill_like(x, like):
    """The number x in every lane, in the type of `like`."""
    return x


def fuse(a, b, c):
    """a b + c"""
    return a * b + c


def lane_of(a, index):
    """One of the floats."""
    return a


def with_lane(a, index, x):
    """The same with x in one lane."""
    return x


def load(array, index, width):
    """array[index]"""
    return float(array[index])


def save(array, index, value):
    """array[index] = value"""
    array[index] = value


def load_rows(array, index, stride, count, width):
    """The numbers at index, index + stride and so on, `count` of them."""
    return tuple(float(x) for x in array[index : index + stride * count : stride])


def save_rows(array, index, stride, values):
    """Store numbers at index, index + stride and so on."""
    for i, value in enumerate(values):
        array[index + i * stride] = value


def save_columns(array, index, stride, values):
    """Store numbers one after the other, the first at index."""
    array[index : index + len(values)] = values
