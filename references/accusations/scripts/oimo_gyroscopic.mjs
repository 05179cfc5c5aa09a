// There is no gyroscopic motion: without a torque, the angular velocity of a body with three different moments stays.
import * as O from 'oimo';
const { World } = O.World ? O : O.default, world = new World({ timestep: 0.01, gravity: [0, 0, 0] });
const body = world.add({ type: 'sphere', size: [0.05], move: true }), diagonal = ([a, b, c]) => [a, 0, 0, 0, b, 0, 0, 0, c];
body.localInertia.elements = diagonal([13, 5, 10]);
body.inverseLocalInertia.elements = diagonal([1 / 13, 1 / 5, 1 / 10]);
body.allowSleep = false;
body.angularVelocity.set(1, 2, 3);
body.syncShapes();
for (let i = 0; i < 100; i++) world.step();
const w = [body.angularVelocity.x, body.angularVelocity.y, body.angularVelocity.z];
const change = Math.max(...w.map((rate, i) => Math.abs(rate - [1, 2, 3][i])));
const text = w.map((rate) => rate.toFixed(4)).join(', ');
console.log(`moments 13, 5 and 10: after 1 s the rates 1, 2, 3 rad/s are ${text}: ${change < 1e-4 ? 'wrong' : 'right'}`);
