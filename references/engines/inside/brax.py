"""Brax in its environment. Source: its source, `io/mjcf.py`, `generalized/pipeline.py` and the two beside it."""

import importlib
from functools import lru_cache
from pathlib import Path

import numpy as np


def prepare(given):
    """Return a run on a free joint, compiled as a whole: `lax.scan` over samples, `fori_loop` over the steps between them.

    Whether JAX computes in double precision is said by the variable JAX_ENABLE_X64 of the process. What is compiled is kept in
    the home of the environment.
    """
    import jax
    from brax.io import mjcf

    jax.config.update("jax_compilation_cache_dir", str(Path.home() / ".cache" / "jax"))
    system = mjcf.loads(_model(given)).replace(mj_model=None)  # each of which would be compiled for anew
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
    """Return what computes all samples, compiled once for every number of them: steps and inertia are data."""
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
    """Return the body; Brax wants a shape, whose mass is none and which touches nothing."""
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
