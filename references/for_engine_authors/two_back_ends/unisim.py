"""Two back ends of one contract, as unisim has it: `set_state`, `step`, `get_base_quat` and `get_base_ang_vel` of many bodies.

The contract says that `set_state` takes rates in body axes and `get_base_ang_vel` returns them in world axes. Here, one back
end does so, and the other one returns what it was given. Run it: `python unisim.py`. With unisim, put its back ends in place of
these, such as `MuJoCoBackend(SceneCfg(model_file=...), num_envs=1, sim_dt=dt)`.
"""

import numpy as np
from scipy.spatial.transform import Rotation

import conservative as cv


class Contract:
    """A back end in NumPy with the methods of the contract that a free body needs, in the steps of Runge and Kutta."""

    in_world_axes = True

    def __init__(self, inertia, dt):
        self.inertia, self.dt = inertia, dt

    def set_state(self, env_indices, qpos, qvel):
        self.q, self.w = qpos[0, 3:], qvel[0, 3:]

    def step(self, ctrl, nsteps=1):
        for _ in range(nsteps):
            y, h, k = np.concatenate([self.q, self.w]), self.dt, 0.0
            slopes = []
            for share in (0.0, 0.5, 0.5, 1.0):
                k = self.slope(y + share * h * k)
                slopes.append(k)
            y = y + h / 6 * (slopes[0] + 2 * slopes[1] + 2 * slopes[2] + slopes[3])
            self.q, self.w = y[:4] / np.linalg.norm(y[:4]), y[4:]

    def slope(self, y):
        (s, *v), w = y[:4], y[4:]
        turning = [-np.dot(v, w) / 2, *((s * w + np.cross(v, w)) / 2)]
        return np.concatenate([turning, np.linalg.solve(self.inertia, np.cross(self.inertia @ w, w))])

    def get_base_quat(self):
        return self.q[None]

    def get_base_ang_vel(self):
        R = Rotation.from_quat(self.q, scalar_first=True).as_matrix()
        return (R @ self.w if self.in_world_axes else self.w)[None]


class InBodyAxes(Contract):
    """A back end that returns the rates of the state as they are."""

    in_world_axes = False


def run(back_end, R0, w0, n):
    """Return the attitudes and rates of a back end, through its contract."""
    q0 = Rotation.from_matrix(R0).as_quat(scalar_first=True)
    back_end.set_state(np.array([0]), np.array([[0, 0, 0, *q0]]), np.array([[0, 0, 0, *w0]]))
    q, w = [back_end.get_base_quat()[0]], [back_end.get_base_ang_vel()[0]]
    for _ in range(n):
        back_end.step(np.zeros((1, 0)))
        q.append(back_end.get_base_quat()[0])
        w.append(back_end.get_base_ang_vel()[0])
    return Rotation.from_quat(q, scalar_first=True).as_matrix(), np.array(w)


def first(R0, w0, inertia, dt, n):
    """Return the motion of one back end."""
    return run(Contract(inertia, dt), R0, w0, n)


def second(R0, w0, inertia, dt, n):
    """Return the motion of the other back end."""
    return run(InBodyAxes(inertia, dt), R0, w0, n)


if __name__ == "__main__":
    a, b = (cv.verification.BackEnd(each, rates="world") for each in (first, second))
    print(cv.verification.parity(a, b).sentence)
