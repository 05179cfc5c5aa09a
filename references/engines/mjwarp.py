"""MuJoCo Warp on the CPU, in single precision, on a free joint or a ball joint at the fixed point.

Switched off: contacts and constraints (`<flag contact="disable" constraint="disable"/>`). Warp records a step once and
replays it; launched from Python, its kernels take a hundred times as long. They are compiled when a run is prepared, once in
the life of an environment, which takes a minute. MuJoCo Warp is made for thousands of worlds at once on a GPU: each of many
bodies has its own world.

Parameters
----------
integrator
    "Euler", "RK4", "implicit", "implicitfast" or "discrete", of which older versions do not have all.

References
----------
MuJoCo Warp, graph capture: https://mujoco.readthedocs.io/en/stable/mjwarp/index.html
Flags and integrators: https://mujoco.readthedocs.io/en/stable/XMLreference.html#option
Warp, `ScopedCapture`: https://nvidia.github.io/warp/
"""

from functools import partial

import numpy as np

from .shared import compile_models, record_warp, stepped

ENGINE = {
    "package": "mujoco-warp",
    "module": "mujoco_warp",
    "oldest": "3.10",
    "settings": {"integrator": "RK4"},
    "orders": {"Euler": 1, "RK4": 4, "implicit": 1, "implicitfast": 1, "discrete": 1},
    "precision": "f32",
    "fields": ("UniformGravity",),
    "descriptions": ("frame", "child", "damping"),
    "method_info": {
        "variants": ("Euler", "RK4", "implicit", "implicitfast", "discrete"),
        "many": ("RK4",),
        "as_installed": ("Euler",),
    },
}


def prepare(given):
    """Return a run of one body."""
    run_many = prepare_many([given])

    def run():
        return {name: samples[0] for name, samples in run_many().items()}

    run.loop = getattr(run_many, "loop", run_many)
    return run


def prepare_many(bodies):
    """Return a run of many bodies, each in its own world with its own rows in the model."""
    import mujoco_warp
    import warp

    given, count = bodies[0], len(bodies)
    warp.config.quiet = True
    with warp.ScopedDevice("cpu"):
        hosts, gravity, arrays = compile_models(bodies)
        model, data = mujoco_warp.put_model(hosts[0]), mujoco_warp.make_data(hosts[0], nworld=count)
        for name, rows in arrays.items():
            setattr(model, name, warp.array(rows.astype(np.float32), dtype=getattr(model, name).dtype))
        model.opt.gravity = warp.array(gravity.astype(np.float32), dtype=warp.vec3)
        mujoco_warp.step(model, data)
        step = record_warp(partial(mujoco_warp.step, model, data))
    qpos, qvel = data.qpos.numpy(), data.qvel.numpy()  # views of the engine's own arrays
    q0, w0 = np.array([body.q0 for body in bodies]), np.array([body.w0 for body in bodies])

    def begin():
        qpos[:, :-4], qpos[:, -4:], qvel[:, :-3], qvel[:, -3:] = 0, q0, 0, w0

    def convert(samples):
        return {name: values.swapaxes(0, 1) for name, values in samples.items()}

    run = stepped(given, begin, step, lambda: {"q": qpos[:, -4:], "w": qvel[:, -3:]}, convert)
    run.owners = data, model  # they own the memory of the views and the rows
    return run
