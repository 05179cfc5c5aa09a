// As installed, damping takes energy from a free brick.
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
function energy_left(off) {
  const settings = new P.PxSceneDesc(scale), v = (...x) => new P.PxVec3(...x);
  const place = new P.PxTransform(v(0, 0, 0), new P.PxQuat(0, 0, 0, 1));
  Object.assign(settings, { gravity: v(0, 0, 0), cpuDispatcher, filterShader: top.DefaultFilterShader() });
  const world = physics.createScene(settings), body = physics.createRigidDynamic(place);
  body.setMass(1);
  body.setMassSpaceInertiaTensor(v(13, 5, 10));
  if (off) body.setAngularDamping(0);
  world.addActor(body);
  body.setAngularVelocity(v(0, 0.05, 10));
  const energy = () => {
    const { x, y, z } = body.getGlobalPose().q.getConjugate().rotate(body.getAngularVelocity());
    return (13 * x * x + 5 * y * y + 10 * z * z) / 2;
  };
  const first = energy();
  for (let i = 0; i < 600; i++) world.simulate(0.01) && world.fetchResults(true);
  return energy() / first;
}
const [rest, undamped] = [energy_left(false), energy_left(true)].map((ratio) => ratio.toFixed(3));
console.log(`energy after 6 s over energy at the start: ${rest}, without damping ${undamped}: ${rest < 0.99 ? 'wrong' : 'right'}`);
