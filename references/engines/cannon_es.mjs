/* cannon-es in double precision. It has no gyroscopic motion: without a torque the angular velocity does not change.
 * A body about a fixed point has a point constraint to a static body. Unless `as_installed`, damping is off and quaternions
 * are normalized exactly and in each step. https://pmndrs.github.io/cannon-es/docs/classes/Body.html
 */
export const ENGINE = {"package": "cannon-es", "precision": "f64"};

export function build({ mass, gravity, moments_com, q_com, w0_W, x0, v0, dt, free, as_installed, q_P, point_P }, C) {
  const [s, x, y, z] = q_P, vector = (v) => new C.Vec3(...v);
  const world = new C.World({ gravity: vector([0, 0, -gravity]) });
  const body = new C.Body({ mass, shape: new C.Sphere(0.05), position: vector(x0), velocity: vector(v0) });
  if (!as_installed) Object.assign(world, { quatNormalizeSkip: 0, quatNormalizeFast: false });
  if (!as_installed) Object.assign(body, { linearDamping: 0, angularDamping: 0 });
  world.addBody(body);
  body.quaternion.set(x, y, z, s);
  body.angularVelocity.set(...w0_W);
  body.inertia.set(...moments_com); // the shape's until here
  body.invInertia.set(...moments_com.map((moment) => 1 / moment));
  body.updateInertiaWorld(true);
  const support = new C.Body({ mass: 0 });
  if (!free) world.addConstraint(new C.PointToPointConstraint(body, vector(point_P), support, new C.Vec3()));
  return { step: () => world.step(dt), read: () => [body.quaternion, body.angularVelocity], axes: q_com };
}
