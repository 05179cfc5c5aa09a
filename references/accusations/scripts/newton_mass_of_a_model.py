"""Moments set in a finished model are ignored by `SolverMuJoCo` without `notify_model_changed`, without an error."""

import newton
import numpy as np
import warp as wp


def rates(moments, notify):
    builder = newton.ModelBuilder()
    builder.gravity = (0.0, 0.0, 0.0)
    body = builder.add_body(mass=1.0, inertia=wp.mat33(2.0, 0.0, 0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 4.0))
    builder.body_qd[body] = wp.spatial_vector(0.0, 0.0, 0.0, 1.0, 2.0, 3.0)
    model = builder.finalize(device="cpu")
    solver = newton.solvers.SolverMuJoCo(model, disable_contacts=True, use_mujoco_cpu=True)
    now, then = model.state(), model.state()
    newton.eval_ik(model, now, now.joint_q, now.joint_qd)
    model.body_inertia.assign(np.diag(moments).astype(np.float32)[None])
    if notify:
        solver.notify_model_changed(newton.ModelFlags.BODY_INERTIAL_PROPERTIES)
    for _ in range(100):
        solver.step(now, then, model.control(), None, 0.01)
        now, then = then, now
    return now.body_qd.numpy()[0, 3:]


old, silent, told = rates((2, 3, 4), False), rates((4, 3, 2), False), rates((4, 3, 2), True)
print(f"rates after 1 s with the old moments {old.round(3)}, new ones {silent.round(3)}, notified {told.round(3)}:", end=" ")
print("wrong" if abs(silent - told).max() > 1e-3 else "right")
