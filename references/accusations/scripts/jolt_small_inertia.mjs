// An inertia whose norm is below 1e-6 kg m^2 is replaced by another one.
import start from 'jolt-physics';
const J = await start(), pairs = new J.ObjectLayerPairFilterTable(1), phases = new J.BroadPhaseLayerInterfaceTable(1, 1);
phases.MapObjectToBroadPhaseLayer(0, new J.BroadPhaseLayer(0));
const filter = new J.ObjectVsBroadPhaseLayerFilterTable(phases, 1, pairs, 1), few = new J.JoltSettings(), layers = { mMaxWorkerThreads: 0 };
Object.assign(layers, { mObjectLayerPairFilter: pairs, mBroadPhaseLayerInterface: phases, mObjectVsBroadPhaseLayerFilter: filter });
const world = new J.JoltInterface(Object.assign(few, layers)), bodies = world.GetPhysicsSystem().GetBodyInterface();
function replaced(moments) {
  const shape = new J.SphereShape(0.05), inertia = J.Mat44.prototype.sIdentity(), v = (...x) => new J.Vec3(...x), [a, b, c] = moments;
  const settings = new J.BodyCreationSettings(shape, new J.RVec3(0, 0, 0), new J.Quat(0, 0, 0, 1), J.EMotionType_Dynamic, 0);
  [v(a, 0, 0), v(0, b, 0), v(0, 0, c)].forEach((column, i) => inertia.SetColumn3(i, column));
  settings.mOverrideMassProperties = J.EOverrideMassProperties_MassAndInertiaProvided;
  Object.assign(settings.mMassPropertiesOverride, { mMass: 2 * c, mInertia: inertia });
  const body = bodies.CreateBody(settings), inverse = body.GetMotionProperties().GetInverseInertiaDiagonal();
  const kept = [inverse.GetX(), inverse.GetY(), inverse.GetZ()].map((x) => 1 / x).sort((x, y) => x - y);
  bodies.DestroyBody(body.GetID());
  return kept.some((moment, i) => Math.abs(moment / [a, b, c].sort((x, y) => x - y)[i] - 1) > 1e-3);
}
const limits = [[1, 1.4, 2], [1.2, 1.2, 2], [1, 1, 0.01]].map((shape) => {
  let [low, high] = [1e-12, 1e-3];
  for (let i = 0; i < 40; i++) replaced(shape.map((x) => x * Math.sqrt(low * high))) ? (low = Math.sqrt(low * high)) : (high = Math.sqrt(low * high));
  return [Math.hypot(...shape) * high, Math.min(...shape) * high];
});
const texts = limits.map(([norm, smallest]) => `norm ${norm.toExponential(2)} (smallest moment ${smallest.toExponential(1)})`);
console.log(`three bodies are kept from these on, kg m^2: ${texts.join(', ')}: ${limits.some(([norm]) => norm > 1e-9) ? 'wrong' : 'right'}`);
