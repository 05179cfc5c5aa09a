"""One study, out of the table of them, on its own: what it is of where nothing is named, and its measurements."""

from __future__ import annotations

from dataclasses import dataclass

from conservative.benchmarks.measures import measurement, samples
from conservative.benchmarks.studies import engine_selection, hard_cases, random, selection, stability, studies
from conservative.benchmarks.studies.study import Progress, Study
from conservative.check import choice
from conservative.errors import BadInput
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
    for argument, value in (("bodies", extent.bodies), ("seed", extent.seed)):
        if value is not None:
            raise BadInput(argument, str(value), f"nothing: only the study {studies.RANDOM!r} draws bodies")
    limits = (extent.quick, extent.skip_missing)
    return Study(name, _scenes(name, extent), _methods(name, extent), *limits, time_limit=extent.time_limit)


def _random(extent: Extent) -> Study:
    if extent.scenes:
        raise BadInput("scenes", ", ".join(extent.scenes), "none: the study draws its bodies; say how many, and a seed")
    bodies = DEFAULT_BODIES if extent.bodies is None else extent.bodies
    found = selection.methods(extent.methods or None, extent.skip_missing, random.settings)
    methods = tuple(dict.fromkeys((*found, *_engines(extent))))
    return studies.random_study(methods, bodies, extent.seed or 0, extent.quick, extent.skip_missing)


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


def measure_study(study: Study, progress: Progress) -> Measurements:
    """Return all that the study finds."""
    findings = list(studies.findings(study, progress))
    return Measurements(
        measurement.frame(each for each in findings if isinstance(each, measurement.Measurement)),
        samples.frame(each for each in findings if isinstance(each, samples.Samples)),
    )
