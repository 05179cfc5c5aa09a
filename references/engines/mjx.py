"""MJX on a free joint or a ball joint, on the CPU. JAX compiles the whole run; compilation is not timed.

Many bodies at once are `jax.vmap` over models and states. Switched off: contacts and constraints (`<flag contact="disable"
constraint="disable"/>`).

Parameters
----------
integrator
    "Euler", "RK4" or "implicitfast".
precision
    "f64" (JAX's `x64`) or "f32", which is JAX's default.

References
----------
MJX: https://mujoco.readthedocs.io/en/stable/mjx.html
Flags and integrators: https://mujoco.readthedocs.io/en/stable/XMLreference.html#option
x64: https://docs.jax.dev/en/latest/notebooks/Common_Gotchas_in_JAX.html#double-64bit-precision
"""

from functools import lru_cache

import numpy as np

from .shared import compile_jax, compile_models, run_jax

ENGINE = {
    "package": "mujoco-mjx",
    "module": "mujoco.mjx",
    "oldest": "3.6",
    "settings": {"integrator": "RK4", "precision": "f64"},
    "orders": {"Euler": 1, "RK4": 4, "implicitfast": 1},
    "fields": ("UniformGravity",),
    "descriptions": ("frame", "child", "damping"),
    "method_info": {
        "variants": ("Euler", "implicitfast", "RK4", "RK4,precision=f32"),
        "many": ("RK4", "RK4,precision=f32"),
        "as_installed": ("Euler,precision=f32",),
        "usual_dt": 0.002,
    },
}


def prepare(given):
    """Return a run, compiled as a whole. The variable JAX_ENABLE_X64 of the process sets the precision."""
    import jax
    from mujoco import mjx

    (host,), _, _ = compile_models([given])
    model, place = mjx.put_model(host), [0, 0, 0] * given.free
    data = mjx.make_data(model)
    number = data.qpos.dtype
    start = data.replace(qpos=jax.numpy.array([*place, *given.q0], number), qvel=jax.numpy.array([*place, *given.w0], number))
    return run_jax(given, mjx.step, _read, model, start, {"q": given.q0, "w": given.w0})


def prepare_many(bodies):
    """Return a run of many bodies, by `jax.vmap` over models and states."""
    import jax
    from mujoco import mjx

    given, q0, w0 = bodies[0], np.array([body.q0 for body in bodies]), np.array([body.w0 for body in bodies])
    hosts, gravity, arrays = compile_models(bodies)
    model = mjx.put_model(hosts[0])
    data = mjx.make_data(model)
    place = np.zeros((len(bodies), 3 * given.free))
    rows = arrays, gravity, np.hstack([place, q0]), np.hstack([place, w0])
    rows = jax.tree.map(lambda values: jax.numpy.asarray(values, model.body_mass.dtype), rows)
    march, counts = _march_many(), np.diff(given.steps).astype(np.int32)
    jax.block_until_ready(march(model, data, rows, counts))

    def run():
        q, w = (np.asarray(samples, float) for samples in march(model, data, rows, counts))
        return {"q": np.concatenate([q0[:, None], q], axis=1), "w": np.concatenate([w0[:, None], w], axis=1)}

    return run


@lru_cache(maxsize=1)
def _march_many():
    """Return a function that computes the samples of many bodies, compiled once per number of bodies and of samples."""
    import jax
    from mujoco import mjx

    def march(model, data, rows, counts):
        arrays, gravity, qpos, qvel = rows
        model = model.replace(opt=model.opt.replace(gravity=gravity), **arrays)
        return compile_jax(mjx.step, _read)(model, data.replace(qpos=qpos, qvel=qvel), counts)

    return jax.jit(jax.vmap(march, in_axes=(None, None, 0, None)))


def _read(data):
    return data.qpos[-4:], data.qvel[-3:]
