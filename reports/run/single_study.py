"""One study, out of the table of them, on its own: what it is of where nothing is named, and its measurements."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass

from conservative.benchmarks.measures import measurement, samples
from conservative.benchmarks.studies import (
    engine_selection,
    hard_cases,
    many_runs,
    on_cluster,
    random,
    selection,
    stability,
    studies,
)
from conservative.benchmarks.studies.study import Finding, Progress, Study
from conservative.check import choice
from conservative.errors import BadInput
from conservative.integration.cluster import open_client
from conservative.method import Method
from conservative.scene import Scene

from .measure import Measurements

DEFAULT_BODIES = 10
"""Random bodies in each field."""


@dataclass(frozen=True)
class Extent:
    """What a study is asked to be of; names that are left out stand for what the study usually takes."""

    scenes: tuple[str, ...] = ()
    methods: tuple[str, ...] = ()
    engines: tuple[str, ...] = ()
    sizes: tuple[str, ...] = ()
    bodies: int | None = None
    seed: int | None = None
    quick: bool = False
    skip_missing: bool = False
    time_limit: float | None = None


def plan_study(name: str, extent: Extent) -> Study:
    """Return the study of that name.

    Raises
    ------
    BadInput
        A name, a setting or a number cannot be used, or is not for this study.
    MissingEngine
        An engine is not installed, and `skip_missing` is False.
    """
    choice("name", name, tuple(studies.MAKERS))
    if name == studies.RANDOM:
        return _random(extent)
    if name == studies.THROUGHPUT:
        return _throughput(extent)
    for argument, value in (("bodies", extent.bodies), ("seed", extent.seed), ("sizes", extent.sizes or None)):
        if value is not None:
            drawn = f"the studies {studies.RANDOM!r} and {studies.THROUGHPUT!r} draw bodies"
            raise BadInput(argument, str(value), f"nothing: only {drawn}")
    limits = (extent.quick, extent.skip_missing)
    return Study(name, _scenes(name, extent), _methods(name, extent), *limits, time_limit=extent.time_limit)


def _random(extent: Extent) -> Study:
    _require_drawn(extent)
    if extent.sizes:
        raise BadInput(
            "sizes", ", ".join(extent.sizes), f"nothing: only the study {studies.THROUGHPUT!r} has numbers of bodies"
        )
    bodies = DEFAULT_BODIES if extent.bodies is None else extent.bodies
    found = selection.methods(extent.methods or None, extent.skip_missing, random.settings)
    methods = tuple(dict.fromkeys((*found, *_engines(extent))))
    return studies.random_study(methods, bodies, extent.seed or 0, extent.quick, extent.skip_missing)


def _throughput(extent: Extent) -> Study:
    """Return the study of many bodies: of what runs many at once, of what is named, and of engines that are."""
    _require_drawn(extent)
    found = selection.methods(extent.methods or None, extent.skip_missing, many_runs.settings)
    methods = tuple(dict.fromkeys((*found, *_engines(extent))))
    sizes = tuple(read_count("sizes", size) for size in extent.sizes)
    numbers = {"sizes": sizes or None, "bodies": extent.bodies, "seed": extent.seed, "time_limit": extent.time_limit}
    given = {name: value for name, value in numbers.items() if value is not None}
    return studies.throughput_study(methods, quick=extent.quick, skip_missing=extent.skip_missing, **given)


def _require_drawn(extent: Extent) -> None:
    if extent.scenes:
        raise BadInput("scenes", ", ".join(extent.scenes), "none: the study draws its bodies; say how many, and a seed")


def read_count(argument: str, text: str) -> int:
    """Return the number that a text such as `1e6` stands for. Raise `BadInput` for what is no integer of 1 or more."""
    with suppress(ValueError, OverflowError):
        if (number := float(text)) >= 1 and number == int(number):
            return int(number)
    raise BadInput(argument, repr(text), "an integer of 1 or more, such as 1000 or 1e6")


def _engines(extent: Extent) -> tuple[Method, ...]:
    return engine_selection.select_engines(extent.engines, extent.skip_missing) if extent.engines else ()


def _scenes(name: str, extent: Extent) -> tuple[Scene, ...]:
    if extent.scenes:
        return selection.scenes(extent.scenes)
    usual = {"stability": lambda: selection.scenes(stability.SCENES), "hard_cases": hard_cases.scenes}
    return usual.get(name, selection.scenes)()


def _methods(name: str, extent: Extent) -> tuple[Method, ...]:
    if name in studies.ENGINES:
        if extent.methods:
            raise BadInput("methods", ", ".join(extent.methods), "none: the study is of --engines")
        return engine_selection.select_engines(extent.engines or (engine_selection.ALL,), extent.skip_missing)
    found = tuple(dict.fromkeys((*selection.methods(extent.methods or None, extent.skip_missing), *_engines(extent))))
    return hard_cases.settings(found) if name == "hard_cases" else found


def measure_study(study: Study, progress: Progress, scheduler: str | None = None) -> Measurements:
    """Return all that the study finds: here, or on the Dask cluster whose scheduler has this address.

    Raises
    ------
    BadInput
        The study is one of times, no scheduler answers, or its workers cannot be used.
    MissingExtra
        Dask, of the extra `cluster`, is not installed.
    """
    findings = list(studies.findings(study, progress)) if scheduler is None else _find_there(study, progress, scheduler)
    return Measurements(
        measurement.frame(each for each in findings if isinstance(each, measurement.Measurement)),
        samples.frame(each for each in findings if isinstance(each, samples.Samples)),
    )


def _find_there(study: Study, progress: Progress, scheduler: str) -> list[Finding]:
    on_cluster.require_untimed(study.name)
    with open_client(scheduler) as client:
        return list(on_cluster.find_on_cluster(client, study, progress))
