"""One worker for each environment: started when it is first asked, ended with this process."""

from __future__ import annotations

import atexit
import os
from collections.abc import Mapping
from threading import Lock

from .client import Worker
from .environment import Environment, temporary_folder

_workers: dict[tuple[str, int], Worker] = {}
_lock = Lock()


def worker_of(environment: Environment, variables: Mapping[str, str] | None = None) -> Worker:
    """Return the worker of an environment. A forked process has workers of its own: two cannot share a pipe."""
    key = str(environment.folder), os.getpid()
    with _lock:
        if key not in _workers:
            home = environment.folder / "home"
            _workers[key] = Worker(environment.interpreter, home, temporary_folder(), variables)
        return _workers[key]


@atexit.register
def close_workers() -> None:
    """End all workers of this process; each is started again when it is asked."""
    for (_, process), worker in list(_workers.items()):
        if process == os.getpid():
            worker.close()
