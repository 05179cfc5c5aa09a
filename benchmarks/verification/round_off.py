"""Round-off over long runs: do errors of energy and momentum walk, like the square root of the number of steps, or run?

    python -m conservative.benchmarks.verification.round_off --steps 1e8 --members 4
    python -m conservative.benchmarks.verification.round_off --method moser_veselov --steps 1e7 --members 16

An ensemble of bricks, each spun a little differently, takes the steps; the drift of each is read at equally spaced times.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import click
import numpy as np
from scipy import stats

from conservative import registry
from conservative.attitude import Array
from conservative.check import positive_integer, positive_number
from conservative.errors import BadInput
from conservative.method import Grid, Method
from conservative.methods.reduced import Reduced
from conservative.scene import Scene

from ..suite.points import PAPER

BLOCKS = 64
"""Equal parts of a run between which drifts are read."""
SPREAD = 1e-3
"""Relative spread of the members' rates at the start."""
LEVEL = 1e-6
"""Drifts are called linear if a random walk has a smaller probability than this."""


@dataclass(frozen=True)
class DriftGrowth:
    """How drifts grow.

    Attributes
    ----------
    steps
        N, steps of the run.
    rms
        Root mean square of the drift after N steps.
    exponent, stderr
        p of rms ~ N^p, fitted to the rms change over 1, 2, 4, ... blocks wherever in the run, and its standard error, from
        leaving out each member in turn.
    bias
        Mean drift per step.
    chance
        Probability that a walk, with steps of mean zero in every member, looks as much like a line as this.
    """

    steps: int
    rms: float
    exponent: float
    stderr: float
    bias: float
    chance: float

    @property
    def linear(self) -> bool:
        """Whether the drift is not a random walk."""
        return self.chance < LEVEL

    def __str__(self) -> str:
        kind = "linear" if self.linear else "no faster than a walk"
        return (
            f"rms {self.rms:.2e} after {self.steps:.0e} steps, exponent {self.exponent:.2f} ± {self.stderr:.2f}, "
            f"bias {self.bias:.1e} a step: {kind} (chance {self.chance:.1g})"
        )


def fit_growth(drift: Array, steps: int) -> DriftGrowth:
    """Return how drifts (members, blocks + 1), zero at first, grow over `steps` steps.

    The changes over blocks of a walk are independent and of mean zero, so that the t value of each member, as a normal
    deviate, squared and summed over members, has a chi-square distribution. Members may drift in different directions.

    Raises
    ------
    BadInput
        There are fewer than two members or sixteen blocks.
    """
    if drift.ndim != 2 or len(drift) < 2 or drift.shape[1] < 17:
        raise BadInput("drift", f"shape {drift.shape}", "two members or more, at 17 times or more")
    changes = np.diff(drift, axis=1)
    blocks = changes.shape[1]
    # Sixteen blocks are enough for t, and long enough that what is periodic in the motion is not taken for dependence.
    coarse = np.diff(drift[:, :: blocks // 16], axis=1)
    scatter = np.maximum(coarse.std(axis=1, ddof=1), np.finfo(float).tiny)
    t = np.abs(coarse.mean(axis=1)) / scatter * math.sqrt(coarse.shape[1])
    deviates = stats.norm.isf(np.clip(stats.t.sf(t, coarse.shape[1] - 1), 1e-300, 0.5))
    chance = float(stats.chi2.sf(np.sum(deviates**2), len(drift)))
    slopes = np.array([_exponent(np.delete(drift, k, axis=0)) for k in range(len(drift))])
    stderr = float(np.sqrt((len(slopes) - 1) * np.mean((slopes - slopes.mean()) ** 2)))
    rms = float(np.sqrt(np.mean(drift[:, -1] ** 2)))
    return DriftGrowth(steps, rms, _exponent(drift), stderr, float(drift[:, -1].mean() / steps), chance)


def _exponent(drift: Array) -> float:
    """Return the slope of log(rms change) over log(blocks passed), over an eighth of the run at most."""
    lags = 2 ** np.arange(int(math.log2((drift.shape[1] - 1) // 8)) + 1)
    sizes = [np.sqrt(np.mean((drift[:, lag:] - drift[:, :-lag]) ** 2)) for lag in lags]
    return float(stats.linregress(np.log(lags), np.log(np.maximum(sizes, np.finfo(float).tiny))).slope)


def ensemble(scene: Scene, members: int, seed: int = 0) -> list[Scene]:
    """Return scenes whose rates at the start differ from that of `scene` by `SPREAD`."""
    draw = np.random.default_rng(seed)
    return [scene.rename(scene.name, w_WB_B0=scene.w_WB_B0 * (1 + SPREAD * draw.normal(size=3))) for _ in range(members)]


def measure_drifts(method: Method, scenes: list[Scene], dt: float, steps: int) -> dict[str, Array]:
    """Return the drift (members, blocks + 1) of each invariant of the scenes; of a vector, of its component along itself.

    Raises
    ------
    IntegrationFailed
        A run did not reach its end.
    """
    found: dict[str, list[Array]] = {}
    grid = Grid(dt, steps, steps // BLOCKS)
    for scene in scenes:
        trajectory = method.solve(scene, grid)
        if trajectory.failure is not None:
            raise trajectory.failure
        for invariant in scene.invariants:
            relative = trajectory.drift(invariant)
            start = invariant.evaluate(scene.R_WB0[None], scene.w_WB_B0[None])[0]
            along = relative if relative.ndim == 1 else relative @ (start / np.linalg.norm(start))
            found.setdefault(invariant.name, []).append((along - along[0])[: BLOCKS + 1])
    return {name: np.array(values) for name, values in found.items()}


def measure_growth(method: Method, scene: Scene, dt: float, steps: int, members: int) -> dict[str, DriftGrowth]:
    """Return the growth of each invariant's drift; `steps` is rounded down to a multiple of `BLOCKS`.

    Raises
    ------
    BadInput
        There are fewer steps than blocks, fewer than two members, or dt is not above 0.
    """
    positive_number("dt", dt, "a finite step above 0, s")
    if positive_integer("steps", steps) < BLOCKS:
        raise BadInput("steps", steps, f"an integer of {BLOCKS} or more")
    if positive_integer("members", members) < 2:
        raise BadInput("members", members, "an integer of 2 or more")
    steps -= steps % BLOCKS
    found = measure_drifts(method, ensemble(scene, members), dt, steps)
    return {name: fit_growth(values, steps) for name, values in found.items()}


@click.command(help="Measure how round-off grows over long runs.")
@click.option("--steps", default=1e6, help="Steps of each run.", show_default=True)
@click.option("--members", default=8, help="Runs.", show_default=True)
@click.option("--dt", default=0.01, help="Step, s.", show_default=True)
@click.option("--method", default=Reduced().name, help="Method with its settings.", show_default=True)
@click.option("--scene", default=PAPER[0], help="Scene with its parameters.", show_default=True)
def main(steps: float, members: int, dt: float, method: str, scene: str) -> None:
    """Print the growth of each invariant's drift."""
    try:
        found = measure_growth(registry.method(method), registry.scene(scene), dt, round(steps), members)
    except BadInput as bad:
        raise click.UsageError(str(bad)) from None
    for name, grown in found.items():
        click.echo(f"{name}: {grown}")


if __name__ == "__main__":
    main()
