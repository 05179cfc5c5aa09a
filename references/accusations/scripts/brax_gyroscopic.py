"""`spring` and `positional` have no gyroscopic motion: the angular velocity of a free body keeps its direction."""

import jax
import numpy as np
from brax.generalized import pipeline as generalized
from brax.io import mjcf
from brax.positional import pipeline as positional
from brax.spring import pipeline as spring

jax.config.update("jax_enable_x64", True)
TEXT = """<mujoco><option gravity="0 0 0" timestep="0.01"/><worldbody><body><freejoint/><inertial mass="1" pos="0 0 0"
diaginertia="13 5 10"/><geom type="sphere" size="0.1" mass="0" contype="0" conaffinity="0"/></body></worldbody></mujoco>"""
system, w0 = mjcf.loads(TEXT), np.array([1.0, 2.0, 3.0])


def rates(pipeline):  # after 1 s, in axes of the world
    start = pipeline.init(system, np.array([0.0, 0, 0, 1, 0, 0, 0]), np.array([0.0, 0, 0, *w0]))
    step = jax.jit(lambda state: pipeline.step(system, state, np.zeros(0)))
    state = start
    for _ in range(100):
        state = step(state)
    return np.asarray(state.xd.ang[0])


def turned(w):  # angle between the angular velocity and its initial direction, rad
    return np.linalg.norm(np.cross(w, w0)) / np.linalg.norm(w) / np.linalg.norm(w0)


pipelines = {"generalized": generalized, "spring": spring, "positional": positional}
found = {name: turned(rates(pipeline)) for name, pipeline in pipelines.items()}
texts = [f"{angle:.4f} rad with {name}" for name, angle in found.items()]
print(f"in 1 s the angular velocity turns by {', '.join(texts)}:", end=" ")
print("wrong" if min(found["spring"], found["positional"]) < 1e-3 else "right")
