// A body with moments of a few thousandths of 1 kg m^2 or less has no gyroscopic motion.
import A from 'ammo.js';
const vector = (...x) => new A.btVector3(...x);
function rates(scale) { // after 1 s
  const c = new A.btDefaultCollisionConfiguration(), dispatcher = new A.btCollisionDispatcher(c);
  const solver = new A.btSequentialImpulseConstraintSolver();
  const world = new A.btDiscreteDynamicsWorld(dispatcher, new A.btDbvtBroadphase(), solver, c);
  world.setGravity(vector(0, 0, 0));
  const state = new A.btDefaultMotionState(new A.btTransform(new A.btQuaternion(0, 0, 0, 1), vector(0, 0, 0)));
  const moments = vector(2.1 * scale, 3.3 * scale, 4.2 * scale);
  const body = new A.btRigidBody(new A.btRigidBodyConstructionInfo(1, state, new A.btSphereShape(0.05), moments));
  body.setActivationState(4); // DISABLE_DEACTIVATION
  body.setAngularVelocity(vector(0.9, -1.1, 0.7));
  world.addRigidBody(body);
  for (let i = 0; i < 100; i++) world.stepSimulation(0.01, 0);
  const w = body.getAngularVelocity(), found = [w.x(), w.y(), w.z()];
  [world, solver, dispatcher, c].forEach(A.destroy);
  return found;
}
const still = (scale) => Math.max(...rates(scale).map((rate, i) => Math.abs(rate - [0.9, -1.1, 0.7][i]))) < 1e-4;
const scales = [1, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5], found = scales.map(still);
const texts = scales.map((scale, i) => `${found[i] ? 'no' : 'yes'} at ${(2.1 * scale).toPrecision(2)}`);
console.log(`gyroscopic motion by the smallest moment, kg m^2: ${texts.join(', ')}: ${found.includes(true) ? 'wrong' : 'right'}`);
