"""The result of a method's run of a batch, and how such a run is interrupted."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from ..attitude import Array
from ..errors import IntegrationFailed


@dataclass(frozen=True, eq=False)
class Block:
    """The samples of n bodies, s of each.

    Attributes
    ----------
    R_WB, w_WB_B
        Attitudes (n, s, 3, 3), body to world, and angular velocities (n, s, 3), rad/s, body axes.
    finished
        Booleans (n,). Bodies that are not finished are integrated again one by one, and their samples are replaced, unless
        `failures` has the reason.
    failures
        Failures by the index of the body, the same as of each body alone. Their samples after the failure are nan.
    supplied
        `Trajectory.supplied` (n, s, 4), nan without; None in scenes without loads.
    """

    R_WB: Array
    w_WB_B: Array
    finished: Any
    failures: Mapping[int, IntegrationFailed] = field(default_factory=dict)
    supplied: Array | None = None


RunMany = Callable[[], Block]


class GivenUp(BaseException):
    """The block is no longer needed: the caller was interrupted, or another block failed."""


_of_thread = threading.local()


def watch(given_up: threading.Event) -> None:
    """Let `pause` of this thread raise `GivenUp` once the event is set."""
    _of_thread.given_up = given_up


def pause() -> None:
    """Raise `GivenUp` if this thread's block is no longer needed.

    Called between two pieces of a block, every 20 to 50 ms. In the main thread, Ctrl-C works without this call.
    """
    given_up = getattr(_of_thread, "given_up", None)
    if given_up is not None and given_up.is_set():
        raise GivenUp
