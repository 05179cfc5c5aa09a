"""Work on other machines: a Dask cluster as an executor like any other.

    from dask.distributed import Client

    with Client("tcp://10.0.0.7:8786") as client:  # or open_client, which says in one line what is wrong
        ensemble = cv.integrate_many(scene, w_WB_B0=starts, path="starts.zarr", client=client)

A task is a pure function of the bytes that it is sent, and its result comes back to whoever asked: workers need no file system
in common, a task whose worker dies is run by another one, and what is run twice counts once. Workers need this package in the
same version, which is asked for before any work. From processors of the same kind the same numbers come back as without a
cluster, bit for bit; compiled code differs from kind to kind.

A scheduler tries for 30 s to reach a worker that has died with results, unless its setting `distributed.comm.timeouts.connect`
says otherwise, and only then has them computed again: that long a run can stand still.

Source: `concurrent.futures` and `distributed.Client.submit`; all scheduling is Dask's. Futures of `Client.get_executor` never
end where fetching a result fails, as it does when a scheduler dies (distributed 2026.8.0).
"""

from __future__ import annotations

import logging
import pkgutil
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Executor, Future
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Any, TypeVar

from ..check import describe
from ..errors import BadInput, require_extra
from ..version import VERSION
from .pickling import dump, load

if TYPE_CHECKING:
    from distributed import Client

T = TypeVar("T")
CONNECT_LIMIT = 5.0
"""Time, s, that a scheduler may take to answer."""
_LOST = "a cluster that stays there; what was written to a path is kept, and resume=True goes on from there"


@contextmanager
def open_client(address: str, limit: float = CONNECT_LIMIT) -> Iterator[Client]:
    """Give a client of the scheduler at an address such as `tcp://127.0.0.1:8786`, with Dask's own messages off in the block.

    The scheduler has `limit`, s, to answer.

    Raises
    ------
    BadInput
        No scheduler answers there, or it is no address.
    MissingExtra
        Dask, of the extra `cluster`, is not installed.
    """
    require_extra("scheduler", "cluster")
    from distributed import Client
    from distributed.comm import get_address_host_port

    with ExitStack() as stack:
        stack.enter_context(_silence("distributed", "distributed.client", "tornado.application"))
        try:
            get_address_host_port(address)  # first, as a client that is made of no address raises again when it is collected
            client = stack.enter_context(Client(address, timeout=limit, set_as_default=False))
        except Exception as error:  # whatever else listens there can answer anything
            got = f"{address!r}, where no scheduler answers ({error or type(error).__name__})"
            allowed = "the address of a Dask scheduler that runs, such as 'tcp://127.0.0.1:8786'"
            raise BadInput("scheduler", got, allowed) from None
        yield client


@contextmanager
def _silence(*names: str) -> Iterator[None]:
    """Let loggers of these names say nothing in the block: what they say in many lines is an exception, too."""
    loggers = [logging.getLogger(name) for name in names]
    before = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for logger, level in zip(loggers, before, strict=True):
            logger.setLevel(level)


@contextmanager
def start_executor(client: Client) -> Iterator[ClusterExecutor]:
    """Yield an executor on the workers of a client, whose versions it has compared.

    Raises
    ------
    BadInput
        The client is none, or not connected; there are no workers; or some have another version of this package. Out of the
        block: the cluster was lost, or a task has ended every worker that tried it.
    MissingExtra
        Dask, of the extra `cluster`, is not installed.
    """
    require_extra("client", "cluster")
    from distributed import KilledWorker
    from distributed.comm import CommClosedError

    _require_client(client)
    try:
        require_versions(client)
        yield ClusterExecutor(client)
    except (CommClosedError, KilledWorker, CancelledError) as error:
        raise BadInput("client", f"a cluster that was lost ({type(error).__name__}: {error})", _LOST) from error


def _require_client(client: object) -> None:
    from distributed import Client

    allowed = "a dask.distributed.Client, not asynchronous, whose scheduler runs, or None"
    if not isinstance(client, Client):
        raise BadInput("client", describe(client), allowed)
    if client.asynchronous or client.status != "running":
        raise BadInput("client", f"one that is {'asynchronous' if client.asynchronous else client.status}", allowed)


def require_versions(client: Any) -> None:
    """Raise `BadInput` unless the client has workers, and all of them have this version of this package."""
    found = client.run(pkgutil.resolve_name, "conservative.version:VERSION", on_error="return")
    if not found:
        allowed = "one with a worker or more, which client.wait_for_workers(1) waits for"
        raise BadInput("client", f"a scheduler at {client.scheduler.address} without workers", allowed)
    others = [f"{_name_version(version)} on {worker}" for worker, version in found.items() if version != VERSION]
    if others:
        raise BadInput("client", f"workers of another version: {', '.join(others)}", f"{VERSION}, as here, on all of them")


def _name_version(found: object) -> str:
    return found if isinstance(found, str) else f"none ({type(found).__name__}: {found})"


class ClusterExecutor(Executor):
    """Sends calls to the workers of a client; `places` is how many run at a time."""

    def __init__(self, client: Any) -> None:
        self.places = sum(client.nthreads().values())
        self._client = client

    def submit(self, fn: Callable[..., T], /, *args: Any, **kwargs: Any) -> Future[T]:
        """Return the future of a call, whose function and arguments are made bytes of: they may be those of a script."""
        task = self._client.submit(_call, VERSION, dump((fn, args, kwargs)), pure=False)
        found: Future[T] = Future()
        found.add_done_callback(lambda done: task.cancel() if done.cancelled() else None)
        task.add_done_callback(lambda task: _pass_on(task, found))
        return found


def _pass_on(task: Any, found: Future[Any]) -> None:
    """Make the result of a task that of a future. Dask calls this for one task after the other, in a thread of its own."""
    if not found.set_running_or_notify_cancel():
        return
    try:
        found.set_result(task.result())
    except BaseException as error:  # whatever it is, it is for whoever waits
        found.set_exception(error)


def _call(version: str, content: bytes) -> Any:
    """Do on a worker what was sent, by a program of the same version: a worker can have come after versions were compared."""
    if version != VERSION:
        raise BadInput("client", f"a worker of version {VERSION}", version)
    do, args, kwargs = load(content)
    return do(*args, **kwargs)
