"""PyBullet in double precision, stepped from Python (`stepSimulation`), because it has no loop of its own.

A body about a fixed point is the only link of a base that does not move, on a spherical joint whose motor is off
(`setJointMotorControlMultiDof`, force 0). Switched off: damping (`linearDamping`, `angularDamping`, `jointDamping`), sleeping
(`ACTIVATION_STATE_DISABLE_SLEEPING`), the limit of rates (`maxJointVelocity`).

Parameters
----------
body
    "multibody" (btMultiBody, Bullet's default) or "maximal" (btRigidBody, in maximal coordinates).
as_installed
    True if damping, sleeping and the limit of rates stay on.

References
----------
PyBullet Quickstart Guide, changeDynamics, createMultiBody, setJointMotorControlMultiDof, resetJointStateMultiDof:
https://github.com/bulletphysics/bullet3/blob/master/docs/pybullet_quickstartguide.pdf
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from .shared import FAR_MASS, FAR_PLACE, OTHER_MASS, OTHER_SIZE, description_of, rescaled, sample, write_urdf

ENGINE = {
    "package": "pybullet",
    "module": "pybullet",
    "oldest": "3.2.5",
    "settings": {"body": "multibody", "as_installed": False},
    "orders": {"multibody": 1, "maximal": 1},
    "fields": ("UniformGravity",),
    "free_only": {"maximal": "PyBullet has no joint to the world for a body in maximal coordinates"},
    "rate_limit": 100.0,  # maxJointVelocity
    "descriptions": ("offset", "file", "world", "setter", "rewritten", "mass", "scaled"),
    "method_info": {
        "variants": ("", "maximal", "as_installed=true"),
        "as_installed": ("as_installed=true",),
        "usual_dt": 1 / 240,
        "flight": True,
    },
}


def prepare(given):
    """Return a run of one body."""
    import pybullet as bullet

    # All runs share one world, which each builds anew: a client takes 28 MB, of which `disconnect` returns 17 MB.
    if not bullet.isConnected():
        bullet.connect(bullet.DIRECT)
    flies = hasattr(given, "p_WB0")
    of_file = description_of(given) in OF_FILES
    build, from_file = _build_free if given.free else _build_held, of_file and given.free
    if of_file:
        build = _build_from_file
    ready, axes = [], [given.q_com]

    def renew():
        bullet.resetSimulation()
        bullet.setGravity(0, 0, -given.gravity)
        bullet.setPhysicsEngineParameter(fixedTimeStep=given.dt, numSubSteps=0)
        if description_of(given) == "world":
            bullet.createMultiBody(FAR_MASS, -1, -1, list(FAR_PLACE))
        ready[:] = [build(bullet, given)]
        if from_file:
            axes[:] = [_inertial_axes(bullet, ready[0])]

    def run():
        if not ready:
            renew()
        body = ready.pop()

        def read():
            if given.free:
                (x, y, z, s), w = bullet.getBasePositionAndOrientation(body)[1], bullet.getBaseVelocity(body)[1]
            else:
                (x, y, z, s), w = bullet.getJointStateMultiDof(body, 0)[:2]  # getLinkState has single precision
            place = {"p": bullet.getBasePositionAndOrientation(body)[0], "v": bullet.getBaseVelocity(body)[0]} if flies else {}
            return {"q": (s, x, y, z), "w_W": w, **place}

        samples = sample(given, bullet.stepSimulation, read)
        if flies:  # Bullet's frame is at the centre of mass
            arm = np.array([_matrix(q) for q in samples["q"]]) @ given.com
            samples |= {"p": samples["p"] - arm, "v": samples["v"] - np.cross(samples["w_W"], arm)}
        if given.free and not from_file:
            return samples
        # From the principal axes about the centre of mass to the axes F.
        q = _product(samples["q"], axes[0] * (1, -1, -1, -1))
        return {"q": q, "w_W": samples["w_W"]} if given.free else {"q": q, "w": samples["w_W"] @ _matrix(given.q_com).T}

    run.renew = renew
    return run


def _build_free(bullet, given):
    maximal = given.body == "maximal"
    arm = given.R0 @ given.com if hasattr(given, "p_WB0") else np.zeros(3)
    place = (getattr(given, "p_WB0", 0) + arm).tolist()
    body = bullet.createMultiBody(given.mass, -1, -1, place, _x_first(given.q0), useMaximalCoordinates=maximal)
    # With its mass, which a body in maximal coordinates does not have yet: accusations/scripts/pybullet_without_shape.py.
    bullet.changeDynamics(body, -1, mass=given.mass, localInertiaDiagonal=given.moments_com.tolist())
    if not given.as_installed:
        _switch_off(bullet, body, -1)
    bullet.resetBaseVelocity(body, (getattr(given, "v_WB0", 0) + np.cross(given.w0_W, arm)).tolist(), given.w0_W.tolist())
    return body


OF_FILES = ("file", "setter", "rewritten", "mass", "scaled")
"""Descriptions of a body by a file."""


def _build_from_file(bullet, given):
    """Return a body that is loaded from a file, and then changed.

    A saved file is the one of PyBullet's `UrdfEditor`; `saveWorld` writes the names of the loaded files only. The Quickstart
    Guide has the mass of `changeDynamics` apart from the inertia, so the file has the inertia and another mass. `globalScaling`
    scales the size, not the mass (bullet3 2379), so the file has the inertia of a body of this mass and another size.
    """
    description, part = description_of(given), -1 if given.free else 0
    if given.body == "maximal":
        raise NotImplementedError("the file has no shape, which a body in maximal coordinates needs")
    if description == "rewritten" and not given.free:
        raise NotImplementedError("UrdfEditor does not write spherical joints")
    with TemporaryDirectory() as folder:
        file = Path(folder) / "body.urdf"
        file.write_text(write_file(given))
        options = {"flags": bullet.URDF_USE_INERTIA_FROM_FILE, "useFixedBase": not given.free}
        body = bullet.loadURDF(str(file), globalScaling=OTHER_SIZE if description == "scaled" else 1.0, **options)
        if description == "rewritten":
            from pybullet_utils.urdfEditor import UrdfEditor

            editor = UrdfEditor()
            editor.initializeFromBulletBody(body, 0)
            editor.saveUrdf(f"{folder}/saved.urdf")
            bullet.removeBody(body)
            body = bullet.loadURDF(f"{folder}/saved.urdf", **options)  # another name: Bullet caches files by their names
    if description == "setter":
        bullet.changeDynamics(body, part, mass=given.mass, localInertiaDiagonal=given.moments_com.tolist())
    if description == "mass":
        bullet.changeDynamics(body, part, mass=given.mass)
    if not given.free:
        return _hold(bullet, body, given)
    if not given.as_installed:
        _switch_off(bullet, body, -1)
    bullet.resetBasePositionAndOrientation(body, [0, 0, 0], _x_first(_product(given.q0, _inertial_axes(bullet, body))))
    bullet.resetBaseVelocity(body, [0, 0, 0], given.w0_W.tolist())
    return body


def write_file(given):
    """Return the URDF file that is loaded first. A body about a fixed point has its principal axes, as in `_build_held`."""
    factors = {
        "setter": {"mass": OTHER_MASS, "inertia": OTHER_MASS},
        "mass": {"mass": OTHER_MASS},
        "scaled": {"length": 1 / OTHER_SIZE, "inertia": OTHER_SIZE**-2},
    }
    written = rescaled(given, **factors.get(description_of(given), {}))
    if given.free:
        return write_urdf(written)
    written.com, written.inertia_com = written.com @ _matrix(given.q_com), np.diag(written.moments_com)
    ball = '<link name="base"/><joint name="ball" type="spherical"><parent link="base"/><child link="body"/></joint></robot>'
    return write_urdf(written).replace("</robot>", ball)


def _inertial_axes(bullet, body):
    """Return the attitude of the principal axes in the file's axes, by Bullet; a body's pose is the one of these axes."""
    x, y, z, w = bullet.getDynamicsInfo(body, -1)[4]
    return np.array([w, x, y, z])


def _build_held(bullet, given):
    """Return a body that is the only link of a base that does not move.

    The link's frame is at the fixed point, and its axes are the principal axes about the centre of mass: in other axes the
    state of the joint is not the attitude of the link.
    """
    R = _matrix(given.q_com)
    link = {
        **{"linkMasses": given.mass, "linkCollisionShapeIndices": -1, "linkVisualShapeIndices": -1, "linkParentIndices": 0},
        **{"linkPositions": [0, 0, 0], "linkOrientations": [0, 0, 0, 1], "linkInertialFrameOrientations": [0, 0, 0, 1]},
        **{"linkInertialFramePositions": (given.com @ R).tolist(), "linkJointTypes": bullet.JOINT_SPHERICAL},
    }
    body = bullet.createMultiBody(0, -1, linkJointAxis=[[0, 0, 1]], **{name: [value] for name, value in link.items()})
    bullet.changeDynamics(body, 0, localInertiaDiagonal=given.moments_com.tolist())
    return _hold(bullet, body, given)


def _hold(bullet, body, given):
    """Set the initial state of a body on a spherical joint, whose axes are the principal ones, and return it."""
    q0, R = _product(given.q0, given.q_com), _matrix(given.q_com)
    if not given.as_installed:
        for part in (-1, 0):
            _switch_off(bullet, body, part)
    # By default the motor of the joint holds the body.
    hold = {"targetPosition": [0, 0, 0, 1], "force": [0, 0, 0], "positionGain": 0, "velocityGain": 0}
    bullet.setJointMotorControlMultiDof(body, 0, bullet.POSITION_CONTROL, **hold)
    bullet.resetJointStateMultiDof(body, 0, _x_first(q0), (given.w0 @ R).tolist())  # rates in its own axes
    return body


def _switch_off(bullet, body, part):
    """Switch off damping, 0.04 by default, sleeping, and the limit of 100 rad/s."""
    awake = bullet.ACTIVATION_STATE_DISABLE_SLEEPING
    nothing = {"linearDamping": 0, "angularDamping": 0, "jointDamping": 0, "maxJointVelocity": 1e6}
    bullet.changeDynamics(body, part, **nothing, activationState=awake)


def _x_first(q):
    return [*q[1:].tolist(), float(q[0])]


def _product(p, q):
    """Return the products of quaternions (..., 4) with one (4,)."""
    s, v = p[..., :1], p[..., 1:]
    return np.concatenate([s * q[0] - v @ q[1:, None], s * q[1:] + q[0] * v + np.cross(v, q[1:])], axis=-1)


def _matrix(q):
    s, v = q[0], q[1:]
    cross = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return np.eye(3) + 2 * s * cross + 2 * cross @ cross
