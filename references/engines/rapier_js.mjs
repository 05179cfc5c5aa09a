/* Rapier's official build for JavaScript, in single precision. `substeps` are iterations of its solver.
 * A body about a fixed point is on a spherical impulse joint. The gyroscopic force is on in 0.20.0 and later. Unless
 * `as_installed`, sleeping is off. https://rapier.rs/docs/user_guides/javascript/rigid_bodies
 */
export const ENGINE = {
  "package": "@dimforge/rapier3d-compat", "oldest": "0.12.0", "descriptions": ["frame", "setter", "world", "damping"], "settings": {"substeps": 4, "as_installed": false}
};
export const start = async (rapier) => (await rapier.init(), rapier);

export function build(given, R, own) {
  const vector = ([x, y, z]) => ({ x, y, z }), quaternion = ([w, x, y, z]) => ({ w, x, y, z }), origin = vector([0, 0, 0]);
  const world = new R.World(vector([0, 0, -given.gravity]));
  own(() => world.free());
  Object.assign(world, { timestep: given.dt, numSolverIterations: given.substeps });
  const settings = R.RigidBodyDesc.dynamic().setRotation(quaternion(given.q0)).setAngvel(vector(given.w0_W));
  const properties = [given.mass, vector(given.com), vector(given.moments_com), quaternion(given.q_com)];
  if (given.description !== 'setter') settings.setAdditionalMassProperties(...properties);
  if (given.description === 'damping') settings.setLinearDamping(0).setAngularDamping(0);
  if (given.description === 'world') world.createRigidBody(R.RigidBodyDesc.dynamic().setTranslation(1000, 200, 30).setAdditionalMass(3));
  const body = world.createRigidBody(settings.setLinvel(...given.v0).setCanSleep(given.as_installed));
  if (given.description === 'setter') body.setAdditionalMassProperties(...properties, true);
  const support = world.createRigidBody(R.RigidBodyDesc.fixed());
  if (!given.free) world.createImpulseJoint(R.JointData.spherical(origin, origin), support, body, true);
  return { step: () => world.step(), read: () => [body.rotation(), body.angvel()] };
}
