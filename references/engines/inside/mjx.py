"""MJX in its environment. Source: MuJoCo's documentation, MJX; JAX's, double precision (x64)."""

from functools import lru_cache
from pathlib import Path

import numpy as np


def prepare(given):
    """Return a run on a free joint, or on a ball joint at the fixed point, compiled as a whole.

    Whether JAX computes in double precision is said by the variable JAX_ENABLE_X64 of the process. What is compiled is kept in
    the home of the environment.
    """
    import jax
    import mujoco
    from mujoco import mjx

    jax.config.update("jax_compilation_cache_dir", str(Path.home() / ".cache" / "jax"))
    model = mjx.put_model(_model(mujoco, given))
    start = mjx.make_data(model)
    number = start.qpos.dtype
    place = [0, 0, 0] * given.free
    start = start.replace(qpos=jax.numpy.array([*place, *given.q0], number), qvel=jax.numpy.array([*place, *given.w0], number))
    counts = np.diff(given.steps).astype(np.int32)
    march = _march()
    jax.block_until_ready(march(model, start, counts))

    def run():
        q, w = march(model, start, counts)
        return {"q": np.vstack([given.q0, np.asarray(q, float)]), "w": np.vstack([given.w0, np.asarray(w, float)])}

    return run


@lru_cache(maxsize=1)
def _march():
    """Return what computes all samples, compiled once for every number of them: step, counts and inertia are data."""
    import jax
    from mujoco import mjx

    def march(model, start, counts):
        def advance(data, n_steps):
            data = jax.lax.fori_loop(0, n_steps, lambda _, data: mjx.step(model, data), data)
            return data, (data.qpos[-4:], data.qvel[-3:])

        return jax.lax.scan(advance, start, counts)[1]

    return jax.jit(march)


def _model(mujoco, given):
    def text(numbers):
        return " ".join(repr(float(number)) for number in numbers)

    # MuJoCo refuses moments of a planar body that exceed the sum of the others by a rounding unit.
    moments = np.minimum(given.moments_com, np.roll(given.moments_com, 1) + np.roll(given.moments_com, 2))
    inertial = f'mass="{given.mass!r}" pos="{text(given.com)}" quat="{text(given.q_com)}" diaginertia="{text(moments)}"'
    return mujoco.MjModel.from_xml_string(f"""
        <mujoco>
          <option gravity="0 0 {-given.gravity!r}" integrator="{given.integrator}" timestep="{given.dt!r}">
            <flag contact="disable" constraint="disable"/>
          </option>
          <worldbody>
            <body><joint type="{"free" if given.free else "ball"}"/><inertial {inertial}/></body>
          </worldbody>
        </mujoco>""")
