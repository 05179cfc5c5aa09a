"""`solid_propulsion` sets the rates to 0, so that the attitude does not change."""

import warnings

import numpy as np
from rocketpy import Environment, Flight, Rocket

warnings.simplefilter("ignore")  # a rocket without fins is unstable
air = Environment(gravity=0.0)
air.set_atmospheric_model(type="custom_atmosphere", pressure=0, temperature=300, wind_u=0, wind_v=0)
drag = {"power_off_drag": 0.0, "power_on_drag": 0.0}
rocket = Rocket(radius=0.1, mass=1.0, inertia=(13.0, 5.0, 10.0), center_of_mass_without_motor=0.0, **drag)


def attitude(equations):
    start = [1.0, 0.0, 0.0, 1e4, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 2.0, 3.0]
    options = {"initial_solution": start, "max_time": 2.0, "rtol": 1e-9, "atol": 6 * [1.0] + 7 * [1e-9]}
    flight = Flight(rocket=rocket, environment=air, rail_length=1, equations_of_motion=equations, **options)
    return np.array(flight.solution[-1])[7:]


usual, solid = attitude("standard"), attitude("solid_propulsion")
angles = [2 * np.degrees(np.arccos(min(abs(state[0]) / np.linalg.norm(state[:4]), 1.0))) for state in (usual, solid)]
print(
    f"a body with rates of 1, 2, 3 rad/s turns in 1 s by {angles[0]:.0f} degrees, with solid_propulsion by {angles[1]:.0f}:",
    end=" ",
)
print("wrong" if angles[1] < 1 else "right")
