/* Havok, its build for Babylon.js, in single precision. It has no gyroscopic motion: without a torque the rates do not change.
 * A body about a fixed point has a constraint to a static body that locks translations. Unless `as_installed`, damping,
 * sleeping and limits of velocities are off. https://doc.babylonjs.com/features/featuresDeepDive/physics/havokPlugin
 */
import { readFileSync } from 'fs';

export const ENGINE = {"package": "@babylonjs/havok", "rate_limit": 100.0};
export const start = (havok, url) => havok({ wasmBinary: readFileSync(new URL('HavokPhysics.wasm', url)) });

export function build({ mass, gravity, com, moments_com, q_com, q0, w0_W, dt, free, as_installed, v0 }, H, own) {
  const origin = [0, 0, 0], anchor = [origin, [1, 0, 0], [0, 1, 0]], last = ([s, ...v]) => [...v, s];
  const call = (name, ...values) => {
    const [result, value] = [H[`HP_${name}`](...values)].flat();
    if (result !== H.Result.RESULT_OK) throw new Error(`HP_${name} failed`);
    return value;
  };
  const make = (kind, name = 'Create', ...values) => {
    const made = call(`${kind}_${name}`, ...values);
    own(() => call(`${kind}_Release`, made));
    return made;
  };
  const set = (kind, made, values) => {
    for (const [name, each] of Object.entries(values)) call(`${kind}_Set${name}`, made, ...each);
  };
  const world = make('World'), body = make('Body'), support = make('Body'), { DYNAMIC, STATIC } = H.MotionType;
  set('World', world, { Gravity: [[0, 0, -gravity]] });
  const moments = moments_com.map((moment) => moment / mass); // of a mass of 1
  const shape = [make('Shape', 'CreateSphere', com, 0.05)], inertia = [[com, mass, moments, last(q_com)]];
  set('Body', body, { Shape: shape, MotionType: [DYNAMIC], MassProperties: inertia, QTransform: [[origin, last(q0)]] });
  if (!as_installed) {
    set('World', world, { SpeedLimit: [1e6, 1e6] });
    set('Body', body, { LinearDamping: [0], AngularDamping: [0], ActivationControl: [H.ActivationControl.ALWAYS_ACTIVE] });
  }
  set('Body', support, { MotionType: [STATIC] });
  for (const each of [body, support]) {
    call('World_AddBody', world, each, false);
    own(() => call('World_RemoveBody', world, each));
  }
  set('Body', body, { LinearVelocity: [v0], AngularVelocity: [w0_W] });
  const joint = make('Constraint'), { ConstraintAxis: axes, ConstraintAxisLimitMode: modes } = H;
  set('Constraint', joint, { ParentBody: [support], ChildBody: [body], AnchorInParent: anchor, AnchorInChild: anchor });
  for (const name of ['X', 'Y', 'Z']) set('Constraint', joint, { AxisMode: [axes[`LINEAR_${name}`], modes.LOCKED] });
  set('Constraint', joint, { Enabled: [!free] });
  const read = () => {
    const [x, y, z, s] = call('Body_GetOrientation', body);
    return [[s, x, y, z], call('Body_GetAngularVelocity', body)];
  };
  return { step: () => H.HP_World_Step(world, dt), read };
}
