"""The plan of a report: scenes, methods, engines, and the studies that measure them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

from conservative.benchmarks.measures.processes import PROCESSES
from conservative.benchmarks.studies import engine_selection, many_runs, price, random, selection, studies, throughput
from conservative.benchmarks.studies.study import Study
from conservative.method import Method
from conservative.references.environments.engine_method import EngineMethod
from conservative.scene import Scene

from .provenance import LockedEngine

MAIN_TIME_LIMIT = 0.15
"""Time budget of a run, s, in a default report, which then takes a minute; the default of `Study` is used in a full report."""
BODIES, QUICK_BODIES = 3, 1
"""Random bodies in each field of a full report, and of a quick one."""
FEW_METHODS, FEW_BODIES = ("taylor:order=12", "heyoka:frame=lean", "mujoco"), 3
"""Methods on the random bodies of a default report, and their number, each in a field of its own. A further field takes four
seconds after the installation, mostly to compile kernels, and a further method of ours two to four seconds a field."""


@dataclass(frozen=True)
class Plan:
    """The plan of a report: what is compared, and the studies in the order of measurement.

    Engines have studies and a section of their own. `bodies` is the number of random bodies in each field, `seed` their seed.
    `arguments` are the texts from which commands make the scenes, such as their files, by the names of the scenes.
    """

    scenes: tuple[Scene, ...]
    methods: tuple[Method, ...]
    studies: tuple[Study, ...]
    engines: tuple[Method, ...] = ()
    quick: bool = False
    skip_missing: bool = False
    png: bool = False
    time_limit: float | None = None
    bodies: int = 0
    seed: int = 0
    arguments: Mapping[str, str] = field(default_factory=dict)

    @property
    def locks(self) -> tuple[LockedEngine, ...]:
        """The locks of the environments that engines run in, sorted by name."""
        methods = (*self.methods, *self.engines)
        used = {each.environment.folder: each.environment for each in methods if isinstance(each, EngineMethod)}
        locks = (LockedEngine(f"{each.engine}=={each.version}", each.runtime, each.packages) for each in used.values())
        return tuple(sorted(locks, key=lambda lock: lock.name))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the studies."""
        return tuple(study.name for study in self.studies)


def plan_report(
    scenes: Iterable[str] = (),
    methods: Iterable[str] = (),
    engines: Iterable[str] = (),
    full: bool = False,
    quick: bool = False,
    skip_missing: bool = False,
    png: bool = False,
    time_limit: float | None = None,
    bodies: int | None = None,
    seed: int = 0,
) -> Plan:
    """Return the plan of a report.

    Parameters
    ----------
    scenes, methods, engines
        Names. Default: the paper's two scenes, `selection.main_methods` (all registered methods if `full`), no engine.
    full
        True if everything is measured: more random bodies, many bodies, hard cases, stability and the paper's figures as well.
    quick, skip_missing, time_limit
        See `Study`. A quick report has no study of hard cases or of many bodies. The default limit is `MAIN_TIME_LIMIT` for the
        scenes, unless `full`.
    png
        True if pictures are also written as PNG.
    bodies, seed
        Random bodies in each field, and their seed. Default if no scene is named: if `full` `BODIES`, or `QUICK_BODIES` if
        `quick`; in a default report one in each of `FEW_BODIES` fields. Otherwise none.

    Raises
    ------
    BadInput
        A name or a setting is unknown, or the limit is not a finite duration above 0.
    MissingEngine
        An engine is not installed, and `skip_missing` is False.
    """
    names, methods = tuple(scenes), tuple(methods)
    few = bodies is None and not (names or methods or full or quick)
    if bodies is None:
        bodies = 1 if few else 0 if names or not full else QUICK_BODIES if quick else BODIES
    chosen = selection.scenes(names) if names else selection.scenes()
    every = selection.methods(methods or None, skip_missing) if methods or full or (bodies and not few) else ()
    compared = every if methods or full else selection.main_methods(skip_missing)
    named = engine_selection.select_engines(engines, skip_missing) if (engines := tuple(engines)) else ()
    if not skip_missing:
        for method in (*compared, *named):
            _ = method.label  # contains the engine's version, so it raises `MissingEngine` before any work
    made: list[Study] = []
    # Random bodies come first, as on the page. Methods that do not support them are not part of the study.
    processes = PROCESSES if full and not quick else 1
    drawn = tuple(method for method in compared if method.name in FEW_METHODS) if few else random.select(every)
    if bodies and drawn:
        study = random.random_study(drawn, bodies, seed, quick or few, skip_missing, processes)
        made.append(replace(study, scenes=study.scenes[:FEW_BODIES], drawn=study.drawn[:FEW_BODIES]) if few else study)
    # In the order of the table of all studies.
    crossed = [name for name in studies.MAKERS if name in studies.MAIN or (full and name in studies.MORE)]
    main_limit = MAIN_TIME_LIMIT if time_limit is None and not full else time_limit
    made += studies.cross_studies(crossed, chosen, compared, quick, skip_missing, main_limit, processes)
    made = [replace(each, methods=(*compared, *named)) if each.name == "motion" else each for each in made]
    if named:
        made += studies.cross_studies(studies.ENGINES, chosen, named, quick, skip_missing, time_limit)
    if full and not (names or quick):
        made += studies.list_hard_studies(compared, skip_missing, time_limit)
    if full and bodies and not quick:
        made += studies.cross_studies((studies.PRICE,), price.scenes(), compared, skip_missing=skip_missing)
    # The coarse study of many bodies, with one setting of each family. Not in a quick report: preparing engines takes minutes.
    if full and bodies and not quick and (many := many_runs.family_settings((*compared, *named))):
        more = {"skip_missing": skip_missing, "time_limit": time_limit, "processes": processes}
        made.append(throughput.throughput_study(many, quick=True, seed=seed, **more))
    arguments = {scene.name: text for scene, text in zip(chosen, names or selection.DEFAULT_SCENES, strict=True)}
    return Plan(chosen, compared, tuple(made), named, quick, skip_missing, png, time_limit, bodies, seed, arguments)
