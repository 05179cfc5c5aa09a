/* MuJoCo's official build for JavaScript, in double precision, with the models of mujoco.py; its loop is in JavaScript. */
import { readdirSync, readFileSync } from 'fs';
import { dirname, join } from 'path';

export const ENGINE = {
  "package": "@mujoco/mujoco", "precision": "f64",
  "settings": {"integrator": "RK4"}, "orders": {"Euler": 1, "RK4": 2, "implicit": 1, "implicitfast": 1},
  "method_info": {"variants": ["Euler", "RK4", "implicit", "implicitfast"], "as_installed": ["Euler"]},
  "formats": ["urdf", "mjcf"]
};
export const start = (mujoco) => mujoco();

export function build({ mass, gravity, com, moments_com: [a, b, c], q_com, q0, w0, dt, free, integrator }, M, own) {
  const moments = [Math.min(a, b + c), Math.min(b, c + a), Math.min(c, a + b)]; // planar bodies exceed it by a rounding unit
  const model = M.MjModel.from_xml_string(`<mujoco><option timestep="${dt}" integrator="${integrator}"
    gravity="0 0 ${-gravity}"><flag contact="disable" constraint="disable" autoreset="disable"/></option><worldbody><body>
    <joint type="${free ? 'free' : 'ball'}"/><inertial mass="${mass}" pos="${com.join(' ')}" quat="${q_com.join(' ')}"
    diaginertia="${moments.join(' ')}"/></body></worldbody></mujoco>`), data = new M.MjData(model);
  own(() => model.delete());
  own(() => data.delete());
  data.qpos.set(q0, model.nq - 4);
  data.qvel.set(w0, model.nv - 3);
  return { step: () => M.mj_step(model, data), read: () => [data.qpos.slice(-4), data.qvel.slice(-3)], rates: 'w' };
}

export function load(path, M, own) { // as in model_files/loaders.py
  const take = (object) => (own(() => object.delete()), object);
  const text = readFileSync(path, 'utf8'), folder = dirname(path), files = take(new M.MjVFS());
  for (const name of readdirSync(folder).filter((each) => text.includes(`"${each}"`))) { // meshes
    files.addBuffer(name, readFileSync(join(folder, name)));
  }
  const spec = take(M.parseXMLString(text, files)), { mjOBJ_BODY, mjOBJ_JOINT } = M.mjtObj;
  if (!M.mjs_firstElement(spec, mjOBJ_JOINT)) {
    M.mjs_addFreeJoint(M.mjs_asBody(M.mjs_firstChild(M.mjs_findBody(spec, 'world'), mjOBJ_BODY, 0)));
  }
  spec.option.gravity.fill(0);
  spec.option.disableflags = M.mjtDisableBit.mjDSBL_CONTACT.value;
  const model = take(M.mj_compile(spec, files)), data = take(new M.MjData(model));
  data.qpos.set([0, 0, 0, 1, 0, 0, 0]);
  return (velocity, force) => {
    data.qvel.set(velocity);
    data.qfrc_applied.set(force);
    M.mj_forward(model, data);
    return [...data.qacc];
  };
}
