"""heyoka: Taylor integration at any tolerance, with a choice of formulations (Biscani & Izzo 2021)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, ClassVar

import numpy as np

from conservative.attitude import Array
from conservative.batch import Batch
from conservative.check import choice, describe, finite_number, positive_integer
from conservative.errors import BadInput
from conservative.features import Feature, features_of
from conservative.grid import Grid
from conservative.method import Method, Role, Run
from conservative.method_info import Maker, MethodInfo
from conservative.methods.many import Block, RunMany
from conservative.methods.units import in_own_units
from conservative.potentials.turning import Turning, static_part
from conservative.scene import Scene
from conservative.trajectory import Counters, Trajectory

from ..engine import STEP_LIMIT, EngineRun, limit_reason, pace_reason, symmetric_axes, version
from ..environments.plain_numbers import take_axes
from ..heyoka_equations import accelerations, forms, formulations
from ..samples import Delivered, States, bind_conversion, to_body_axes

FRAMES = ("body", "non_spinning", "lean", "base_vectors", "angle")
_TOLERANCES_AND_FRAMES = tuple(f"tol={tol},frame={frame}" for frame in FRAMES[:3] for tol in ("1e-6", "1e-9", "1e-12", "1e-16"))

SMALLEST_TOL = 1e-20
"""A step of this tolerance has five terms more than one of 1e-16; smaller ones compile ever longer and gain nothing."""

WIDEST = 64
"""Bodies in a batch: more are refused, since each number of them is compiled for itself."""

# Up to here it is cheaper (5 to 20 %) not to keep the polynomials of the steps for evaluation between their ends.
_FEW_SAMPLES = 8


@dataclass(frozen=True)
class Heyoka(Method):
    """heyoka's adaptive Taylor integrator in double precision; dt is only the interval between samples.

    Compiled integrators are kept per formulation and tolerance, in heyoka's fastest mode (not compact, not high-accuracy, not
    vectorised within a step). Compact mode takes 1.5 to 2.7 times as long (eight bodies in each of five fields, three frames,
    four tolerances). Samples are values of the steps' Taylor polynomials and as accurate as the steps. Fields are in
    `conservative.references.heyoka_equations.accelerations`.

    Parameters
    ----------
    tol
        Relative error of a step, 1e-20 to below 1. The order is 20 at 1e-16 and 25 at 1e-20; both give round-off.
    frame
        "body": quaternion and body rates in principal axes, the usual formulation. "non_spinning", for a body symmetric about
        an axis, free or in a field along it: quaternion of the frame that turns at l/J1 and world momentum l; the spin has a
        closed form. "base_vectors": rates and two rows of the rotation matrix, one of them along the field's axis; the second
        row is their cross product, and the rows are not orthonormalised. "lean", the fastest: rates and one angle (asymmetric
        free body); axis, momentum and one angle (symmetric top that stays away from one of the poles); otherwise the
        non-spinning frame if there is one, or base vectors. At equal error, base vectors take 17 to 30 % less time than "body"
        (measured in four fields). "angle", for a field that does not turn: rates, the field's axis in the body and one angle
        about it. A trial run chooses the axes for each body, so that the field's axis stays away from the pole of the angle.
    fast_math
        Whether the compiler may reorder sums: "on", "off", or "auto", which is on for base vectors and the angle. Measured as
        above, it changes the mean time at a tolerance by -13 to +4 % for base vectors, by -13 to -2 % for the angle, and by
        -5 to +8 % for "body".
    width, driver
        Settings of `prepare_many`: the number of bodies in a batch, by default the number that heyoka recommends for the
        processor; and whether batches run in a loop ("batch") or in heyoka's function for ensembles, on one thread
        ("ensemble"). Bodies whose equations differ in their form run one at a time.
    numbers
        "compiled": the numbers of body and field are constants of the compiled code, which then serves this body only;
        "parameters": they are runtime parameters, and the code serves all bodies of the same form.

    Raises
    ------
    BadInput
        tol is out of range, frame, driver, fast_math or numbers are unknown, or the width is not an integer of 1 to 64.
    MissingEngine
        heyoka is not installed.

    `prepare_many` raises BadInput if numbers are compiled and the equations of the bodies differ.
    """

    tol: float = 1e-16
    frame: str = "body"
    width: int | None = None
    driver: str = "batch"
    numbers: str = "parameters"
    fast_math: str = "auto"

    family: ClassVar[str] = "heyoka"
    role: ClassVar[Role] = Role.ENGINE
    order = None
    method_info: ClassVar[MethodInfo] = MethodInfo(
        # Base vectors are the cheapest frame to read if many samples are kept. Lean is often the same: one tolerance is enough.
        variants=(*_TOLERANCES_AND_FRAMES, "tol=1e-9,frame=base_vectors", "tol=1e-9,frame=angle"),
        fastest=("fast_math=on", "", "frame=lean", "frame=lean,fast_math=off", "tol=1e-9,frame=angle"),
        report=("", "frame=non_spinning", "frame=lean"),
        suite=("tol=1e-9", "tol=1e-16"),
        many=(
            *("frame=base_vectors", "frame=base_vectors,width=8", "frame=base_vectors,width=16"),
            *("frame=base_vectors,driver=ensemble", "frame=lean", "frame=base_vectors,width=8,numbers=compiled"),
            *("", "width=8", "width=8,fast_math=on", "width=16", "frame=lean,width=8"),
        ),
        colour="green",
        supports=frozenset({Feature.TURNING, Feature.ROTOR}).union(*map(features_of, accelerations.READERS)),
    )

    def __post_init__(self) -> None:
        allowed = f"a number above 0, from {SMALLEST_TOL:g}, and below 1"
        if not SMALLEST_TOL <= finite_number("tol", self.tol, allowed) < 1:
            raise BadInput("tol", describe(self.tol), allowed)
        choice("frame", self.frame, FRAMES)
        choice("driver", self.driver, ("batch", "ensemble"))
        choice("numbers", self.numbers, ("parameters", "compiled"))
        choice("fast_math", self.fast_math, ("auto", "on", "off"))
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
        if self.driver != "batch":
            parts["driver"] = self.driver
        if self.fast_math != "auto":
            parts["fast_math"] = f"fast_math={self.fast_math}"
        return parts if self.numbers == "parameters" else parts | {"numbers": f"numbers={self.numbers}"}

    def unsupported(self, scene: Scene) -> str | None:
        potential = static_part(scene.potential)
        if potential is not None and type(potential) not in accelerations.READERS:
            kind, table = type(potential).__name__, f"{accelerations.__name__}.READERS"
            return f"no heyoka expressions for {kind}; add them to {table}"
        if self.frame == "angle" and isinstance(scene.potential, Turning):
            return "an angle about the field's axis needs a field that does not turn"
        if self.frame == "non_spinning" and symmetric_axes(scene) is None:
            return "a non-spinning frame needs a body symmetric about an axis, free or with its centre of mass on that axis"
        return None

    def program(self, scene: Scene) -> object:
        if self.unsupported(scene):
            return self.name
        problem = self.formulate(scene)  # the lean frame is often one of the others
        return self.family, problem.form, problem.fast_math, self.numbers

    def formulate(self, scene: Scene) -> formulations.Formulation:
        """Return a scene as this setting integrates it."""
        problem: formulations.Formulation = getattr(formulations, self.frame)(scene)
        return problem if self.fast_math == "auto" else replace(problem, fast_math=self.fast_math == "on")

    @in_own_units
    def prepare(self, scene: Scene, grid: Grid) -> Run:
        problem = self.formulate(scene)
        integrators, label = self.integrators(problem), self.label
        t, end, parameters = grid.t, float(grid.t[-1]), np.array(problem.parameters)  # a list takes 0.7 us more in each run
        propagate = _from_sample_to_sample if grid.n_samples <= _FEW_SAMPLES else _over_grid
        samples = formulations.gather([problem])

        @cache
        def find_reason() -> str:  # once, so that repeated runs, which are timed, do not pay for it
            with integrators.borrow() as integrator:
                _begin(integrator, parameters, problem.start)
                return pace_reason(scene, integrator, end)

        def loop() -> tuple[Array, int, str]:
            if reason := find_reason():
                return problem.start[None], 0, reason
            with integrators.borrow() as integrator:
                _begin(integrator, parameters, problem.start)
                return propagate(integrator, t)

        def bind() -> Callable[[], Any]:
            integrator = integrators.copy()
            _begin(integrator, parameters, problem.start)
            return _bind_loop(integrator, problem.start, t)

        def bind_final() -> Callable[[], Delivered]:
            integrator = integrators.copy()
            _begin(integrator, parameters, problem.start)
            return _bind_final(integrator, problem.start, end, samples(np.empty((1, 0, 0))), problem.axes.R_BF)

        def convert(result: tuple[Array, int, str]) -> Trajectory:
            states, steps, reason = result
            return problem.axes.trajectory(grid, label, samples(states[None]), Counters(steps), reason)

        return EngineRun(loop, convert, bind, bind_final)

    def integrators(self, problem: formulations.Formulation, width: int = 0) -> forms.Integrators:
        """Return compiled integrators of a scene, of `width` bodies at once."""
        numbers = tuple(problem.parameters) if self.numbers == "compiled" else ()
        return forms.compile_double(problem.form, self.tol, problem.fast_math, numbers, width)

    def prepare_many(self, bodies: Batch, grid: Grid) -> RunMany | None:
        axes = take_axes(bodies, grid, self.unsupported)
        problems = [self.formulate(axis.scene) for axis in axes or ()]
        if not problems or any(problem.form != problems[0].form for problem in problems):
            return None
        if self.numbers == "compiled" and any(problem.parameters != problems[0].parameters for problem in problems):
            raise BadInput("numbers", "'compiled' for bodies that differ", "bodies with the same equations, or 'parameters'")
        width = self.width or int(forms.heyoka().recommended_simd_size())
        padded = [*problems, *[problems[-1]] * (-len(problems) % width)]
        rows = (np.array([getattr(problem, name) for problem in padded]) for name in ("parameters", "start"))
        parameters, start = (row.reshape(-1, width, row.shape[1]).swapaxes(1, 2).copy() for row in rows)
        batches = self.integrators(problems[0], width), parameters, start
        march, t = _run_batches if self.driver == "batch" else _run_ensemble, grid.t
        samples, R_BF = formulations.gather(problems), np.array([problem.axes.R_BF for problem in problems])

        def run() -> Block:
            values = march(*batches, t)[..., : len(problems)].transpose(2, 0, 1)
            R_WB, w_WB_B, finite = to_body_axes(t, samples(values), R_BF)
            return Block(R_WB, w_WB_B, finite == len(t))

        return run


def _begin(integrator: Any, parameters: Array, start: Array) -> None:
    # Parameters at the end that equations have no use for (for a spin about a principal axis, say) are not stored.
    integrator.pars[:] = parameters[: len(integrator.pars)]
    integrator.time = 0.0
    integrator.state[:] = start


def _bind_loop(integrator: Any, start: Array, t: Array) -> Callable[[], Array]:
    """Return a loop over the times t (n,), s, as a user of heyoka writes it, which returns states.

    It keeps views of the state and has no limit of steps. Parameters set again would take 2.5 us and the limit 0.1 us.
    """
    state: Array = integrator.state
    until, grid, times = integrator.propagate_until, integrator.propagate_grid, t.tolist()
    states: Array = np.empty((len(t), len(state)))

    def to_end() -> Array:
        state[:] = start
        integrator.time = 0.0
        until(times[1])
        return state

    def to_samples() -> Array:
        state[:] = states[0] = start
        integrator.time = 0.0
        for sample in range(1, len(times)):
            until(times[sample])
            states[sample] = state
        return states

    def over_grid() -> Array:
        state[:] = start
        integrator.time = 0.0
        return np.asarray(grid(t)[-1])

    return to_end if len(t) == 2 else to_samples if len(t) <= _FEW_SAMPLES else over_grid


def _bind_final(integrator: Any, start: Array, t_end: float, states: States, R_BF: Array) -> Callable[[], Delivered]:
    """Return the loop to t_end, s, as a user of heyoka writes it, and the conversion of the final state to body axes."""
    state, until, convert = integrator.state, integrator.propagate_until, bind_conversion(t_end, states, R_BF)

    def to_final() -> Delivered:
        state[:] = start
        integrator.time = 0.0
        until(t_end)
        return convert(state)

    return to_final


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


def _run_batches(integrators: forms.Integrators, parameters: Array, start: Array, t: Array) -> Array:
    """Return states (samples, m, n) at times t, batch after batch; nan for a body after its integration stops.

    Each batch has `width` bodies in the lanes of an integrator (heyoka's documentation, Batch mode). Parameters are
    (batches, k, width) and initial states (batches, m, width).
    """
    states, reached = np.empty((len(start), len(t), *start.shape[1:])), np.empty((len(start), len(t), 1, start.shape[2]))
    states[:, 0], reached[:, 0] = start, 0.0
    with integrators.borrow() as integrator:
        state, now, pars, propagate = integrator.state, integrator.time, integrator.pars, integrator.propagate_until
        for batch in range(len(start)):
            pars[:] = parameters[batch, : len(pars)]
            state[:] = start[batch]
            integrator.set_time(0.0)
            for sample, time in enumerate(t[1:].tolist(), start=1):
                propagate(time, max_steps=STEP_LIMIT)
                states[batch, sample], reached[batch, sample] = state, now
    states = np.where(reached == t[:, None, None], states, np.nan)
    return states.transpose(1, 2, 0, 3).reshape(len(t), start.shape[1], -1)


def _run_ensemble(integrators: forms.Integrators, parameters: Array, start: Array, t: Array) -> Array:
    """Return the same from `ensemble_propagate_until_batch` on one thread, which copies the integrator for each batch."""
    hy, made = forms.heyoka(), list[Any]()
    states = np.full((len(t), start.shape[1], len(start) * start.shape[2]), np.nan)
    states[0] = np.concatenate(start, axis=1)

    def begin(integrator: Any, i: int) -> Any:
        if made:
            return made[i]
        integrator.pars[:] = parameters[i, : len(integrator.pars)]
        integrator.state[:] = start[i]
        integrator.set_time(0.0)
        return integrator

    with integrators.borrow() as integrator:
        for sample, time in enumerate(t[1:], start=1):
            done = hy.ensemble_propagate_until_batch(integrator, time, len(start), begin, max_workers=1, max_steps=STEP_LIMIT)
            made = [entry[0] for entry in done]
            states[sample] = np.concatenate(
                [np.where(integrator.time == time, integrator.state, np.nan) for integrator in made], axis=1
            )
    return states
