"""`ComputeMassProperties` replaces moments of 1e-6 kg m^2 by those of a small sphere; it keeps moments of 1e-4 kg m^2."""

import sys

from pxr import Gf, Usd, UsdPhysics

stage = Usd.Stage.Open(sys.argv[1])
base, factors = stage.GetPrimAtPath("/World/base"), []
for size in (1e-4, 1e-5, 1e-6):
    UsdPhysics.MassAPI(base).GetDiagonalInertiaAttr().Set(Gf.Vec3f(size, 2 * size, 2.5 * size))
    moments = UsdPhysics.RigidBodyAPI(base).ComputeMassProperties(lambda *_: UsdPhysics.MassInformation())[1]
    factors.append(min(moments) / size)
texts = [f"{factor:.3g} at {size:g} kg m^2" for factor, size in zip(factors, (1e-4, 1e-5, 1e-6))]
print(f"smallest moment over the one in the file: {', '.join(texts)}:", end=" ")
print("wrong" if max(abs(factor - 1) for factor in factors) > 1e-3 else "right")
