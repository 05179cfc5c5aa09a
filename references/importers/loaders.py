"""Each engine's own loader, and the accelerations of the body that it makes. Runs in the environments of engines.

A loader is a function `name(path, kind)` that loads a file and returns `accelerate(w, v, force, torque)`, whose arguments (3,)
are rates, the velocity of the origin of the root link, and a force and torque there, in its axes. It returns the angular
acceleration and the acceleration of the origin. Engines without such a function make one short step from the identity.
"""

from __future__ import annotations

import os
import tempfile

import numpy as np

STEP64, STEP32 = 2.0**-17, 2.0**-10
"""Steps, s, of engines whose accelerations are differences: their errors are near 1e-5 and 1e-3 of the acceleration."""


def probe(engine, path, kind, cases):
    """Return accelerations (n, 6), angular and of the origin, for cases (n, 12) of `accelerate`, or the reason of a refusal.

    `output` is what the engine printed while it loaded the file.
    """
    with tempfile.TemporaryFile() as stream:
        kept = os.dup(2)
        os.dup2(stream.fileno(), 1)
        os.dup2(stream.fileno(), 2)
        answer = {}
        try:
            accelerate = LOADERS[engine](path, kind)
        except NotImplementedError:
            raise
        except (Exception, SystemExit) as error:
            answer = {"refused": f"{type(error).__name__}: {' '.join(str(error).split())}"}
        finally:
            os.dup2(kept, 1)
            os.dup2(kept, 2)
            os.close(kept)
        stream.seek(0)
        answer["output"] = " ".join(stream.read(65536).decode(errors="replace").split())
    if "refused" not in answer:
        answer["accelerations"] = np.array([np.concatenate(accelerate(*np.reshape(case, (4, 3)))) for case in cases])
    return answer


def mujoco(path, kind):
    """Return `accelerate` of MuJoCo: `mj_forward` with the free joint's own coordinates."""
    import mujoco

    model = _mujoco_model(path, kind)
    data = mujoco.MjData(model)
    data.qpos[:] = 0, 0, 0, 1, 0, 0, 0

    def accelerate(w, v, force, torque):
        data.qvel[:], data.qfrc_applied[:] = [*v, *w], [*force, *torque]
        mujoco.mj_forward(model, data)
        return data.qacc[3:], data.qacc[:3]

    return accelerate


def _mujoco_model(path, kind):
    """Return the model of a file, on a free joint, without gravity, contacts and passive forces."""
    import mujoco

    if kind not in ("urdf", "mjcf"):
        raise NotImplementedError
    spec = mujoco.MjSpec.from_file(path)
    if not spec.joints:
        spec.worldbody.first_body().add_freejoint()
    spec.option.gravity = [0, 0, 0]
    spec.option.disableflags = int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    return spec.compile()


def mjx(path, kind):
    """Return `accelerate` of MJX: `mjx.forward` in double precision."""
    import jax
    from mujoco import mjx

    model = mjx.put_model(_mujoco_model(path, kind))
    data = mjx.make_data(model).replace(qpos=jax.numpy.array([0.0, 0, 0, 1, 0, 0, 0]))
    forward = jax.jit(lambda qvel, force: mjx.forward(model, data.replace(qvel=qvel, qfrc_applied=force)).qacc)

    def accelerate(w, v, force, torque):
        qacc = np.asarray(forward(np.concatenate([v, w]), np.concatenate([force, torque])))
        return qacc[3:], qacc[:3]

    return accelerate


def mjwarp(path, kind):
    """Return `accelerate` of MuJoCo Warp: `forward`, in single precision."""
    import mujoco
    import mujoco_warp
    import warp

    warp.config.quiet = True
    warp.set_device("cpu")
    host = _mujoco_model(path, kind)
    model, data = mujoco_warp.put_model(host), mujoco_warp.put_data(host, mujoco.MjData(host))
    data.qpos.assign(np.array([[0, 0, 0, 1, 0, 0, 0]], np.float32))

    def accelerate(w, v, force, torque):
        data.qvel.assign(np.array([[*v, *w]], np.float32))
        data.qfrc_applied.assign(np.array([[*force, *torque]], np.float32))
        mujoco_warp.forward(model, data)
        qacc = data.qacc.numpy()[0]
        return qacc[3:], qacc[:3]

    return accelerate


