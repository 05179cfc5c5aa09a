// There is no gyroscopic motion: without a torque, the angular velocity of a body with three different moments stays.
import R from '@dimforge/rapier3d-compat';
await R.init();
const world = new R.World({ x: 0, y: 0, z: 0 }), axes = { x: 0, y: 0, z: 0, w: 1 }, moments = { x: 13, y: 5, z: 10 };
const settings = R.RigidBodyDesc.dynamic().setAngvel({ x: 1, y: 2, z: 3 }).setCanSleep(false);
const body = world.createRigidBody(settings.setAdditionalMassProperties(1, { x: 0, y: 0, z: 0 }, moments, axes));
world.timestep = 0.01;
for (let i = 0; i < 100; i++) world.step();
const w = ['x', 'y', 'z'].map((axis) => body.angvel()[axis]);
const change = Math.max(...w.map((rate, i) => Math.abs(rate - [1, 2, 3][i])));
const text = w.map((rate) => rate.toFixed(4)).join(', ');
console.log(`moments 13, 5 and 10: after 1 s the rates 1, 2, 3 rad/s are ${text}: ${change < 1e-4 ? 'wrong' : 'right'}`);
