"""An environment as Gymnasium has them, with MuJoCo inside, and a wrapper around it: which of the two is wrong?

Run it: `python environment.py`. Put your environment in place of `FreeBody`, and your wrapper in place of `InWorldAxes`.
"""

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

import conservative as cv

MODEL = """<mujoco>
  <option timestep="{dt!r}" integrator="RK4" gravity="0 0 0"/>
  <worldbody><body><freejoint/><inertial pos="0 0 0" mass="1" fullinertia="{inertia}"/></body></worldbody>
</mujoco>"""


class FreeBody:
    """A free body: `reset(seed, options)` and `step(action)`; it observes its quaternion, scalar first, and its rates."""

    def __init__(self, inertia, dt):
        six = [inertia[i][k] for i, k in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
        text = MODEL.format(dt=dt, inertia=" ".join(repr(float(x)) for x in six))
        self.model = mujoco.MjModel.from_xml_string(text)
        self.data = mujoco.MjData(self.model)

    def reset(self, seed=None, options=None):
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[3:], self.data.qvel[3:] = options["quaternion"], options["rates"]
        return self.observe(), {}

    def step(self, action):
        mujoco.mj_step(self.model, self.data)
        return self.observe(), 0.0, False, False, {}

    def observe(self):
        return np.concatenate([self.data.qpos[3:], self.data.qvel[3:]])


class InWorldAxes(FreeBody):
    """The same body, whose wrapper observes the rates in world axes, as the angular velocity of a sensor of the frame."""

    def observe(self):
        mujoco.mj_forward(self.model, self.data)
        seen = np.zeros(6)
        mujoco.mj_objectVelocity(self.model, self.data, mujoco.mjtObj.mjOBJ_BODY, 1, seen, False)
        return np.concatenate([self.data.qpos[3:], seen[:3]])


def environment(R0, w0, inertia, dt, n):
    """Return the motion in the environment."""
    return run(FreeBody(inertia, dt), R0, w0, n)


def wrapper(R0, w0, inertia, dt, n):
    """Return the motion in the wrapped environment."""
    return run(InWorldAxes(inertia, dt), R0, w0, n)


def run(env, R0, w0, n):
    """Return the attitudes and rates that an environment observes."""
    start = {"quaternion": Rotation.from_matrix(R0).as_quat(scalar_first=True), "rates": w0}
    seen = [env.reset(options=start)[0], *(env.step(None)[0] for _ in range(n))]
    q, w = np.split(np.array(seen), [4], axis=1)
    return Rotation.from_quat(q, scalar_first=True).as_matrix(), w


if __name__ == "__main__":
    print(cv.verification.parity(environment, wrapper).sentence)
