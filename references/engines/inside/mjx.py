"""MJX in its environment. Source: MuJoCo's documentation, MJX; JAX's, double precision (x64)."""

from types import SimpleNamespace

import numpy as np


def prepare(given):
    """Return a run on a free joint, or on a ball joint at the fixed point, compiled as a whole.

    It is a `lax.scan` over samples, with a `fori_loop` over the steps between them. Whether JAX computes in double precision is
    said by the variable JAX_ENABLE_X64 of the process.
    """
    import jax
    import mujoco
    from mujoco import mjx

    model = mjx.put_model(_model(mujoco, given))
    start = mjx.make_data(model)
    number = start.qpos.dtype
    place = [0, 0, 0] * given.free
    start = start.replace(qpos=jax.numpy.array([*place, *given.q0], number), qvel=jax.numpy.array([*place, *given.w0], number))
    place = SimpleNamespace(jax=jax, model=model, step=mjx.step)
    march = jax.jit(lambda data: _march(place, data, given))
    jax.block_until_ready(march(start))

    def run():
        q, w = march(start)
        return {"q": np.vstack([given.q0, np.asarray(q, float)]), "w": np.vstack([given.w0, np.asarray(w, float)])}

    return run


def _march(place, data, given):
    lax = place.jax.lax

    def advance(data, n_steps):
        data = lax.fori_loop(0, n_steps, lambda _, data: place.step(place.model, data), data)
        return data, (data.qpos[-4:], data.qvel[-3:])

    counts = place.jax.numpy.asarray(np.diff(given.steps).astype(np.int32))
    return lax.scan(advance, data, counts)[1]


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
