"""Newton: its solvers on one body, in single precision. Source: its documentation, Solvers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from conservative.card import Card
from conservative.scene import Scene

from ..environments.engine_method import EngineMethod, Orders
from ..environments.environment import Distribution

FREE_ONLY = {
    "SemiImplicit": "the joints of SolverSemiImplicit are springs, too stiff for such steps",
    "XPBD": "no settings of SolverXPBD were found with which its ball joint holds a body right",
}


@dataclass(frozen=True)
class Newton(EngineMethod):
    """Newton on the CPU, in single precision, with one of its solvers, on a free joint, or on a ball joint at the fixed point.

    Switched off: angular damping of `SolverSemiImplicit` and `SolverFeatherstone`, which is 0.05 by default, and contacts of
    `SolverMuJoCo`. `SolverKamino` solves with DVI on sparse matrices, as Newton's example `basic_dzhanibekov` has it: thirty
    times as fast as its default here, with the same motion. A step is recorded by Warp once and then replayed; from Python it
    takes a hundred times as long. `SolverVBD` alone is stepped from Python, as a record loses what it keeps from step to step,
    and with it all motion. Kernels are
    compiled when a run is prepared, once in the life of an environment: that takes from one to four minutes for each solver.

    Parameters
    ----------
    solver
        "SemiImplicit", "XPBD", "Featherstone", "VBD", "Kamino", or MuJoCo Warp inside Newton (`SolverMuJoCo`) with an
        integrator: "MuJoCo_euler", "MuJoCo_implicitfast" or "MuJoCo_rk4".
    as_installed
        Whether Newton's own defaults stay: damping, contacts, the solver inside Kamino.

    References
    ----------
    Solvers: https://newton-physics.github.io/newton/stable/api/newton_solvers.html
    Damping: https://newton-physics.github.io/newton/stable/api/_generated/newton.solvers.SolverSemiImplicit.html
    Its own spinning body: https://github.com/newton-physics/newton/blob/main/newton/examples/basic/example_basic_dzhanibekov.py
    """

    solver: str = "MuJoCo_rk4"
    as_installed: bool = False

    family: ClassVar[str] = "newton"
    precision: ClassVar[str] = "f32"
    takes_gravity: ClassVar[bool] = True
    # Versions before 1.8 build and step models in other ways. Bare `newton` lacks MuJoCo.
    distribution: ClassVar[Distribution] = Distribution("newton[sim]", "newton", oldest="1.8")
    orders: ClassVar[Orders] = {
        **{"SemiImplicit": 1, "XPBD": 1, "Featherstone": 1, "VBD": 1, "Kamino": 1},
        **{"MuJoCo_euler": 1, "MuJoCo_implicitfast": 1, "MuJoCo_rk4": 4},
    }
    card: ClassVar[Card] = Card(
        variants=(*orders, "SemiImplicit,as_installed=true"), as_installed=("SemiImplicit,as_installed=true",)
    )

    def unsupported(self, scene: Scene) -> str | None:
        return super().unsupported(scene) or (FREE_ONLY.get(self.solver) if scene.potential is not None else None)
