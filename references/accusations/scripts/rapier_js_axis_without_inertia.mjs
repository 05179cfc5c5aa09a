// The angular velocity about an axis without inertia becomes 0, except if this is an axis of the world (issue 587).
import R from '@dimforge/rapier3d-compat';
await R.init();
function speed(moments, q, w) {
  const world = new R.World({ x: 0, y: 0, z: 0 }), identity = { x: 0, y: 0, z: 0, w: 1 };
  const [x, y, z] = moments, settings = R.RigidBodyDesc.dynamic().setRotation(q).setAngvel(w).setCanSleep(false);
  const body = world.createRigidBody(settings.setAdditionalMassProperties(1, { x: 0, y: 0, z: 0 }, { x, y, z }, identity));
  world.step();
  return Math.hypot(body.angvel().x, body.angvel().y, body.angvel().z);
}
const turned = { x: 0.2, y: -0.4, z: 0.1, w: Math.sqrt(0.79) }, { x, y, z, w } = turned;
const axis = { x: 8 * (x * z + w * y), y: 8 * (y * z - w * x), z: 4 * (1 - 2 * (x * x + y * y)) };
const rod = speed([1, 1, 0], turned, axis), needle = speed([1, 1, 1e-6], turned, axis);
const along_z = speed([1, 1, 0], { x: 0, y: 0, z: 0, w: 1 }, { x: 0, y: 0, z: 4 });
const numbers = `${rod.toFixed(3)}, with a moment of 1e-6 ${needle.toFixed(3)}, along the world's z axis ${along_z.toFixed(3)}`;
console.log(`after one step 4 rad/s about an axis without inertia are ${numbers}: ${Math.abs(rod - 4) > 1e-3 ? 'wrong' : 'right'}`);
