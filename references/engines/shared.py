"""Functions that several adapters share. They run in the environments of engines and import nothing of this package."""

from functools import lru_cache, partial

import numpy as np

PER_BODY = ("body_mass", "body_subtreemass", "body_inertia", "body_ipos", "body_iquat", "body_invweight0", "dof_invweight0")
"""Arrays of a MuJoCo model that depend on the body."""


def sample(given, step, read):
    """Return the samples of an engine that is stepped from Python, by name: `read` returns them, `step` makes one step."""
    samples = []
    for n_steps in np.diff(given.steps, prepend=0).tolist():
        for _ in range(n_steps):
            step()
        samples.append({name: np.array(values, float) for name, values in read().items()})  # copies of an engine's own arrays
    return {name: np.array([each[name] for each in samples]) for name in samples[0]}


def write_mjcf(given, option="", shape=""):
    """Return the body as an MJCF file, on a free joint or on a ball joint at the fixed point."""
    # MuJoCo refuses moments of a planar body that exceed the sum of the others by a rounding unit.
    moments = np.minimum(given.moments_com, np.roll(given.moments_com, 1) + np.roll(given.moments_com, 2))
    inertial = {"mass": np.array([given.mass]), "pos": given.com, "quat": given.q_com, "diaginertia": moments}
    attributes = " ".join(f'{name}="{" ".join(map(repr, values.tolist()))}"' for name, values in inertial.items())
    return f"""
        <mujoco>
          {option}
          <worldbody>
            <body><joint type="{"free" if given.free else "ball"}"/><inertial {attributes}/>{shape}</body>
          </worldbody>
        </mujoco>"""


def compile_models(bodies):
    """Return MuJoCo's models of the bodies, without contacts and constraints, and their gravities and arrays `PER_BODY`."""
    import mujoco

    flags = '<flag contact="disable" constraint="disable"/>'
    models = []
    for body in bodies:
        attributes = f'gravity="0 0 {-body.gravity!r}" integrator="{body.integrator}" timestep="{body.dt!r}"'
        models.append(mujoco.MjModel.from_xml_string(write_mjcf(body, f"<option {attributes}>{flags}</option>")))
    gravity = np.array([model.opt.gravity for model in models])
    return models, gravity, {name: np.array([getattr(model, name) for model in models]) for name in PER_BODY}


@lru_cache(maxsize=8)
def compile_jax(step, read):
    """Return a function of a model, a state and numbers of steps that JAX compiles: it returns the samples after the first.

    `step` maps a model and a state to the next state, and `read` maps a state to a sample. The function is compiled once for
    each number of samples, because the model and the numbers of steps are data.
    """
    import jax

    def march(model, state, counts):
        def advance(state, n_steps):
            state = jax.lax.fori_loop(0, n_steps, lambda _, state: step(model, state), state)
            return state, read(state)

        return jax.lax.scan(advance, state, counts)[1]

    return jax.jit(march)


def record_warp(step):
    """Return a function that replays a step; the step itself if this version of Warp does not record on the CPU."""
    import warp

    try:
        with warp.ScopedCapture() as capture:
            step()
    except RuntimeError:
        return step
    return partial(warp.capture_launch, capture.graph)
