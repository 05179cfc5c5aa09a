"""heyoka: Taylor integration at any tolerance, on the formulation that suits it. Source: Biscani & Izzo (2021)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any, ClassVar

import numpy as np

from conservative.attitude import Array
from conservative.batch import Batch
from conservative.card import Card, Maker
from conservative.check import choice, describe, finite_number, positive_integer
from conservative.errors import BadInput
from conservative.grid import Grid
from conservative.method import Method, Role, Run
from conservative.methods.many import RunMany
from conservative.methods.units import SI, find_units, in_own_units
from conservative.potentials.turning import static_part
from conservative.scene import Scene
from conservative.trajectory import Counters, Trajectory

from ..engine import STEP_LIMIT, limit_reason, pace_reason, symmetric_axes, version
from ..heyoka_equations import accelerations, batches, forms, formulations

FRAMES = ("body", "non_spinning", "lean", "base_vectors")
_TOLERANCES_AND_FRAMES = tuple(f"tol={tol},frame={frame}" for frame in FRAMES[:3] for tol in ("1e-6", "1e-9", "1e-12", "1e-16"))

SMALLEST_TOL = 1e-20
"""A step of this tolerance has five terms more than one of 1e-16; smaller ones compile ever longer and gain nothing."""

WIDEST = 64
"""Bodies in a batch: more are refused, since each number of them is compiled for itself."""

# Up to here it is cheaper (5 to 20 %) not to keep the polynomials of the steps for evaluation between their ends.
_FEW_SAMPLES = 8


@dataclass(frozen=True)
class Heyoka(Method):
    """heyoka's adaptive Taylor integrator in double precision; dt is only the distance of samples.

    Compiled integrators are kept per formulation and tolerance, in heyoka's fastest mode (not compact, not high-accuracy, not
    vectorised within a step; `fast_math` where it gains, which is for base vectors). Samples are Taylor polynomials of steps,
    so they cost no accuracy. Fields are those of this package: `conservative.references.heyoka_equations.accelerations`.

    Parameters
    ----------
    tol
        Relative error of a step, 1e-20 to below 1. Values below 2.2e-16 are round-off with a term or two more.
    frame
        "body": quaternion and body rates in principal axes, which is what anybody would write. "non_spinning", for a body
        symmetric about an axis, free or in a field along it: quaternion of the frame that turns with l/J1, and world momentum
        l; spin in closed form afterwards. "base_vectors": rates and two rows of the rotation matrix, that along the field's
        axis and one at right angles; the second row is their cross product, and none is tidied up. "lean": the fewest products
        an evaluation that we found, the strongest opponent: rates and one angle (asymmetric free body); axis, momentum and one
        angle (symmetric top that stays away from one of the poles); otherwise the non-spinning frame where there is one, and
        base vectors where not. At equal error those take 17 to 30 % less time than "body" (measured in four fields).

    width, driver
        Of `prepare_many`, for the frames "body" and "base_vectors": how many bodies are in a batch, by default as many as
        heyoka recommends on this processor, and whether batches run in a loop ("batch") or in heyoka's function for
        ensembles, on one thread ("ensemble"). Other frames run one body at a time.

    Raises
    ------
    BadInput
        tol is out of range, the frame or the driver is unknown, or the width is not an integer of 1 to 64.
    MissingEngine
        heyoka is not installed.
    """

    tol: float = 1e-16
    frame: str = "body"
    width: int | None = None
    driver: str = "batch"

    family: ClassVar[str] = "heyoka"
    role: ClassVar[Role] = Role.ENGINE
    card: ClassVar[Card] = Card(
        # Base vectors are the cheapest frame to read if many samples are kept. Lean is often the same: one tolerance is enough.
        variants=(*_TOLERANCES_AND_FRAMES, "tol=1e-9,frame=base_vectors"),
        report=("", "frame=non_spinning", "frame=lean"),
        suite=("tol=1e-9", "tol=1e-16"),
        many=(
            *("frame=base_vectors", "frame=base_vectors,width=8", "frame=base_vectors,width=16"),
            *("frame=base_vectors,driver=ensemble", "frame=lean"),
        ),
        colour="green",
        time_dependent=True,
    )

    def __post_init__(self) -> None:
        allowed = f"a number above 0, from {SMALLEST_TOL:g}, and below 1"
        if not SMALLEST_TOL <= finite_number("tol", self.tol, allowed) < 1:
            raise BadInput("tol", describe(self.tol), allowed)
        choice("frame", self.frame, FRAMES)
        choice("driver", self.driver, tuple(batches.MARCHES))
        if self.width is not None and not 1 <= positive_integer("width", self.width) <= WIDEST:
            raise BadInput("width", describe(self.width), f"an integer from 1 to {WIDEST}, or None")
        version("heyoka", "heyoka")

    @property
    def maker(self) -> Maker:
        return Maker("heyoka", version("heyoka", "heyoka"))

    @property
    def setting_parts(self) -> dict[str, str]:
        parts = {"tol": f"tol={self.tol:g}", "frame": self.frame}
        if self.width:
            parts["width"] = f"width={self.width}"
        return parts if self.driver == "batch" else parts | {"driver": self.driver}

    @property
    def order(self) -> None:
        return None

    def unsupported(self, scene: Scene) -> str | None:
        potential = static_part(scene.potential)
        if potential is not None and type(potential) not in accelerations.READERS:
            kind, table = type(potential).__name__, f"{accelerations.__name__}.READERS"
            return f"no heyoka expressions for {kind}; add them to {table}"
        if self.frame == "non_spinning" and symmetric_axes(scene) is None:
            return "a non-spinning frame needs a body symmetric about an axis, free or with its centre of mass on that axis"
        return None

    @in_own_units
    def prepare(self, scene: Scene, grid: Grid) -> Run:
        problem = getattr(formulations, self.frame)(scene)
        integrators, label = forms.compile_double(problem.form, self.tol, problem.fast_math), self.label
        propagate, t = _from_sample_to_sample if grid.n_samples <= _FEW_SAMPLES else _over_grid, grid.t

        @cache
        def find_reason() -> str:  # once, so that repeated runs, which are timed, do not pay for it
            with integrators.borrow() as integrator:
                _begin(integrator, problem)
                return pace_reason(scene, integrator, float(t[-1]))

        def run() -> Trajectory:
            reason = find_reason()
            with integrators.borrow() as integrator:
                _begin(integrator, problem)
                states, steps, reason = (problem.start[None], 0, reason) if reason else propagate(integrator, t)
            R_WF, w = problem.readout(t[: len(states)], states)
            return problem.axes.trajectory(grid, label, R_WF, w, Counters(steps), reason)

        return run

    def prepare_many(self, bodies: Batch, grid: Grid) -> RunMany | None:
        scenes = [bodies.take(i) for i in range(len(bodies))]
        if not scenes or any(self.unsupported(scene) or find_units(scene, grid.dt) != SI for scene in scenes):
            return None
        problems = [getattr(formulations, self.frame)(scene) for scene in scenes]
        together = batches.gather(problems, self.tol, self.width or batches.recommended_width())
        if together is None:
            return None
        march, t = batches.MARCHES[self.driver], grid.t
        return lambda: together.read(march(together, t), len(bodies))


def _begin(integrator: Any, problem: formulations.Formulation) -> None:
    # Parameters at the end that equations have no use for (for a spin about a principal axis, say) are not stored.
    integrator.pars[:] = problem.parameters[: len(integrator.pars)]
    integrator.time = 0.0
    integrator.state[:] = problem.start


def _over_grid(integrator: Any, t: Array) -> tuple[Array, int, str]:
    """Return states (n, m), number of steps and how one call ended that evaluates the steps' polynomials at the samples."""
    outcome, _, _, steps, _, states = integrator.propagate_grid(t, max_steps=STEP_LIMIT)
    return states, int(steps), limit_reason(int(steps), 1.0) or f"heyoka: {outcome.name}"


def _from_sample_to_sample(integrator: Any, t: Array) -> tuple[Array, int, str]:
    """Return the same, with steps cut at the samples."""
    states, steps = np.full((len(t), len(integrator.state)), np.nan), 0
    states[0] = integrator.state
    for sample, time in enumerate(t[1:], start=1):
        outcome, _, _, taken, *_ = integrator.propagate_until(time, max_steps=STEP_LIMIT - steps)
        steps += int(taken)
        if steps >= STEP_LIMIT or not np.isfinite(integrator.state).all():
            break
        states[sample] = integrator.state
    return states, steps, limit_reason(steps, 1.0) or f"heyoka: {outcome.name}"
