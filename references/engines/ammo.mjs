/* ammo.js: Bullet in single precision. Its gyroscopic force is Bullet's default, implicit in axes of the body.
 * A body about a fixed point has a point constraint to the world. Unless `as_installed`, sleeping is off. There is no damping.
 * https://github.com/kripken/ammo.js
 */
export const ENGINE = {"package": "ammo.js"};

export function build({ mass, gravity, moments_com, q_com, w0_W, x0, v0, dt, free, as_installed, q_P, point_P }, A, own) {
  const [s, x, y, z] = q_P, vector = (v) => own(new A.btVector3(...v));
  const configuration = own(new A.btDefaultCollisionConfiguration()), phase = own(new A.btDbvtBroadphase());
  const dispatcher = own(new A.btCollisionDispatcher(configuration)), solver = own(new A.btSequentialImpulseConstraintSolver());
  const world = own(new A.btDiscreteDynamicsWorld(dispatcher, phase, solver, configuration));
  world.setGravity(vector([0, 0, -gravity]));
  const place = own(new A.btTransform(own(new A.btQuaternion(x, y, z, s)), vector(x0)));
  const state = own(new A.btDefaultMotionState(place)), shape = own(new A.btSphereShape(0.05));
  const body = own(new A.btRigidBody(own(new A.btRigidBodyConstructionInfo(mass, state, shape, vector(moments_com)))));
  if (!as_installed) body.setActivationState(4); // DISABLE_DEACTIVATION
  body.setLinearVelocity(vector(v0));
  body.setAngularVelocity(vector(w0_W));
  world.addRigidBody(body);
  if (!free) world.addConstraint(own(new A.btPoint2PointConstraint(body, vector(point_P))));
  const read = () => {
    const q = body.getWorldTransform().getRotation(), w = body.getAngularVelocity();
    return [[q.w(), q.x(), q.y(), q.z()], [w.x(), w.y(), w.z()]];
  };
  return { step: () => world.stepSimulation(dt, 0), read, axes: q_com }; // 0: not in steps of 1/60 s
}
