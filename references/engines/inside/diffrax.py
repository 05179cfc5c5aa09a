"""Diffrax in its environment, on Euler's equations. Source: its documentation, ODE solvers, diffeqsolve."""

import numpy as np


def prepare(given):
    """Return a run compiled as a whole, with samples saved at their times. JAX_ENABLE_X64 says in which precision."""
    import diffrax
    import jax
    import jax.numpy as jnp

    solver = getattr(diffrax, given.solver)()
    moments, start = jnp.array(given.moments), jnp.concatenate([jnp.array(given.q0), jnp.array(given.w0)])
    times = jnp.array(given.steps * given.dt)
    controller = diffrax.PIDController(given.rtol, given.rtol) if given.rtol else diffrax.ConstantStepSize()

    weight, com = given.mass * given.gravity, jnp.array(given.com)

    def derivative(t, y, _):
        q, w = y[:4], y[4:]
        # of the unit quaternion's rotation, the third row: the vertical in body axes
        up = jnp.array([2 * (q[1] * q[3] - q[0] * q[2]), 2 * (q[2] * q[3] + q[0] * q[1]), 1 - 2 * (q[1] ** 2 + q[2] ** 2)])
        turn = jnp.concatenate([-jnp.dot(q[1:], w)[None], q[0] * w + jnp.cross(q[1:], w)]) / 2
        torque = jnp.cross(moments * w, w) - weight * jnp.cross(com, up)
        return jnp.concatenate([turn, torque / moments])

    @jax.jit
    def solve():
        options = {"saveat": diffrax.SaveAt(ts=times), "stepsize_controller": controller, "max_steps": None, "throw": False}
        adjoint = diffrax.ForwardMode() if hasattr(diffrax, "ForwardMode") else diffrax.DirectAdjoint()
        term = diffrax.ODETerm(derivative)
        return diffrax.diffeqsolve(term, solver, times[0], times[-1], given.dt, start, adjoint=adjoint, **options)

    jax.block_until_ready(solve())

    def run():
        found = solve()
        y = np.asarray(found.ys, float)
        return {"q": y[:, :4], "w": y[:, 4:], "steps": int(found.stats["num_steps"])}

    return run
