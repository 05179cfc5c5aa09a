"""heyoka: Taylor integration at any tolerance, with a choice of formulations (Biscani & Izzo 2021)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Any, ClassVar

import numpy as np

from conservative.attitude import Array
from conservative.batch import Batch
from conservative.card import Card, Maker
from conservative.check import choice, describe, finite_number, positive_integer
from conservative.errors import BadInput
from conservative.grid import Grid
from conservative.method import Method, Role, Run
from conservative.methods.many import Block, RunMany
from conservative.methods.units import SI, find_units, in_own_units
from conservative.potentials.turning import static_part
from conservative.scene import Scene
from conservative.trajectory import Counters, Trajectory

from ..engine import STEP_LIMIT, limit_reason, pace_reason, symmetric_axes, version
from ..heyoka_equations import accelerations, forms, formulations

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
    vectorised within a step; `fast_math` for base vectors only, where it is faster). Samples are values of the steps' Taylor
    polynomials and as accurate as the steps. Fields are those of `conservative.references.heyoka_equations.accelerations`.

    Parameters
    ----------
    tol
        Relative error of a step, 1e-20 to below 1. Values below 2.2e-16 add a term or two and give round-off.
    frame
        "body": quaternion and body rates in principal axes, the usual formulation. "non_spinning", for a body symmetric about
        an axis, free or in a field along it: quaternion of the frame that turns at l/J1 and world momentum l; the spin has a
        closed form. "base_vectors": rates and two rows of the rotation matrix, one of them along the field's axis; the second
        row is their cross product, and the rows are not orthonormalised. "lean", the fastest: rates and one angle (asymmetric
        free body); axis, momentum and one angle (symmetric top that stays away from one of the poles); otherwise the
        non-spinning frame if there is one, or base vectors. At equal error, base vectors take 17 to 30 % less time than "body"
        (measured in four fields).
    width, driver
        Settings of `prepare_many` for the frames "body" and "base_vectors": the number of bodies in a batch, by default the
        number that heyoka recommends for the processor; and whether batches run in a loop ("batch") or in heyoka's function for
        ensembles, on one thread ("ensemble"). Other frames integrate one body at a time.

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
        choice("driver", self.driver, ("batch", "ensemble"))
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
        together = _gather(problems, self.tol, self.width or int(forms.heyoka().recommended_simd_size()))
        if together is None:
            return None
        march, t = _run_batches if self.driver == "batch" else _run_ensemble, grid.t
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


@dataclass(frozen=True, eq=False)
class Batches:
    """Bodies of one form in the lanes of heyoka's batch integrators (heyoka's documentation, Batch mode).

    Attributes
    ----------
    integrators, width
        Integrators, and the number of bodies that each integrates at once.
    parameters, start
        Parameters (k, n) and initial states (m, n); n is a multiple of the width.
    attitudes
        Maps states without rates (.., m - 3) to attitudes (.., 3, 3) in the axes of the field.
    R_WD, R_BF
        Rotations (n, 3, 3) of each body: the field's axes to world axes, and the axes of its equations to body axes.
    """

    integrators: forms.Integrators
    width: int
    parameters: Array
    start: Array
    attitudes: Callable[[Array], Array]
    R_WD: Array
    R_BF: Array

    def read(self, states: Array, count: int) -> Block:
        """Return the samples of the first `count` bodies from states (samples, m, n)."""
        samples = len(states)
        rows = np.ascontiguousarray(states.transpose(2, 0, 1))[:count]
        R_DF = self.attitudes(rows[..., :-3].reshape(count * samples, -1)).reshape(count, samples, 3, 3)
        R_FB = self.R_BF[:count, None].swapaxes(-1, -2)
        R_WB, w_WB_B = self.R_WD[:count, None] @ R_DF @ R_FB, (rows[..., None, -3:] @ R_FB)[..., 0, :]
        return Block(R_WB, w_WB_B, np.isfinite(rows).all(axis=(1, 2)))


@lru_cache(maxsize=64)
def _compile_batch(form: forms.Form, tol: float, fast_math: bool, width: int) -> forms.Integrators:
    equations = form.build()
    start = [[0.0] * width for _ in equations]
    return forms.Integrators(forms.heyoka().taylor_adaptive_batch(equations, start, tol=tol, fast_math=fast_math))


def _gather(problems: Sequence[formulations.Formulation], tol: float, width: int) -> Batches | None:
    """Return scenes as batches; None if their forms differ, or if attitudes depend on more than states."""
    first = problems[0]
    if first.attitudes is None or any(problem.form != first.form for problem in problems):
        return None
    padded = [*problems, *[problems[-1]] * (-len(problems) % width)]
    return Batches(
        integrators=_compile_batch(first.form, tol, first.fast_math, width),
        width=width,
        parameters=np.array([problem.parameters for problem in padded]).T,
        start=np.array([problem.start for problem in padded]).T,
        attitudes=first.attitudes,
        R_WD=np.array([problem.R_WD for problem in padded]),
        R_BF=np.array([problem.axes.R_BF for problem in padded]),
    )


def _run_batches(batches: Batches, t: Array) -> Array:
    """Return states (samples, m, n) at times t, batch after batch; nan for a body after its integration stops."""
    states = np.full((len(t), *batches.start.shape), np.nan)
    states[0] = batches.start
    with batches.integrators.borrow() as integrator:
        for first in range(0, batches.start.shape[1], batches.width):
            part = slice(first, first + batches.width)
            _begin_batch(integrator, batches, part)
            for sample, time in enumerate(t[1:], start=1):
                integrator.propagate_until(time, max_steps=STEP_LIMIT)
                states[sample, :, part] = _read_state(integrator, time)
    return states


def _run_ensemble(batches: Batches, t: Array) -> Array:
    """Return the same from `ensemble_propagate_until_batch` on one thread, which copies the integrator for each batch."""
    hy, states = forms.heyoka(), np.full((len(t), *batches.start.shape), np.nan)
    states[0] = batches.start
    count = batches.start.shape[1] // batches.width
    made: list[Any] = []

    def begin(integrator: Any, i: int) -> Any:
        if made:
            return made[i]
        _begin_batch(integrator, batches, slice(i * batches.width, (i + 1) * batches.width))
        return integrator

    with batches.integrators.borrow() as integrator:
        for sample, time in enumerate(t[1:], start=1):
            done = hy.ensemble_propagate_until_batch(integrator, time, count, begin, max_workers=1, max_steps=STEP_LIMIT)
            made = [each[0] for each in done]
            states[sample] = np.concatenate([_read_state(each, time) for each in made], axis=1)
    return states


def _begin_batch(integrator: Any, batches: Batches, part: slice) -> None:
    integrator.set_time(0.0)
    integrator.pars[:] = batches.parameters[: len(integrator.pars), part]
    integrator.state[:] = batches.start[:, part]


def _read_state(integrator: Any, time: float) -> Array:
    """Return the state (m, width); nan for bodies that did not reach `time`: one that is not finite stops its batch."""
    return np.where(integrator.time == time, integrator.state, np.nan)
