/* PhysX 5 in single precision, compiled for browsers (physx-js-webidl), here in Node.
 * A body about a fixed point has a spherical joint to the world. Unless `as_installed`, the gyroscopic force is on; damping,
 * sleeping and the limit of rates are off. https://nvidia-omniverse.github.io/PhysX/physx/5.6.1/docs/RigidBodyDynamics.html
 */
import { readFileSync } from 'fs';

export const ENGINE = {
  "package": "physx-js-webidl", "oldest": "2.7.0", "rate_limit": 100.0,
  "settings": {"solver": "PGS", "as_installed": false}, "orders": {"PGS": 1, "TGS": 1}
};

export async function start(PhysX, url) {
  const { process } = globalThis, wasmBinary = readFileSync(new URL('physx-js-webidl.wasm', url));
  Object.assign(globalThis, { process: undefined, window: globalThis }); // it refuses to start where it sees Node
  const P = await PhysX({ wasmBinary }).finally(() => Object.assign(globalThis, { process, window: undefined }));
  const top = P.PxTopLevelFunctions.prototype, scale = new P.PxTolerancesScale(), version = top.PHYSICS_VERSION;
  const foundation = top.CreateFoundation(version, new P.PxDefaultAllocator(), new P.PxDefaultErrorCallback());
  const physics = top.CreatePhysics(version, foundation, scale), cpuDispatcher = top.DefaultCpuDispatcherCreate(0);
  return Object.assign(P, { top, scale, physics, cpuDispatcher, filterShader: top.DefaultFilterShader() });
}

export function build({ mass, gravity, com, moments_com, q_com, q0, w0_W, dt, free, solver, as_installed, v0 }, P, own) {
  const vector = (v) => own(new P.PxVec3(...v)), quaternion = ([s, x, y, z]) => own(new P.PxQuat(x, y, z, s));
  const pose = (v, q) => own(new P.PxTransform(vector(v), quaternion(q))), origin = pose([0, 0, 0], [1, 0, 0, 0]);
  const released = (object) => (own(() => object.release()), object), { top, physics, scale, cpuDispatcher, filterShader } = P;
  const settings = own(new P.PxSceneDesc(scale)), solverType = P.PxSolverTypeEnum[`e${solver}`];
  Object.assign(settings, { gravity: vector([0, 0, -gravity]), cpuDispatcher, filterShader, solverType });
  const world = released(physics.createScene(settings)), body = released(physics.createRigidDynamic(pose([0, 0, 0], q0)));
  const set = (values) => Object.entries(values).forEach(([name, value]) => body[`set${name}`](value));
  set({ Mass: mass, MassSpaceInertiaTensor: vector(moments_com), CMassLocalPose: pose(com, q_com) });
  if (!as_installed) {
    body.setRigidBodyFlag(1 << 10, true); // eENABLE_GYROSCOPIC_FORCES, which the build does not name
    set({ LinearDamping: 0, AngularDamping: 0, MaxAngularVelocity: 1e6, SleepThreshold: 0 });
  }
  world.addActor(body);
  set({ LinearVelocity: vector(v0), AngularVelocity: vector(w0_W) });
  if (!free) released(top.SphericalJointCreate(physics, P.NULL, origin, body, origin));
  const read = () => [body.getGlobalPose().q, body.getAngularVelocity()];
  return { step: () => world.simulate(dt) && world.fetchResults(true), read };
}
