"""Ensembles of thousands of random bodies of one kind: all different, or many starts of one heavy top.

Body number i does not depend on the number of bodies. Bodies are drawn with NumPy's PCG64 from (seed, number of the kind):

* second moments about the principal axes 0.1 to 1, log-uniform, so that a mass distribution exists. The mean moment of inertia
  is 1 kg m^2 and the condition at most 5.5;
* principal axes and initial attitude: rotations uniform on the group, so inertias are full matrices;
* initial rates: normal, 2 rad/s along each axis, with a median of 3.2 rad/s;
* heavy tops: centre of mass in a uniform direction, weight times distance 1.8 to 12 N m, uniform;
* one body: the first body of these draws, weight times distance such that the motion lasts 20 characteristic times, the square
  root of the mean moment of inertia over weight times distance. Only initial attitudes and rates differ.
"""

from __future__ import annotations

import numpy as np

from conservative.attitude import Array, from_quaternion
from conservative.batch import Batch
from conservative.body import RigidBody
from conservative.check import choice
from conservative.potentials.uniform_gravity import UniformGravity
from conservative.scene import Scene

KINDS = ("heavy_tops", "free_bodies", "one_body")
DURATION = 12.0
"""Length of the motion, s."""
RATE = 2.0
"""Standard deviation of each initial rate, rad/s."""
MOMENT = (1.8, 12.0)
"""Smallest and largest weight times distance, N m."""


def draw(kind: str, n: int, seed: int = 0) -> Batch:
    """Return the first n bodies of a seed, of one of the `KINDS`."""
    choice("kind", kind, KINDS)
    tables = [np.random.Generator(np.random.PCG64((seed, KINDS.index(kind), column))) for column in range(6)]
    second = 10 ** -tables[0].random((n, 3))
    J = second.sum(axis=1, keepdims=True) - second
    J /= J.mean(axis=1, keepdims=True)
    normal = (table.standard_normal((n, 4)) for table in tables[1:3])
    R_BP, R_WB0 = (from_quaternion(q / np.linalg.norm(q, axis=1)[:, None]) for q in normal)
    w_WB_B0 = RATE * tables[3].standard_normal((n, 3))
    inertia = (R_BP * J[:, None]) @ R_BP.swapaxes(1, 2)
    inertia = (inertia + inertia.swapaxes(1, 2)) / 2
    parameters: dict[str, Array] = {}
    potential = None
    if kind != "free_bodies":  # the weight is 1 N
        direction, (low, high) = tables[4].standard_normal((n, 3)), MOMENT
        length = (20 / DURATION) ** 2 if kind == "one_body" else low + (high - low) * tables[5].random(n)
        parameters["com_B"] = direction * (length / np.linalg.norm(direction, axis=1))[:, None]
        potential = UniformGravity(1.0, parameters["com_B"][0])
    first = Scene(kind, RigidBody(inertia[0]), R_WB0[0], w_WB_B0[0], DURATION, potential, group="random", source="ours")
    return Batch(first, R_WB0, w_WB_B0, None, {}) if kind == "one_body" else Batch(first, R_WB0, w_WB_B0, inertia, parameters)
