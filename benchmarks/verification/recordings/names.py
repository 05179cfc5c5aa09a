"""Names of columns: their words, and the unit behind them."""

from __future__ import annotations

import math
import re
import unicodedata
from dataclasses import dataclass
from functools import lru_cache


def vocabulary(text: str) -> frozenset[str]:
    """Return the words of a text."""
    return frozenset(text.split())


TURNS = {
    **dict.fromkeys(("rad/s", "rad_s", "rad/sec", "rad_sec", "rads", "rad s^-1", "rad s-1", "rad.s-1", "rad*s^-1", "1/s"), 1.0),
    **dict.fromkeys(("deg/s", "deg_s", "deg/sec", "deg_sec", "dps", "°/s", "deg s^-1", "deg s-1", "grad/s"), math.pi / 180),
    **dict.fromkeys(("rpm", "rev/min", "r/min", "1/min"), math.pi / 30),
    **{"mdps": math.pi / 180e3, "mrad/s": 1e-3, "rev/s": 2 * math.pi},
}
"""Units of rates only, in rad/s, by their names, lower case."""
SECONDS = {
    **dict.fromkeys(("s", "sec", "secs", "second", "seconds", "epsec"), 1.0),
    **{"min": 60.0, "days": 86_400.0, "day": 86_400.0, "hours": 3600.0, "hour": 3600.0},
    **dict.fromkeys(("ms", "msec", "msecs", "milliseconds"), 1e-3),
    **dict.fromkeys(("us", "usec", "usecs", "microseconds", "µs", "μs"), 1e-6),
    **dict.fromkeys(("ns", "nsec", "nsecs", "nanoseconds"), 1e-9),
}
"""Units of times, in s, by their names, lower case."""
ARCS = {
    **dict.fromkeys(("deg", "degrees", "degree", "°"), math.pi / 180),
    **dict.fromkeys(("rad", "radians", "-", ""), 1.0) | {"mrad": 1e-3},
}
"""Units of angles, in rad, and their names for rates in short, lower case."""
UNITS = TURNS | SECONDS | ARCS
"""Units in rad, s and rad/s by their names, lower case."""
OTHER_UNITS = frozenset(
    {
        "m", "mm", "cm", "km", "ft", "m/s", "m s^-1", "km/s", "ft/s", "m/s^2", "m/s2", "m/s²", "m s^-2", "ft/s^2", "g",
        "mg", "gauss", "mgauss", "t", "ut", "µt", "μt", "nt", "c", "°c", "degc", "deg c", "k", "f", "n", "nm", "n m",
        "n*m", "n-m", "n·m", "v", "mv", "a", "ma", "w", "j", "pa", "hpa", "kpa", "%", "rad/s^2", "rad/s2", "rad/s²",
        "rad s^-2", "deg/s^2", "deg/s2", "deg/s²", "kg", "nms", "n m s", "lsb", "count", "counts", "ticks", "lbs",
        "slug", "psf", "hz",
    }
)  # fmt: skip
"""Units of other quantities."""
LONGEST_NAME = 200
"""Longest name that is searched for a meaning, characters."""
MOST_WORDS = 24
"""Largest number of words of a name with a meaning."""
LETTERS = frozenset("xyzw")
ANGLES = ("roll", "pitch", "yaw")
GREEK = ("phi", "theta", "psi")
_PAIRS = frozenset(a + b for a in "xyz" for b in "xyz")
_PLAIN = LETTERS | _PAIRS | frozenset("ijk")
LABELS = LETTERS | _PAIRS | frozenset((*"ijkrpqs", "real", "scalar", "angle", *ANGLES, *GREEK))
"""Words that name a part of a quantity. Numbers do, too."""
SYNONYMS: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(("heading", "hdg", "kurs", "gier", "gieren", "gierwinkel", "lacet", "cap"), ("yaw",)),
    **dict.fromkeys(("bank", "rll", "rollen", "rollwinkel", "wank", "roulis"), ("roll",)),
    **dict.fromkeys(("pch", "ptch", "nick", "nicken", "nickwinkel", "tangage"), ("pitch",)),
    **dict.fromkeys(("gyr", "gyroscope", "gyroskop", "giroscopio", "giroscope"), ("gyro",)),
    **dict.fromkeys(("quat", "quaternions", "quaternionen"), ("quaternion",)),
    **dict.fromkeys(("att", "lage", "assiette"), ("attitude",)),
    **dict.fromkeys(("ori", "orient"), ("orientation",)),
    **dict.fromkeys(("vel", "velocities", "geschwindigkeit", "vitesse", "velocidad"), ("velocity",)),
    **dict.fromkeys(("ang", "rotational", "angulaire", "angular"), ("angular",)),
    **dict.fromkeys(("drehrate", "drehgeschwindigkeit", "winkelgeschwindigkeit", "angvel", "angrate"), ("angular", "velocity")),
    **dict.fromkeys(("zeit", "temps", "tiempo", "tempo", "timer"), ("time",)),
    **dict.fromkeys(("winkel",), ("angle",)),
    **dict.fromkeys(("timestamp", "timestamps"), ("time", "stamp")),
    **dict.fromkeys(("rotvec", "rvec"), ("rotation", "vector")),
    **dict.fromkeys(("rotmat", "rotmatrix"), ("rotation", "matrix")),
    **dict.fromkeys(("nanosec", "nanosecs", "nanosecond", "nanoseconds", "nsecs", "nanos"), ("nsec",)),
    **dict.fromkeys(("microsec", "microsecs", "microsecond", "microseconds", "usecs", "micros"), ("usec",)),
    **dict.fromkeys(("millisec", "millisecs", "millisecond", "milliseconds", "msecs", "millis"), ("msec",)),
}
"""Words of one meaning, also of other languages."""
_VOCABULARY = vocabulary(
    "attitude orientation rotation quaternion matrix vector euler rodrigues gibbs omega gyro angular velocity rate speed body "
    "angle axis time stamp header elapsed seconds secs sec imu sensor acc accel adc bias temp cmd wheel motor raw data dot "
    "roll pitch yaw phi theta psi msec usec nsec dcm mrp sigma qpos qvel bdy"
)
_COMPOUND = _VOCABULARY | SYNONYMS.keys()
_TOKEN = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|[0-9]+|[./:]|[^\W\d_]+")
_FRAMES = re.compile("([qwrc])(wb|bw|bn|nb|ib|bi|bl|lb|br|rs|b)")
_ENDS = frozenset(("deg_s", "rad_s", "deg_sec", "rad_sec", "dps", "rpm", "degrees", "deg", "radians", "rad"))
_SCALARS = ["q", "s"], ["quaternion", "s"]
_LAST = _ENDS | {"seconds", "secs", "sec", "s", "msec", "usec", "nsec", "ms", "us", "ns"}


