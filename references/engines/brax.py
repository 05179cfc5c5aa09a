"""Brax on a free joint, on the CPU. JAX compiles the whole run; compilation is not timed.

Nothing had to be switched off: damping (`ang_damping`, `vel_damping`) and scaling of inertia (`spring_inertia_scale`) are 0 by
default. "spring" and "positional" have no gyroscopic term. "positional" takes 2 sin(turn / 2) / dt for the rate after a step.

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

import numpy as np

from .shared import run_jax, write_mjcf

ENGINE = {
    "package": "brax",
    "module": "brax",
    "oldest": "0.14",
    "settings": {"pipeline": "generalized", "precision": "f64"},
    "orders": {"generalized": 1, "positional": 1, "spring": 1},
    "free_only": "Brax reads no ball joint",
    "method_info": {
        "variants": ("generalized", "positional", "spring", "generalized,precision=f32"),
        "as_installed": ("precision=f32",),
    },
}


def prepare(given):
    """Return a run, compiled as a whole. The variable JAX_ENABLE_X64 of the process sets the precision."""
    import jax
    from brax.io import mjcf

    # Brax requires a shape. This one has no mass and no contacts.
    shape = '<geom type="sphere" size="0.1" mass="0" contype="0" conaffinity="0"/>'
    model = write_mjcf(given, f'<option gravity="0 0 0" timestep="{given.dt!r}"/>', shape)
    system = mjcf.loads(model).replace(mj_model=None)  # static data, which would cause another compilation
    place = [np.array([0, 0, 0, *values], system.gravity.dtype) for values in (given.q0, given.w0)]
    pipeline, step = _pipeline(given.pipeline)
    start = jax.jit(pipeline.init)(system, *place)
    q, w = (np.asarray(part, float) for part in _read(start))
    return run_jax(given, step, _read, system, start, {"q": q, "w_W": w})


@lru_cache(maxsize=8)
def _pipeline(name):
    """Return a pipeline, and its step without actions: always the same function, so that it is compiled once."""
    pipeline, no_action = importlib.import_module(f"brax.{name}.pipeline"), np.zeros(0)
    return pipeline, lambda system, state: pipeline.step(system, state, no_action)


def _read(state):
    return state.x.rot[0], state.xd.ang[0]
