"""The Adams-Bashforth methods of orders 3, 4 and 5 (integrators 4, 5 and 9) have order 2."""

import tempfile
from pathlib import Path

import jsbsim
import numpy as np

AIRCRAFT = """<fdm_config name="body" version="2.0"><metrics/><mass_balance>
  <ixx unit="KG*M2">13</ixx><iyy unit="KG*M2">5</iyy><izz unit="KG*M2">10</izz><emptywt unit="KG">1</emptywt>
  <location name="CG" unit="M"><x>0</x><y>0</y><z>0</z></location></mass_balance>
  <ground_reactions/><propulsion/><aerodynamics/></fdm_config>"""
jsbsim.FGJSBBase().debug_lvl = 0
folder = tempfile.TemporaryDirectory()
(place := Path(folder.name, "aircraft", "body")).mkdir(parents=True)
(place / "body.xml").write_text(AIRCRAFT)


def rates(method, steps):  # after 1 s
    flight = jsbsim.FGFDMExec(folder.name)
    flight.load_model("body")
    flight["simulation/models/FGAerodynamics/enabled"], flight["simulation/integrator/rate/rotational"] = 0, method
    flight.set_dt(1 / steps)
    flight["ic/h-sl-ft"], flight["ic/p-rad_sec"], flight["ic/q-rad_sec"], flight["ic/r-rad_sec"] = 1e7, 1.0, 2.0, 3.0
    flight.run_ic()
    all(flight.run() for _ in range(steps))
    return np.array([flight[f"velocities/{axis}i-rad_sec"] for axis in "pqr"])


orders = {}
for name, method in {"AB2": 3, "AB3": 4, "AB4": 5, "AB5": 9}.items():
    errors = [np.linalg.norm(rates(method, steps) - rates(method, 20000)) for steps in (100, 400)]
    orders[name] = np.log2(errors[0] / errors[1]) / 2
text = ", ".join(f"{order:.1f} of {name}" for name, order in orders.items())
print(f"order of the rates {text}:", "wrong" if max(orders.values()) < 2.5 else "right")
