"""Each engine's own loader, and the accelerations of the body that it makes. Runs in the environments of engines.

A loader `_name(path, kind)` returns a function from a velocity (6,) and a force (6,) at the origin of the root link to the
acceleration (6,) of that origin, all linear before angular and in its axes. Some engines make one short step for it.
"""

import os
import sys
import tempfile
import warnings
from pathlib import Path

import numpy as np

STEP64, STEP32 = 2.0**-17, 2.0**-10
"""Such steps, s, in double and single precision. Measured errors of accelerations in the catalogue: 1.3e-11 and 4.5e-3."""
PLACE = np.array([0.0, 0, 0, 1, 0, 0, 0])


def probe(engine, path, kind, cases):
    """Return accelerations (n, 6) for velocities and forces (n, 2, 6), or the reason of a refusal; and the engine's output."""
    answer, kept = {}, os.dup(2)
    with tempfile.TemporaryFile() as stream, warnings.catch_warnings():
        warnings.simplefilter("always")
        # Without the lines of code that Python shows: they name masses, too.
        warnings.showwarning = lambda message, kind, *_: print(f"{kind.__name__}: {message}", file=sys.stderr, flush=True)
        os.dup2(stream.fileno(), 1)
        os.dup2(stream.fileno(), 2)
        try:
            accelerate = LOADERS[engine](path, kind)
        except (NotImplementedError, ImportError) as error:
            raise NotImplementedError(f"it does not support this: {error}") from None
        except (Exception, SystemExit) as error:
            answer["refused"] = f"{type(error).__name__}: {' '.join(str(error).split())}"
        finally:
            os.dup2(kept, 1)
            os.dup2(kept, 2)
            os.close(kept)
        stream.seek(0)
        answer["output"] = " ".join(stream.read(65536).decode(errors="replace").split())
    if "refused" not in answer:
        answer["accelerations"] = np.array([accelerate(*case) for case in cases], float)
    return answer


def _choose(kind, **readers):
    if readers.get(kind) is None:
        raise NotImplementedError(f"no loader for {kind.upper()}")
    return readers[kind]


def _one_free(bodies):
    if len(bodies) != 1:
        raise ValueError(f"after loading there are {len(bodies)} free bodies")
    return bodies


def _linear(vector):
    return np.concatenate([vector, np.zeros(3)])


def _compile_mujoco(path, kind):
    """Return MuJoCo's model of a file, on a free joint, without forces, fluid and the armature of the joint."""
    import mujoco

    read = _choose(kind, urdf=mujoco.MjSpec, mjcf=mujoco.MjSpec)
    if path.endswith((".xml", ".urdf")):
        spec = read.from_file(path)
    else:  # MjModel.from_xml_path takes any name, and MjSpec.from_file some
        spec = read.from_string(Path(path).read_text())
        spec.modelfiledir = str(Path(path).parent)
    if not spec.joints:
        _one_free(list(spec.worldbody.bodies))
        spec.worldbody.first_body().add_freejoint()
    option, flags = spec.option, mujoco.mjtDisableBit
    option.gravity, option.wind, option.density, option.viscosity = [0, 0, 0], [0, 0, 0], 0, 0
    option.integrator = 0  # none is needed, and MJX does not have all
    forces = ("CONTACT", "CONSTRAINT", "PASSIVE", "SPRING", "DAMPER", "ACTUATION")  # some only in some versions
    option.disableflags = sum(int(getattr(flags, f"mjDSBL_{name}", 0)) for name in forces)
    for joint in spec.joints:
        joint.armature = joint.frictionloss = 0
    for part in (spec.compiler, *spec.joints):  # the body keeps the axes of the file
        for name in {"align", "alignfree"}.intersection(dir(part)):
            setattr(part, name, 0)
    return mujoco, spec.compile()


def _mujoco(path, kind):
    mujoco, model = _compile_mujoco(path, kind)
    data = mujoco.MjData(model)
    data.qpos[:] = PLACE

    def accelerate(v, force):
        data.qvel[:], data.qfrc_applied[:] = v, force
        mujoco.mj_forward(model, data)
        return data.qacc.copy()

    return accelerate


def _mjx(path, kind):
    import jax
    from mujoco import mjx

    model = mjx.put_model(_compile_mujoco(path, kind)[1])
    data = mjx.make_data(model).replace(qpos=jax.numpy.array(PLACE))
    return jax.jit(lambda v, force: mjx.forward(model, data.replace(qvel=v, qfrc_applied=force)).qacc)


