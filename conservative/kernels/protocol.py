"""Arguments and results of every kernel that takes steps.

    march(model, coefficients, workspace) -> Result

    deliver(result, workspace, output) -> its fields, and the number of finite samples

- `model`: what moves, what acts on it and how it starts, a named tuple `Model` of the kernel's file;
- `coefficients`: what a step is made of, its length included, a named tuple `Coefficients` of the same file;
- `workspace`: a `Workspace`, the samples to fill and the steps after which they are taken;
- `output`: an `Output`, the same samples as attitudes and rates in body axes. They are filled within the same call of machine
  code, because a second call would take 1.2 us.

Where a step can fail, the constant `FAILURE` of the file says why.

Python calls `enter(*model, *coefficients, *workspace, *output)`, which is `march` and `deliver`, with a plain tuple for a
result: numba finds the class of a named tuple that passes between Python and machine code by unpickling it, which costs 5 us
for each; loose values cost nothing. Where `enter` cuts them follows from the fields (`find_ends`); a value too many or too few
is an error when `enter` is compiled. Each file has its own: numba does not find the code of a closure over a compiled function
in its cache again.

A named tuple as an argument takes 1.1 us as well. `taylor` and `dense`, whose runs can take 1 us, therefore have `bind` instead
of `enter`: it returns a function without model and coefficients, and passes the model as an array of its numbers.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from . import kernel, small
from .compiler.lanes import save_columns, save_rows
from .samples import fill


class Workspace(NamedTuple):
    """Samples to fill: of attitudes q (n, 4), of any length, and momenta L (n, 3), kg m^2/s, both in principal axes.

    They are the start, every `every`-th of n_steps steps, and the last. After about `pause` units of work handlers of signals
    are called (`signals`), 0: never. What a unit is, and how many there are in 20 ms or so, the constant `PAUSE` of a kernel's
    file says. Results are the same whatever it is, bit for bit.
    """

    n_steps: int
    every: int
    pause: int
    q: Any
    L: Any


class Output(NamedTuple):
    """Samples in body axes: `axes`, the numbers of `samples.fill`, and R_WB (n, 3, 3) and w_WB_B (n, 3), rad/s, to fill.

    Arrays without samples are not filled.
    """

    axes: Any
    R_WB: Any
    w_WB_B: Any


class Result(NamedTuple):
    """Progress of the steps.

    `done` steps were taken, made of `stages` stages with `corrections` corrections (sweeps, projections) and `evaluations` of
    the torque, which is None where they are not counted. `size` is the relative size of the last correction or, where done <
    n_steps, what is left of the equations of the step that failed; `elsewhere` then says whether these have another solution
    than the one that the state leads to continuously.
    """

    done: int
    stages: int
    corrections: int
    evaluations: Any
    size: float
    elsewhere: bool


def find_ends(model: type[NamedTuple], coefficients: type[NamedTuple]) -> tuple[int, int, int]:
    """Return the ends of a model, its coefficients and the workspace among the loose values: constants of the machine code."""
    end = len(model._fields)
    return end, end + len(coefficients._fields), end + len(coefficients._fields) + len(Workspace._fields)


@small
def record(row, q, L, q_out, L_out):
    """Store a sample, number by number: for a tuple assigned to a slice numba compiles its text of an error, 2.2 s."""
    q_out[row, 0], q_out[row, 1], q_out[row, 2], q_out[row, 3] = q
    L_out[row, 0], L_out[row, 1], L_out[row, 2] = L


@small
def record_lanes(first, row, samples, values, out):
    """Store a sample of the bodies in lanes, from number `first` on: `values` of each, in a flat array (bodies, samples, .)."""
    count = len(values)
    save_columns(out, count * (first * samples + row), count * samples, values)


@small
def record_supply(row, supplied, L_out):
    """Store the sums of work and impulse of the loads behind the momentum; nothing without loads."""
    save_rows(L_out, row * L_out.shape[1] + 3, 1, supplied[:4])


@small
def loosen(result):
    """Return the fields of a result as a plain tuple."""
    return result[:]


@kernel
def deliver(result, workspace, output):
    """Fill the output with the samples before a failure. Return the fields of the result and the number of finite samples."""
    done, n_steps, every, n = result.done, workspace.n_steps, workspace.every, len(output.R_WB)
    if done < n_steps:
        n = min(n, 1 + done // every)
    axes = output.axes
    finite = fill(axes[:0], every, n_steps, workspace.q, workspace.L, axes, output.R_WB[:n], output.w_WB_B[:n])
    return (*loosen(result), finite)
