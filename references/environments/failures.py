"""How a run in another process can fail: each way an outcome, which rows and trajectories carry."""

from __future__ import annotations

import signal

from conservative.errors import IntegrationFailed, MissingEngine
from conservative.outcome import Outcome, OutcomeKind


class EngineCrashed(IntegrationFailed):
    """The engine raised an exception, or its process ended. Attribute: `reason`."""

    def __init__(self, reason: str) -> None:
        self.reason = reason
        self.outcome = Outcome(OutcomeKind.CRASHED, reason)
        super().__init__(f"The engine {self.outcome}. Use another scene or setting")


class EngineTimeout(IntegrationFailed):
    """The engine did not answer in time, and its process was ended. Attribute: `limit` (s)."""

    def __init__(self, limit: float) -> None:
        self.limit = limit
        self.outcome = Outcome(OutcomeKind.TIMEOUT, f"after {limit:g} s")
        super().__init__(f"The engine did not answer within {limit:g} s. Use a shorter run or a longer time limit")


class MissingEnvironment(MissingEngine):
    """An engine, or a version of it, has no environment; the message has the line that makes one."""

    def __init__(self, engine: str, version: str = "", installed: tuple[str, ...] = ()) -> None:
        self.engine, self.package = engine, engine
        wanted = f"{engine}=={version}" if version else engine
        has = f" (installed: {', '.join(installed)})" if installed else ""
        ImportError.__init__(self, f"{wanted} is not installed{has}. Run: conservative engines install {wanted}")


def describe_exit(code: int, last_words: str) -> str:
    """Return how a process ended, with the last line that it printed."""
    how = f"exit code {code}" if code >= 0 else f"signal {-code}"
    name = "" if code >= 0 else f" ({signal.Signals(-code).name})" if -code in set(signal.Signals) else ""
    return f"{how}{name}" + (f": {last_words}" if last_words else "")
