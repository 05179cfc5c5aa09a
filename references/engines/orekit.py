"""Orekit's `TorqueFree`: Jacobi's elliptic functions, evaluated in Java at each sample. It needs a Java runtime.

References
----------
TorqueFree: https://www.orekit.org/site-orekit-development/apidocs/org/orekit/attitudes/TorqueFree.html
"""

import numpy as np

ENGINE = {
    "package": "orekit-jpype",
    "module": "orekit_jpype",
    "oldest": "13",
    "order": None,
    "title": "TorqueFree",
    "free_only": "TorqueFree is the motion of a free body",
}


def prepare(given):
    """Return a run that evaluates the exact solution at each sample; a Java virtual machine is started once in a process."""
    import orekit_jpype

    orekit_jpype.initVM()
    from org.hipparchus.geometry.euclidean.threed import Rotation, Vector3D
    from org.orekit.attitudes import Attitude, Inertia, InertiaAxis, TorqueFree
    from org.orekit.frames import FramesFactory
    from org.orekit.time import AbsoluteDate
    from org.orekit.utils import AngularCoordinates

    frame, date = FramesFactory.getGCRF(), AbsoluteDate.ARBITRARY_EPOCH
    # Hipparchus' rotation of a quaternion turns the frame, not the vector: of that of R_WF, it takes world to F components.
    turn, spin = Rotation(*given.q0.tolist(), False), Vector3D(*given.w0.tolist())
    start = Attitude(date, frame, AngularCoordinates(turn, spin, Vector3D.ZERO))
    axes = zip(given.moments.tolist(), (Vector3D.PLUS_I, Vector3D.PLUS_J, Vector3D.PLUS_K), strict=True)
    motion = TorqueFree(start, Inertia(*[InertiaAxis(moment, axis) for moment, axis in axes]))
    times = (given.steps * given.dt).tolist()

    def run():
        found = [motion.getAttitude(None, date.shiftedBy(time), frame) for time in times]
        turns, rates = [each.getRotation() for each in found], [each.getSpin() for each in found]
        q = [(turn.getQ0(), turn.getQ1(), turn.getQ2(), turn.getQ3()) for turn in turns]
        return {"q": np.array(q), "w": np.array([(rate.getX(), rate.getY(), rate.getZ()) for rate in rates])}

    return run