def pinocchio(path, kind):
    """Return `accelerate` of Pinocchio: `aba` on a free flyer."""
    import pinocchio as pin

    build = {
        "urdf": pin.buildModelFromUrdf,
        "mjcf": pin.buildModelFromMJCF,
        "sdf": getattr(pin, "buildModelFromSdf", None),
    }.get(kind)
    if build is None:
        raise NotImplementedError
    model = build(path) if kind == "mjcf" else build(path, pin.JointModelFreeFlyer())
    if model.nv == 0:
        model = build(path, pin.JointModelFreeFlyer())
    data = model.createData()
    model.gravity.linear = np.zeros(3)

    def accelerate(w, v, force, torque):
        a = pin.aba(model, data, np.array([0.0, 0, 0, 0, 0, 0, 1]), np.concatenate([v, w]), np.concatenate([force, torque]))
        return a[3:], a[:3] + np.cross(w, v)

    return accelerate


def drake(path, kind):
    """Return `accelerate` of Drake: time derivatives of a continuous plant, whose velocities are in world axes."""
    import pydrake.all as drake

    plant = drake.MultibodyPlant(0.0)
    if kind == "usd":
        raise NotImplementedError
    drake.Parser(plant).AddModels(path)
    plant.mutable_gravity_field().set_gravity_vector([0, 0, 0])
    plant.Finalize()
    context = plant.CreateDefaultContext()
    (body,) = plant.GetFloatingBaseBodies()
    plant.SetFreeBodyPose(context, plant.get_body(body), drake.RigidTransform())

    def accelerate(w, v, force, torque):
        plant.SetVelocities(context, np.concatenate([w, v]))
        plant.get_applied_generalized_force_input_port().FixValue(context, np.concatenate([torque, force]))
        a = plant.EvalTimeDerivatives(context).get_generalized_velocity().CopyToVector()
        return a[:3], a[3:]

    return accelerate


def dart(path, kind):
    """Return `accelerate` of DART: `computeForwardDynamics` with spatial velocities in body axes."""
    import dartpy

    if kind == "urdf":
        skeleton = dartpy.utils.DartLoader().parseSkeleton(path)
    elif kind == "sdf":
        skeleton = dartpy.utils.SdfParser.readSkeleton(path)
    elif kind == "mjcf":
        world = dartpy.utils.MjcfParser.readWorld(path)
        skeleton = world and world.getSkeleton(0)
    else:
        raise NotImplementedError
    if skeleton is None:
        raise ValueError("the loader returned no skeleton")
    skeleton.setGravity([0, 0, 0])
    skeleton.setPositions(np.zeros(skeleton.getNumDofs()))

    body = skeleton.getBodyNode(0)

    def accelerate(w, v, force, torque):
        skeleton.setVelocities(np.concatenate([w, v]))
        skeleton.setForces(np.concatenate([torque, force]))
        skeleton.computeForwardDynamics()
        return body.getAngularAcceleration(), body.getLinearAcceleration()

    return accelerate


def _by_steps(advance, point, step):
    """Return `accelerate` from a step, which maps rates, velocity, force and torque at a point to rates and velocity."""

    def accelerate(w, v, force, torque):
        start = v + np.cross(w, point)
        w_end, v_end = advance(w, start, force, torque - np.cross(point, force))
        turn = (w_end - w) / step
        return turn, (v_end - start) / step - np.cross(turn, point) - np.cross(w, np.cross(w, point))

    return accelerate


def pybullet(path, kind, flags="URDF_USE_INERTIA_FROM_FILE"):
    """Return `accelerate` of PyBullet; without the flag it ignores the inertia of a file, as documented."""
    import pybullet

    if not pybullet.isConnected():
        pybullet.connect(pybullet.DIRECT)
    pybullet.resetSimulation()
    if kind == "urdf":
        body = pybullet.loadURDF(path, flags=getattr(pybullet, flags) if flags else 0)
    elif kind in ("sdf", "mjcf"):
        body = {"sdf": pybullet.loadSDF, "mjcf": pybullet.loadMJCF}[kind](path)[-1]
    else:
        raise NotImplementedError
    pybullet.setPhysicsEngineParameter(fixedTimeStep=STEP64, numSubSteps=0)
    for part in range(-1, pybullet.getNumJoints(body)):
        pybullet.changeDynamics(body, part, linearDamping=0, angularDamping=0, jointDamping=0, maxJointVelocity=1e6)
    point, turn = pybullet.getDynamicsInfo(body, -1)[3:5]

    def advance(w, v, force, torque):
        pybullet.resetBasePositionAndOrientation(body, point, turn)
        pybullet.resetBaseVelocity(body, v.tolist(), w.tolist())
        pybullet.applyExternalForce(body, -1, force.tolist(), point, pybullet.WORLD_FRAME)
        pybullet.applyExternalTorque(body, -1, torque.tolist(), pybullet.WORLD_FRAME)
        pybullet.stepSimulation()
        v, w = pybullet.getBaseVelocity(body)
        return np.array(w), np.array(v)

    return _by_steps(advance, np.array(point), STEP64)