def _mjwarp(path, kind):
    import mujoco_warp

    mujoco, host = _compile_mujoco(path, kind)
    model, data = mujoco_warp.put_model(host), mujoco_warp.put_data(host, mujoco.MjData(host))
    data.qpos.assign(PLACE[None].astype(np.float32))

    def accelerate(v, force):
        data.qvel.assign(v[None].astype(np.float32))
        data.qfrc_applied.assign(force[None].astype(np.float32))
        mujoco_warp.forward(model, data)
        return data.qacc.numpy()[0].copy()

    return accelerate


def _brax(path, kind):
    import jax
    from brax.generalized import dynamics, pipeline
    from brax.io import mjcf

    model = _choose(kind, mjcf=mjcf.load_mjmodel)(path)
    option = model.opt
    option.gravity[:], option.wind[:], option.density, option.viscosity = 0, 0, 0, 0
    option.integrator, option.cone, option.impratio = 0, 0, 1  # the defaults of steps and contacts; Brax refuses others
    for values in (model.dof_armature, model.dof_damping, model.jnt_stiffness):
        values[:] = 0
    system = mjcf.load_model(model).replace(mj_model=None)

    @jax.jit
    def accelerate(v, force):
        state = pipeline.init(system, PLACE, v)
        return jax.numpy.linalg.solve(state.mass_mx, dynamics.forward(system, state, force))

    return accelerate


def _pinocchio(path, kind):
    import pinocchio as pin

    build = _choose(kind, urdf=pin.buildModelFromUrdf, mjcf=pin.buildModelFromMJCF, sdf=getattr(pin, "buildModelFromSdf", None))
    model = build(path) if kind == "mjcf" else build(path, pin.JointModelFreeFlyer())
    data, place = model.createData(), np.roll(PLACE, 3)  # zeros and a quaternion, scalar last
    model.gravity.linear = np.zeros(3)
    for name in ("armature", "rotorInertia", "damping", "friction"):  # of the joint; not every version has all of them
        if hasattr(model, name):
            setattr(model, name, np.zeros(model.nv))
    return lambda v, force: pin.aba(model, data, place, v, force) + _linear(np.cross(v[3:], v[:3]))  # it is spatial


def _drake(path, kind):
    import pydrake.all as drake

    plant = drake.MultibodyPlant(0.0)
    _choose(kind, **dict.fromkeys(("urdf", "sdf", "mjcf"), drake.Parser(plant).AddModels))(path)
    plant.mutable_gravity_field().set_gravity_vector([0, 0, 0])
    plant.Finalize()
    context = plant.CreateDefaultContext()
    (body,) = _one_free(plant.GetFloatingBaseBodies())
    plant.SetFreeBodyPose(context, plant.get_body(body), drake.RigidTransform())

    def accelerate(v, force):
        plant.SetVelocities(context, np.roll(v, 3))
        plant.get_applied_generalized_force_input_port().FixValue(context, np.roll(force, 3))
        return np.roll(plant.EvalTimeDerivatives(context).get_generalized_velocity().CopyToVector(), 3)

    return accelerate


def _dart(path, kind):
    import dartpy
    from dartpy import utils

    world = _choose(
        kind, urdf=utils.DartLoader().parseSkeleton, sdf=utils.SdfParser.readSkeleton, mjcf=utils.MjcfParser.readWorld
    )(path)
    skeleton = world.getSkeleton(0) if world and kind == "mjcf" else world
    if skeleton is None:
        raise ValueError("DART's loader returned nothing")
    _one_free([skeleton.getRootJoint()] * bool(skeleton.getNumDofs()))
    skeleton.setGravity([0, 0, 0])
    skeleton.setPositions(np.zeros(skeleton.getNumDofs()))
    body, joint = skeleton.getBodyNode(0), skeleton.getRootJoint()
    # The body starts at the identity, wherever the file places it.
    joint.setTransformFromParentBodyNode(dartpy.math.Isometry3())
    joint.setTransformFromChildBodyNode(dartpy.math.Isometry3())

    def accelerate(v, force):
        skeleton.setVelocities(np.roll(v, 3))
        skeleton.setForces(np.roll(force, 3))
        skeleton.computeForwardDynamics()
        return np.concatenate([body.getLinearAcceleration(), body.getAngularAcceleration()])

    return accelerate


def _by_steps(step, seconds, point):
    """Return accelerations from a step, which maps velocity and force (6,) at a point (3,) to the velocity after it."""

    def accelerate(v, force):
        w, start = v[3:], v + _linear(np.cross(v[3:], point))
        a = (step(start, force - np.roll(_linear(np.cross(point, force[:3])), 3)) - start) / seconds
        return a - _linear(np.cross(a[3:], point) + np.cross(w, np.cross(w, point)))

    return accelerate


