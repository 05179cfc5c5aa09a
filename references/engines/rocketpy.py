"""RocketPy's `Flight` on a rocket without a motor, in double precision: SciPy's solvers on its own equations, in Python.

Switched off: gravity, the atmosphere's pressure and with it drag, and the rail. The functions of time that a `Flight` returns
interpolate between steps, so each sample is the end of a flight that continues the
previous one (`initial_solution`). The solver is started again at each sample.

Parameters
----------
solver
    "DOP853", "RK45", "RK23", "Radau", "BDF" or "LSODA" (RocketPy's default); each chooses its steps.
rtol
    Relative tolerance, above 0 and below 1, 1e-6 by default in RocketPy. The absolute one is `rtol` for the quaternion, and
    `rtol` times the initial rate for rates.
equations
    "standard", or "solid_propulsion", RocketPy's older equations (see `references/accusations/scripts/rocketpy_rates.py`).
as_installed
    True if there is one flight, whose functions of time are read at the samples, with RocketPy's absolute tolerances: 1e-6
    for the quaternion and 1e-3 rad/s for rates.

References
----------
Flight: https://docs.rocketpy.org/en/latest/reference/classes/Flight.html
Equations of motion: https://docs.rocketpy.org/en/latest/technical/equations_of_motion.html
"""

import warnings

import numpy as np

ENGINE = {
    "package": "rocketpy",
    "module": "rocketpy",
    "oldest": "1.9",
    "settings": {"solver": "DOP853", "rtol": 1e-12, "equations": "standard", "as_installed": False},
    "orders": dict.fromkeys(("DOP853", "RK45", "RK23", "Radau", "BDF", "LSODA")),  # None: the solver chooses its steps
    "choices": {"equations": ("standard", "solid_propulsion")},
    "tolerance": "rtol",
    "free_only": "a rocket flies: nothing in RocketPy holds a point of it",
    "descriptions": ("frame",),
    "method_info": {
        "variants": ("", "LSODA", "equations=solid_propulsion"),
        "as_installed": ("LSODA,rtol=1e-6,as_installed=true",),
    },
}

PLACE = [0.0, 0.0, 1e4, 0.0, 0.0, 0.0]
"""Position, m, above the ground, at which a flight would end, and velocity, m/s."""
ANY = 6 * [1.0]
"""Absolute tolerances of these, which do not change."""
BURNT = 1.0
"""Initial time, s, of "solid_propulsion": the burn time of an empty motor."""


def prepare(given):
    """Return a run of one rocket."""
    from rocketpy import Environment, Rocket

    warnings.simplefilter("ignore")  # a rocket without fins is unstable
    air = Environment(gravity=0.0)
    air.set_atmospheric_model(type="custom_atmosphere", pressure=0, temperature=300, wind_u=0, wind_v=0)
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = given.inertia_com.tolist()
    drag = {"power_off_drag": 0.0, "power_on_drag": 0.0}
    inertia = (xx, yy, zz, xy, xz, yz)
    rocket = Rocket(radius=0.1, mass=given.mass, inertia=inertia, center_of_mass_without_motor=0.0, **drag)
    begin = BURNT if given.equations == "solid_propulsion" else 0.0
    times = begin + given.steps * given.dt
    first = [begin, *PLACE, *given.q0.tolist(), *given.w0.tolist()]

    def run_once():
        flight = _fly(given, air, rocket, first, times[-1])
        functions = (flight.e0, flight.e1, flight.e2, flight.e3, flight.w1, flight.w2, flight.w3)
        samples = np.array([[function.get_value_opt(time) for time in times.tolist()] for function in functions]).T
        return {"q": samples[:, :4], "w": samples[:, 4:], "steps": len(flight.solution) - 1}

    def run():
        states, steps = [first], 0
        for time in times[1:].tolist():
            flight = _fly(given, air, rocket, states[-1], time)
            states.append(flight.solution[-1])
            steps += len(flight.solution) - 1
        samples = np.array(states)[:, 7:]
        return {"q": samples[:, :4], "w": samples[:, 4:], "steps": steps}

    return run_once if given.as_installed else run


def _fly(given, air, rocket, state, end):
    from rocketpy import Flight

    options = {"ode_solver": given.solver, "rtol": given.rtol, "equations_of_motion": given.equations}
    if not given.as_installed:
        options["atol"] = ANY + 4 * [given.rtol] + 3 * [given.rtol * float(np.linalg.norm(given.w0))]
    return Flight(rocket=rocket, environment=air, rail_length=1, initial_solution=state, max_time=float(end), **options)
