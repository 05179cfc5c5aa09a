// With `RK4`, errors of the attitude fall with the square of the step.
import start from '@mujoco/mujoco';
const M = await start();
function attitude(steps) { // after 1 s
  const model = M.MjModel.from_xml_string(`<mujoco><option timestep="${1 / steps}" integrator="RK4" gravity="0 0 0"/><worldbody>
    <body><freejoint/><inertial mass="1" pos="0 0 0" diaginertia="13 5 10"/></body></worldbody></mujoco>`);
  const data = new M.MjData(model);
  data.qvel.set([1, 2, 3], 3);
  for (let i = 0; i < steps; i++) M.mj_step(model, data);
  return [...data.qpos.slice(3)];
}
const best = attitude(12800), counts = [25, 50, 100, 200];
const errors = counts.map((steps) => 2 * Math.hypot(...attitude(steps).map((x, i) => x - best[i])));
const orders = errors.slice(1).map((error, i) => Math.log2(errors[i] / error));
const texts = errors.map((error, i) => `${error.toExponential(1)} rad in ${counts[i]} steps`);
const order = Math.min(...orders);
console.log(`error after 1 s: ${texts.join(', ')}, order ${order.toFixed(1)}: ${order < 3 ? 'wrong' : 'right'}`);
