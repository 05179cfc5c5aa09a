"""Other starts of a prepared run of `taylor` or `dense`: the numbers that depend on attitude and rates, written in place.

`conservative.methods.taylor_model` makes the same numbers in Python, which takes 0.1 ms. If a start needs a model of another
kind, such as a top that comes near the vertical, nothing is written.
"""

from __future__ import annotations

import math

from ..attitude import ROTATION_TOLERANCE
from ..check import LARGEST, SMALLEST
from . import axial, entry, kernel
from .compiler.traced import trace
from .compiler.vector import add, cross, dot, scale, subtract, times
from .samples import ALONG, SPIN

FIELD, FREE, POLHODE, TOP = 0, 1, 2, 3
"""Kinds of models: rows in a field, rows of a free body, and the oscillations of `axial`."""
R_BP, J, J_INVERSE, R_WD, POTENTIAL, LARGEST_J, ROTOR_SIZE, RATE, ROTOR, SPINNING, REDUCIBLE, MOMENT, POLE, SIZE = (
    *(0, 9, 12, 15, 24, 25, 26, 27, 28, 31, 32, 33, 34, 35),
)
"""Places in the constants of a body: the rotation from the kernel's axes, moments along them, and inverses of those that the
kernel uses; the rotation from the axes D of a field; the scale of the potential, J; the largest moment; the size of the rotor's
momentum; the rate of an orbit, rad/s; the rotor's momentum; 1 in a non-spinning frame; 1 if a top is reduced away from the
vertical; its `moment` of `axial.Nutation`; `taylor_model.POLE`."""
KIND, SCALES, LEFT, G, A, Q, L, FIELD_AT, AXES_D, FRAME_SPIN, FIRST, AXES = range(12)
"""Places in the layout: the kind of the model, and where its parts are in the numbers of a run, -1 for missing parts."""
UNITS = 2.0**28
"""Ratio of energy and largest moment, 1/s^2, up to which SI units are used (`conservative.methods.units`), and its inverse."""

move_along = trace(axial.move_along)


@kernel
def read_rows(values, at):
    """Return nine numbers as the rows of a matrix."""
    return (
        (values[at], values[at + 1], values[at + 2]),
        (values[at + 3], values[at + 4], values[at + 5]),
        (values[at + 6], values[at + 7], values[at + 8]),
    )


@kernel
def transpose(M):
    """Return the transpose of a matrix."""
    return ((M[0][0], M[1][0], M[2][0]), (M[0][1], M[1][1], M[2][1]), (M[0][2], M[1][2], M[2][2]))


@kernel
def combine(x, M):
    """Return the product x M of a row and a matrix."""
    return add(add(scale(x[0], M[0]), scale(x[1], M[1])), scale(x[2], M[2]))


@kernel
def multiply(M, N):
    """Return the product of two matrices."""
    return combine(M[0], N), combine(M[1], N), combine(M[2], N)


@kernel
def write(numbers, at, x):
    """Store three numbers."""
    numbers[at], numbers[at + 1], numbers[at + 2] = x


@kernel
def write_rows(numbers, at, M):
    """Store a matrix by rows."""
    for i in range(3):
        write(numbers, at + 3 * i, M[i])


@kernel
def quaternion_of(M):
    """Return `attitude.to_quaternion` of a rotation."""
    xx, yy, zz = M[0][0], M[1][1], M[2][2]
    a, b, c = M[2][1] - M[1][2], M[0][2] - M[2][0], M[1][0] - M[0][1]
    xy, xz, yz = M[0][1] + M[1][0], M[0][2] + M[2][0], M[1][2] + M[2][1]
    squares = (1.0 + xx + yy + zz, 1.0 + xx - yy - zz, 1.0 - xx + yy - zz, 1.0 - xx - yy + zz)
    largest = max(max(squares[0], squares[1]), max(squares[2], squares[3]))
    if squares[0] == largest:
        q = (squares[0], a, b, c)
    elif squares[1] == largest:
        q = (a, squares[1], xy, xz)
    elif squares[2] == largest:
        q = (b, xy, squares[2], yz)
    else:
        q = (c, xz, yz, squares[3])
    n = 1.0 / math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    n = -n if q[0] < 0.0 else n
    return q[0] * n, q[1] * n, q[2] * n, q[3] * n


