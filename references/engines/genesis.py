"""Genesis's rigid solver on the CPU, on the free joint of a body from an MJCF file, stepped from Python (`scene.step`).

Its kernels are compiled when a run is prepared, once in the life of an environment: with the import, this takes one to four
minutes. One of its packages, pygltflib, has no wheel: `conservative engines install genesis --allow-build`. The environment
takes 8 GB, nearly all of it PyTorch for GPUs. Switched off: collisions and constraints (`enable_collision`,
`disable_constraint`).

Parameters
----------
integrator
    "Euler", "implicitfast" or "approximate_implicitfast", which is Genesis's default.
precision
    "f64" or "f32", which is Genesis's default (`gs.init(precision="32")`). A process has one precision.
as_installed
    True if collisions and constraints stay on.

References
----------
RigidOptions: https://github.com/Genesis-Embodied-AI/genesis-world/blob/main/genesis/options/solvers.py
Precision, `gs.init`; RigidEntity: https://genesis-world.readthedocs.io
"""

from functools import partial
from pathlib import Path

import numpy as np

from .shared import stepped, write_mjcf

AS_INSTALLED = "approximate_implicitfast,precision=f32,as_installed=true"
ENGINE = {
    "package": "genesis-world",
    "module": "genesis",
    "requirements": ("torch",),
    "oldest": "1.4",
    "settings": {"integrator": "implicitfast", "precision": "f64", "as_installed": False},
    "orders": {"Euler": 1, "implicitfast": 2, "approximate_implicitfast": 2},
    "method_info": {
        "variants": ("Euler", "implicitfast", "approximate_implicitfast", "implicitfast,precision=f32", AS_INSTALLED),
        "as_installed": (AS_INSTALLED,),
    },
}


def prepare(given):
    """Return a run of one body, with its kernels compiled."""
    import genesis as gs

    if not getattr(gs, "_initialized", False):  # once per process
        gs.init(backend=gs.cpu, precision=given.precision[1:], logging_level="error")
    scene = gs.Scene(
        sim_options=gs.options.SimOptions(dt=given.dt, gravity=(0, 0, 0)),
        rigid_options=gs.options.RigidOptions(
            integrator=getattr(gs.integrator, given.integrator),
            enable_collision=given.as_installed,
            disable_constraint=not given.as_installed,
        ),
        show_viewer=False,
    )
    file = Path("body.xml").resolve()
    # Genesis requires a shape. This one has no contacts.
    file.write_text(write_mjcf(given, shape='<geom type="sphere" size="0.1" contype="0" conaffinity="0"/>'), encoding="utf-8")
    body = scene.add_entity(gs.morphs.MJCF(file=str(file)))
    scene.build()
    place, rates = np.array([0, 0, 0, *given.q0]), np.array([0, 0, 0, *given.w0])
    step = partial(scene.step, update_visualizer=False)
    step()

    def begin():
        scene.reset()
        body.set_qpos(place)
        body.set_dofs_velocity(rates)

    def read():
        return {"q": body.get_quat().numpy().ravel(), "w_W": body.get_ang().numpy().ravel()}

    return stepped(given, begin, step, read)
