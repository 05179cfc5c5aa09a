"""With `RK4`, errors of the attitude fall with the square of the step."""

import jax
import mujoco
import numpy as np
from mujoco import mjx

jax.config.update("jax_enable_x64", True)
TEXT = """<mujoco><option integrator="RK4" gravity="0 0 0"><flag contact="disable" constraint="disable"/></option>
<worldbody><body><freejoint/><inertial mass="1" pos="0 0 0" diaginertia="13 5 10"/></body></worldbody></mujoco>"""
model = mjx.put_model(mujoco.MjModel.from_xml_string(TEXT))
start = mjx.make_data(model)
start = start.replace(qvel=start.qvel.at[3:].set(np.array([1.0, 2.0, 3.0])))


@jax.jit
def attitude(steps):  # after 1 s
    stepped = model.replace(opt=model.opt.replace(timestep=1 / steps))
    return jax.lax.fori_loop(0, steps, lambda _, data: mjx.step(stepped, data), start).qpos[3:]


best, counts = np.array(attitude(12800)), (25, 50, 100, 200)
errors = np.array([2 * np.linalg.norm(attitude(steps) - best) for steps in counts])
order = np.log2(errors[:-1] / errors[1:]).min()
texts = [f"{error:.1e} rad in {steps} steps" for error, steps in zip(errors, counts)]
print(f"error after 1 s: {', '.join(texts)}, order {order:.1f}:", "wrong" if order < 3 else "right")
