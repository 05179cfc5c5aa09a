"""Exudyn with one of its integrators, in its own loop (`mbs.SolveDynamic`), in fixed steps.

Explicit integrators work on the Lie group (`useLieGroupIntegration`), with a rotation vector as the node's coordinates; so do
the implicit ones, with a full Newton iteration to 1e-12. Explicit ones support no joints. A body about a fixed point is
therefore a free body with the moments about that point as its central ones, so heavy that this point stays. Its weight is a
force at the centre of mass, and a spring is an `ObjectConnectorSpringDamper`. All other fields are a torque from a user
function in Python, in each evaluation. Switched off: files of solutions (`writeSolutionToFile`),
accelerations at the end of a step (`computeEndOfStepAccelerations`), adaptive steps (`automaticStepSize`). Each call includes
the start of a solver.

Parameters
----------
integrator
    "ExplicitEuler", "ExplicitMidpoint", "RK33", "RK44", "RK67", "DOPRI5", "GeneralizedAlpha", "TrapezoidalIndex2" or "default":
    Exudyn's default solver, coordinates and settings.

References
----------
Solvers: https://github.com/jgerstmayr/EXUDYN/blob/master/docs/RST/SolversInExudyn.rst
The node: https://github.com/jgerstmayr/EXUDYN/blob/master/docs/RST/items/NodeRigidBodyRotVecLG.rst
Settings: https://exudyn.readthedocs.io/en/latest/docs/RST/structures/StructuresAndSettings.html
"""

import numpy as np

from .shared import FIELDS, field_torque, pack_field

ENGINE = {
    "package": "exudyn",
    "module": "exudyn",
    "oldest": "1.9",
    "settings": {"integrator": "RK44"},
    "orders": {
        **{"ExplicitEuler": 1, "ExplicitMidpoint": 2, "RK33": 3, "RK44": 4, "RK67": 6, "DOPRI5": 5},
        **{"GeneralizedAlpha": 2, "TrapezoidalIndex2": 2, "default": 2},
    },
    "fields": FIELDS,
    "method_info": {
        "variants": ("ExplicitMidpoint", "RK44", "RK67", "GeneralizedAlpha"),
        "suite": ("RK44", "RK67"),
        "as_installed": ("default",),
    },
}

EXPLICIT = ("ExplicitEuler", "ExplicitMidpoint", "RK33", "RK44", "RK67", "DOPRI5", "VelocityVerlet")
HEAVY = 1e25
"""Mass of a body about a fixed point over its largest moment, 1/m^2: forces move that point by less than round-off."""


def prepare(given):
    """Return a run of one body."""
    import exudyn as exu
    from exudyn.utilities import RigidBodyInertia, SensorBody

    mbs, default = exu.SystemContainer().AddSystem(), given.integrator == "default"
    # The explicit integrators raise with the default, Euler parameters.
    kind = {} if default else {"nodeType": exu.NodeType.RotationRotationVector}
    mass = given.mass if given.free else HEAVY * given.moments.max()
    body = mbs.CreateRigidBody(
        inertia=RigidBodyInertia(mass=mass, inertiaTensor=np.diag(given.moments)),
        referenceRotationMatrix=given.R0,
        initialAngularVelocity=given.w0_W,
        **kind,
    )
    _load(mbs, body, given)
    outputs = exu.OutputVariableType.RotationMatrix, exu.OutputVariableType.AngularVelocityLocal
    sampled = len(given.steps) > 2  # sensors are needed only for samples between start and end
    sensors = [mbs.AddSensor(SensorBody(bodyNumber=body, outputVariableType=o, storeInternal=True)) for o in outputs * sampled]
    mbs.Assemble()
    settings = _settings(exu, given)
    solver = {} if default else {"solverType": getattr(exu.DynamicSolverType, given.integrator)}
    start = given.R0.ravel(), given.w0

    def run():
        mbs.SolveDynamic(settings, **solver)
        end = [np.array(mbs.GetObjectOutputBody(body, output, [0, 0, 0])).ravel() for output in outputs]
        between = [mbs.GetSensorStoredData(sensor)[1:-1, 1:] for sensor in sensors] or [np.empty((0, 9)), np.empty((0, 3))]
        R, w = (np.vstack(parts) for parts in zip(start, between, end, strict=True))
        return {"R": R.reshape(-1, 3, 3), "w": w}

    return run


def _load(mbs, body, given):
    """Add the weight or the field to a body."""
    from exudyn import OutputVariableType
    from exudyn.itemInterface import LoadForceVector, LoadTorqueVector, MarkerBodyRigid, ObjectConnectorSpringDamper

    def mark(place, body=body):
        return mbs.AddMarker(MarkerBodyRigid(bodyNumber=body, localPosition=place.tolist()))

    field = pack_field(given).tolist()
    if given.gravity:
        mbs.AddLoad(LoadForceVector(markerNumber=mark(given.com), loadVector=[0, 0, -given.mass * given.gravity]))
    elif given.stiffness and not given.turn.any():
        ends = [mark(given.point), mark(given.anchor, mbs.CreateGround())]
        length = {"referenceLength": given.rest_length, "stiffness": given.stiffness}
        mbs.AddObject(ObjectConnectorSpringDamper(markerNumbers=ends, **length))
    elif any(field):

        def torque(mbs, t, _):
            R = mbs.GetObjectOutputBody(body, OutputVariableType.RotationMatrix, [0, 0, 0])
            return field_torque(field, R.tolist(), t)

        load = {"bodyFixed": True, "loadVectorUserFunction": torque}
        mbs.AddLoad(LoadTorqueVector(markerNumber=mark(np.zeros(3)), **load))


def _settings(exu, given):
    settings = exu.SimulationSettings()
    settings.solutionSettings.sensorsWritePeriod = given.steps[1] * given.dt
    time = settings.timeIntegration
    time.numberOfSteps, time.endTime, time.verboseMode = given.n_steps, given.n_steps * given.dt, 0
    if given.integrator == "default":
        return settings
    settings.solutionSettings.writeSolutionToFile = False
    time.automaticStepSize = False  # also for DOPRI5
    if given.integrator in EXPLICIT:
        time.explicitIntegration.useLieGroupIntegration = True
        time.explicitIntegration.computeEndOfStepAccelerations = False
    else:
        time.newton.useModifiedNewton = False
        time.newton.relativeTolerance, time.newton.absoluteTolerance = 1e-12, 1e-14
        time.newton.numericalDifferentiation.minimumCoordinateSize = 1
    return settings
