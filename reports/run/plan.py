"""The plan of a report: scenes, methods, engines, and the studies that measure them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

from conservative.benchmarks.measures.processes import PROCESSES
from conservative.benchmarks.studies import engine_selection, selection
from conservative.benchmarks.studies.declaration import Declaration, Extent
from conservative.benchmarks.studies.studies import STUDIES
from conservative.benchmarks.studies.study import Study, remember_truths
from conservative.method import Method
from conservative.references.environments.engine_method import EngineMethod
from conservative.scene import Scene

from .provenance import LockedEngine


@dataclass(frozen=True)
class Kind:
    """A kind of report: its longest studies, whether it has all methods, and the random bodies in each field.

    `time_limit` is the time budget of a run, s, None for the default of `Study`; `processes` is the number that time in turn.
    """

    extent: Extent
    every_method: bool = False
    bodies: int = 0
    time_limit: float | None = None
    processes: int = 1


DEFAULT, QUICK, FULL, QUICK_FULL = (False, False), (False, True), (True, False), (True, True)
KINDS = {
    DEFAULT: Kind(Extent.EVERY, bodies=1, time_limit=0.15),  # it takes a minute
    QUICK: Kind(Extent.EVERY, time_limit=0.15),
    FULL: Kind(Extent.LONG, every_method=True, bodies=3, processes=PROCESSES),
    QUICK_FULL: Kind(Extent.FULL, every_method=True, bodies=1),
}
"""The kinds of report by the options `--full` and `--quick`."""
FEW_METHODS, FEW_BODIES = ("taylor:order=12", "heyoka:frame=lean", "mujoco"), 3
"""Methods on the random bodies of a default report, and their number, each in a field of its own. A further field takes four
seconds after the installation, mostly to compile kernels, and a further method of ours two to four seconds a field."""


@dataclass(frozen=True)
class Plan:
    """The plan of a report: what is compared, and the studies in the order of measurement.

    Engines have a section of their own, and are verified if `verified`. `named` are the methods that the user
    named. `bodies` is the number of random bodies in each field, `seed` their seed. `arguments` are the texts from which
    commands make the scenes, such as their files, by the names of the scenes.
    """

    scenes: tuple[Scene, ...]
    methods: tuple[Method, ...]
    studies: tuple[Study, ...]
    engines: tuple[Method, ...] = ()
    named: tuple[Method, ...] = ()
    quick: bool = False
    skip_missing: bool = False
    png: bool = False
    latex: bool = False
    time_limit: float | None = None
    bodies: int = 0
    seed: int = 0
    arguments: Mapping[str, str] = field(default_factory=dict)
    verified: bool = False

    @property
    def locks(self) -> tuple[LockedEngine, ...]:
        """The locks of the environments that engines run in, sorted by name."""
        methods = (*self.methods, *self.engines)
        used = {method.environment.folder: method.environment for method in methods if isinstance(method, EngineMethod)}
        locks = (
            LockedEngine(f"{environment.engine}=={environment.version}", environment.runtime, environment.packages)
            for environment in used.values()
        )
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
    latex: bool = False,
    time_limit: float | None = None,
    bodies: int | None = None,
    seed: int = 0,
) -> Plan:
    """Return the plan of a report.

    Parameters
    ----------
    scenes, methods, engines
        Names. Default: the paper's two scenes, `selection.main_methods` (all registered methods if `full`), no engine.
    full, quick
        The kind of the report, see `KINDS`; `quick` also for each study.
    skip_missing, time_limit
        See `Study`. The default limit depends on the kind.
    png, latex
        True if pictures are also written as PNG, and a table as LaTeX.
    bodies, seed
        Random bodies in each field, and their seed. The default depends on the kind. A default report has one in each of
        `FEW_BODIES` fields, and none if a scene or a method is named; a full one has none if a scene is named.

    Raises
    ------
    BadInput
        A name or a setting is unknown, or the limit is not a finite duration above 0.
    MissingEngine
        An engine is not installed, and `skip_missing` is False.
    """
    names, methods, engines = tuple(scenes), tuple(methods), tuple(engines)
    kind = KINDS[full, quick]
    whole = bool(methods) or kind.every_method
    few = bodies is None and not names and not whole
    if bodies is None:
        bodies = 0 if names or (methods and not full) else kind.bodies
    chosen = selection.scenes(names) if names else selection.scenes()
    all_methods = selection.methods(methods or None, skip_missing) if whole or (bodies and not few) else ()
    compared = all_methods if whole else selection.main_methods(skip_missing)
    named = engine_selection.select_engines(engines, skip_missing) if engines else ()
    if not skip_missing:
        for method in (*compared, *named):
            _ = method.label  # contains the engine's version, so it raises `MissingEngine` before any work
    shared = {"truth": remember_truths(), "skip_missing": skip_missing}

    def methods_of(declared: Declaration) -> tuple[Method, ...]:
        """Return the methods of a study; none if the report does not have it."""
        if declared.extent > kind.extent or (declared.draw and not bodies) or (declared.scenes and names):
            return ()
        if declared.draw and few:
            return tuple(method for method in compared if method.name in FEW_METHODS)
        mine = all_methods if declared.draw else compared
        return declared.in_report(tuple(dict.fromkeys((*mine, *named))) if declared.named else mine)

    made: list[Study] = []
    for declared in STUDIES.values():
        if not (taken := methods_of(declared)):
            continue
        limit = kind.time_limit if time_limit is None and not (named and declared.named) else time_limit
        extent = {"skip_missing": skip_missing, "bodies": bodies, "seed": seed} if declared.draw else shared
        settings = {"quick": quick or (few and declared.draw is not None), "time_limit": limit, **extent}
        settings |= dict(declared.report_keywords)
        study = declared.plan(taken, () if declared.scenes else chosen, kind.processes, **settings)
        if declared.draw and few:
            study = replace(study, scenes=study.scenes[:FEW_BODIES], drawn=study.drawn[:FEW_BODIES])
        made.append(study)
    arguments = {scene.name: text for scene, text in zip(chosen, names or selection.DEFAULT_SCENES, strict=True)}
    asked = compared if methods else ()
    return Plan(
        *(chosen, compared, tuple(made), named, asked, quick, skip_missing, png, latex, time_limit, bodies, seed, arguments),
        verified=bool(named) and not names,
    )
