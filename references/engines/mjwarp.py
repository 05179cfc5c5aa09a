"""MuJoCo Warp on the CPU, in single precision, on a free joint or a ball joint at the fixed point.

Switched off: contacts and constraints (`<flag contact="disable" constraint="disable"/>`). Warp records a step once and
replays it; launched from Python, its kernels take a hundred times as long. They are compiled when a run is prepared, once in
the life of an environment, which takes a minute. MuJoCo Warp is made for thousands of worlds at once on a GPU: each of many
bodies has its own world.

Parameters
----------
integrator
    "Euler", "RK4" or "implicitfast".

References
----------
MuJoCo Warp, graph capture: https://mujoco.readthedocs.io/en/stable/mjwarp/index.html
Flags and integrators: https://mujoco.readthedocs.io/en/stable/XMLreference.html#option
Warp, `ScopedCapture`: https://nvidia.github.io/warp/
"""

from functools import partial

import numpy as np

ENGINE = {
    "package": "mujoco-warp",
    "module": "mujoco_warp",
    "oldest": "3.10",
    "settings": {"integrator": "RK4"},
    "orders": {"Euler": 1, "RK4": 4, "implicitfast": 1},
    "precision": "f32",
    "gravity": True,
    "card": {
        "variants": ("Euler", "RK4", "implicitfast"),
        "many": ("RK4",),
        "as_installed": ("Euler",),
    },
}

PER_BODY = ("body_mass", "body_subtreemass", "body_inertia", "body_ipos", "body_iquat", "body_invweight0", "dof_invweight0")
"""Parts of the model that depend on the body, apart from gravity."""


def prepare(given):
    """Return a run of one body."""
    run_many = prepare_many([given])

    def run():
        return {name: samples[0] for name, samples in run_many().items()}

    return run


def prepare_many(bodies):
    """Return a run of many bodies, each in its own world with its own rows in the model.

    A step is recorded once and then replayed, as MuJoCo Warp's documentation advises: from Python it takes a hundred times as
    long.
    """
    import mujoco
    import mujoco_warp
    import warp

    given, count = bodies[0], len(bodies)
    warp.config.quiet = True
    with warp.ScopedDevice("cpu"):
        hosts = [_model(mujoco, body) for body in bodies]
        model, data = mujoco_warp.put_model(hosts[0]), mujoco_warp.make_data(hosts[0], nworld=count)
        for name in PER_BODY:
            rows = np.array([getattr(host, name) for host in hosts])
            setattr(model, name, warp.array(rows.astype(np.float32), dtype=getattr(model, name).dtype))
        gravity = np.array([host.opt.gravity for host in hosts], np.float32)
        model.opt.gravity = warp.array(gravity, dtype=warp.vec3)
        mujoco_warp.step(model, data)
        step = _record(warp, partial(mujoco_warp.step, model, data))
    qpos, qvel = data.qpos.numpy(), data.qvel.numpy()  # views of the engine's own arrays
    q0, w0 = np.array([body.q0 for body in bodies]), np.array([body.w0 for body in bodies])

    def run():
        qpos[:, :-4], qpos[:, -4:], qvel[:, :-3], qvel[:, -3:] = 0, q0, 0, w0
        q, w = np.empty((count, len(given.steps), 4)), np.empty((count, len(given.steps), 3))
        for sample, n_steps in enumerate(np.diff(given.steps, prepend=0).tolist()):
            for _ in range(n_steps):
                step()
            q[:, sample], w[:, sample] = qpos[:, -4:], qvel[:, -3:]
        return {"q": q, "w": w}

    run.owners = data, model  # of the views and the rows
    return run


def _record(warp, step):
    """Return a function that replays a step; the step itself if this version of Warp does not record on the CPU."""
    try:
        with warp.ScopedCapture() as capture:
            step()
    except RuntimeError:
        return step
    return partial(warp.capture_launch, capture.graph)


def _model(mujoco, given):
    # MuJoCo refuses moments of a planar body that exceed the sum of the others by a rounding unit.
    moments = np.minimum(given.moments_com, np.roll(given.moments_com, 1) + np.roll(given.moments_com, 2))
    inertial = {"pos": given.com, "quat": given.q_com, "diaginertia": moments}
    attributes = " ".join(f'{name}="{" ".join(map(repr, value.tolist()))}"' for name, value in inertial.items())
    return mujoco.MjModel.from_xml_string(f"""
        <mujoco>
          <option gravity="0 0 {-given.gravity!r}" integrator="{given.integrator}" timestep="{given.dt!r}">
            <flag contact="disable" constraint="disable"/>
          </option>
          <worldbody>
            <body>
              <joint type="{"free" if given.free else "ball"}"/><inertial mass="{given.mass!r}" {attributes}/>
            </body>
          </worldbody>
        </mujoco>""")
