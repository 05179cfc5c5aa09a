"""CyRK's explicit Runge-Kutta methods on quaternion and body rates: a compiled ODE solver for any equations.

The solver, its step control and its interpolation are C++ (`nbsolve2_ivp`). numba compiles the right-hand side, which the
solver calls by its address. Samples come from the interpolant of the steps. Each method chooses its steps.

Parameters
----------
method
    "DOP853", "Vern8", "Vern7", "Tsit5", "RK45" or "RK23".
rtol
    Relative and absolute tolerance, above 0 and below 1.

References
----------
Solvers: https://cyrk.readthedocs.io/en/latest/
"""

from functools import lru_cache

import numpy as np

from .shared import FIELDS, compile_derivative, pack_field

ENGINE = {
    "package": "cyrk",
    "module": "CyRK",
    "oldest": "0.20",
    "settings": {"method": "DOP853", "rtol": 1e-12},
    "orders": dict.fromkeys(("DOP853", "Vern8", "Vern7", "Tsit5", "RK45", "RK23")),  # None: the solver chooses its steps
    "tolerance": "rtol",
    "fields": FIELDS,
    "method_info": {"variants": ("", "Vern8", "Vern7", "Tsit5"), "suite": ("", "rtol=1e-9")},
}


def prepare(given):
    """Return a run of one body."""
    solve, address = _compile()
    body = np.concatenate([pack_field(given, given.mass * given.gravity * given.com), given.moments])
    start, times = np.concatenate([given.q0, given.w0]), given.steps * given.dt

    def run():
        y, steps, status = solve(address, start, given.method, times, body, given.rtol)
        samples = np.full((len(times), 7), np.nan)
        samples[: len(y)] = y[: len(times)]  # a failed run returns fewer rows
        # The reason is read only if samples are not finite.
        return {"q": samples[:, :4], "w": samples[:, 4:], "steps": steps, "reason": f"CyRK's status is {status}"}

    return run


@lru_cache(maxsize=1)
def _compile():
    """Return a function that integrates, and the address of the right-hand side."""
    from CyRK import cyjit, nbsolve2_ivp
    from numba import njit

    derivative = compile_derivative()

    @cyjit
    def right_hand_side(out, t, y, body):
        derivative(out, t, y, body)

    @njit
    def solve(address, start, method, times, body, tolerance):
        result = nbsolve2_ivp(address, (0.0, times[-1]), start, method, times, False, body, tolerance, tolerance)
        y, steps, status = result.y.T.copy(), result.steps_taken, result.status
        result.free()
        return y, steps, status

    solve.right_hand_side = right_hand_side  # its address is in use
    return solve, right_hand_side.address
