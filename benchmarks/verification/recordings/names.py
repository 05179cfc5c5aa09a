"""Names of columns: their letters and digits, and the unit behind them."""

from __future__ import annotations

import math
import re

UNITS = {
    **dict.fromkeys(
        ("deg/s", "deg_s", "deg_sec", "deg", "dps", "degrees", "degree", "°", "°/s", "deg s^-1", "deg s-1"), math.pi / 180
    ),
    **dict.fromkeys(
        ("rad/s", "rad_s", "rad_sec", "rad", "radians", "rad s^-1", "rad s-1", "rad.s-1", "rad*s^-1", "1/s", "-", ""), 1.0
    ),
    **dict.fromkeys(("rpm", "rev/min", "r/min"), math.pi / 30) | dict.fromkeys(("s", "sec", "secs", "seconds"), 1.0),
    **dict.fromkeys(("mdps",), math.pi / 180e3) | dict.fromkeys(("mrad/s", "mrad"), 1e-3) | {"min": 60.0, "rev/s": 2 * math.pi},
    **dict.fromkeys(("ms", "msec"), 1e-3)
    | dict.fromkeys(("us", "usec", "µs", "μs"), 1e-6)
    | dict.fromkeys(("ns", "nsec"), 1e-9),
}
"""Units in rad, s and rad/s by their names, lower case."""
LONGEST_NAME = 200
"""Longest name that is searched for a meaning, characters."""
_SUFFIX = r"[_-](deg_s|rad_s|deg_sec|rad_sec|dps|rpm|degrees|deg|radians|rad|seconds|msec|usec|nsec|ms|us|ns|s)(?=_|$)"
_SPOKEN = ((r"^(roll|pitch|yaw)(?:speed|rate)$", r"rate\1"), (r"^heading$", "yaw"), (r"^bank$", "roll"))


def split_name(name: str) -> tuple[str, str | None]:
    """Return the letters and digits of a column's name without its unit, and the unit."""
    text = name.strip().lower() if len(name) <= LONGEST_NAME else ""  # the time of some patterns grows with the square
    match = re.search(r"[(\[]([^)\]]*[a-z°^/][^)\]]*)[)\]]$", text) or re.search(_SUFFIX, text)
    match = match or re.search(r"(?<=^time)([mun]s)$", text)  # TimeUS of ArduPilot
    if match is None and (comma := re.search(r",\s*([^,]+)$", text)) and comma[1].strip() in UNITS:
        match = comma
    rest = text[: match.start()] + text[match.end() :] if match else text
    key = re.sub(r"[^a-z0-9]", "", re.sub(r"^(field|data)\.", "", rest.lstrip("#%_ ")))
    for pattern, usual in _SPOKEN:
        key = re.sub(pattern, usual, key)
    return key, match[1].strip() if match else None
