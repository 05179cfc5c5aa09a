// As installed, the motion depends on the unit of time, because of damping, sleep and a limit of 47 rad/s.
import start from 'jolt-physics';
const J = await start(), pairs = new J.ObjectLayerPairFilterTable(1), phases = new J.BroadPhaseLayerInterfaceTable(1, 1);
phases.MapObjectToBroadPhaseLayer(0, new J.BroadPhaseLayer(0));
const filter = new J.ObjectVsBroadPhaseLayerFilterTable(phases, 1, pairs, 1), few = new J.JoltSettings();
Object.assign(few, { mMaxWorkerThreads: 0, mObjectLayerPairFilter: pairs, mBroadPhaseLayerInterface: phases });
const world = new J.JoltInterface(Object.assign(few, { mObjectVsBroadPhaseLayerFilter: filter })), system = world.GetPhysicsSystem();
system.SetGravity(new J.Vec3(0, 0, 0));
function rate(unit, still) { // after 100 steps, in radians per unit of time
  const bodies = system.GetBodyInterface(), inertia = J.Mat44.prototype.sIdentity(), v = (...x) => new J.Vec3(...x);
  [v(1, 0, 0), v(0, 1, 0), v(0, 0, 1)].forEach((column, i) => inertia.SetColumn3(i, column));
  const place = [new J.RVec3(0, 0, 0), new J.Quat(0, 0, 0, 1)];
  const settings = new J.BodyCreationSettings(new J.SphereShape(0.05), ...place, J.EMotionType_Dynamic, 0);
  settings.mOverrideMassProperties = J.EOverrideMassProperties_MassAndInertiaProvided;
  Object.assign(settings.mMassPropertiesOverride, { mMass: 1, mInertia: inertia });
  if (still) Object.assign(settings, { mAngularDamping: 0, mAllowSleeping: false, mMaxAngularVelocity: 1e6 });
  const body = bodies.CreateBody(settings), id = body.GetID();
  bodies.AddBody(id, J.EActivation_Activate);
  bodies.SetAngularVelocity(id, v(0, 0, 1 / unit));
  for (let i = 0; i < 100; i++) world.Step(0.01 * unit, 1);
  const found = body.GetAngularVelocity().GetZ() * unit;
  bodies.RemoveBody(id);
  return found;
}
const units = [0.01, 0.1, 100], found = units.map((unit) => rate(unit, false)), still = units.map((unit) => rate(unit, true));
const texts = units.map((unit, i) => `${found[i].toFixed(3)} in units of ${unit} s, ${still[i].toFixed(3)} without these`);
console.log(`a rate of 1 becomes ${texts.join('; ')}: ${found.some((x) => Math.abs(x - 1) > 0.01) ? 'wrong' : 'right'}`);
