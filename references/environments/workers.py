"""One worker for each environment: started when it is first asked, ended with this process."""

from __future__ import annotations

import atexit
import os
from collections.abc import Mapping
from pathlib import Path
from threading import Lock

from .client import Worker
from .environment import Environment, temporary_folder

_workers: dict[tuple[tuple[object, ...], int], Worker] = {}
_lock = Lock()


def worker_of(environment: Environment, variables: Mapping[str, str] | None = None) -> Worker:
    """Return the worker of an environment whose process has some variables beside ours.

    A forked process has workers of its own, as two cannot share a pipe.
    """
    key = (environment.folder, *sorted((variables or {}).items())), os.getpid()
    with _lock:
        if key not in _workers:
            home = environment.folder / "home"
            _workers[key] = Worker(environment.interpreter, home, temporary_folder(), variables)
        return _workers[key]


@atexit.register
def close_workers(folder: Path | None = None) -> None:
    """End the workers of an environment, by default all of this process; each is started again when it is asked."""
    for ((place, *_), process), worker in list(_workers.items()):
        if process == os.getpid() and folder in (None, place):
            worker.close()
