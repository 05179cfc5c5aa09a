"""Basilisk's integrators on a free spacecraft hub or on a body of its `MJScene`, in Basilisk's loop (`ExecuteSimulation`).

A simulation cannot be started twice, so each run creates a new one, which is not timed. Attitudes are modified Rodrigues
parameters. `MJScene` takes accelerations from MuJoCo and integrates them with Basilisk's integrators. By default it advances
the quaternion by the mean rate of a step, which has order 2 and which no tolerance improves. Its option
`highOrderAttitudeIntegration` gives the quaternion the order of the integrator.

Parameters
----------
integrator
    "Euler", "RK2", "RK4" (Basilisk's default), "RKF45" or "RKF78" on a hub; the last two choose their own steps. On `MJScene`
    as installed "MJScene_Euler", "MJScene_RK2", "MJScene_RK4" (its default) or "MJScene_RKF78", and with its option
    "MJScene_high_RK4" or "MJScene_high_RKF78".
tol
    Absolute and relative tolerance of RKF45 and RKF78, above 0 and below 1.

References
----------
MJScene: https://avslab.github.io/basilisk/Documentation/simulation/mujocoDynamics/_GeneralModuleFiles/MJScene.html
Spacecraft and its hub: https://avslab.github.io/basilisk/Documentation/simulation/dynamics/spacecraft/spacecraft.html
Integrators: https://github.com/AVSLab/basilisk/tree/develop/src/simulation/dynamics/Integrators
"""

import numpy as np

from .shared import write_mjcf

HUB = {"Euler": 1, "RK2": 2, "RK4": 4, "RKF45": None, "RKF78": None}
SCENE = {
    **{"MJScene_Euler": 1, "MJScene_RK2": 2, "MJScene_RK4": 2, "MJScene_RKF78": 2},
    **{"MJScene_high_RK4": 4, "MJScene_high_RKF78": None},
}
ENGINE = {
    "package": "bsk",
    "module": "Basilisk.simulation.spacecraft",
    "oldest": "2.8",
    "settings": {"integrator": "RK4", "tol": 1e-12},
    "orders": {**HUB, **SCENE},
    "tolerance": "tol",
    "free_only": {
        **dict.fromkeys(HUB, "a spacecraft is free: nothing in Basilisk holds a point of its hub"),
        **dict.fromkeys(SCENE, "Basilisk's MJScene sets attitudes of free bodies only, and switches MuJoCo's gravity off"),
    },
    "method_info": {
        "variants": ("Euler", "RK2", "RK4", "RKF78", "MJScene_RK4", "MJScene_high_RK4", "MJScene_high_RKF78"),
        "suite": ("RK4", "RKF78"),
        "as_installed": ("RK4",),
        "rotors": True,
    },
}

ADAPTIVE = ("RKF45", "RKF78")
MUJOCO_LEAST = 1e-15
"""Smallest moment, kg m^2, that MuJoCo accepts (mjMINVAL)."""


def prepare(given):
    """Return a run of one body. `renew` creates the simulation of the next call."""
    ready = [_build(given)]  # what Basilisk does not support is refused here, not in the run

    def run():
        simulation, message, recorder = ready.pop() if ready else _build(given)
        simulation.ExecuteSimulation()
        end = message.read()
        sigma, w = np.array(recorder.sigma_BN), np.array(recorder.omega_BN_B)
        q = _quaternion(np.vstack([sigma[: len(given.steps) - 1], [end.sigma_BN]]))
        return {"q": q, "w": np.vstack([w[: len(given.steps) - 1], [end.omega_BN_B]])}

    def renew():
        ready[:] = [_build(given)]

    run.renew = renew
    return run


def _build(given):
    """Return a simulation, the message of the body's state, and its recorder."""
    from Basilisk.simulation import svIntegrators
    from Basilisk.utilities import SimulationBaseClass

    step = round(given.dt * 1e9)  # Basilisk counts nanoseconds
    if abs(step * 1e-9 / given.dt - 1) > 1e-9:
        raise NotImplementedError(f"Basilisk's steps are whole nanoseconds, unlike dt = {given.dt:g} s")
    simulation = SimulationBaseClass.SimBaseClass()
    simulation.CreateNewProcess("process").addTask(simulation.CreateNewTask("task", step))
    hub = given.integrator in HUB
    system, message = _add_hub(given, simulation) if hub else _add_scene(given, simulation)
    name = given.integrator.rpartition("_")[2]
    integrator = getattr(svIntegrators, f"svIntegrator{name}")(system)
    system.setIntegrator(integrator)
    if name in ADAPTIVE:
        integrator.absTol = integrator.relTol = given.tol
    recorder = message.recorder(step * int(given.steps[1]))
    simulation.AddModelToTask("task", recorder)
    simulation.InitializeSimulation()
    if not hub:  # its states exist from here on
        body = system.getBody("body")
        body.setAttitude(_sigma(given.q0))
        body.setAttitudeRate(given.w0.tolist())
    simulation.ConfigureStopTime(given.n_steps * step)
    simulation.owners = system, integrator
    return simulation, message, recorder


def _add_hub(given, simulation):
    """Add a spacecraft; return it and the message of its state."""
    from Basilisk.simulation import spacecraft

    craft = spacecraft.Spacecraft()
    craft.ModelTag = "craft"
    hub = craft.hub
    hub.mHub, hub.r_BcB_B, hub.IHubPntBc_B = given.mass, [[0.0], [0.0], [0.0]], np.diag(given.moments).tolist()
    hub.r_CN_NInit = hub.v_CN_NInit = [[0.0], [0.0], [0.0]]
    hub.sigma_BNInit = [[number] for number in _sigma(given.q0)]
    hub.omega_BN_BInit = given.w0[:, None].tolist()
    simulation.AddModelToTask("task", craft)
    if hasattr(given, "rotor"):
        _add_wheel(given, simulation, craft)
    return craft, craft.scStateOutMsg


def _add_scene(given, simulation):
    """Add a scene of MuJoCo with a free body; return it and the message of the body's state."""
    if hasattr(given, "rotor"):
        raise NotImplementedError("a rotor needs a wheel of a spacecraft hub, which MJScene does not have: use RK4 or RKF78")
    if given.moments_com.min() < MUJOCO_LEAST:
        raise NotImplementedError("MuJoCo refuses a body without a moment, and MJScene crashes then")
    try:
        from Basilisk.simulation import mujoco
    except ImportError:
        raise NotImplementedError("this version of Basilisk was built without MuJoCo") from None
    scene = mujoco.MJScene(write_mjcf(given, '<option gravity="0 0 0"/>'))
    scene.ModelTag = "scene"
    if "high" in given.integrator:
        if not hasattr(scene, "highOrderAttitudeIntegration"):
            raise NotImplementedError("this version of Basilisk has no highOrderAttitudeIntegration")
        scene.highOrderAttitudeIntegration = True
    simulation.AddModelToTask("task", scene)
    return scene, scene.getBody("body").getOrigin().stateOutMsg


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


def _sigma(q):
    """Return modified Rodrigues parameters [3] of a quaternion (4,)."""
    return (q[1:] / (1 + q[0])).tolist()


def _quaternion(sigma):
    """Return quaternions (n, 4) from modified Rodrigues parameters (n, 3), of either set."""
    square = np.sum(sigma**2, axis=1, keepdims=True)
    return np.hstack([1 - square, 2 * sigma]) / (1 + square)
