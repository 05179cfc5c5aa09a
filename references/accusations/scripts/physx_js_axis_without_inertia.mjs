// With gyroscopic forces on, the angular velocity about an axis without inertia becomes 0.
import { readFileSync } from 'fs';
import { fileURLToPath } from 'url';
import start from 'physx-js-webidl';
const place = fileURLToPath(import.meta.resolve('physx-js-webidl')).replace(/[^/]*$/, ''), { process } = globalThis;
Object.assign(globalThis, { process: undefined, window: globalThis }); // it refuses to start where it sees Node
const P = await start({ wasmBinary: readFileSync(`${place}physx-js-webidl.wasm`) });
Object.assign(globalThis, { process, window: undefined });
const top = P.PxTopLevelFunctions.prototype, scale = new P.PxTolerancesScale(), version = top.PHYSICS_VERSION;
const foundation = top.CreateFoundation(version, new P.PxDefaultAllocator(), new P.PxDefaultErrorCallback());
const physics = top.CreatePhysics(version, foundation, scale), cpuDispatcher = top.DefaultCpuDispatcherCreate(0);
function speed(moment, gyroscopic = true) {
  const settings = new P.PxSceneDesc(scale), v = (...x) => new P.PxVec3(...x);
  const place = new P.PxTransform(v(0, 0, 0), new P.PxQuat(0, 0, 0, 1));
  Object.assign(settings, { gravity: v(0, 0, 0), cpuDispatcher, filterShader: top.DefaultFilterShader() });
  const world = physics.createScene(settings), body = physics.createRigidDynamic(place);
  body.setMass(1);
  body.setRigidBodyFlag(1 << 10, gyroscopic); // eENABLE_GYROSCOPIC_FORCES, which the build does not name
  body.setMassSpaceInertiaTensor(v(1, 1, moment));
  body.setAngularDamping(0);
  body.setSleepThreshold(0);
  world.addActor(body);
  body.setAngularVelocity(v(0, 0, 4));
  world.simulate(0.01) && world.fetchResults(true);
  return body.getAngularVelocity().z;
}
const rod = speed(0), numbers = [rod, speed(1e-6), speed(0, false)].map((rate) => rate.toFixed(3));
const text = `${numbers[0]}, with a moment of 1e-6 ${numbers[1]}, without gyroscopic forces ${numbers[2]}`;
console.log(`after one step 4 rad/s about an axis without inertia are ${text}: ${Math.abs(rod - 4) > 1e-3 ? 'wrong' : 'right'}`);
