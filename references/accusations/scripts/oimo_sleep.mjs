// As installed, slow bodies fall asleep.
import * as O from 'oimo';
const { World } = O.World ? O : O.default;
function rest(speed, sleep) { // rate after 2 s over the rate at the start
  const world = new World({ timestep: 0.01, gravity: [0, 0, 0] }), body = world.add({ type: 'sphere', size: [0.05], move: true });
  if (!sleep) body.allowSleep = false;
  body.angularVelocity.set(0, 0, speed);
  for (let i = 0; i < 200; i++) world.step();
  return body.angularVelocity.z / speed;
}
const speeds = [1, 0.3, 0.1], found = speeds.map((speed) => [rest(speed, true), rest(speed, false)].map((x) => x.toFixed(3)));
const texts = speeds.map((speed, i) => `${found[i][0]} at ${speed} rad/s, ${found[i][1]} without sleep`);
console.log(`rate after 2 s over rate at the start: ${texts.join('; ')}: ${found.some(([x]) => x < 0.9) ? 'wrong' : 'right'}`);
