"""With `positional`, a fast ball loses angular velocity without a torque."""

import jax
import numpy as np
from brax.io import mjcf
from brax.positional import pipeline

jax.config.update("jax_enable_x64", True)
TEXT = """<mujoco><option gravity="0 0 0" timestep="0.01"/><worldbody><body><freejoint/><inertial mass="1" pos="0 0 0"
diaginertia="1 1 1"/><geom type="sphere" size="0.1" mass="0" contype="0" conaffinity="0"/></body></worldbody></mujoco>"""
system = mjcf.loads(TEXT)
step = jax.jit(lambda state: pipeline.step(system, state, np.zeros(0)))


def speed_left(speed):
    state = pipeline.init(system, np.array([0.0, 0, 0, 1, 0, 0, 0]), np.array([0.0, 0, 0, 0, 0, speed]))
    for _ in range(100):
        state = step(state)
    return float(state.xd.ang[0, 2]) / speed


found = {speed: speed_left(speed) for speed in (1.0, 10.0, 100.0)}
texts = [f"{rest:.4f} at {speed:g} rad/s" for speed, rest in found.items()]
print(f"rate after 100 steps of 0.01 s over rate at the start: {', '.join(texts)}:", end=" ")
print("wrong" if min(found.values()) < 0.99 else "right")
