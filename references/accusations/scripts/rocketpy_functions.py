"""Functions of time of a `Flight` interpolate between its steps, with errors far above those at the steps."""

import warnings

import numpy as np
from rocketpy import Environment, Flight, Rocket

warnings.simplefilter("ignore")  # a rocket without fins is unstable
air = Environment(gravity=0.0)
air.set_atmospheric_model(type="custom_atmosphere", pressure=0, temperature=300, wind_u=0, wind_v=0)
drag = {"power_off_drag": 0.0, "power_on_drag": 0.0}
rocket = Rocket(radius=0.1, mass=1.0, inertia=(13.0, 5.0, 10.0), center_of_mass_without_motor=0.0, **drag)
START = [0.0, 0.0, 0.0, 1e4, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 2.0, 3.0]


def fly(end, tolerance=1e-13):
    options = {"initial_solution": START, "rtol": tolerance, "atol": 6 * [1.0] + 7 * [tolerance], "ode_solver": "DOP853"}
    return Flight(rocket=rocket, environment=air, rail_length=1, max_time=float(end), **options)


def error(time):
    state = np.array([function.get_value_opt(time) for function in (flight.e0, flight.e1, flight.e2, flight.e3)])
    return 2 * np.linalg.norm(state - fly(time).solution[-1][7:11])


flight = fly(2.0, 1e-9)
steps = [float(state[0]) for state in flight.solution[1:-1:4]]
later = [float(state[0]) for state in flight.solution[2::4]]
at, between = max(map(error, steps)), max(error((a + b) / 2) for a, b in zip(steps, later))
print(f"error of the attitude {at:.1e} rad at steps, {between:.1e} rad between them:", end=" ")
print("wrong" if between > 100 * at else "right")
