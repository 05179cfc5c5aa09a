"""JSBSim on an aircraft without forces except weight, stepped from Python (`FGFDMExec.run`), because it has no loop.

Changed: the planet does not turn (`load_planet`), so that the Earth's rate is not in the attitudes, and there is no model of
aerodynamics (`simulation/models/FGAerodynamics/enabled`). JSBSim also integrates the translation in each step.

Parameters
----------
rate
    Integrator of the rates (`simulation/integrator/rate/rotational`): "RectEuler" (JSBSim's default), "Trapezoidal", "AB2",
    "AB3", "AB4" or "AB5" (Adams-Bashforth, all of order 2 here, because the state before the start is taken as constant).
attitude
    Integrator of the attitude (`simulation/integrator/position/rotational`): one of these, "Buss1", "Buss2" or
    "LocalLinearization"; empty for the integrator of the rates.

References
----------
FGPropagate, the integrators; FGInertial, FGMassBalance: https://jsbsim-team.github.io/jsbsim/classJSBSim_1_1FGPropagate.html
"""

import tempfile
from pathlib import Path

from .shared import stepped

INTEGRATORS = {  # FGPropagate::eIntegrateType
    **{"RectEuler": 1, "Trapezoidal": 2, "AB2": 3, "AB3": 4, "AB4": 5, "Buss1": 6, "Buss2": 7, "LocalLinearization": 8},
    "AB5": 9,
}
ENGINE = {
    "package": "jsbsim",
    "module": "jsbsim",
    "oldest": "1.3",
    "settings": {"rate": "AB2", "attitude": ""},
    "orders": {"RectEuler": 1, "Trapezoidal": 1, "AB2": 2, "AB3": 2, "AB4": 2, "AB5": 2},
    "choices": {"attitude": ("", *INTEGRATORS)},
    "free_only": "an aircraft flies: nothing in JSBSim holds one of its points",
    "method_info": {
        "variants": ("RectEuler", "Trapezoidal", "AB2", "AB5"),
        "as_installed": ("RectEuler",),
    },
}

PLANET = '<planet name="still"><rotation_rate unit="RAD/SEC">0</rotation_rate></planet>'
AIRCRAFT = """<fdm_config name="body" version="2.0">
  <metrics><location name="AERORP" unit="M"><x>0</x><y>0</y><z>0</z></location></metrics>
  <mass_balance>
    <ixx unit="KG*M2">{0!r}</ixx><iyy unit="KG*M2">{1!r}</iyy><izz unit="KG*M2">{2!r}</izz>
    <emptywt unit="KG">{3!r}</emptywt><location name="CG" unit="M"><x>0</x><y>0</y><z>0</z></location>
  </mass_balance>
  <ground_reactions/><propulsion/><aerodynamics/>
</fdm_config>"""
HEIGHT = 1e7
"""Initial height in feet: the aircraft falls."""


def prepare(given):
    """Return a run of one body."""
    import jsbsim

    jsbsim.FGJSBBase().debug_lvl = 0
    with tempfile.TemporaryDirectory() as folder:
        aircraft = Path(folder) / "aircraft" / "body"
        aircraft.mkdir(parents=True)
        (aircraft / "body.xml").write_text(AIRCRAFT.format(*given.moments.tolist(), given.mass))
        (aircraft / "still.xml").write_text(PLANET)
        flight = jsbsim.FGFDMExec(folder)
        flight.load_planet(str(aircraft / "still.xml"), False)
        flight.load_model("body")
    flight["simulation/models/FGAerodynamics/enabled"] = 0
    flight.set_dt(given.dt)
    flight["simulation/integrator/rate/rotational"] = INTEGRATORS[given.rate]
    flight["simulation/integrator/position/rotational"] = INTEGRATORS[given.attitude or given.rate]
    flight["ic/h-sl-ft"] = HEIGHT
    for axis, rate in zip("pqr", given.w0.tolist(), strict=True):
        flight[f"ic/{axis}-rad_sec"] = rate
    attitude = flight.get_propagate()

    def convert(samples):
        T = samples["T"]
        # The planet-fixed frame is inertial here. Its attitude in the world follows from the initial attitude.
        return {"R": given.R0 @ T[0] @ T.swapaxes(1, 2), "w": samples["w"]}

    def read():
        return {"T": attitude.get_Tec2b(), "w": [flight[f"velocities/{axis}i-rad_sec"] for axis in "pqr"]}

    return stepped(given, flight.run_ic, flight.run, read, convert)
