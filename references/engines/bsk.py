"""Basilisk's integrators on one free spacecraft hub, in Basilisk's own loop (`ExecuteSimulation`).

A simulation cannot be started twice, so each run creates a new one, which is not timed. Attitudes are modified Rodrigues
parameters.

Parameters
----------
integrator
    "Euler", "RK2", "RK4" (Basilisk's default), "RKF45" or "RKF78"; the last two choose their own steps.
tol
    Their absolute and relative tolerance, above 0 and below 1.

References
----------
Spacecraft and its hub: https://avslab.github.io/basilisk/Documentation/simulation/dynamics/spacecraft/spacecraft.html
Integrators: https://github.com/AVSLab/basilisk/tree/develop/src/simulation/dynamics/Integrators
"""

import numpy as np

ENGINE = {
    "package": "bsk",
    "module": "Basilisk.simulation.spacecraft",
    "oldest": "2.8",
    "settings": {"integrator": "RK4", "tol": 1e-12},
    "orders": {"Euler": 1, "RK2": 2, "RK4": 4, "RKF45": None, "RKF78": None},
    "tolerance": "tol",
    "free_only": "a spacecraft is free: nothing in Basilisk holds a point of its hub",
    "method_info": {
        "variants": ("Euler", "RK2", "RK4", "RKF78"),
        "suite": ("RK4", "RKF78"),
        "as_installed": ("RK4",),
        "rotors": True,
    },
}

ADAPTIVE = ("RKF45", "RKF78")


def prepare(given):
    """Return a run of one spacecraft hub. `renew` creates the simulation of the next call."""
    ready = []

    def run():
        simulation, craft, recorder = ready.pop() if ready else _build(given)
        simulation.ExecuteSimulation()
        end = craft.scStateOutMsg.read()
        sigma, w = np.array(recorder.sigma_BN), np.array(recorder.omega_BN_B)
        q = _quaternion(np.vstack([sigma[: len(given.steps) - 1], [end.sigma_BN]]))
        return {"q": q, "w": np.vstack([w[: len(given.steps) - 1], [end.omega_BN_B]])}

    run.renew = lambda: ready.append(_build(given))
    return run


def _build(given):
    from Basilisk.simulation import spacecraft, svIntegrators
    from Basilisk.utilities import SimulationBaseClass

    step = round(given.dt * 1e9)  # Basilisk counts nanoseconds
    if abs(step * 1e-9 / given.dt - 1) > 1e-9:
        raise NotImplementedError(f"Basilisk's steps are whole nanoseconds, unlike dt = {given.dt:g} s")
    simulation = SimulationBaseClass.SimBaseClass()
    simulation.CreateNewProcess("process").addTask(simulation.CreateNewTask("task", step))
    craft = spacecraft.Spacecraft()
    craft.ModelTag = "craft"
    hub = craft.hub
    hub.mHub, hub.r_BcB_B, hub.IHubPntBc_B = given.mass, [[0.0], [0.0], [0.0]], np.diag(given.moments).tolist()
    hub.r_CN_NInit = hub.v_CN_NInit = [[0.0], [0.0], [0.0]]
    hub.sigma_BNInit = (given.q0[1:, None] / (1 + given.q0[0])).tolist()
    hub.omega_BN_BInit = given.w0[:, None].tolist()
    simulation.AddModelToTask("task", craft)
    if hasattr(given, "rotor"):
        _add_wheel(given, simulation, craft)
    integrator = getattr(svIntegrators, f"svIntegrator{given.integrator}")(craft)
    craft.setIntegrator(integrator)
    if given.integrator in ADAPTIVE:
        integrator.absTol = integrator.relTol = given.tol
    recorder = craft.scStateOutMsg.recorder(step * int(given.steps[1]))
    simulation.AddModelToTask("task", recorder)
    simulation.InitializeSimulation()
    simulation.ConfigureStopTime(given.n_steps * step)
    return simulation, craft, recorder


def _add_wheel(given, simulation, craft):
    """Add a balanced reaction wheel without torque, whose absolute momentum about its axis is constant.

    The hub's inertia contains the wheel's about its axis, which the constant momentum leaves out of the scene's.
    """
    from Basilisk.simulation import reactionWheelStateEffector
    from Basilisk.utilities import simIncludeRW

    size = float(np.linalg.norm(given.rotor))
    axis, spin = given.rotor / size, 0.01 * float(given.moments.max())
    craft.hub.IHubPntBc_B = (np.diag(given.moments) + spin * np.outer(axis, axis)).tolist()
    wheels, effector = simIncludeRW.rwFactory(), reactionWheelStateEffector.ReactionWheelStateEffector()
    wheels.create("custom", axis.tolist(), Js=spin, useMaxTorque=False).Omega = size / spin - float(axis @ given.w0)
    wheels.addToSpacecraft("wheels", effector, craft)
    simulation.AddModelToTask("task", effector)
    simulation.kept = wheels, effector  # the simulation has pointers to both


def _quaternion(sigma):
    """Return quaternions (n, 4) from modified Rodrigues parameters (n, 3), of either set."""
    square = np.sum(sigma**2, axis=1, keepdims=True)
    return np.hstack([1 - square, 2 * sigma]) / (1 + square)
