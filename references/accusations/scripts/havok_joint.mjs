// A body on a joint moves otherwise in other units of time, also without damping and sleep.
import { readFileSync } from 'fs';
import { fileURLToPath } from 'url';
import start from '@babylonjs/havok';
const place = fileURLToPath(import.meta.resolve('@babylonjs/havok')).replace(/[^/]*$/, '');
const H = await start({ wasmBinary: readFileSync(`${place}HavokPhysics.wasm`) }), origin = [0, 0, 0], axes = [[1, 0, 0], [0, 1, 0]];
function rates(unit) { // after 300 steps, in radians per unit of time
  const world = H.HP_World_Create()[1], body = H.HP_Body_Create()[1], support = H.HP_Body_Create()[1], centre = [0, 0, 0.2];
  H.HP_World_SetGravity(world, [0, 0, -9.81 / unit ** 2]);
  H.HP_World_SetSpeedLimit(world, 1e6, 1e6);
  H.HP_Body_SetShape(body, H.HP_Shape_CreateSphere(centre, 0.05)[1]);
  H.HP_Body_SetMotionType(body, H.MotionType.DYNAMIC);
  H.HP_Body_SetMotionType(support, H.MotionType.STATIC);
  H.HP_Body_SetMassProperties(body, [centre, 1, [2.1, 3.3, 4.2], [0, 0, 0, 1]]);
  for (const name of ['LinearDamping', 'AngularDamping']) H[`HP_Body_Set${name}`](body, 0);
  H.HP_Body_SetActivationControl(body, H.ActivationControl.ALWAYS_ACTIVE);
  for (const each of [body, support]) H.HP_World_AddBody(world, each, false);
  H.HP_Body_SetAngularVelocity(body, [0.9 / unit, -1.1 / unit, 3 / unit]);
  H.HP_Body_SetLinearVelocity(body, [-0.22 / unit, -0.18 / unit, 0]);
  const joint = H.HP_Constraint_Create()[1], { ConstraintAxis: linear, ConstraintAxisLimitMode: modes } = H;
  H.HP_Constraint_SetParentBody(joint, support);
  H.HP_Constraint_SetChildBody(joint, body);
  for (const name of ['Parent', 'Child']) H[`HP_Constraint_SetAnchorIn${name}`](joint, origin, ...axes);
  for (const name of ['X', 'Y', 'Z']) H.HP_Constraint_SetAxisMode(joint, linear[`LINEAR_${name}`], modes.LOCKED);
  H.HP_Constraint_SetEnabled(joint, true);
  for (let i = 0; i < 300; i++) H.HP_World_Step(world, 0.01 * unit);
  return H.HP_Body_GetAngularVelocity(body)[1].map((rate) => rate * unit);
}
const usual = rates(1), units = [0.1, 10], found = units.map(rates);
const errors = found.map((rate) => Math.max(...rate.map((x, i) => Math.abs(x - usual[i]))));
const text = units.map((unit, i) => `${errors[i].toFixed(3)} in units of ${unit} s`).join(', ');
console.log(`difference of the rates after 3 units of time: ${text}: ${Math.max(...errors) > 0.01 ? 'wrong' : 'right'}`);
