"""One sweep: many random initial states of a scene, integrated and summarized."""

from __future__ import annotations

import math
import warnings
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any

import numpy as np

from conservative import registry
from conservative.check import describe, positive_number
from conservative.errors import AccuracyNotReached, BadInput, NotWritten, nearest
from conservative.grid import MOST_STEPS, Grid, grid_for
from conservative.integration.blocks import LOAD_BYTES, SAMPLE_BYTES
from conservative.integration.distributions import QUANTILES, angle_quantiles, mean_attitudes
from conservative.integration.ensemble import Ensemble
from conservative.integration.many import integrate_many
from conservative.integration.one import read_method
from conservative.integration.spread import spread
from conservative.integration.store import find_ensemble
from conservative.method import Method
from conservative.methods.trials import parts_for, trials_of
from conservative.outcome import ProgressOfMany
from conservative.scene import Scene

from ..terminal.progress import Tell
from .single_run import COMPARED, LARGE, find_errors, read_error, run_on

KINDS = ("attitude", "rate", "inertia")
FIELD = "potential."
_SPREAD = "what varies, and how, such as attitude=5deg, rate=2%, inertia=1% or potential.weight=2%"
_UNITS = {"attitude": "attitude=5deg or attitude=0.1rad", "rate": "rate=5deg/s, rate=0.1rad/s or rate=10%"}
"""Quantities whose unit must be given: 5 could be degrees or radians."""
MOST_TIMES = 6
"""Largest number of times in the summary of the spread of attitudes."""
MOST_FAILURES = 10
"""Largest number of failures in a summary."""
Summary = dict[str, Any]
_OPTIONS = {"path": "out", "sample_every": "samples", "client": "scheduler", "n": "starts"}
"""Arguments of `integrate_many` and `spread`, and their options."""


