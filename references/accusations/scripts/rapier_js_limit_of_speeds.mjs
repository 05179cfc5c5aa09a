// Speeds above 400 m/s become 400 m/s, without a message.
import R from '@dimforge/rapier3d-compat';
await R.init();
function speed(metres) {
  const world = new R.World({ x: 0, y: 0, z: 0 });
  const body = world.createRigidBody(R.RigidBodyDesc.dynamic().setLinvel(metres, 0, 0).setCanSleep(false).setAdditionalMass(1));
  world.step();
  return body.linvel().x;
}
const speeds = [399, 401, 1000], found = speeds.map(speed), text = found.map((x) => x.toFixed(1)).join(', ');
const wrong = found.some((x, i) => Math.abs(x - speeds[i]) > 0.1);
console.log(`after one step, ${speeds.join(', ')} m/s are ${text}: ${wrong ? 'wrong' : 'right'}`);
