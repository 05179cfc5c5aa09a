"""`solid_propulsion` raises an error without a motor during the first second."""

import warnings

from rocketpy import Environment, Flight, Rocket

warnings.simplefilter("ignore")  # a rocket without fins is unstable
air = Environment(gravity=0.0)
air.set_atmospheric_model(type="custom_atmosphere", pressure=0, temperature=300, wind_u=0, wind_v=0)
drag = {"power_off_drag": 0.0, "power_on_drag": 0.0}
rocket = Rocket(radius=0.1, mass=1.0, inertia=(13.0, 5.0, 10.0), center_of_mass_without_motor=0.0, **drag)


def fly(begin, equations):
    start = [begin, 0.0, 0.0, 1e4, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 2.0, 3.0]
    options = {"initial_solution": start, "max_time": begin + 0.5, "equations_of_motion": equations}
    try:
        Flight(rocket=rocket, environment=air, rail_length=1, **options)
    except Exception as error:
        return type(error).__name__
    return "no error"


found = {begin: fly(begin, "solid_propulsion") for begin in (0.0, 1.0)}
texts = [f"from {begin:g} s {end}" for begin, end in found.items()]
print(f"{', '.join(texts)}, with standard {fly(0.0, 'standard')}:", "wrong" if found[0.0] != "no error" else "right")