@dataclass(frozen=True, eq=False)
class Sweep:
    """The arguments of `integrate_many` and their options."""

    scene: Scene
    starts: Mapping[str, Any]
    settings: Mapping[str, Any]
    spread: Mapping[str, str]
    seed: int
    samples: int
    steps: int | None
    """Steps of each body, if they are known before the run."""

    @property
    def size(self) -> str:
        """The size of all samples, such as `58 MB`."""
        size = len(self.starts["R_WB0"]) * self.samples * (SAMPLE_BYTES + LOAD_BYTES * self.scene.loaded)
        power = min(max(0, int(math.log10(size) // 3)), 4)
        return f"{size / 1000**power:.3g} {('B', 'kB', 'MB', 'GB', 'TB')[power]}"


def read_spread(items: Iterable[str]) -> dict[str, str]:
    """Return the quantities and their spreads from texts such as `attitude=5deg` and `potential.weight=2%`.

    Raises
    ------
    BadInput
        A text is not of that form, has no unit, or a quantity is named twice.
    """
    spreads: dict[str, str] = {}
    for item in items:
        name, _, value = (part.strip() for part in item.partition("="))
        if not value:
            raise BadInput("spread", repr(item), _SPREAD)
        if name not in KINDS and not name.startswith(FIELD):
            raise BadInput("spread", repr(name), f"{nearest(name, KINDS)}, or {FIELD} and the name of a number of the field")
        if name in _UNITS and value[-1:] in {*"0123456789."}:
            raise BadInput("spread", repr(item), f"a number with its unit, such as {_UNITS[name]}")
        if name in spreads:
            raise BadInput("spread", f"{item!r} after {name}={spreads[name]}", "each quantity once")
        spreads[name] = value
    return spreads


def plan(
    scene_name: str,
    n: int,
    varied: Mapping[str, str],
    seed: int,
    samples: int,
    dt: float | None,
    error: float | None,
    method: Sequence[str],
    **settings: Any,
) -> Sweep:
    """Return the sweep. `varied` is a result of `read_spread`, and the settings are arguments of `integrate_many`.

    `method` has one name or none. Without a method and a step dt, s, both are chosen for an error, rad (`read_error`).

    Raises
    ------
    BadInput
        A name, a number, a spread or the folder cannot be used; messages name options.
    """
    scene, out, steps = registry.scene(scene_name), settings["path"], None
    if error is not None and dt is not None:
        raise BadInput("dt", describe(dt), "none together with --error, which chooses the step")
    settings |= {"error": read_error(error, dt, method), "method": registry.method(method[0]) if method else None}
    if settings["resume"] and out is None:
        raise BadInput("resume", "no folder", "--out, the folder of a sweep that was interrupted")
    if settings["error"] is None:
        grid = grid_for(scene, scene.dt if dt is None else dt, settings["t_end"], MOST_STEPS)
        steps, every = grid.n_steps, math.ceil(grid.n_steps / (samples - 1))
        settings |= {"dt": grid.dt, "sample_every": every}
        samples = Grid(grid.dt, steps, every).n_samples
    else:
        end = settings["t_end"]
        end = scene.t_end if end is None else positive_number("t_end", end, "a finite duration above 0, s")
        settings["dt"] = end / (samples - 1)
    plain = {name: value for name, value in varied.items() if not name.startswith(FIELD)}
    parameters = {name.removeprefix(FIELD): value for name, value in varied.items() if name not in plain}
    try:
        starts = spread(scene, n, **plain, parameters=parameters, seed=seed)
        if out is not None:
            find_ensemble(out, settings["resume"])
    except BadInput as error:
        raise _in_options(error) from None
    options = {name: value for name, value in settings.items() if value not in (None, False)}
    return Sweep(scene, starts, options, varied, seed, samples, steps)


def run_sweep(sweep: Sweep, tell: Tell) -> tuple[Ensemble, Summary]:
    """Return the ensemble of a sweep, and its times. `tell` is called with the finished share and the rate in words.

    Raises
    ------
    BadInput
        A setting or the folder cannot be used; messages name options.
    """
    last: ProgressOfMany | None = None

    def report(progress: ProgressOfMany) -> None:
        nonlocal last
        last = progress
        steps = f", {rate_text(progress.rate * sweep.steps)} steps/s" if sweep.steps else ""
        tell(progress.done / progress.total, f"{rate_text(progress.rate)} bodies/s{steps}")

    tell(0.0, "preparing: a first run compiles")
    begin = perf_counter()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", AccuracyNotReached)  # the summary says so
            ensemble = integrate_many(sweep.scene, **sweep.starts, **sweep.settings, progress=report)
    except KeyboardInterrupt as stop:
        out = sweep.settings.get("path")
        if last is not None and out is not None:
            stored = f"{last.done:,} of {last.total:,} bodies are finished in {out}"
            stop.add_note(f"{stored}; the same command with --resume does the rest")
        raise
    except BadInput as error:
        raise _in_options(error) from None
    wall = perf_counter() - begin
    rate = (last.done - last.found) / (last.elapsed or wall) if last else 0.0
    return ensemble, {
        "wall_time": wall,
        "found_before": last.found if last else len(ensemble),
        "bodies_per_second": rate,
        "body_steps_per_second": rate * ensemble.grid.n_steps,
    }


def _in_options(error: BadInput) -> BadInput:
    """Return an error about an argument as an error about its option."""
    argument = _OPTIONS.get(error.argument, error.argument)
    if isinstance(error, NotWritten):
        return NotWritten(argument, error.path, error.cause, error.allowed)
    return BadInput(argument, error.got, error.allowed)


def summarize(sweep: Sweep, ensemble: Ensemble, times: Summary) -> Summary:
    """Return outcomes, drifts, spread of attitudes, and times of the ensemble of a sweep."""
    choice = ensemble.choice
    failed = sorted(ensemble.failures.items())
    kinds = Counter(failure.outcome.kind.value for _, failure in failed)
    drifts: dict[str, Any] = {}
    for name, values in ensemble.drifts.items():
        body = -1 if np.isnan(values).all() else int(np.nanargmax(values))
        largest = {"largest": float(values[body]), "body": body, "median": float(np.nanmedian(values))} if body >= 0 else None
        drifts[name] = largest
    samples = np.unique(np.rint(np.linspace(0, len(ensemble.t) - 1, MOST_TIMES)).astype(int)).tolist()
    quantiles = angle_quantiles(ensemble.R_WB, mean_attitudes(ensemble.R_WB, samples), samples).tolist()
    names = [f"p{100 * share:g}" for share in QUANTILES]
    error = None
    if choice is None:
        method = read_method(sweep.settings.get("method"), sweep.scene)
        error = {"asked": None, "bodies": 1, **_own_error(sweep.scene, method, ensemble.grid)}
    else:
        reached, bodies = choice.reached, getattr(choice, "bodies", 1)
        error = {"asked": choice.error, "estimate": choice.estimate, "reached": reached, "bodies": bodies}
    return {
        "scene": sweep.scene.name,
        "label": ensemble.label,
        "bodies": len(ensemble),
        "spread": dict(sweep.spread),
        "seed": sweep.seed,
        "dt": ensemble.grid.dt,
        "steps": ensemble.grid.n_steps,
        "t_end": float(ensemble.t[-1]),
        "error": error,
        "samples": len(ensemble.t),
        "outcomes": {"ok": len(ensemble) - len(failed), **kinds},
        "failures": [
            {"body": i, "text": str(failure.outcome), **vars(failure.outcome)} for i, failure in failed[:MOST_FAILURES]
        ],
        "drift": drifts,
        "angle_from_mean": [
            {"t": float(ensemble.t[i]), **dict(zip(names, row, strict=True))} for i, row in zip(samples, quantiles, strict=True)
        ],
        **times,
    }


def _own_error(scene: Scene, method: Method, grid: Grid) -> dict[str, Any]:
    """Return the attitude error of the scene itself, rad, or None and the reason, and whether it is small.

    It is estimated from a run with twice the step, or measured if both differ completely or the second one fails.
    """
    grid, estimate = replace(grid, every=math.ceil(grid.n_steps / COMPARED)), math.inf
    with suppress(BadInput):  # fewer than eight steps, or twice the step is too long for the method
        parts = parts_for(scene)
        estimate = trials_of(scene).estimate(method, replace(grid, n_steps=grid.n_steps // parts * parts))[0].error
    if math.isfinite(estimate):
        return {"estimate": estimate, "reached": estimate <= LARGE}
    summary = find_errors(run_on(scene, method, grid), grid, None, None, None)
    attitude = summary.get("attitude")
    return {"estimate": attitude, "reached": attitude is not None and attitude <= LARGE, "reason": summary.get("reason")}


def rate_text(value: float) -> str:
    """Return a rate with three digits, such as 3,460 or 20.7M."""
    for size, prefix in ((1e9, "G"), (1e6, "M")):
        if value >= size:
            return f"{value / size:.3g}{prefix}"
    return f"{float(f'{value:.3g}'):,.0f}" if value >= 100 else f"{value:.3g}"
