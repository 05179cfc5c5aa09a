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
    """Return a run of one body."""
    import orekit_jpype

    orekit_jpype.initVM()  # once per process
    from org.hipparchus.geometry.euclidean.threed import Rotation, Vector3D
    from org.orekit.attitudes import Attitude, Inertia, InertiaAxis, TorqueFree
    from org.orekit.frames import FramesFactory
    from org.orekit.time import AbsoluteDate
    from org.orekit.utils import AngularCoordinates

    frame, date = FramesFactory.getGCRF(), AbsoluteDate.ARBITRARY_EPOCH
    # A quaternion of Hipparchus turns the frame, not the vector: with q0 of R_WF, unchanged, the rotation converts from world
    # to F components, as an attitude of Orekit does. False: q0 is normalised already.
    turn, spin = Rotation(*given.q0.tolist(), False), Vector3D(*given.w0.tolist())
    start = Attitude(date, frame, AngularCoordinates(turn, spin, Vector3D.ZERO))
    axes = zip(given.moments.tolist(), (Vector3D.PLUS_I, Vector3D.PLUS_J, Vector3D.PLUS_K), strict=True)
    motion = TorqueFree(start, Inertia(*[InertiaAxis(moment, axis) for moment, axis in axes]))
    times = (given.steps * given.dt).tolist()

    def run():
        attitudes = [motion.getAttitude(None, date.shiftedBy(time), frame) for time in times]
        turns, rates = [attitude.getRotation() for attitude in attitudes], [attitude.getSpin() for attitude in attitudes]
        q = [(turn.getQ0(), turn.getQ1(), turn.getQ2(), turn.getQ3()) for turn in turns]
        return {"q": np.array(q), "w": np.array([(rate.getX(), rate.getY(), rate.getZ()) for rate in rates])}

    return run
