"""One sweep: many random starts of a scene, how they are run, and the summary of what they gave."""

from __future__ import annotations

import math
import warnings
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from conservative import registry
from conservative.attitude import Array
from conservative.check import MOST_STEPS, describe, positive_number
from conservative.errors import AccuracyNotReached, BadInput, NotWritten, nearest
from conservative.integration.distributions import QUANTILES, angle_quantiles, mean_attitudes
from conservative.integration.ensemble import Ensemble
from conservative.integration.many import integrate_many
from conservative.integration.spread import spread
from conservative.method import grid_for
from conservative.outcome import ProgressOfMany
from conservative.scene import Scene

from ..tables.cells import finite_or_none, outcome_record
from ..tables.sweep import rate_text

KINDS = ("attitude", "rate", "inertia")
FIELD = "potential."
_SPREAD = "what varies, and how, such as attitude=5deg, rate=2%, inertia=1% or potential.weight=2%"
MOST_TIMES = 6
"""Times at which a summary tells how far attitudes are apart."""
MOST_FAILURES = 10
"""Failures that a summary lists."""
Step = Callable[[float, str], None]
_WORDS = {"path": "out", "sample_every": "samples", "client": "scheduler", "n": "starts"}
"""Arguments of functions, and the options that they come from."""
_FOLDER = "a folder that is not there yet, such as sweep.zarr; the picture goes beside it, into sweep.svg"


@dataclass(frozen=True, eq=False)
class Sweep:
    """What is asked for: n starts of a scene, spread as `spread` has it, and how they are integrated."""

    scene: Scene
    n: int
    spread: Mapping[str, Any]
    seed: int
    settings: Mapping[str, Any]
    steps: int | None = None
    """Of each body, where that is known before the run."""


def read_spread(items: Iterable[str]) -> dict[str, Any]:
    """Return the arguments that the function `spread` takes for texts such as `attitude=5deg` and `potential.weight=2%`.

    Raises
    ------
    BadInput
        A text says nothing of the kind, or a quantity stands there twice.
    """
    found: dict[str, Any] = {}
    parameters: dict[str, str] = {}
    for item in items:
        name, _, value = (part.strip() for part in item.partition("="))
        if not value:
            raise BadInput("spread", repr(item), _SPREAD)
        part, key = (parameters, name.removeprefix(FIELD)) if name.startswith(FIELD) else (found, name)
        if part is found and name not in KINDS:
            raise BadInput("spread", repr(name), f"{nearest(name, KINDS)}, or {FIELD} and the name of a number of the field")
        if key in part:
            raise BadInput("spread", f"{item!r} after {name}={part[key]}", "each quantity once")
        part[key] = value
    return found | ({"parameters": parameters} if parameters else {})


def plan(scene_name: str, n: int, varied: Mapping[str, Any], seed: int, **settings: Any) -> Sweep:
    """Return what is asked for; the settings are those of `integrate_many`, and `samples`, how many of each body are kept.

    Raises
    ------
    BadInput
        A name or a number cannot be used.
    """
    scene = registry.scene(scene_name)
    if settings["resume"] and settings["path"] is None:
        raise BadInput("resume", "no folder", "--out, the folder of a sweep that was interrupted")
    samples, dt, end = settings.pop("samples"), settings.pop("dt"), settings["t_end"]
    if settings["error"] is None:
        grid = grid_for(scene, scene.dt if dt is None else dt, end, MOST_STEPS)
        settings |= {"dt": grid.dt, "sample_every": math.ceil(grid.n_steps / (samples - 1))}
        return Sweep(scene, n, varied, seed, settings, grid.n_steps)
    if dt is not None:
        raise BadInput("dt", describe(dt), "none together with --error, which chooses the step")
    end = scene.t_end if end is None else positive_number("t_end", end, "a finite duration above 0, s")
    return Sweep(scene, n, varied, seed, settings | {"dt": end / (samples - 1)})


@dataclass(frozen=True, eq=False)
class Result:
    """What a sweep gave, the wall time that took, s, and the last that was heard of its progress, None of no work."""

    ensemble: Ensemble
    wall: float
    last: ProgressOfMany | None


def run_sweep(sweep: Sweep, step: Step) -> Result:
    """Return what the sweep gives; `step` is called with the share that is done, and how fast, in words.

    Raises
    ------
    BadInput
        A spread, a setting or a folder cannot be used; messages name options.
    """
    heard: list[ProgressOfMany] = []

    def hear(progress: ProgressOfMany) -> None:
        heard[:] = [progress]
        step(progress.done / progress.total, _progress_text(sweep, progress))

    step(0.0, "preparing: a first run compiles")
    try:
        starts, settings = spread(sweep.scene, sweep.n, seed=sweep.seed, **sweep.spread), _given(sweep.settings)
        begin = perf_counter()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", AccuracyNotReached)  # the summary says so
            found = integrate_many(sweep.scene, **starts, **settings, progress=hear)
    except KeyboardInterrupt as stop:
        if heard and (text := _kept_text(sweep, heard[0])):
            stop.add_note(text)
        raise
    except BadInput as error:
        raise _in_options(error) from None
    return Result(found, perf_counter() - begin, heard[0] if heard else None)


