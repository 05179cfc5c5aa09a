"""MuJoCo's five integrators on one body, in this process. Other versions run in environments: `mujoco@3.6.0:RK4`."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from threading import Lock
from types import SimpleNamespace
from typing import Any, ClassVar

from conservative.batch import Batch
from conservative.card import Card, Maker
from conservative.check import choice, positive_integer
from conservative.errors import Unsupported
from conservative.grid import Grid
from conservative.method import Method, Role, Run
from conservative.methods.many import Block, RunMany
from conservative.methods.units import in_own_units
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from ..engine import load, principal_axes, unsupported_reason, version
from ..environments.plain_numbers import EngineSamples, ManySamples, describe, take_axes
from .mujoco_versions import INTEGRATORS, prepare_many_with, prepare_with


@dataclass(frozen=True)
class MuJoCo(Method):
    """MuJoCo with one of its integrators, in its own loop.

    The loop is `mujoco.rollout` where samples are close and `mj_step(m, d, nstep)` from sample to sample where they are not.
    The body's principal axes are MuJoCo's body axes; everything the motion does not need is switched off. A free body has a
    free joint at its centre of mass, as MuJoCo's users have it; a body in a field has a ball joint at its fixed point.

    Parameters
    ----------
    integrator
        "Euler", "RK4", "implicit", "implicitfast" or "discrete".
    threads
        Threads of `mujoco.rollout` where many bodies run at once, each with a model of its own.

    Raises
    ------
    BadInput
        The integrator is unknown, or threads is not an integer of 1 or more.
    MissingEngine
        MuJoCo is not installed.
    """

    integrator: str = "RK4"
    threads: int = 1

    family: ClassVar[str] = "mujoco"
    role: ClassVar[Role] = Role.ENGINE
    card: ClassVar[Card] = Card(
        variants=INTEGRATORS,
        report=("Euler", ""),
        suite=("Euler", "RK4"),
        many=("RK4", "RK4,threads=2", "Euler", "implicit", "implicitfast", "discrete"),
        pictures=("Euler", "RK4", "implicit"),
        as_installed=("Euler",),
        colour="vermilion",
    )

    def __post_init__(self) -> None:
        choice("integrator", self.integrator, INTEGRATORS)
        positive_integer("threads", self.threads)
        version("mujoco", "MuJoCo")

    @property
    def maker(self) -> Maker:
        return Maker("mujoco", version("mujoco", "MuJoCo"))

    @property
    def setting_parts(self) -> dict[str, str]:
        return {"integrator": self.integrator} | ({} if self.threads == 1 else {"threads": f"threads={self.threads}"})

    @property
    def order(self) -> int:
        return 4 if self.integrator == "RK4" else 1

    def unsupported(self, scene: Scene) -> str | None:
        return unsupported_reason(scene)

    @in_own_units
    def prepare(self, scene: Scene, grid: Grid) -> Run:
        """Compile MuJoCo's model. Raises `Unsupported` for an integrator that this version does not have."""
        mj = load("mujoco", "mujoco", "MuJoCo")
        axes = principal_axes(scene)
        samples = EngineSamples(axes, grid, self.label)
        try:
            march = prepare_with(mj, SimpleNamespace(integrator=self.integrator, **describe(axes, grid)))
        except NotImplementedError as error:  # an integrator that another version has
            raise Unsupported("method", self.name, f"what {self.label} supports ({error})") from None

        def run() -> Trajectory:
            with _quiet(mj):
                found = march()
            return samples.trajectory(found)

        return run

    def prepare_many(self, bodies: Batch, grid: Grid) -> RunMany | None:
        mj = load("mujoco", "mujoco", "MuJoCo")
        axes = take_axes(bodies, grid, self.unsupported)
        if axes is None or not hasattr(mj.mjtIntegrator, f"mjINT_{self.integrator.upper()}"):
            return None
        samples = ManySamples(axes, grid)
        march = prepare_many_with(mj, [SimpleNamespace(**asdict(self), **describe(each, grid)) for each in axes])

        def run() -> Block:
            with _quiet(mj):
                return samples.trajectory(march())

        return run


class _Quiet:
    """Keeps MuJoCo from writing its warnings to a file in the working directory; they are read from the data instead.

    The first of the runs that overlap puts the user's own handler aside, the last one puts it back.
    """

    def __init__(self) -> None:
        self._lock, self._runs, self._before = Lock(), 0, None

    @contextmanager
    def __call__(self, mj: Any) -> Iterator[None]:
        with self._lock:
            if self._runs == 0:
                self._before = mj.get_mju_user_warning()
                mj.set_mju_user_warning(lambda message: None)
            self._runs += 1
        try:
            yield
        finally:
            with self._lock:
                self._runs -= 1
                if self._runs == 0:
                    mj.set_mju_user_warning(self._before)


_quiet = _Quiet()
