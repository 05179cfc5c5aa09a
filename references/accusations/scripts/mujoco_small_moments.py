"""URDF: inertias of about 1e-15 kg m^2 are refused."""

import sys

import mujoco

text = open(sys.argv[1]).read().replace("<link", '<mujoco><compiler fusestatic="false"/></mujoco><link', 1)
old, sizes = 'ixx="1e-15" iyy="2e-15" izz="2.5e-15" ixy="0.0" ixz="0.0" iyz="0.0"', ("1e-13", "1e-14", "1e-15")


def refused(size, xx, yy, zz, xy, xz, yz):
    values = {"xx": xx, "yy": yy, "zz": zz, "xy": xy, "xz": xz, "yz": yz}
    try:
        mujoco.MjModel.from_xml_string(
            text.replace(old, " ".join(f'i{name}="{value * float(size)!r}"' for name, value in values.items()))
        )
    except ValueError:
        return True
    return False


diagonal = [size for size in sizes if refused(size, 1, 2, 2.5, 0, 0, 0)]
products = [size for size in sizes if refused(size, 1.9, 1.8, 1.8, -0.26, -0.2, -0.69)]
texts = [" and ".join(refusals) or "none" for refusals in (diagonal, products)]
print(f"of {', '.join(sizes)} kg m^2 it refuses {texts[0]} on the diagonal, {texts[1]} with products:", end=" ")
print("wrong" if diagonal or products else "right")
