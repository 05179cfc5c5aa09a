"""Diffrax on quaternion and body rates, in double precision on the CPU. JAX compiles the whole run; this is not timed.

Parameters
----------
solver
    "Euler", "Heun", "Midpoint", "Bosh3", "Tsit5", "Dopri5" or "Dopri8".
rtol
    Relative and absolute tolerance of adaptive steps, up to 1; 0 for fixed steps of dt.

References
----------
Solvers: https://docs.kidger.site/diffrax/api/solvers/ode_solvers/
Choice of steps: https://docs.kidger.site/diffrax/api/stepsize_controller/
"""

import numpy as np

ENGINE = {
    "package": "diffrax",
    "module": "diffrax",
    "oldest": "0.7",
    "settings": {"solver": "Tsit5", "rtol": 0.0},
    "orders": {"Euler": 1, "Heun": 2, "Midpoint": 2, "Bosh3": 3, "Tsit5": 5, "Dopri5": 5, "Dopri8": 8},
    "tolerance": "rtol",
    "fields": ("UniformGravity",),
    "method_info": {
        "variants": ("", "Dopri8", "Dopri8,rtol=1e-12"),
        "suite": ("", "Dopri8,rtol=1e-12"),
    },
}


def prepare(given):
    """Return a run, compiled as a whole. The variable JAX_ENABLE_X64 of the process sets the precision."""
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
        # the vertical in body axes: the third row of the rotation matrix
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
        solution = solve()
        y = np.asarray(solution.ys, float)
        return {"q": y[:, :4], "w": y[:, 4:], "steps": int(solution.stats["num_steps"])}

    return run
