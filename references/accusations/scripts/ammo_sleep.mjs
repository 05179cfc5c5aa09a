// As installed, slow bodies fall asleep.
import A from 'ammo.js';
const vector = (...x) => new A.btVector3(...x);
function rest(speed, sleep) { // rate after 3 s over the rate at the start
  const c = new A.btDefaultCollisionConfiguration(), dispatcher = new A.btCollisionDispatcher(c);
  const solver = new A.btSequentialImpulseConstraintSolver();
  const world = new A.btDiscreteDynamicsWorld(dispatcher, new A.btDbvtBroadphase(), solver, c);
  world.setGravity(vector(0, 0, 0));
  const state = new A.btDefaultMotionState(new A.btTransform(new A.btQuaternion(0, 0, 0, 1), vector(0, 0, 0)));
  const body = new A.btRigidBody(new A.btRigidBodyConstructionInfo(1, state, new A.btSphereShape(0.05), vector(1, 1, 1)));
  if (!sleep) body.setActivationState(4); // DISABLE_DEACTIVATION
  body.setAngularVelocity(vector(0, 0, speed));
  world.addRigidBody(body);
  for (let i = 0; i < 300; i++) world.stepSimulation(0.01, 0);
  const ratio = body.getAngularVelocity().z() / speed;
  [world, solver, dispatcher, c].forEach(A.destroy);
  return ratio;
}
const speeds = [1.1, 0.9, 0.1], found = speeds.map((speed) => [rest(speed, true), rest(speed, false)].map((x) => x.toFixed(3)));
const texts = speeds.map((speed, i) => `${found[i][0]} at ${speed} rad/s, ${found[i][1]} without sleep`);
console.log(`rate after 3 s over rate at the start: ${texts.join('; ')}: ${found.some(([x]) => x < 0.9) ? 'wrong' : 'right'}`);
