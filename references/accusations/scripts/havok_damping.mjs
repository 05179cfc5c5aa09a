// As installed, damping takes energy from a free brick.
import { readFileSync } from 'fs';
import { fileURLToPath } from 'url';
import start from '@babylonjs/havok';
const place = fileURLToPath(import.meta.resolve('@babylonjs/havok')).replace(/[^/]*$/, '');
const H = await start({ wasmBinary: readFileSync(`${place}HavokPhysics.wasm`) });
function energy_left(off) {
  const world = H.HP_World_Create()[1], body = H.HP_Body_Create()[1], moments = [13, 5, 10];
  H.HP_World_SetGravity(world, [0, 0, 0]);
  H.HP_Body_SetShape(body, H.HP_Shape_CreateSphere([0, 0, 0], 0.05)[1]);
  H.HP_Body_SetMotionType(body, H.MotionType.DYNAMIC);
  H.HP_Body_SetMassProperties(body, [[0, 0, 0], 1, moments, [0, 0, 0, 1]]);
  if (off) H.HP_Body_SetAngularDamping(body, 0);
  H.HP_World_AddBody(world, body, false);
  H.HP_Body_SetAngularVelocity(body, [0, 0.05, 10]);
  const energy = () => { // of the rates about the axes of the body
    const [x, y, z, s] = H.HP_Body_GetOrientation(body)[1], w = H.HP_Body_GetAngularVelocity(body)[1], axes = [
      [1 - 2 * (y * y + z * z), 2 * (x * y + s * z), 2 * (x * z - s * y)],
      [2 * (x * y - s * z), 1 - 2 * (x * x + z * z), 2 * (y * z + s * x)],
      [2 * (x * z + s * y), 2 * (y * z - s * x), 1 - 2 * (x * x + y * y)],
    ];
    return axes.reduce((sum, axis, i) => sum + moments[i] / 2 * axis.reduce((rate, part, j) => rate + part * w[j], 0) ** 2, 0);
  };
  const first = energy();
  for (let i = 0; i < 600; i++) H.HP_World_Step(world, 0.01);
  return energy() / first;
}
const [rest, undamped] = [energy_left(false), energy_left(true)].map((ratio) => ratio.toFixed(3));
console.log(`energy after 6 s over energy at the start: ${rest}, without damping ${undamped}: ${rest < 0.99 ? 'wrong' : 'right'}`);
