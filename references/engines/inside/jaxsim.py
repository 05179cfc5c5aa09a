"""JaxSim in its environment. Source: its documentation, API: `JaxSimModel`, `JaxSimModelData`, `js.model.step`."""

from functools import lru_cache
from pathlib import Path

import numpy as np


def prepare(given):
    """Return a run on a floating base, compiled as a whole: `lax.scan` over samples, `fori_loop` over the steps between them.

    Whether JAX computes in double precision is said by the variable JAX_ENABLE_X64 of the process. What is compiled is kept in
    the home of the environment.
    """
    import jax
    import jaxsim.api as js

    jax.config.update("jax_compilation_cache_dir", str(Path.home() / ".cache" / "jax"))
    integrator = js.model.IntegratorType[given.integrator]
    options = {"is_urdf": False, "time_step": given.dt, "gravity": 0.0, "integrator": integrator}
    model = js.model.JaxSimModel.build_from_model_description(_description(given), **options)
    start = js.data.JaxSimModelData.build(
        model,
        base_quaternion=jax.numpy.array(given.q0),
        base_angular_velocity=jax.numpy.array(given.w0_W),
        velocity_representation=js.common.VelRepr.Mixed,  # angular velocity in the world
    )
    counts = np.diff(given.steps).astype(np.int32)
    march = _march()
    jax.block_until_ready(march(model, start, counts))

    def run():
        q, w = march(model, start, counts)
        return {"q": np.vstack([given.q0, np.asarray(q, float)]), "w_W": np.vstack([given.w0_W, np.asarray(w, float)])}

    return run


@lru_cache(maxsize=1)
def _march():
    """Return what computes the samples after the start, compiled once for every integrator, step and number of samples."""
    import jax
    import jaxsim.api as js

    def march(model, data, counts):
        def advance(data, n_steps):
            data = jax.lax.fori_loop(0, n_steps, lambda _, data: js.model.step(model, data), data)
            return data, (data.base_quaternion, data.base_velocity[3:])

        return jax.lax.scan(advance, data, counts)[1]

    return jax.jit(march)


def _description(given):
    """Return the body as SDF; JaxSim reads URDF by a program of Gazebo's."""
    ixx, iyy, izz = map(repr, given.moments.tolist())
    return f"""
        <?xml version="1.0"?>
        <sdf version="1.10">
          <model name="body">
            <link name="link">
              <inertial>
                <mass>{given.mass!r}</mass>
                <inertia>
                  <ixx>{ixx}</ixx><iyy>{iyy}</iyy><izz>{izz}</izz><ixy>0</ixy><ixz>0</ixz><iyz>0</iyz>
                </inertia>
              </inertial>
            </link>
          </model>
        </sdf>""".strip()
