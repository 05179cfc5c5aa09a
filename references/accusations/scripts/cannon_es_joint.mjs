// A body on a point constraint moves otherwise in other units of time, and in units of mass if its mass is large.
import * as C from 'cannon-es';
function rates(unit, mass) { // after 300 steps, in radians per unit of time
  const world = new C.World({ gravity: new C.Vec3(0, 0, -9.81 / unit ** 2) }), moments = [2.1, 3.3, 4.2].map((x) => x * mass);
  const body = new C.Body({ mass, shape: new C.Sphere(0.05), position: new C.Vec3(0, 0, 0.2) });
  Object.assign(body, { linearDamping: 0, angularDamping: 0 });
  world.addBody(body);
  body.angularVelocity.set(0.9 / unit, -1.1 / unit, 3 / unit);
  body.velocity.set(-0.22 / unit, -0.18 / unit, 0);
  body.inertia.set(...moments);
  body.invInertia.set(...moments.map((moment) => 1 / moment));
  body.updateInertiaWorld(true);
  world.addConstraint(new C.PointToPointConstraint(body, new C.Vec3(0, 0, -0.2), new C.Body({ mass: 0 }), new C.Vec3()));
  for (let i = 0; i < 300; i++) world.step(0.01 * unit);
  return ['x', 'y', 'z'].map((axis) => body.angularVelocity[axis] * unit);
}
const usual = rates(1, 1), error = (rate) => Math.max(...rate.map((x, i) => Math.abs(x - usual[i])));
const units = [0.1, 10, 100].map((unit) => [`in units of ${unit} s`, error(rates(unit, 1))]);
const found = [...units, ...[1e3, 1e6].map((mass) => [`with ${mass} kg`, error(rates(1, mass))])];
const text = found.map(([name, x]) => `${x.toPrecision(2)} ${name}`).join(', ');
console.log(`difference of the rates after 3 units of time: ${text}: ${found.some(([, x]) => x > 0.01) ? 'wrong' : 'right'}`);
