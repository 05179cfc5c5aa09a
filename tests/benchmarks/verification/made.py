"""Motions with a planted fault, of a body whose axes are not principal."""

import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import conservative as cv
from conservative.attitude import from_quaternion, to_quaternion
from conservative.references.engine import principal_axes
from conservative.references.exact.method import free_body
from conservative.references.solvers.scipy import SolveIvp, list_derivatives, solve_pieces, state_derivative

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
    """The motion by a closed form, else by SciPy with compiled derivatives, which the verification does not use."""
    if scene.potential is None and not scene.loaded and scene.body.rotor_momentum is None:
        return free_body(scene.body, scene.R_WB0, scene.w_WB_B0, t)
    scene = scene.rename(scene.name, t_end=max(scene.t_end, t[-1]))
    y = solve_pieces(
        scene, list_derivatives(scene, float(t[-1])), np.append(0.0, t[t > 0]), SolveIvp("DOP853", 2.3e-14, 2.3e-14)
    )[0]
    R_FB = principal_axes(scene).R_BF.T
    R, w = from_quaternion(y[:, :4] / np.linalg.norm(y[:, :4], axis=1, keepdims=True)) @ R_FB, y[:, 4:] @ R_FB
    return (R, w) if t[0] == 0 else (R[1:], w[1:])


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


def rates_first(f, t, y, h, before, corrections=1):
    """A step of a game engine, with so many corrections of the gyroscopic torque."""
    new = y.copy()
    for _ in range(corrections):
        new[4:] = y[4:] + h * f(t, new)[4:]
    new[:4] += h * f(t, new)[:4]
    return new


def rk4(f, t, y, h, before):
    a = f(t, y)
    b = f(t + h / 2, y + h / 2 * a)
    c = f(t + h / 2, y + h / 2 * b)
    return y + h / 6 * (a + 2 * b + 2 * c + f(t + h, y + h * c))


METHODS = {
    "explicit Euler": lambda f, t, y, h, before: y + h * f(t, y),
    "semi-implicit Euler with an explicit gyroscopic term": rates_first,
    "semi-implicit Euler with an implicit gyroscopic term": lambda *of: rates_first(*of, 30),
    "Adams-Bashforth 2 (first step Euler)": lambda f, t, y, h, before: y + h * (1.5 * f(t, y) - 0.5 * before),
    "Heun's method": lambda f, t, y, h, before: y + h / 2 * (f(t, y) + f(t + h, y + h * f(t, y))),
    "RK4": rk4,
}


def stepped(scene, name, parts, t=T):
    """The motion by a textbook method, with so many steps between two rows, in principal axes."""
    axes, f, step = principal_axes(scene), state_derivative(scene), METHODS[name]
    y, h = np.append(axes.q0, axes.w0), t[1] / parts
    rows, before = [y], f(0.0, y)
    for number in range(1, (len(t) - 1) * parts + 1):
        y, before = step(f, (number - 1) * h, y, h, before), f((number - 1) * h, y)
        y[:4] /= np.linalg.norm(y[:4])
        rows += [y] * (number % parts == 0)
    y, R_FB = np.array(rows), axes.R_BF.T
    return from_quaternion(y[:, :4]) @ R_FB, y[:, 4:] @ R_FB


def without(scene, damping=0.0, gyroscopic=False):
    """The motion without the gyroscopic torque or with rates that lose `damping`, 1/s, by SciPy in body axes."""
    J, (R0, w0) = scene.body.inertia, (scene.R_WB0, scene.w_WB_B0)
    h = np.zeros(3) if scene.body.rotor_momentum is None else scene.body.rotor_momentum
    D = np.zeros((3, 3)) if scene.damping is None else scene.damping.matrix

    def f(t, y):
        R, w = y[:9].reshape(3, 3), y[9:]
        turn = R @ np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
        torque = gyroscopic * np.cross(J @ w + h, w) - D @ w
        if scene.potential is not None:
            torque = torque + np.cross(scene.potential.moment_B, -R[2])
        return np.concatenate([turn.ravel(), np.linalg.solve(J, torque) - damping * w])

    y = solve_ivp(f, (0, T[-1]), np.concatenate([R0.ravel(), w0]), "DOP853", T, rtol=1e-13, atol=1e-14).y.T
    return Rotation.from_matrix(y[:, :9].reshape(-1, 3, 3)).as_matrix(), y[:, 9:]
