/* Jolt Physics, its official build for JavaScript, in single precision. `substeps` are collision steps.
 *
 * A body about a fixed point has a point constraint to the world. Unless `as_installed`, the gyroscopic force is on, and damping,
 * sleeping and the limits of velocities are off.
 *
 * BodyCreationSettings, MassProperties, PointConstraint: https://jrouwe.github.io/JoltPhysics/
 * Memory: https://github.com/jrouwe/JoltPhysics.js#memory-management
 */
'use strict';
const { owner, runOf, start } = require('./shared.js');

exports.ENGINE = {
  "package": "jolt-physics",
  "oldest": "0.30.0",
  "settings": {"substeps": 1, "as_installed": false},
  "precision": "f32",
  "fields": ["UniformGravity"],
  "rate_limit": 47.0,
  "card": {"variants": ["", "substeps=2", "as_installed=true"], "as_installed": ["as_installed=true"]}
};
let loaded;

exports.prepare = async (given, load) => {
  const J = await (loaded ??= (await load())());
  const { velocity } = start(given), { own, free } = owner(J.destroy);

  function build() {
    const vector = (v) => own(new J.Vec3(...v)), point = (v) => own(new J.RVec3(...v));
    const limits = { mMaxBodies: 4, mMaxBodyPairs: 4, mMaxContactConstraints: 4, mMaxWorkerThreads: 0 };
    const settings = Object.assign(own(new J.JoltSettings()), limits);
    const pairs = new J.ObjectLayerPairFilterTable(1), phases = new J.BroadPhaseLayerInterfaceTable(1, 1);  // the world's
    phases.MapObjectToBroadPhaseLayer(0, own(new J.BroadPhaseLayer(0)));
    settings.mObjectLayerPairFilter = pairs;
    settings.mBroadPhaseLayerInterface = phases;
    settings.mObjectVsBroadPhaseLayerFilter = new J.ObjectVsBroadPhaseLayerFilterTable(phases, 1, pairs, 1);
    const world = own(new J.JoltInterface(settings)), system = world.GetPhysicsSystem(), bodies = system.GetBodyInterface();
    system.SetGravity(vector([0, 0, -given.gravity]));

    // The centre of mass is that of the shape.
    const shape = new J.OffsetCenterOfMassShape(new J.SphereShape(0.05), vector(given.com)), [s, x, y, z] = given.q0;
    const turn = own(new J.Quat(x, y, z, s));
    const made = own(new J.BodyCreationSettings(shape, point([0, 0, 0]), turn, J.EMotionType_Dynamic, 0));
    const inertia = J.Mat44.prototype.sIdentity();
    for (const i of [0, 1, 2]) inertia.SetColumn3(i, vector(given.inertia_com.slice(3 * i, 3 * i + 3)));
    made.mOverrideMassProperties = J.EOverrideMassProperties_MassAndInertiaProvided;
    made.mMassPropertiesOverride.mMass = given.mass;
    made.mMassPropertiesOverride.mInertia = inertia;
    if (!given.as_installed) {
      const off = { mLinearDamping: 0, mAngularDamping: 0, mMaxLinearVelocity: 1e6, mMaxAngularVelocity: 1e6 };
      Object.assign(made, off, { mApplyGyroscopicForce: true, mAllowSleeping: false });
    }
    const body = bodies.CreateBody(made), id = body.GetID();
    bodies.AddBody(id, J.EActivation_Activate);
    bodies.SetLinearAndAngularVelocity(id, vector(velocity), vector(given.w0_W));
    if (!given.free) {
      const joint = own(new J.PointConstraintSettings());
      joint.mPoint1 = joint.mPoint2 = point([0, 0, 0]);
      system.AddConstraint(joint.Create(J.Body.prototype.sFixedToWorld, body));
    }
    const read = () => {
      const q = body.GetRotation(), w = body.GetAngularVelocity();
      return [[q.GetW(), q.GetX(), q.GetY(), q.GetZ()], [w.GetX(), w.GetY(), w.GetZ()]];
    };
    return { step: () => world.Step(given.dt, given.substeps), read, free };
  }
  return runOf(given, build);
};
