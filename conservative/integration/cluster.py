"""Blocks of bodies on a Dask cluster, through an executor of `concurrent.futures`.

    from dask.distributed import Client

    with Client("tcp://10.0.0.7:8786") as client:  # or open_client, whose error is one line
        ensemble = cv.integrate_many(scene, w_WB_B0=starts, path="starts.zarr", client=client)

A task is a pure function of the bytes in its message. Its result returns to the submitting process. Workers need no
common file system. If a worker dies, another one runs its tasks, and only one result is used if a task runs twice. Workers
need the same version of this package, which is checked before any work. On processors of the same kind the results are the same
as without a cluster, bit for bit; compiled code differs between kinds.

If a worker dies with results, the scheduler tries to reach it for 30 s (its setting `distributed.comm.timeouts.connect`) before
other workers compute them again. The run waits for that long.

Futures of Dask's own `Client.get_executor` are not used, because they never end if fetching a result fails, for example when a
scheduler dies (distributed 2026.8.0).
"""

from __future__ import annotations

import logging
import pkgutil
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Executor, Future
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, TypeVar

from ..check import describe
from ..errors import BadInput, require_extra
from ..pickling import dump, load
from ..version import VERSION

if TYPE_CHECKING:
    from distributed import Client

T = TypeVar("T")
CONNECT_LIMIT = 5.0
"""Time, s, that a scheduler may take to answer."""
_LOGGERS = ("distributed", "distributed.client", "tornado.application")
"""Loggers that print tracebacks of exceptions that are also raised."""


@contextmanager
def open_client(address: str, limit: float = CONNECT_LIMIT) -> Iterator[Client]:
    """Yield a client of the scheduler at an address such as `tcp://127.0.0.1:8786`, without Dask's own messages in the block.

    The scheduler has `limit`, s, to answer. Raise `BadInput` if no scheduler answers there or it is not an address, and
    `MissingExtra` without Dask, of the extra `cluster`.
    """
    require_extra("scheduler", "cluster")
    from distributed import Client
    from distributed.comm import get_address_host_port

    levels = {name: logging.getLogger(name).level for name in _LOGGERS}
    for name in levels:
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    try:
        try:
            get_address_host_port(address)  # a client with a wrong address raises again when it is collected
            client = Client(address, timeout=limit, set_as_default=False)
        except Exception as error:  # another program at that address can answer anything
            got = f"{address!r}, where no scheduler answers ({error or type(error).__name__})"
            allowed = "the address of a Dask scheduler that runs, such as 'tcp://127.0.0.1:8786'"
            raise BadInput("scheduler", got, allowed) from None
        with client:
            yield client
    finally:
        for name, level in levels.items():
            logging.getLogger(name).setLevel(level)


@contextmanager
def start_executor(client: Client) -> Iterator[ClusterExecutor]:
    """Yield an executor on the workers of a client, after comparing their versions with this one.

    Raise `BadInput` if the argument is not a connected client, or there are no workers, or some with another version of this
    package; from the block, if the cluster was lost, or a task ended every worker that tried it. Raise `MissingExtra` without
    Dask, of the extra `cluster`.
    """
    require_extra("client", "cluster")
    from distributed import Client, KilledWorker
    from distributed.comm import CommClosedError

    allowed = "a dask.distributed.Client, not asynchronous, whose scheduler runs, or None"
    if not isinstance(client, Client):
        raise BadInput("client", describe(client), allowed)
    if client.asynchronous or client.status != "running":
        raise BadInput("client", f"one that is {'asynchronous' if client.asynchronous else client.status}", allowed)
    try:
        require_versions(client)
        yield ClusterExecutor(client)
    except (CommClosedError, KilledWorker, CancelledError) as error:
        allowed = (
            "a cluster that keeps running; blocks written to a path stay there; resume=True computes the others (--resume)"
        )
        raise BadInput("client", f"a cluster that was lost ({type(error).__name__}: {error})", allowed) from error


def require_versions(client: Any) -> None:
    """Raise `BadInput` unless the client has workers, and all of them have this version of this package."""
    versions = client.run(pkgutil.resolve_name, "conservative.version:VERSION", on_error="return")
    if not versions:
        allowed = "one with a worker or more, which client.wait_for_workers(1) waits for"
        raise BadInput("client", f"a scheduler at {client.scheduler.address} without workers", allowed)
    others = [f"{version!s} on {worker}" for worker, version in versions.items() if version != VERSION]
    if others:
        raise BadInput("client", f"workers of another version: {', '.join(others)}", f"{VERSION}, as here, on all of them")


class ClusterExecutor(Executor):
    """Sends calls to the workers of a client; `places` is the number of calls that run at a time."""

    def __init__(self, client: Any) -> None:
        self.places = sum(client.nthreads().values())
        self._client = client

    def submit(self, fn: Callable[..., T], /, *args: Any, **kwargs: Any) -> Future[T]:
        """Return the future of a call. Function and arguments can belong to a script, because they are sent as bytes."""
        task = self._client.submit(_call, VERSION, dump((fn, args, kwargs)), pure=False)
        future: Future[T] = Future()

        def pass_on(task: Any) -> None:  # called by Dask for one task after the other, in a thread of its own
            if future.set_running_or_notify_cancel():
                try:
                    future.set_result(task.result())
                except BaseException as error:  # raised by the waiting process
                    future.set_exception(error)

        future.add_done_callback(lambda done: task.cancel() if done.cancelled() else None)
        task.add_done_callback(pass_on)
        return future


def _call(version: str, content: bytes) -> Any:
    """Make a call on a worker. A worker that started after the comparison of versions can have another version."""
    if version != VERSION:
        raise BadInput("client", f"a worker of version {VERSION}", version)
    do, args, kwargs = load(content)
    return do(*args, **kwargs)
