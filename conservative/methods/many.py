"""The result of a method's run of a batch, and how such a run is interrupted."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ..attitude import Array


@dataclass(frozen=True, eq=False)
class Block:
    """What a run of n bodies gives, of s samples each.

    Attributes
    ----------
    R_WB, w_WB_B
        Attitudes (n, s, 3, 3), body to world, and angular velocities (n, s, 3), rad/s, body axes.
    finished
        Whether each body (n,) was finished here. Those that were not are run again, each alone, and their samples replaced.
    """

    R_WB: Array
    w_WB_B: Array
    finished: Any


RunMany = Callable[[], Block]


class GivenUp(BaseException):
    """Nobody waits for this block any more: whoever asked for it was interrupted, or another block failed."""


_of_thread = threading.local()


def watch(given_up: threading.Event) -> None:
    """Let `pause` of this thread raise `GivenUp` once the event is set."""
    _of_thread.given_up = given_up


def pause() -> None:
    """Raise `GivenUp` if nobody waits for this thread's block any more.

    Called between two pieces of a block, every 20 to 50 ms. In the main thread, Ctrl-C needs no call: Python raises it by
    itself.
    """
    given_up = getattr(_of_thread, "given_up", None)
    if given_up is not None and given_up.is_set():
        raise GivenUp
