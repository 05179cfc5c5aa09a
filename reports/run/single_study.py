"""A single study by name, with its default scenes and methods, and its measurements."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from operator import methodcaller

from conservative.benchmarks.measures.processes import PROCESSES, QUICK_PROCESSES
from conservative.benchmarks.studies import (
    engine_selection,
    hard_cases,
    on_cluster,
    price,
    random,
    selection,
    stability,
    studies,
    throughput,
)
from conservative.benchmarks.studies.study import Progress, Study
from conservative.check import choice
from conservative.errors import BadInput

from .measure import Measurements

DEFAULT_BODIES = 10
"""Random bodies in each field."""


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

    `sizes` are the numbers of bodies of the study of throughput, such as `1e3`; `bodies` and `seed` are those of random bodies.
    For the others see `Study`.

    Raises
    ------
    BadInput
        A name, a setting or a number is invalid, or does not apply to this study.
    MissingEngine
        An engine is not installed, and `skip_missing` is False.
    """
    choice("name", name, tuple(studies.MAKERS))
    _require_fitting(name, scenes=scenes, methods=methods, sizes=sizes, bodies=bodies, seed=seed)
    if name in studies.ENGINES:
        compared = engine_selection.select_engines(engines or (engine_selection.ALL,), skip_missing)
    else:
        of_family: dict[str, selection.Settings] = {
            studies.RANDOM: random.settings,
            studies.THROUGHPUT: methodcaller("settings_for", "many"),
        }
        named = selection.methods(methods or None, skip_missing, of_family.get(name, selection.all_variants))
        others = engine_selection.select_engines(engines, skip_missing) if engines else ()
        compared = tuple(dict.fromkeys((*named, *others)))
    processes = (QUICK_PROCESSES if quick else PROCESSES) if name in studies.IN_TURN else 1
    if name == studies.RANDOM:
        number = DEFAULT_BODIES if bodies is None else bodies
        return random.random_study(compared, number, seed or 0, quick, skip_missing, processes)
    if name == studies.THROUGHPUT:
        counts = tuple(read_count("sizes", size) for size in sizes)
        numbers = {"sizes": counts or None, "bodies": bodies, "seed": seed, "time_limit": time_limit}
        given = {key: value for key, value in numbers.items() if value is not None}
        return throughput.throughput_study(compared, quick=quick, skip_missing=skip_missing, processes=processes, **given)
    if name == "hard_cases":
        compared = hard_cases.settings(compared)
    usual = {
        "stability": lambda: selection.scenes(stability.SCENES),
        "hard_cases": hard_cases.scenes,
        "price": price.scenes,
    }
    chosen = selection.scenes(scenes) if scenes else usual.get(name, selection.scenes)()
    return Study(name, chosen, compared, quick, skip_missing, time_limit=time_limit, processes=processes)


def _require_fitting(name: str, **given: Sequence[str] | int | None) -> None:
    """Raise `BadInput` if an argument is given that a study does not have."""
    drawn = (studies.RANDOM, studies.THROUGHPUT)
    draws = f"nothing: only the studies {drawn[0]!r} and {drawn[1]!r} draw bodies"
    refused = (
        ("scenes", name in drawn, "none: the study draws its bodies; their number and seed are options"),
        ("bodies", name not in drawn, draws),
        ("seed", name not in drawn, draws),
        ("sizes", name != studies.THROUGHPUT, f"nothing: only the study {studies.THROUGHPUT!r} has numbers of bodies"),
        ("methods", name in studies.ENGINES, "none: the study is of --engines"),
    )
    for argument, applies, allowed in refused:
        value = given[argument]
        if applies and value not in (None, (), []):
            raise BadInput(argument, str(value) if isinstance(value, int) else ", ".join(value or ()), allowed)


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