def _pybullet(path, kind):
    import pybullet as bullet

    if not bullet.isConnected():
        bullet.connect(bullet.DIRECT)
    bullet.resetSimulation()
    if kind == "urdf":  # without this flag it ignores the inertia of the file, as documented; the other loaders have no flag
        body = bullet.loadURDF(path, flags=bullet.URDF_USE_INERTIA_FROM_FILE)
    else:
        body = _choose(kind, sdf=bullet.loadSDF, mjcf=bullet.loadMJCF)(path)[-1]
    bullet.setPhysicsEngineParameter(fixedTimeStep=STEP64, numSubSteps=0)
    for part in range(-1, bullet.getNumJoints(body)):
        bullet.changeDynamics(body, part, linearDamping=0, angularDamping=0, jointDamping=0, maxJointVelocity=1e6)
    point, turn = bullet.getDynamicsInfo(body, -1)[3:5]

    def step(v, force):
        v, force = v.tolist(), force.tolist()
        bullet.resetBasePositionAndOrientation(body, point, turn)
        bullet.resetBaseVelocity(body, v[:3], v[3:])
        bullet.applyExternalForce(body, -1, force[:3], point, bullet.WORLD_FRAME)
        bullet.applyExternalTorque(body, -1, force[3:], bullet.WORLD_FRAME)
        bullet.stepSimulation()
        return np.concatenate(bullet.getBaseVelocity(body))

    return _by_steps(step, STEP64, point)


def _sapien(path, kind):
    import sapien

    system = sapien.physx.PhysxCpuSystem()
    scene = sapien.Scene([system])
    system.timestep = STEP32
    loader = scene.create_urdf_loader()
    loader.fix_root_link = False
    articulations, actors = _choose(kind, urdf=loader.load_multiple)(path)[:2]  # a link without children is an actor
    dynamic = sapien.physx.PhysxRigidDynamicComponent
    links = articulations[0].get_links() if articulations else [actors[0].find_component_by_type(dynamic)]
    for link in links:
        link.set_linear_damping(0)
        link.set_angular_damping(0)
        link.set_max_angular_velocity(1e6)
        link.set_disable_gravity(True)

    def step(v, force):
        v, force = v.astype(np.float32), force.astype(np.float32)
        if articulations:
            articulations[0].set_root_pose(sapien.Pose())
            articulations[0].set_root_linear_velocity(v[:3])
            articulations[0].set_root_angular_velocity(v[3:])
        else:
            actors[0].set_pose(sapien.Pose())
            links[0].set_linear_velocity(v[:3])
            links[0].set_angular_velocity(v[3:])
        links[0].add_force_torque(force[:3], force[3:])
        system.step()
        return np.concatenate([links[0].get_linear_velocity(), links[0].get_angular_velocity()]).astype(float)

    step.owner = scene
    return _by_steps(step, STEP32, links[0].get_cmass_local_pose().p)


def _newton(path, kind):
    import newton

    builder = newton.ModelBuilder()
    read = _choose(kind, urdf=builder.add_urdf, mjcf=builder.add_mjcf, usd=builder.add_usd)
    read(path, collapse_fixed_joints=True, **({"floating": True} if kind == "urdf" else {}))
    model = builder.finalize(device="cpu")
    model.gravity.zero_()
    solver = newton.solvers.SolverSemiImplicit(model, angular_damping=0.0)
    before, after = model.state(), model.state()

    def step(v, force):
        before.body_q.assign(np.array([[0, 0, 0, 0, 0, 0, 1]], np.float32))
        before.body_qd.assign(v[None].astype(np.float32))
        before.body_f.assign(force[None].astype(np.float32))
        solver.step(before, after, None, None, STEP32)
        return after.body_qd.numpy()[0].astype(float)

    return _by_steps(step, STEP32, model.body_com.numpy()[0])


_ALL = _mujoco, _pinocchio, _drake, _dart, _pybullet, _newton, _sapien, _brax, _mjx, _mjwarp
LOADERS = {loader.__name__[1:]: loader for loader in _ALL}
"""Loaders by the names of engines."""

FAMILIES: dict[str, dict[str, tuple[str, ...]]] = {
    "urdf": {
        "urdfdom": ("pinocchio", "dart"),
        "MuJoCo": ("mujoco", "mujoco_js", "mjx", "mjwarp"),
    },
    "mjcf": {"MuJoCo": ("mujoco", "mujoco_js", "mjx", "mjwarp", "brax")},
    "sdf": {"libsdformat": ("drake", "pinocchio")},
    "usd": {"usd-core": ("newton",)},
}
"""Engines that read a format with the same parser, by format and parser. All other engines have a parser of their own."""


def family(engine: str, kind: str) -> str:
    """Return the name of the parser with which an engine reads files of a kind."""
    return next((name for name, engines in FAMILIES.get(kind, {}).items() if engine in engines), engine)
