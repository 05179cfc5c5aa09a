"""One sweep: many random starts of a scene, how they are run, and the summary of what they gave."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from conservative import registry
from conservative.attitude import Array
from conservative.check import positive_number
from conservative.errors import BadInput, nearest
from conservative.integration.distributions import QUANTILES, angle_quantiles, mean_attitudes
from conservative.integration.ensemble import Ensemble
from conservative.integration.many import integrate_many
from conservative.integration.spread import spread
from conservative.method import grid_for
from conservative.scene import Scene

from ..tables.cells import outcome_record

KINDS = ("attitude", "rate", "inertia")
FIELD = "potential."
_SPREAD = "what varies, and how, such as attitude=5deg, rate=2%, inertia=1% or potential.weight=2%"
MOST_TIMES = 6
"""Times at which a summary tells how far attitudes are apart."""
MOST_FAILURES = 10
"""Failures that a summary lists."""
Told = Callable[[int, int], None]
"""Called with the number of bodies that are done, and of all."""


@dataclass(frozen=True, eq=False)
class Sweep:
    """What is asked for: n starts of a scene, spread as `spread` has it, and how they are integrated."""

    scene: Scene
    n: int
    spread: Mapping[str, Any]
    seed: int
    settings: Mapping[str, Any]


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
    samples, dt, error = settings.pop("samples"), settings.pop("dt"), settings["error"]
    if error is None:
        grid = grid_for(scene, scene.dt if dt is None else dt, settings["t_end"], 2**53)
        settings |= {"dt": grid.dt, "sample_every": math.ceil(grid.n_steps / (samples - 1))}
    else:
        end = scene.t_end if settings["t_end"] is None else positive_number("t_end", settings["t_end"])
        settings |= {"dt": end / (samples - 1) if dt is None else dt}
    return Sweep(scene, n, varied, seed, settings)


def run_sweep(sweep: Sweep, tell: Told) -> tuple[Ensemble, float]:
    """Return what the sweep gives, and the wall time that took, s.

    Raises
    ------
    BadInput
        A spread, a setting or a folder cannot be used.
    """
    starts = spread(sweep.scene, sweep.n, seed=sweep.seed, **sweep.spread)
    begin = perf_counter()
    found = integrate_many(sweep.scene, **starts, **sweep.settings, progress=tell)
    return found, perf_counter() - begin


def summarize(sweep: Sweep, found: Ensemble, wall: float, computed: int) -> dict[str, Any]:
    """Return what was run, how it ended, what drifted and how far attitudes are apart; `computed` bodies took `wall` s."""
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
        "samples": len(found.t),
        "outcomes": {"ok": len(found) - len(failed), **kinds},
        "failures": [{"body": i, **outcome_record(failure.outcome)} for i, failure in failed[:MOST_FAILURES]],
        "drift": {name: _largest(values) for name, values in found.drifts.items()},
        "angles_from_mean": _angles(found),
        "wall_time": wall,
        "bodies_per_second": computed / wall,
        "body_steps_per_second": computed * found.grid.n_steps / wall,
    }


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
    samples = np.unique(np.linspace(0, len(found.t) - 1, MOST_TIMES).astype(int)).tolist()
    quantiles = angle_quantiles(found.R_WB, mean_attitudes(found.R_WB, samples), samples)
    return [
        {"t": float(found.t[i])} | {f"{share:g}": _finite(value) for share, value in zip(QUANTILES, row, strict=True)}
        for i, row in zip(samples, quantiles.tolist(), strict=True)
    ]


def _finite(value: float) -> float | None:
    return None if math.isnan(value) else value


def draw_svg(found: Ensemble) -> str:
    """Return the picture of an ensemble as SVG."""
    import vl_convert

    from ..charts.style import apply_style

    return str(vl_convert.vegalite_to_svg(apply_style(found.plot()).to_dict()))


def picture_path(out: Path) -> Path:
    """Return the file of the picture beside a folder of samples."""
    return out.with_suffix(".svg")
