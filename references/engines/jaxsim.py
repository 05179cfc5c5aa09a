"""JaxSim on a floating base, on the CPU. JAX compiles the whole run; compilation is not timed.

Nothing is switched off: without shapes there is no contact, and damping belongs to joints, of which there are none.
JaxSim's `RungeKutta4Fast` is not offered. One of its packages, pptree, has no wheel:
`conservative engines install jaxsim --allow-build`.

Parameters
----------
integrator
    "SemiImplicitEuler", which is JaxSim's default, or "RungeKutta4".
precision
    "f64", which is JaxSim's default, or "f32", which it calls experimental.

References
----------
Integrators: https://github.com/gbionics/jaxsim/blob/main/src/jaxsim/api/integrators.py
Precision: https://github.com/gbionics/jaxsim/blob/main/src/jaxsim/__init__.py
Models and their joints: https://jaxsim.readthedocs.io/en/latest/modules/api.html
"""

from .shared import run_jax

ENGINE = {
    "package": "jaxsim",
    "module": "jaxsim",
    "oldest": "0.9",
    "settings": {"integrator": "RungeKutta4", "precision": "f64"},
    "orders": {"SemiImplicitEuler": 1, "RungeKutta4": 4},
    "free_only": "JaxSim's joints are revolute, prismatic or fixed",
    "method_info": {
        "variants": ("SemiImplicitEuler", "RungeKutta4", "RungeKutta4,precision=f32"),
        "as_installed": ("SemiImplicitEuler",),
    },
}


def prepare(given):
    """Return a run, compiled as a whole. The variable JAX_ENABLE_X64 of the process sets the precision."""
    import jax
    import jaxsim.api as js

    integrator = js.model.IntegratorType[given.integrator]
    options = {"is_urdf": False, "time_step": given.dt, "gravity": 0.0, "integrator": integrator}
    model = js.model.JaxSimModel.build_from_model_description(_description(given), **options)
    start = js.data.JaxSimModelData.build(
        model,
        base_quaternion=jax.numpy.array(given.q0),
        base_angular_velocity=jax.numpy.array(given.w0_W),
        velocity_representation=js.common.VelRepr.Mixed,  # angular velocity in the world
    )
    return run_jax(given, js.model.step, _read, model, start, {"q": given.q0, "w_W": given.w0_W})


def _read(data):
    return data.base_quaternion, data.base_velocity[3:]


def _description(given):
    """Return the body as SDF, because JaxSim reads URDF with a program of Gazebo."""
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