def sapien(path, kind):
    """Return `accelerate` of SAPIEN (PhysX): its URDF loader, without damping."""
    import sapien

    if kind != "urdf":
        raise NotImplementedError
    system = sapien.physx.PhysxCpuSystem()
    scene = sapien.Scene([system])
    system.timestep = STEP32
    loader = scene.create_urdf_loader()
    loader.fix_root_link = False
    body = loader.load_multiple(path)[0][0]
    links = body.get_links()
    for link in links:
        link.set_linear_damping(0)
        link.set_angular_damping(0)
        link.set_max_angular_velocity(1e6)
        link.set_disable_gravity(True)

    def advance(w, v, force, torque):
        body.set_root_pose(sapien.Pose())
        body.set_root_linear_velocity(v.astype(np.float32))
        body.set_root_angular_velocity(w.astype(np.float32))
        links[0].add_force_torque(force.astype(np.float32), torque.astype(np.float32))
        system.step()
        return links[0].get_angular_velocity().astype(float), links[0].get_linear_velocity().astype(float)

    return _by_steps(advance, links[0].get_cmass_local_pose().p.astype(float), STEP32)


def newton(path, kind):
    """Return `accelerate` of Newton: `SolverSemiImplicit`, on the body that its importer makes with fixed joints collapsed."""
    import newton
    import warp

    warp.config.quiet = True
    warp.set_device("cpu")
    builder = newton.ModelBuilder()
    options = {"collapse_fixed_joints": True}
    if kind == "urdf":
        builder.add_urdf(path, floating=True, **options)
    elif kind == "mjcf":
        builder.add_mjcf(path, **options)
    elif kind == "usd":
        builder.add_usd(path, **options)
    else:
        raise NotImplementedError
    model = builder.finalize(device="cpu")
    model.gravity.zero_()
    solver = newton.solvers.SolverSemiImplicit(model, angular_damping=0.0)
    before, after, com = model.state(), model.state(), model.body_com.numpy()[0].astype(float)

    def advance(w, v, force, torque):
        before.body_q.assign(np.array([[0, 0, 0, 0, 0, 0, 1]], np.float32))
        before.body_qd.assign(np.array([[*v, *w]], np.float32))
        before.body_f.assign(np.array([[*force, *torque]], np.float32))
        solver.step(before, after, None, None, STEP32)
        end = after.body_qd.numpy()[0].astype(float)
        return end[3:], end[:3]

    return _by_steps(advance, com, STEP32)


def brax(path, kind):
    """Return `accelerate` of Brax: its generalized pipeline, whose free joint has the coordinates of MuJoCo's."""
    import jax
    from brax.generalized import dynamics, pipeline
    from brax.io import mjcf

    if kind != "mjcf":
        raise NotImplementedError
    system = mjcf.load(path)
    system = system.replace(gravity=0 * system.gravity, mj_model=None)
    start = pipeline.init(system, np.array([0.0, 0, 0, 1, 0, 0, 0]), np.zeros(6))

    @jax.jit
    def forward(qd, force):
        state = pipeline.init(system, start.q, qd)
        return jax.numpy.linalg.solve(state.mass_mx, dynamics.forward(system, state, force))

    def accelerate(w, v, force, torque):
        a = np.asarray(forward(np.concatenate([v, w]), np.concatenate([force, torque])))
        return a[3:], a[:3]

    return accelerate


LOADERS = {
    "mujoco": mujoco,
    "mjx": mjx,
    "mjwarp": mjwarp,
    "pinocchio": pinocchio,
    "drake": drake,
    "dart": dart,
    "pybullet": pybullet,
    "sapien": sapien,
    "newton": newton,
    "brax": brax,
}
"""Loaders by the names of engines."""