@kernel
def write_quaternion(numbers, at, q):
    """Store a quaternion."""
    numbers[at], numbers[at + 1], numbers[at + 2], numbers[at + 3] = q


@kernel
def matrix_of(q):
    """Return `attitude.from_quaternion` of a quaternion."""
    w, x, y, z = q
    ww, xx, yy, zz = w * w, x * x, y * y, z * z
    return (
        (ww + xx - yy - zz, 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
        (2.0 * (x * y + w * z), ww - xx + yy - zz, 2.0 * (y * z - w * x)),
        (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), ww - xx - yy + zz),
    )


@kernel
def axes_about(axis):
    """Return `attitude.axes_about` of a unit vector."""
    x, y, z = abs(axis[0]), abs(axis[1]), abs(axis[2])
    if x >= y and x >= z:
        first = cross((0.0, 0.0, 1.0), axis)
    elif y >= z:
        first = cross((1.0, 0.0, 0.0), axis)
    else:
        first = cross((0.0, 1.0, 0.0), axis)
    first = scale(1.0 / math.sqrt(dot(first, first)), first)
    return transpose((first, cross(axis, first), axis))


@kernel
def is_start(R, w):
    """Return whether R is a rotation and w are rates that `Scene` accepts."""
    rows, largest = transpose(R), max(max(abs(w[0]), abs(w[1])), abs(w[2]))
    off = 0.0
    for i in range(3):
        for j in range(3):
            size = abs(dot(rows[i], rows[j]) - (1.0 if i == j else 0.0))
            off = size if not size <= off else off  # also nan
    sized = largest == 0.0 or SMALLEST <= largest <= LARGEST
    return off <= ROTATION_TOLERANCE and dot(cross(R[0], R[1]), R[2]) > 0.0 and sized and math.isfinite(w[0] + w[1] + w[2])


@kernel
def turns_about_third(moments, momentum):
    """Return whether the momentum of a free body circulates about the third axis, as `taylor_model.find_model` chooses it."""
    most, least = max(max(moments[0], moments[1]), moments[2]), min(min(moments[0], moments[1]), moments[2])
    middle = moments[0] + moments[1] + moments[2] - most - least
    for i in range(3):
        middle = moments[i] if least < moments[i] < most else middle
    rates = (momentum[0] / moments[0], momentum[1] / moments[1], momentum[2] / moments[2])
    return moments[2] == (most if dot(momentum, rates) * middle < dot(momentum, momentum) else least)


@kernel
def height_rate(along, spin, energy, moment, u):
    """Return u'^2 of `axial.Nutation` at a height u."""
    return (1.0 - u * u) * (energy - moment * u) - (along - spin * u) ** 2


@kernel
def write_polhode(numbers, at, g_at, g, row, momentum, inverse):
    """Store `taylor_model.reduce_free` of the direction g of the momentum and the first row of the attitude."""
    axis = 1.0 if g[2] >= 0.0 else -1.0
    factors = scale(momentum, inverse)
    a, b, c = factors
    slopes = (c - b, a - c, b - a)
    products = (slopes[2] * slopes[1], slopes[0] * slopes[2], slopes[1] * slopes[0])
    squares = times(g, g)
    total = dot(products, squares)
    linear = subtract((total, total, total), scale(3.0, times(products, squares)))
    write(numbers, at, factors)
    write(numbers, at + 3, linear)
    write(numbers, at + 6, scale(4.0, products))
    numbers[at + 9], numbers[at + 10] = dot(squares, factors), axis
    write(numbers, at + 11, move_along(g, (0.0, 0.0, axis), row))
    write(numbers, g_at, g)


