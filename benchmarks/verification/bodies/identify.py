"""The body that an engine has, from its accelerations for known velocities and forces."""

from __future__ import annotations

import math

import numpy as np

from conservative.attitude import Array, hat
from conservative.references.model_files.pieces import Piece, list_numbers

CASES = 24
RATE = 3.0
"""Number of cases, half of them without force and torque, and their typical rate, rad/s."""


def accelerations(part: Piece, cases: Array) -> Array:
    """Return the accelerations (n, 6) of a body for velocities and forces (n, 2, 6), as in `loaders`.

    Newton and Euler about the centre of mass c: m a_c = F, J w' = T - c x F - w x J w, a = a_c - w' x c - w x (w x c).
    """
    _, w, force, torque = np.moveaxis(np.reshape(cases, (-1, 4, 3)), 1, 0)
    moment = torque - np.cross(part.com, force) - np.cross(w, w @ part.inertia.T)
    turn = np.linalg.solve(part.inertia, moment.T).T
    return np.hstack([force / part.mass - np.cross(turn, part.com) - np.cross(w, np.cross(w, part.com)), turn])


def make_cases(part: Piece) -> Array:
    """Return generic rates, velocities, forces and torques (n, 2, 6) for a body, so that all terms are of one order."""
    size = np.sqrt(abs(np.trace(part.inertia) / part.mass)) or 1.0
    units = RATE * np.array((1, part.mass * size * RATE, part.mass * size**2 * RATE))
    w, force, torque = np.random.default_rng(2026).normal(size=(3, CASES, 3)) * units[:, None, None]
    force[::2] = torque[::2] = 0
    return np.hstack([-np.cross(w, part.com), w, force, torque + np.cross(part.com, force)]).reshape(-1, 2, 6)


def identify(cases: Array, measured: Array, near: Piece) -> Piece:
    """Return the body that explains accelerations (n, 6) best, by least squares about the centre of mass of a body `near` it.

    With a the acceleration of the point P, d = c - P, and L = m d: F = m a + w' x L + w x (w x L), and
    T = L x a + J_P w' + w x J_P w. All nine entries of J_P are free, because a wrong loader may make it unsymmetric.
    """
    rows, right = [], []
    size = np.sqrt(abs(np.trace(near.inertia) / near.mass)) or 1.0
    units = near.mass, near.mass * size, near.mass * size**2
    for (_, w, force, torque), acceleration in zip(np.reshape(cases, (-1, 4, 3)), measured, strict=True):
        turn, P = acceleration[3:], near.com
        a = acceleration[:3] + np.cross(turn, P) + np.cross(w, np.cross(w, P))
        W = hat(w)
        A = np.zeros((6, 13))
        A[:3, 0], A[:3, 1:4] = a * units[0] / units[1], hat(turn) + W @ W
        A[3:, 1:4] = -hat(a) * units[1] / units[2]
        A[3:, 4:] = np.kron(np.eye(3), turn) + W @ np.kron(np.eye(3), w)
        rows.append(A)
        right.append(np.concatenate([force / units[1], (torque - np.cross(P, force)) / units[2]]))
    x = np.linalg.lstsq(np.vstack(rows), np.concatenate(right), rcond=None)[0]
    mass, d = x[0] * units[0], x[1:4] / x[0] * size
    inertia = x[4:].reshape(3, 3) * units[2] + mass * hat(d) @ hat(d)  # J_P = J - m [d]x [d]x
    return Piece(float(mass), near.com + d, inertia)


def describe(part: Piece) -> str:
    """Return mass, kg, centre of mass, m, and the six numbers of the inertia, kg m^2, as text."""
    inertia = list_numbers(part.inertia[(0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)])
    size = math.sqrt(abs(np.trace(part.inertia) / part.mass))
    return f"mass {part.mass:.4g}, centre of mass {list_numbers(part.com, size)}, inertia {inertia}"
