// As installed, damping takes energy from a free brick.
import * as C from 'cannon-es';
function energy_left(off) {
  const world = new C.World(), body = new C.Body({ mass: 1, shape: new C.Sphere(0.05) }), moments = [13, 5, 10];
  if (off) body.angularDamping = 0;
  world.addBody(body);
  body.inertia.set(...moments);
  body.invInertia.set(...moments.map((moment) => 1 / moment));
  body.updateInertiaWorld(true);
  body.angularVelocity.set(0, 0.05, 10);
  const energy = () => {
    const { x, y, z } = body.quaternion.inverse().vmult(body.angularVelocity);
    return (moments[0] * x * x + moments[1] * y * y + moments[2] * z * z) / 2;
  };
  const start = energy();
  for (let i = 0; i < 600; i++) world.step(0.01);
  return energy() / start;
}
const [rest, undamped] = [energy_left(false), energy_left(true)].map((ratio) => ratio.toFixed(3));
console.log(`energy after 6 s over energy at the start: ${rest}, without damping ${undamped}: ${rest < 0.99 ? 'wrong' : 'right'}`);