@dataclass(frozen=True)
class Name:
    """The words of a name without its unit, lower case; those from number `part` on are behind its last point or slash.

    `all` are the words with a unit that is a word. `unit` is lower case, None without one.
    """

    words: tuple[str, ...]
    unit: str | None = None
    part: int = 0
    all: tuple[str, ...] = ()

    @property
    def label(self) -> str:
        """The last word that names a part of a quantity, such as x or 3; "" without one."""
        labels = [word for word in self.words if word in LABELS or word.isdigit()]
        return next((word for word in reversed(labels) if word != "angle"), labels[-1] if labels else "")


@lru_cache(maxsize=20_000)
def parse(name: str) -> Name:
    """Return the words of a column's name, and its unit."""
    text = re.sub(r" #\d+$", "", name.strip())
    if len(text) > LONGEST_NAME:
        return Name(())
    text = "".join(letter for letter in unicodedata.normalize("NFKD", text) if not unicodedata.combining(letter))
    unit, inside = None, re.search(r"[(\[{]([^()\[\]{}]*)[)\]}]$", text)
    if inside and _is_unit(content := inside[1].strip().lower()):
        text, unit = text[: inside.start()], content or None
    elif (comma := re.search(r",\s*([^,]+)$", text)) and comma[1].strip().lower() in UNITS:
        text, unit = text[: comma.start()], comma[1].strip().lower()
    elif text.endswith(("°/s", "°")):
        text, unit = text.rstrip("°/s"), text[text.index("°") :]
    words, starts = list[str](), [0]
    for token in _TOKEN.findall(text):
        if token in "./:":
            starts.append(len(words))
        else:
            words += _split(token.lower())
            if len(words) > 1 and words[-2] in ("nano", "micro", "milli") and words[-1].startswith("sec"):
                words[-2:] = [words[-2][0].replace("m", "u" if words[-2] == "micro" else "m") + "sec"]
    if len(words) > MOST_WORDS:
        return Name(())
    # The last part with more than labels: q in attitude.q.0, and p in velocities/p.
    part = max(
        (start for start in starts if any(word not in _PLAIN and not word.isdigit() for word in words[start:])), default=0
    )
    whole = tuple(words)
    if unit is None:
        words, unit = _cut_unit(words)
    if words[-1:] == ["in"]:
        words.pop()
    return Name(tuple(words), unit, part if part < len(words) else 0, whole)


def _is_unit(text: str) -> bool:
    return text in UNITS or (text not in LABELS and bool(re.search(r"[a-z°%μ]", text)))


def _cut_unit(words: list[str]) -> tuple[list[str], str | None]:
    """Return words without those of a unit at the end, or before the last word if that names a part, and the unit."""
    for size in (2, 1):
        if len(words) > size and (unit := "_".join(words[-size:])) in _LAST and words[-2:] not in _SCALARS:
            return words[:-size], unit
        if len(words) > size + 1 and words[-1] in LABELS and (unit := "_".join(words[-size - 1 : -1])) in _ENDS:
            return [*words[: -size - 1], words[-1]], unit
    return words, None


@lru_cache(maxsize=20_000)
def _split(token: str) -> tuple[str, ...]:
    """Return the words of a token: gyrox is gyro and x, rollspeed is roll and speed, qx is q and x."""
    if token in SYNONYMS:
        return SYNONYMS[token]
    if token in _VOCABULARY or token in LABELS or token in _LAST or len(token) < 2:
        return (token,)
    if len(token) == 2 and (token[1] in LETTERS or (token[0] == "q" and token[1] in "rijks")):
        return tuple(token)
    if match := _FRAMES.fullmatch(token):
        return match[1], match[2]
    return tuple(_cover(token) or (token[0] in "xyz" and (rest := _cover(token[1:])) and [token[0], *rest]) or [token])


@lru_cache(maxsize=20_000)
def _cover(token: str) -> list[str] | None:
    """Return the known words that make up a token, up to a last letter such as x; None if they do not."""
    if len(token) > 40:
        return None
    if token in ("", *LETTERS, "ms", "us", "ns"):
        return [token] * bool(token)
    for size in range(len(token), 2, -1):
        start = token[:size]
        start = start if start in _COMPOUND else start[:-1] if start[-1] == "s" and start[:-1] in _COMPOUND else ""
        if start and (rest := _cover(token[size:])) is not None:
            return [*SYNONYMS.get(start, (start,)), *rest]
    return None
