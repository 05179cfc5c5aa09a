"""A limit on how long one run may take, so that one engine at an extreme rate does not hold up a study."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TypeVar

from conservative.outcome import Outcome, OutcomeKind

from .case import Case, Failure, Success, attempt

T = TypeVar("T")


class TimeLimitExceeded(TimeoutError):
    """A piece of work took longer than it was given. Attribute: `limit` (s)."""

    def __init__(self, limit: float) -> None:
        self.limit = limit
        super().__init__(f"abandoned after {limit:g} s")


def run_within(limit: float, work: Callable[[], T]) -> T:
    """Return what `work` returns, or raise what it raises, if that takes no longer than `limit` s.

    It runs in a thread. Work that is abandoned goes on in the background, as Python cannot end a thread, and dies with the
    process. What keeps the interpreter locked, as our own kernels do, cannot be abandoned before it is done, and is then late.

    Raises
    ------
    TimeLimitExceeded
        It takes longer.
    """
    found: list[T] = []
    raised: list[BaseException] = []

    def worker() -> None:
        try:
            found.append(work())
        except BaseException as error:
            raised.append(error)

    thread = threading.Thread(target=worker, daemon=True)
    thread.start()
    thread.join(limit)
    if thread.is_alive():
        raise TimeLimitExceeded(limit)
    if raised:
        raise raised[0]
    return found[0]


def attempt_within(limit: float, case: Case, skip_missing: bool) -> Success | Failure:
    """Return the outcome of a case that is waited for `limit` s; see `attempt`."""
    try:
        return run_within(limit, lambda: attempt(case, skip_missing))
    except TimeLimitExceeded as late:
        return Failure(Outcome(OutcomeKind.TIMEOUT, str(late)))
