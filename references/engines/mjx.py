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

from functools import lru_cache, partial
from pathlib import Path

import numpy as np

ENGINE = {
    "package": "mujoco-mjx",
    "module": "mujoco.mjx",
    "oldest": "3.6",
    "settings": {"integrator": "RK4", "precision": "f64"},
    "orders": {"Euler": 1, "RK4": 4, "implicitfast": 1},
    "gravity": True,
    "card": {
        "variants": ("Euler", "implicitfast", "RK4", "RK4,precision=f32"),
        "many": ("RK4", "RK4,precision=f32"),
        "as_installed": ("Euler,precision=f32",),
    },
}

PER_BODY = ("body_mass", "body_subtreemass", "body_inertia", "body_ipos", "body_iquat", "body_invweight0", "dof_invweight0")
"""Parts of the model that depend on the body, apart from gravity."""


def prepare(given):
    """Return a run, compiled as a whole.

    The variable JAX_ENABLE_X64 of the process sets the precision. Compiled code is kept in the home of the environment.
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


def prepare_many(bodies):
    """Return a run of many bodies, by `jax.vmap` over models and states."""
    import jax
    import mujoco
    from mujoco import mjx

    jax.config.update("jax_compilation_cache_dir", str(Path.home() / ".cache" / "jax"))
    given, q0, w0 = bodies[0], np.array([body.q0 for body in bodies]), np.array([body.w0 for body in bodies])
    hosts = [_model(mujoco, body) for body in bodies]
    one = mjx.put_model(hosts[0])
    number = one.body_mass.dtype
    rows = {name: np.array([getattr(host, name) for host in hosts]) for name in PER_BODY}
    rows = {name: jax.numpy.asarray(values, number) for name, values in rows.items()}
    gravity = jax.numpy.asarray(np.array([host.opt.gravity for host in hosts]), number)
    data = mjx.make_data(one)
    place = np.zeros((len(bodies), 3 * given.free))
    qpos = jax.numpy.asarray(np.hstack([place, q0]), number)
    qvel = jax.numpy.asarray(np.hstack([place, w0]), number)
    counts = np.diff(given.steps).astype(np.int32)

    together, given_to_it = _march_many(), (one, data, rows, gravity, qpos, qvel, counts)
    jax.block_until_ready(together(*given_to_it))

    def run():
        start = q0[:, None], w0[:, None]
        rest = (np.asarray(samples, float) for samples in together(*given_to_it))
        q, w = (np.concatenate(both, axis=1) for both in zip(start, rest))  # noqa: B905
        return {"q": q, "w": w}

    return run


@lru_cache(maxsize=1)
def _march_many():
    """Return a function that computes all samples of many bodies, compiled once per number of bodies and of samples."""
    import jax
    from mujoco import mjx

    def march(model, data, rows, gravity, qpos, qvel, counts):
        model = model.replace(opt=model.opt.replace(gravity=gravity), **rows)
        return _march_samples(mjx, jax, model, data.replace(qpos=qpos, qvel=qvel), counts)

    return jax.jit(jax.vmap(march, in_axes=(None, None, 0, 0, 0, 0, None)))


def _march_samples(mjx, jax, model, start, counts):
    """Return samples of attitude and rates; `counts` are the numbers of steps between them."""

    def advance(data, n_steps):
        data = jax.lax.fori_loop(0, n_steps, lambda _, data: mjx.step(model, data), data)
        return data, (data.qpos[-4:], data.qvel[-3:])

    return jax.lax.scan(advance, start, counts)[1]


@lru_cache(maxsize=1)
def _march():
    """Return a function that computes all samples, compiled once per number of samples: step, counts and inertia are data."""
    import jax
    from mujoco import mjx

    return jax.jit(partial(_march_samples, mjx, jax))


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
