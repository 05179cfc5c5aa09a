"""Studies on a Dask cluster: a task for each scene, and the findings in the order of the scenes, as without one.

Only studies of accuracy: a time means something only where nothing else runs, and on one machine. How many points a slow engine
gets in a study of convergence depends on what its runs take; what they find does not.
"""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Future
from dataclasses import replace
from typing import Any

from conservative.errors import BadInput
from conservative.integration.cluster import start_executor
from conservative.references.truth import reference

from . import studies
from .study import Finding, Progress, Study, Truths

UNTIMED = ("paper", "convergence", "long_runs", "sphere_curves", "paper_figures", "stability", "hard_cases")
"""Studies whose findings are no times."""


def require_untimed(name: str) -> None:
    """Raise `BadInput` unless a study is one without times."""
    if name not in UNTIMED:
        allowed = f"none for a study of times, which share a machine with nothing; with one, {', '.join(UNTIMED)}"
        raise BadInput("scheduler", f"one for the study {name!r}", allowed)


def find_on_cluster(client: Any, study: Study, progress: Progress) -> Iterator[Finding]:
    """Yield what `studies.findings` yields of a study, found by the workers of a `dask.distributed.Client`.

    Raises
    ------
    BadInput
        The study is one of times, or the cluster has no workers, or some with another version of this package, or was lost.
    MissingEngine
        An engine is not installed there, and the study does not skip what is missing.
    """
    require_untimed(study.name)
    parts = [replace(study, scenes=(scene,), truth=reference) for scene in study.scenes]
    with start_executor(client) as executor:
        futures: list[Future[list[Finding]]] = [executor.submit(_find_all, part) for part in parts]
        try:
            for done, future in enumerate(futures):
                progress(done, len(parts), parts[done].scenes[0].name)
                yield from future.result()
        finally:
            for future in futures:
                future.cancel()


def _find_all(study: Study) -> list[Finding]:
    """Return all findings of a study, whose truths are found where it runs."""
    return list(studies.findings(replace(study, truth=Truths())))
