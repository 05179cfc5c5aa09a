"""MJX in its environment. Source: MuJoCo's documentation, MJX; JAX's, double precision (x64)."""

from types import SimpleNamespace

import numpy as np


def prepare(given):
    """Return a run on a free joint, compiled as a whole: `lax.scan` over samples, `fori_loop` over the steps between them.

    Whether JAX computes in double precision is said by the variable JAX_ENABLE_X64 of the process.
    """
    import jax
    import mujoco
    from mujoco import mjx

    model = mjx.put_model(_model(mujoco, given))
    start = mjx.make_data(model)
    number = start.qpos.dtype
    start = start.replace(
        qpos=jax.numpy.array([0, 0, 0, *given.q0], number), qvel=jax.numpy.array([0, 0, 0, *given.w0], number)
    )
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
        return data, (data.qpos[3:7], data.qvel[3:6])

    counts = place.jax.numpy.asarray(np.diff(given.steps).astype(np.int32))
    return lax.scan(advance, data, counts)[1]


def _model(mujoco, given):
    moments = " ".join(repr(float(moment)) for moment in given.moments)
    return mujoco.MjModel.from_xml_string(f"""
        <mujoco>
          <option gravity="0 0 0" integrator="{given.integrator}" timestep="{given.dt!r}">
            <flag contact="disable" constraint="disable"/>
          </option>
          <worldbody>
            <body><freejoint/><inertial mass="{given.mass!r}" pos="0 0 0" diaginertia="{moments}"/></body>
          </worldbody>
        </mujoco>""")
