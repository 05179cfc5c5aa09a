"""Times: right states at times that are not the times of the rows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

from conservative.attitude import Array

from .mistake import Mistake, Number


@dataclass(frozen=True)
class Time(Mistake):
    """Other times: `at` returns the times of attitudes and the times of rates.

    They are functions of times after the start (n,), of the step of the program, and of the numbers, all s.

    Attributes
    ----------
    of_step
        True if the step of the program has to be known.
    after
        True if the first row is right: the others are later or earlier.
    unit
        Size of the unit of time, s; 0 for other mistakes.
    both
        True if attitudes and rates are needed.
    """

    kind: ClassVar[str] = "times"
    at: Callable[..., tuple[Array, Array]]
    of_step: bool = False
    after: bool = True
    unit: float = 0.0
    both: bool = False


@dataclass(frozen=True)
class RowTimes(Mistake):
    """Times that are found row by row. They have no effect on another recording."""

    kind: ClassVar[str] = "times"


def _both(t: Array) -> tuple[Array, Array]:
    return t, t


TIMES = (
    Time(
        "time shift",
        "Constant time shift: the file is {shift:+.4g} s ahead of the exact motion after its first row",
        lambda t, step, shift: _both(t + shift),
        numbers=(Number("shift", unit="s"),),
    ),
    Time(
        "time scale",
        "The time is scaled: the file is {rate:+.3g} s per second too fast",
        lambda t, step, rate: _both(t * (1 + rate)),
        numbers=(Number("rate"),),
    ),
    Time(
        "phase drift",
        "The time is scaled: the file is {rate:+.3g} s per second too fast, and {shift:+.3g} s ahead",
        lambda t, step, shift, rate: _both(t * (1 + rate) + shift),
        numbers=(Number("shift", unit="s"), Number("rate")),
    ),
    Time(
        "rates at other times",
        "The rates are {late:+.4g} s late against the attitudes (leapfrog: half a step)",
        lambda t, step, late: (t, t - late),
        both=True,
        numbers=(Number("late", unit="s"),),
    ),
    Time(
        "half a step late",
        "The samples are half a step late",
        lambda t, step: _both(t - step / 2),
        of_step=True,
        remedy="answer the state after `steps` steps",
    ),
    Time(
        "half a step early",
        "The samples are half a step early",
        lambda t, step: _both(t + step / 2),
        of_step=True,
        remedy="answer the state after `steps` steps",
    ),
    Time(
        "a step late",
        "The samples are a step late",
        lambda t, step: _both(t - step),
        of_step=True,
        remedy="answer the state after `steps` steps, the first of them after 0 steps",
    ),
    Time(
        "a step early",
        "The samples are a step early",
        lambda t, step: _both(t + step),
        of_step=True,
        remedy="answer the state after `steps` steps, the first of them after 0 steps",
    ),
    Time(
        "rates half a step late",
        "The rates are half a step late",
        lambda t, step: (t, t - step / 2),
        of_step=True,
        both=True,
        remedy="answer both at the time of the attitude",
    ),
    Time(
        "rates half a step early",
        "The rates are half a step early",
        lambda t, step: (t, t + step / 2),
        of_step=True,
        both=True,
        remedy="answer both at the time of the attitude",
    ),
    *(
        Time(
            f"time in {name}",
            f"The times are in {name}",
            lambda t, step, size=size: _both(t * size),
            after=False,
            unit=size,
            remedy="`dt` is in s",
        )
        for name, size in (("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9), ("min", 60.0))
    ),
)  # fmt: skip
DROPPED = RowTimes(
    "dropped rows",
    "Rows are missing: {rows:.0f}, the first before {at:.6g} s, and the times have no gaps there",
)
JITTERED = RowTimes(
    "jittered times",
    "The time stamps are jittered by {jitter:.3g} s (root of the mean square)",
    numbers=(Number("jitter"),) * 3,
)
ROW_TIMES = (DROPPED, JITTERED)
