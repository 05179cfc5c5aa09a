"""The sentence for a pull request: how the accuracy of free rotation changed.

The tests that authors of engines copy (`references/motions`) print the same sentence.
"""

from __future__ import annotations

import math

FREE = "free rotation at your step"
SAME_ORDER = 0.2
"""Difference of two orders of convergence from which the sentence has them."""
SAME_ERROR = 0.01
"""Relative difference of two errors up to which they are the same: a file has three digits, and 3.049 is 3.05 in it."""


def change_of(errors: tuple[float, float], orders: tuple[float, float], first_bad: str = "", subject: str = "") -> str:
    """Return the sentence, "" if it has nothing to say.

    Parameters
    ----------
    errors
        Attitude errors before and now, rad; nan if one is not known. Errors that are equal in two digits are left out,
        and so are errors that fell if there is a `first_bad`: it is no improvement.
    orders
        Orders of convergence before and now; nan if one is not known. Orders that differ by less than 0.2 are left out.
    first_bad
        First motion that became wrong, with its mistake.
    subject
        Name of the subject, if there are several.
    """
    was, now = (f"{error:.2g}" for error in errors)
    numbers = []
    fell = errors[1] < errors[0]
    if was != now and abs(errors[1] - errors[0]) > SAME_ERROR * errors[0] and not (fell and first_bad):  # False for nan
        numbers.append(f"attitude error {was} to {now} rad")
    if abs(orders[1] - orders[0]) >= SAME_ORDER:  # False for nan
        numbers.append(f"order {orders[0]:.1f} to {orders[1]:.1f}")
    parts = [", ".join(numbers)] * bool(numbers) + [f"first bad motion: {first_bad}"] * bool(first_bad)
    return f"{FREE}{f' ({subject})' * bool(subject)}: {'; '.join(parts)}" if parts else ""


UNKNOWN = (math.nan, math.nan)
"""Errors or orders that are not known."""