def _given(settings: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in settings.items() if value not in (None, False)}


def _in_options(error: BadInput) -> BadInput:
    """Return an error about an argument of a function as one about an option."""
    allowed = error.allowed.replace("resume=True", "--resume")
    argument = _WORDS.get(error.argument, error.argument)
    if argument == "samples":
        allowed = allowed.replace("a larger one, or a path", "fewer samples or starts, or a folder for them, --out")
        return BadInput(argument, str(error.got).partition("for ")[2], allowed)
    if isinstance(error, NotWritten):
        return NotWritten(argument, error.path, error.cause, allowed)
    return BadInput(argument, error.got, allowed)


def _kept_text(sweep: Sweep, progress: ProgressOfMany) -> str:
    """Return what is kept, should the run end now; nothing where it is not written to a folder."""
    out = sweep.settings.get("path")
    if out is None:
        return ""
    return f"{progress.done:,} of {progress.total:,} bodies are finished in {out}; the same command with --resume does the rest"


def _progress_text(sweep: Sweep, progress: ProgressOfMany) -> str:
    steps = f", {rate_text(progress.rate * sweep.steps)} steps/s" if sweep.steps else ""
    return f"{rate_text(progress.rate)} bodies/s{steps}"


def summarize(sweep: Sweep, result: Result) -> dict[str, Any]:
    """Return what was run, how it ended, what drifted and how far attitudes are apart."""
    found, last = result.ensemble, result.last
    rate = (last.done - last.found) / (last.elapsed or result.wall) if last else 0.0
    failed = sorted(found.failures.items())
    kinds = Counter(failure.outcome.kind.value for _, failure in failed)
    return {
        "scene": sweep.scene.name,
        "label": found.label,
        "bodies": len(found),
        "spread": _flat(sweep.spread),
        "seed": sweep.seed,
        "dt": found.grid.dt,
        "steps": found.grid.n_steps,
        "t_end": float(found.t[-1]),
        "error": _error_of(found.choice),
        "samples": len(found.t),
        "outcomes": {"ok": len(found) - len(failed), **kinds},
        "failures": [
            {"body": i, "text": str(failure.outcome), **outcome_record(failure.outcome)}
            for i, failure in failed[:MOST_FAILURES]
        ],
        "drift": {name: _largest(values) for name, values in found.drifts.items()},
        "angle_from_mean": _angles(found),
        "wall_time": result.wall,
        "found_before": last.found if last else len(found),
        "bodies_per_second": rate,
        "body_steps_per_second": rate * found.grid.n_steps,
    }


def _error_of(choice: Any) -> dict[str, Any] | None:
    """Return the error that was asked for, rad, and its estimate, and on how many bodies that rests."""
    if choice is None:
        return None
    return {"asked": choice.error, "estimate": choice.estimate, "reached": choice.reached, "bodies": choice.bodies}


def _flat(varied: Mapping[str, Any]) -> dict[str, str]:
    plain = {name: value for name, value in varied.items() if name != "parameters"}
    return plain | {f"{FIELD}{name}": value for name, value in varied.get("parameters", {}).items()}


def _largest(values: Array) -> dict[str, Any] | None:
    """Return the largest and the median drift (n,), and the number of the body that has the largest; None of none."""
    if np.isnan(values).all():
        return None
    body = int(np.nanargmax(values))
    return {"largest": float(values[body]), "body": body, "median": float(np.nanmedian(values))}


def _angles(found: Ensemble) -> list[dict[str, float | None]]:
    """Return quantiles of angles from the mean attitude, rad, at a few times, s."""
    samples = np.unique(np.rint(np.linspace(0, len(found.t) - 1, MOST_TIMES)).astype(int)).tolist()
    quantiles = angle_quantiles(found.R_WB, mean_attitudes(found.R_WB, samples), samples)
    names = [f"p{100 * share:g}" for share in QUANTILES]
    return [
        dict(zip(["t", *names], [float(found.t[i]), *map(finite_or_none, row)], strict=True))
        for i, row in zip(samples, quantiles.tolist(), strict=True)
    ]


def picture_path(out: Path) -> Path:
    """Return the file of the picture beside a folder of samples. Raise `BadInput` where both would be the same."""
    try:
        picture = out.with_suffix(".svg")
    except ValueError:  # no name, such as . or /
        picture = out
    if picture == out:
        raise BadInput("out", repr(str(out)), _FOLDER)
    return picture
