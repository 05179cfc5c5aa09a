"""Studies on a Dask cluster: a task for each scene, with the findings in the order of the scenes.

Only studies of accuracy run on a cluster, because times are comparable on one idle machine only. The number of points of a slow
engine in a study of convergence depends on the time of its runs; their values do not.
"""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Future
from dataclasses import replace

from conservative.errors import BadInput
from conservative.integration.cluster import open_client, start_executor
from conservative.references.truth import reference

from . import studies
from .study import Finding, Progress, Study, remember_truths


def find_on_cluster(scheduler: str, study: Study, progress: Progress) -> Iterator[Finding]:
    """Yield the findings of a study from the workers of the Dask cluster with this scheduler; see `studies.findings`.

    Raises
    ------
    BadInput
        The study measures times, or no scheduler answers, or the cluster has no workers, has workers with another version of
        this package, or was lost.
    MissingEngine
        An engine is not installed there, and `skip_missing` is False.
    MissingExtra
        Dask, of the extra `cluster`, is not installed.
    """
    if studies.STUDIES[study.name].timed:
        untimed = ", ".join(name for name, declared in studies.STUDIES.items() if not declared.timed)
        allowed = f"no scheduler for a study of times, which need an idle machine, or one of {untimed}"
        raise BadInput("scheduler", f"one for the study {study.name!r}", allowed)
    parts = [replace(study, scenes=(scene,), truth=reference) for scene in study.scenes]
    with open_client(scheduler) as client, start_executor(client) as executor:
        futures: list[Future[list[Finding]]] = [executor.submit(_find_all, part) for part in parts]
        try:
            for done, future in enumerate(futures):
                progress(done / len(parts), parts[done].scenes[0].name)
                yield from future.result()
        finally:
            for future in futures:
                future.cancel()


def _find_all(study: Study) -> list[Finding]:
    """Return all findings of a study; the worker computes the reference solutions."""
    return list(studies.findings(replace(study, truth=remember_truths())))
