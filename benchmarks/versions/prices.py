"""Times that a project accepts: a factor for a method, with the reason, in the command or in its file for CI.

[accept-slower]                                   # conservative.toml
my_method = "6x: the gyroscopic torque is computed"
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from conservative.errors import BadInput
from conservative.toml_reader import read

TABLE = "accept-slower"


@dataclass(frozen=True)
class Price:
    """A factor of the time of a step that is accepted, and the reason."""

    factor: float
    reason: str

    def __str__(self) -> str:
        return f"accepted up to {self.factor:g} times" + f": {self.reason}" * bool(self.reason)


def read_prices(texts: Sequence[str], file: Path) -> dict[str, Price]:
    """Return the prices by method: from a file, where each needs a reason, and from texts `NAME=6x` or `NAME=6x: reason`.

    Raises `BadInput` for a text or a line that is not one.
    """
    prices, allowed = dict[str, Price](), f'a table [{TABLE}] of texts, such as my_method = "6x: the reason"'
    lines = read(file, allowed).texts(TABLE, allowed) if file.is_file() else {}
    for text in [*(f"{name}={text}" for name, text in lines.items()), *texts]:
        match = re.fullmatch(r"(.+?)=\s*(\d+(?:\.\d+)?)x(?::\s*(.*\S))?\s*", text)
        if not match or float(match[2]) <= 1 or (len(prices) < len(lines) and not match[3]):
            raise BadInput(TABLE, repr(text), "NAME=6x, or NAME=6x: reason; in conservative.toml with the reason")
        prices[match[1].strip()] = Price(float(match[2]), match[3] or "")
    return prices
