"""Motions with a planted fault, of a body whose axes are not principal."""

import numpy as np
from scipy.spatial.transform import Rotation

import conservative as cv
from conservative.attitude import from_quaternion, to_quaternion
from conservative.benchmarks.judge.diagnose import TEXTBOOK
from conservative.benchmarks.judge.motion import Compared
from conservative.references.engine import principal_axes
from conservative.references.solvers.scipy import state_derivative

BODY = cv.RigidBody([[3.0, 0.4, -0.2], [0.4, 2.0, 0.3], [-0.2, 0.3, 4.0]])
START = Rotation.from_rotvec([0.4, -0.7, 0.3]), [0.7, -1.1, 1.6]
FREE = cv.Scene("free", BODY, *START, 6.0)
HEAVY = cv.Scene("heavy", BODY, *START, 6.0, cv.UniformGravity(5.0, [0.1, -0.3, 0.6]))
TOML = """t_end = 6.0
[body]
inertia = [[3.0, 0.4, -0.2], [0.4, 2.0, 0.3], [-0.2, 0.3, 4.0]]
[start]
w_WB_B = [0.7, -1.1, 1.6]
R_WB.rotation_vector = [0.4, -0.7, 0.3]
"""
T = np.linspace(0, 6, 121)


def exact(scene, t=T):
    return Compared(scene, t, (None, None), True).truth(t)


def late(scene, shift):
    """The motion ahead by a time, s, after an exact first row."""
    (R, w), (R0, w0) = exact(scene, T + shift), exact(scene)
    return np.concatenate([R0[:1], R[1:]]), np.concatenate([w0[:1], w[1:]])


def turned(scene, *turn):
    C = Rotation.from_rotvec(turn).as_matrix()
    R, w = exact(scene)
    return R @ C, w @ C


def reordered(scene):
    R, w = exact(scene)
    return from_quaternion(np.roll(to_quaternion(R), -1, axis=1)), w


def noisy(scene, size, seed=3):
    R, w = exact(scene)
    random = np.random.default_rng(seed)
    return R @ Rotation.from_rotvec(size * random.normal(size=(len(T), 3))).as_matrix(), w + size * random.normal(size=w.shape)


def stepped(scene, name, parts, t=T):
    """The motion by a textbook method, with so many steps between two rows."""
    axes, f, step = principal_axes(scene), state_derivative(scene), TEXTBOOK[name][1]
    y, h = np.append(axes.q0, axes.w0), t[1] / parts
    rows, before = [y], f(0.0, y)
    for number in range(1, (len(t) - 1) * parts + 1):
        y, before = step(f, (number - 1) * h, y, h, before), f((number - 1) * h, y)
        y[:4] /= np.linalg.norm(y[:4])
        rows += [y] * (number % parts == 0)
    return Compared(scene, t, (None, None), True).motion(np.array(rows))


def without(scene, damping=0.0, gyroscopic=False):
    return Compared(scene, T, (None, None), True).move(T, gyroscopic, damping)
