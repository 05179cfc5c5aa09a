// As installed, damping takes energy from a free brick.
import start from 'jolt-physics';
const J = await start(), pairs = new J.ObjectLayerPairFilterTable(1), phases = new J.BroadPhaseLayerInterfaceTable(1, 1);
phases.MapObjectToBroadPhaseLayer(0, new J.BroadPhaseLayer(0));
const filter = new J.ObjectVsBroadPhaseLayerFilterTable(phases, 1, pairs, 1), few = new J.JoltSettings();
Object.assign(few, { mMaxWorkerThreads: 0, mObjectLayerPairFilter: pairs, mBroadPhaseLayerInterface: phases });
const world = new J.JoltInterface(Object.assign(few, { mObjectVsBroadPhaseLayerFilter: filter })), system = world.GetPhysicsSystem();
system.SetGravity(new J.Vec3(0, 0, 0));
function energy_left(off) {
  const bodies = system.GetBodyInterface(), inertia = J.Mat44.prototype.sIdentity(), v = (...x) => new J.Vec3(...x);
  [v(13, 0, 0), v(0, 5, 0), v(0, 0, 10)].forEach((column, i) => inertia.SetColumn3(i, column));
  const place = [new J.RVec3(0, 0, 0), new J.Quat(0, 0, 0, 1)];
  const settings = new J.BodyCreationSettings(new J.SphereShape(0.05), ...place, J.EMotionType_Dynamic, 0);
  settings.mOverrideMassProperties = J.EOverrideMassProperties_MassAndInertiaProvided;
  Object.assign(settings.mMassPropertiesOverride, { mMass: 1, mInertia: inertia });
  if (off) settings.mAngularDamping = 0;
  const body = bodies.CreateBody(settings), id = body.GetID();
  bodies.AddBody(id, J.EActivation_Activate);
  bodies.SetAngularVelocity(id, v(0, 0.05, 10));
  const energy = () => {
    const w = body.GetRotation().Conjugated().MulVec3(body.GetAngularVelocity());
    return (13 * w.GetX() ** 2 + 5 * w.GetY() ** 2 + 10 * w.GetZ() ** 2) / 2;
  };
  const first = energy();
  for (let i = 0; i < 600; i++) world.Step(0.01, 1);
  const ratio = energy() / first;
  bodies.RemoveBody(id);
  return ratio;
}
const [rest, undamped] = [energy_left(false), energy_left(true)].map((ratio) => ratio.toFixed(3));
console.log(`energy after 6 s over energy at the start: ${rest}, without damping ${undamped}: ${rest < 0.99 ? 'wrong' : 'right'}`);