@entry
def restart(body, layout, numbers, R_WB0, w_WB_B0):  # noqa: PLR0912, PLR0915  # the parts of one model
    """Write another start into the numbers of a run. Return False, and write nothing, if that is not possible.

    `body` (`SIZE`,) and `layout` (12,) have the places above. It is not possible for an attitude that is not a rotation or
    rates that are not finite, in other units, and if the start needs a model of another kind.
    """
    R, w = read_rows(R_WB0.reshape(-1), 0), (w_WB_B0[0], w_WB_B0[1], w_WB_B0[2])
    if not is_start(R, w):
        return False
    kind, moments, inverse = layout[KIND], (body[J], body[J + 1], body[J + 2]), read_rows(body, J_INVERSE)[0]
    rotor, of_body = (body[ROTOR], body[ROTOR + 1], body[ROTOR + 2]), read_rows(body, R_BP)
    rates = combine(w, of_body)
    momentum = times(moments, rates)
    energy = 0.5 * dot(momentum, rates) + body[POTENTIAL]
    if not body[LARGEST_J] <= UNITS * energy or not energy <= UNITS * body[LARGEST_J]:
        return False
    whole, R_WP = add(momentum, rotor), multiply(R, of_body)
    size, axes_D = math.sqrt(dot(whole, whole)), read_rows(body, R_WD)
    if kind in (FREE, POLHODE):
        if size == 0.0 or (body[SPINNING] == 0.0 and body[ROTOR_SIZE] == 0.0 and not turns_about_third(moments, momentum)):
            return False
        along = combine(whole, transpose(R_WP))
        axes_D = axes_about(scale(1.0 / math.sqrt(dot(along, along)), along))
    R_DP = multiply(transpose(axes_D), R_WP)
    g, v = R_DP[2], times(inverse, momentum)
    wide = math.sqrt(g[0] * g[0] + g[1] * g[1])
    top = dot(g, v), v[2], v[0] * v[0] + v[1] * v[1] + body[MOMENT] * g[2], body[MOMENT]
    if body[REDUCIBLE] != 0.0:
        end = 1.0 - body[POLE]
        away = abs(g[2]) < end and height_rate(*top, -end) < 0.0 and height_rate(*top, end) < 0.0
        if away != (kind == TOP):
            return False
    largest = math.sqrt(2.0 * energy * body[LARGEST_J]) + body[ROTOR_SIZE]
    numbers[layout[SCALES]], numbers[layout[SCALES] + 1] = energy + body[RATE] * largest, largest
    write_quaternion(numbers, layout[Q], quaternion_of(R_WP))
    write(numbers, layout[L], momentum)
    at = layout[FIELD_AT]
    if kind in (FREE, POLHODE):
        write_quaternion(numbers, layout[LEFT], quaternion_of(axes_D))
    if kind == FREE:
        numbers[at] = size
    if kind == POLHODE:
        write_polhode(numbers, at, layout[G], g, R_DP[0], size, inverse)
    elif kind == TOP:
        numbers[at], numbers[at + 1], numbers[at + 2] = top[0], top[1], top[2]
        numbers[at + 4], numbers[at + 5] = R_DP[0][2] / wide, R_DP[1][2] / wide
        numbers[at + 6], numbers[at + 7] = -g[0] / wide, g[1] / wide
        numbers[layout[G]], numbers[layout[G] + 1] = g[2], g[0] * v[1] - g[1] * v[0]
    else:
        write(numbers, layout[G], g)
        write(numbers, layout[A], R_DP[0])
    if body[SPINNING] != 0.0:
        spin = (moments[0] - moments[2]) / (moments[0] * moments[2]) * momentum[2]
        numbers[layout[AXES] + SPIN], numbers[layout[AXES] + ALONG] = spin, 1.0 / moments[2]
        if layout[FRAME_SPIN] >= 0:
            numbers[layout[FRAME_SPIN]] = spin
    if layout[AXES_D] >= 0:
        write_rows(numbers, layout[AXES_D], axes_D)
    if layout[FIRST] >= 0:
        write_rows(numbers, layout[FIRST], matrix_of(quaternion_of(R)))
        write(numbers, layout[FIRST] + 9, w)
    return True
