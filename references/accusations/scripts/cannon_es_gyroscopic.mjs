// There is no gyroscopic motion: without a torque, the angular velocity of a body with three different moments stays.
import * as C from 'cannon-es';
const world = new C.World(), body = new C.Body({ mass: 1, shape: new C.Sphere(0.05) }), moments = [13, 5, 10];
Object.assign(body, { linearDamping: 0, angularDamping: 0 });
world.addBody(body);
body.angularVelocity.set(1, 2, 3);
body.inertia.set(...moments);
body.invInertia.set(...moments.map((moment) => 1 / moment));
body.updateInertiaWorld(true);
for (let i = 0; i < 100; i++) world.step(0.01);
const w = [body.angularVelocity.x, body.angularVelocity.y, body.angularVelocity.z];
const change = Math.max(...w.map((rate, i) => Math.abs(rate - [1, 2, 3][i])));
const text = w.map((rate) => rate.toFixed(4)).join(', ');
console.log(`moments 13, 5 and 10: after 1 s the rates 1, 2, 3 rad/s are ${text}: ${change < 1e-4 ? 'wrong' : 'right'}`);
