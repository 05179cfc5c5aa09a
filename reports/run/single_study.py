"""A single study by name, with its default scenes and methods, and its measurements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any

from conservative.benchmarks.measures.processes import PROCESSES, QUICK_PROCESSES
from conservative.benchmarks.studies import engine_selection, on_cluster, selection, studies
from conservative.benchmarks.studies.declaration import Declaration
from conservative.benchmarks.studies.study import Progress, Study
from conservative.check import choice
from conservative.errors import BadInput

from .measure import Measurements


def plan_study(
    name: str,
    scenes: Sequence[str] = (),
    methods: Sequence[str] = (),
    engines: Sequence[str] = (),
    sizes: Sequence[str] = (),
    bodies: int | None = None,
    seed: int | None = None,
    quick: bool = False,
    skip_missing: bool = False,
    time_limit: float | None = None,
) -> Study:
    """Return a study by name. Omitted scenes, methods and engines are the defaults of the study.

    `sizes` are the numbers of bodies of the study of throughput, such as `1e3`; `bodies` and `seed` are of random bodies.
    For the others see `Study`.

    Raises
    ------
    BadInput
        A name, a setting or a number is invalid, or does not apply to this study.
    MissingEngine
        An engine is not installed, and `skip_missing` is False.
    """
    choice("name", name, tuple(studies.STUDIES))
    declared = studies.STUDIES[name]
    options = {"scenes": scenes, "methods": methods, "sizes": sizes, "bodies": bodies, "seed": seed}
    _require_options(declared, {option: value for option, value in options.items() if value not in (None, (), [])})
    counts = tuple(read_count("sizes", size) for size in sizes)
    extent = {
        key: value for key, value in {"sizes": counts or None, "bodies": bodies, "seed": seed}.items() if value is not None
    }
    ours = selection.methods(methods or None, skip_missing, declared.settings)
    others = declared.of_engines(engine_selection.select_engines(engines, skip_missing)) if engines else ()
    compared = tuple(dict.fromkeys((*ours, *others)))
    settings = {"quick": quick, "skip_missing": skip_missing, "time_limit": time_limit, **extent}
    processes = QUICK_PROCESSES if quick else PROCESSES
    return declared.plan(compared, selection.scenes(scenes) if scenes else (), processes, **settings)


def _require_options(declared: Declaration, options: Mapping[str, Any]) -> None:
    """Raise `BadInput` if an option is given that the study does not have."""
    for option, value in options.items():
        if option not in declared.options:
            text = ", ".join(map(str, value)) if isinstance(value, Sequence) else str(value)
            allowed = f"nothing: the study {declared.name!r} has no {option}; it has {', '.join(declared.options)}"
            raise BadInput(option, text, allowed)


def read_count(argument: str, text: str) -> int:
    """Return the value of a text such as `1e6`. Raise `BadInput` if it is not an integer of 1 or more."""
    with suppress(ValueError, OverflowError):
        if (number := float(text)) >= 1 and number == int(number):
            return int(number)
    raise BadInput(argument, repr(text), "an integer of 1 or more, such as 1000 or 1e6")


def measure_study(study: Study, progress: Progress, scheduler: str | None = None) -> Measurements:
    """Return the findings of a study, measured here or on the Dask cluster with this scheduler (see `find_on_cluster`)."""
    if scheduler is None:
        return Measurements.of(studies.findings(study, progress))
    return Measurements.of(on_cluster.find_on_cluster(scheduler, study, progress))
