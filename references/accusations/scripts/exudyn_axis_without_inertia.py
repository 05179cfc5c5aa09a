"""With `GeneralizedAlpha`, a turned rod that has no inertia about its axis gets another rate, instead of being refused."""

import contextlib
import os

import exudyn as exu
import numpy as np
from exudyn.utilities import RigidBodyInertia


def rate(moment, R):
    mbs = exu.SystemContainer().AddSystem()
    inertia, node = RigidBodyInertia(mass=1.7, inertiaTensor=np.diag([1, 1.1, moment])), exu.NodeType.RotationRotationVector
    body = mbs.CreateRigidBody(inertia=inertia, nodeType=node, referenceRotationMatrix=R, initialAngularVelocity=R @ (0, 0, 4))
    mbs.Assemble()
    settings = exu.SimulationSettings()
    time = settings.timeIntegration
    time.numberOfSteps, time.endTime, time.verboseMode, time.automaticStepSize = 1, 0.01, 0, False
    time.newton.useModifiedNewton, time.newton.numericalDifferentiation.minimumCoordinateSize = False, 1
    try:
        mbs.SolveDynamic(settings, solverType=exu.DynamicSolverType.GeneralizedAlpha)
    except exu.SolverError:
        return None
    return mbs.GetObjectOutputBody(body, exu.OutputVariableType.AngularVelocityLocal, [0, 0, 0])[2]


with open(os.devnull, "w") as nowhere, contextlib.redirect_stdout(nowhere):  # messages of the solver
    R = [np.linalg.qr(matrix)[0] for matrix in np.random.default_rng(0).normal(size=(100, 3, 3))]
    rods, needles = ([rate(moment, np.linalg.det(each) * each) for each in R] for moment in (0, 1e-9))
wrong, refused = sum(w is not None and abs(w - 4) > 1e-6 for w in rods), sum(w is None for w in rods)
needles = sum(abs(w - 4) > 1e-6 for w in needles)
text = f"{refused} are refused, {wrong} have another rate than 4 rad/s, with a moment of 1e-9 {needles}"
print(f"of 100 attitudes {text}:", "wrong" if wrong else "right")
