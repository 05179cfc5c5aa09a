"""`SolverSemiImplicit` and `SolverXPBD` use moments set in a finished model with the old inverses, also when notified."""

import newton
import numpy as np
import warp as wp


def rates(name, built, moments):
    builder = newton.ModelBuilder()
    builder.gravity = (0.0, 0.0, 0.0)
    body = builder.add_body(mass=1.0, inertia=wp.mat33(*np.diag(built).astype(float).ravel()))
    builder.body_qd[body] = wp.spatial_vector(0.0, 0.0, 0.0, 1.0, 2.0, 3.0)
    model = builder.finalize(device="cpu")
    solver = getattr(newton.solvers, f"Solver{name}")(model, angular_damping=0.0)
    now, then = model.state(), model.state()
    newton.eval_ik(model, now, now.joint_q, now.joint_qd)
    model.body_inertia.assign(np.diag(moments).astype(np.float32)[None])
    solver.notify_model_changed(newton.ModelFlags.BODY_INERTIAL_PROPERTIES)
    for _ in range(100):
        now.clear_forces()
        solver.step(now, then, model.control(), None, 0.01)
        now, then = then, now
    return now.body_qd.numpy()[0, 3:]


old, new, errors = (2, 3, 4), (4, 3, 2), {}
for name in ("SemiImplicit", "XPBD"):
    errors[name] = abs(rates(name, old, new) - rates(name, new, new)).max()
texts = [f"{error:.3f} rad/s with {name}" for name, error in errors.items()]
print(f"rates after 1 s differ from those of a model built with the moments by {', '.join(texts)}:", end=" ")
print("wrong" if max(errors.values()) > 1e-3 else "right")
