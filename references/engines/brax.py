"""Brax on a free joint, on the CPU. JAX compiles the whole run; compilation is not timed.

Nothing had to be switched off: damping (`ang_damping`, `vel_damping`) and scaling of inertia (`spring_inertia_scale`) are 0 by
default. "spring" and "positional" have no gyroscopic term, so a free body turns about its initial axis. "positional" takes
2 sin(turn / 2) / dt for the rate after a step, so that fast bodies lose energy.

Parameters
----------
pipeline
    "generalized", "positional" or "spring".
precision
    "f64" (JAX's `x64`) or "f32", which is JAX's default.

References
----------
Defaults: https://github.com/google/brax/blob/main/brax/io/mjcf.py
Spring, how it integrates: https://github.com/google/brax/blob/main/brax/spring/integrator.py
Positional, `project_xd`: https://github.com/google/brax/blob/main/brax/positional/integrator.py
x64: https://docs.jax.dev/en/latest/notebooks/Common_Gotchas_in_JAX.html#double-64bit-precision
"""

import importlib
from functools import lru_cache
from pathlib import Path

import numpy as np

ENGINE = {
    "package": "brax",
    "module": "brax",
    "oldest": "0.14",
    "settings": {"pipeline": "generalized", "precision": "f64"},
    "orders": {"generalized": 1, "positional": 1, "spring": 1},
    "free_only": "Brax reads no ball joint",
    "card": {
        "variants": ("generalized", "positional", "spring", "generalized,precision=f32"),
        "as_installed": ("precision=f32",),
    },
}


def prepare(given):
    """Return a run, compiled as a whole: `lax.scan` over samples, `fori_loop` over the steps between them.

    The variable JAX_ENABLE_X64 of the process sets the precision. Compiled code is kept in the home of the environment.
    """
    import jax
    from brax.io import mjcf

    jax.config.update("jax_compilation_cache_dir", str(Path.home() / ".cache" / "jax"))
    system = mjcf.loads(_model(given)).replace(mj_model=None)  # static data, which would cause another compilation
    number = system.gravity.dtype
    place = np.array([0, 0, 0, *given.q0], number), np.array([0, 0, 0, *given.w0], number)
    counts = np.diff(given.steps).astype(np.int32)
    march = _march(given.pipeline)
    jax.block_until_ready(march(system, place, counts))

    def run():
        q, w = march(system, place, counts)
        return {"q": np.asarray(q, float), "w_W": np.asarray(w, float)}

    return run


@lru_cache(maxsize=8)
def _march(name):
    """Return a function that computes all samples, compiled once per number of samples: steps and inertia are data."""
    import jax

    pipeline, no_action = importlib.import_module(f"brax.{name}.pipeline"), np.zeros(0)

    def march(system, place, counts):
        def advance(state, n_steps):
            state = jax.lax.fori_loop(0, n_steps, lambda _, state: pipeline.step(system, state, no_action), state)
            return state, (state.x.rot[0], state.xd.ang[0])

        start = pipeline.init(system, *place)
        samples = jax.lax.scan(advance, start, counts)[1]
        return jax.tree.map(lambda first, rest: jax.numpy.concatenate([first, rest]), (start.x.rot, start.xd.ang), samples)

    return jax.jit(march)


def _model(given):
    """Return the body as MJCF, with the shape that Brax requires, which has no mass and no contacts."""
    moments = " ".join(map(repr, given.moments.tolist()))
    return f"""
        <mujoco>
          <option gravity="0 0 0" timestep="{given.dt!r}"/>
          <worldbody>
            <body>
              <freejoint/>
              <inertial mass="{given.mass!r}" pos="0 0 0" diaginertia="{moments}"/>
              <geom type="sphere" size="0.1" mass="0" contype="0" conaffinity="0"/>
            </body>
          </worldbody>
        </mujoco>"""
