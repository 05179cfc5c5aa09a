/* Jolt Physics, its official build for JavaScript, in single precision. `substeps` are collision steps.
 * A body about a fixed point has a point constraint to the world. Unless `as_installed`, the gyroscopic force is on; damping,
 * sleeping and limits of velocities are off. https://jrouwe.github.io/JoltPhysics/class_body_creation_settings.html
 */
export const ENGINE = {
  "package": "jolt-physics", "oldest": "0.30.0", "settings": {"substeps": 1, "as_installed": false}, "rate_limit": 47.0
};
export const start = (Jolt) => Jolt();

export function build(given, J, own) {
  const vector = (v) => own(new J.Vec3(...v)), origin = own(new J.RVec3(0, 0, 0)), [s, x, y, z] = given.q0;
  const pairs = new J.ObjectLayerPairFilterTable(1), phases = new J.BroadPhaseLayerInterfaceTable(1, 1); // the world frees them
  phases.MapObjectToBroadPhaseLayer(0, own(new J.BroadPhaseLayer(0)));
  const filter = new J.ObjectVsBroadPhaseLayerFilterTable(phases, 1, pairs, 1), few = own(new J.JoltSettings());
  Object.assign(few, { mMaxBodies: 4, mMaxBodyPairs: 4, mMaxContactConstraints: 4, mObjectLayerPairFilter: pairs });
  Object.assign(few, { mMaxWorkerThreads: 0, mBroadPhaseLayerInterface: phases, mObjectVsBroadPhaseLayerFilter: filter });
  const world = own(new J.JoltInterface(few));
  const system = world.GetPhysicsSystem(), bodies = system.GetBodyInterface(), inertia = J.Mat44.prototype.sIdentity();
  system.SetGravity(vector([0, 0, -given.gravity]));
  const shape = new J.OffsetCenterOfMassShape(new J.SphereShape(0.05), vector(given.com)), turn = own(new J.Quat(x, y, z, s));
  const settings = own(new J.BodyCreationSettings(shape, origin, turn, J.EMotionType_Dynamic, 0));
  for (const i of [0, 1, 2]) inertia.SetColumn3(i, vector(given.inertia_com[i]));
  settings.mOverrideMassProperties = J.EOverrideMassProperties_MassAndInertiaProvided;
  Object.assign(settings.mMassPropertiesOverride, { mMass: given.mass, mInertia: inertia });
  const still = { mLinearDamping: 0, mAngularDamping: 0, mMaxLinearVelocity: 1e6, mMaxAngularVelocity: 1e6 };
  if (!given.as_installed) Object.assign(settings, still, { mApplyGyroscopicForce: true, mAllowSleeping: false });
  const body = bodies.CreateBody(settings);
  bodies.AddBody(body.GetID(), J.EActivation_Activate);
  bodies.SetLinearAndAngularVelocity(body.GetID(), vector(given.v0), vector(given.w0_W));
  const joint = Object.assign(own(new J.PointConstraintSettings()), { mPoint1: origin, mPoint2: origin });
  if (!given.free) system.AddConstraint(joint.Create(J.Body.prototype.sFixedToWorld, body));
  const read = () => {
    const q = body.GetRotation(), w = body.GetAngularVelocity();
    return [[q.GetW(), q.GetX(), q.GetY(), q.GetZ()], [w.GetX(), w.GetY(), w.GetZ()]];
  };
  return { step: () => world.Step(given.dt, given.substeps), read };
}
