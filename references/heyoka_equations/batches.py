"""Many scenes of one form as heyoka's batches: several bodies in the lanes of one integrator.

Source: heyoka's documentation, Batch mode; Ensemble propagation.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from conservative.attitude import Array
from conservative.methods.many import Block

from ..engine import STEP_LIMIT
from . import forms
from .formulations import Formulation

March = Callable[["Batches", Array], Array]
"""Takes batches and times of samples (s,), s, to states (samples, m, bodies)."""


@dataclass(frozen=True, eq=False)
class Batches:
    """Bodies of one form, in columns, and the integrators that take `width` of them at once.

    Attributes
    ----------
    integrators, width
        Integrators of so many bodies, and that number.
    parameters, start
        Columns (k, n) and (m, n): values of the form's parameters, and states at t = 0; n is a multiple of the width.
    attitudes
        Takes states without rates (.., m - 3) to attitudes (.., 3, 3) in the axes of the field.
    R_WD, R_BF
        Rotations (n, 3, 3) of each body: the field's axes to the world's, and the axes of its equations to the body's.
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
def compile_batch(form: forms.Form, tol: float, fast_math: bool, width: int) -> forms.Integrators:
    """Return integrators of `width` bodies at once of a form, in double precision, for a relative tolerance."""
    equations = form.build()
    start = [[0.0] * width for _ in equations]
    return forms.Integrators(forms.heyoka().taylor_adaptive_batch(equations, start, tol=tol, fast_math=fast_math))


def gather(problems: Sequence[Formulation], tol: float, width: int) -> Batches | None:
    """Return scenes as batches; None where they are not all of one form, or their attitudes need more than their states."""
    first = problems[0]
    if first.attitudes is None or any(problem.form != first.form for problem in problems):
        return None
    padded = [*problems, *[problems[-1]] * (-len(problems) % width)]
    return Batches(
        integrators=compile_batch(first.form, tol, first.fast_math, width),
        width=width,
        parameters=np.array([problem.parameters for problem in padded]).T,
        start=np.array([problem.start for problem in padded]).T,
        attitudes=first.attitudes,
        R_WD=np.array([problem.R_WD for problem in padded]),
        R_BF=np.array([problem.axes.R_BF for problem in padded]),
    )


def recommended_width() -> int:
    """Return how many bodies at once heyoka recommends on this processor."""
    return int(forms.heyoka().recommended_simd_size())


def march_batches(batches: Batches, t: Array) -> Array:
    """Return states (..., m, n) at times t (s,), s, batch after batch; nan from where a body does not get on."""
    states = np.full((len(t), *batches.start.shape), np.nan)
    states[0] = batches.start
    with batches.integrators.borrow() as integrator:
        for first in range(0, batches.start.shape[1], batches.width):
            part = slice(first, first + batches.width)
            _set(integrator, batches, part)
            for sample, time in enumerate(t[1:], start=1):
                integrator.propagate_until(time, max_steps=STEP_LIMIT)
                states[sample, :, part] = _read_state(integrator, time)
    return states


def march_ensemble(batches: Batches, t: Array) -> Array:
    """Return states (..., m, n) at times t (s,), s, from `ensemble_propagate_until_batch` on one thread.

    It copies its integrator for each batch.
    """
    hy, states = forms.heyoka(), np.full((len(t), *batches.start.shape), np.nan)
    states[0] = batches.start
    count = batches.start.shape[1] // batches.width
    made: list[Any] = []

    def begin(integrator: Any, i: int) -> Any:
        if made:
            return made[i]
        _set(integrator, batches, slice(i * batches.width, (i + 1) * batches.width))
        return integrator

    with batches.integrators.borrow() as integrator:
        for sample, time in enumerate(t[1:], start=1):
            done = hy.ensemble_propagate_until_batch(integrator, time, count, begin, max_workers=1, max_steps=STEP_LIMIT)
            made = [each[0] for each in done]
            states[sample] = np.concatenate([_read_state(each, time) for each in made], axis=1)
    return states


MARCHES: dict[str, March] = {"batch": march_batches, "ensemble": march_ensemble}
"""How batches are run: in a loop over them, or by heyoka's own function for ensembles."""


def _set(integrator: Any, batches: Batches, part: slice) -> None:
    integrator.set_time(0.0)
    integrator.pars[:] = batches.parameters[: len(integrator.pars), part]
    integrator.state[:] = batches.start[:, part]


def _read_state(integrator: Any, time: float) -> Array:
    """Return the state (m, width); nan for bodies that are not there: one that is not finite stops the others of its batch."""
    return np.where(integrator.time == time, integrator.state, np.nan)
