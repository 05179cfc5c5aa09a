/* Oimo.js in double precision. It has no gyroscopic motion: without a torque the angular velocity does not change.
 * A body about a fixed point has a ball joint to a static body. Unless `as_installed`, sleeping is off.
 * https://github.com/lo-th/Oimo.js
 */
export const ENGINE = {"package": "oimo", "precision": "f64"};

export function build({ mass, gravity, moments_com, q_com, w0_W, x0, v0, dt, free, as_installed, q_P, point_P }, O) {
  const [s, x, y, z] = q_P, diagonal = ([a, b, c]) => [a, 0, 0, 0, b, 0, 0, 0, c];
  const world = new O.World({ timestep: dt, gravity: [0, 0, -gravity] });
  const body = world.add({ type: 'sphere', size: [0.05], pos: x0, move: true });
  body.localInertia.elements = diagonal(moments_com); // the shape's until here
  body.inverseLocalInertia.elements = diagonal(moments_com.map((moment) => 1 / moment));
  Object.assign(body, { mass, inverseMass: 1 / mass, allowSleep: as_installed });
  body.orientation.set(x, y, z, s);
  body.linearVelocity.set(...v0);
  body.angularVelocity.set(...w0_W);
  body.syncShapes();
  const support = world.add({ type: 'sphere', size: [0.05] });
  if (!free) world.add({ type: 'jointBall', body1: body, body2: support, pos1: point_P });
  return { step: () => world.step(), read: () => [body.orientation, body.angularVelocity], axes: q_com };
}
