"""`globalScaling` scales the size of a body and keeps its mass, but does not scale an inertia of the file."""

import sys

import pybullet as p

p.connect(p.DIRECT)


def load(**options):
    p.resetSimulation()
    mass, _, moments = p.getDynamicsInfo(p.loadURDF(sys.argv[1], **options), -1)[:3]
    return mass, moments[0]


(mass, shape), (scaled_mass, scaled_shape) = load(), load(globalScaling=2.0)
file, scaled_file = (load(flags=p.URDF_USE_INERTIA_FROM_FILE, globalScaling=size)[1] for size in (1.0, 2.0))
mass, shape, file = scaled_mass / mass, scaled_shape / shape, scaled_file / file
print(f"factors for a size of 2: mass {mass:.3g}, inertia of a shape {shape:.3g}, inertia of the file {file:.3g}:", end=" ")
print("wrong" if abs(file / (4 * mass) - 1) > 0.05 else "right")  # the shape has a margin
