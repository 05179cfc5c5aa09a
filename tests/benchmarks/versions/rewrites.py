"""Changes of a program in C: some that are equal in exact arithmetic, and physical mistakes.

An equal change has a few of the rewrites below, and other flags of the compiler, chosen at random by its number; the first
changes have one rewrite each.
"""

import random
import subprocess
from itertools import chain
from pathlib import Path

from ...environments import PATIENCE

PROGRAM = Path(__file__).parents[2] / "references" / "programs" / "heavy.c"
PRECISIONS, METHODS = ("float", "double"), ("", "-DEULER")
LOOP = "for (i = 0; i < 7; i++) "
REWRITES = {
    "y[i] = y[i] / n;": ("y[i] = y[i] * (1 / n);", "y[i] *= 1 / n;"),
    "n = sqrt(y[0] * y[0] + y[1] * y[1] + y[2] * y[2] + y[3] * y[3]);": (
        "n = sqrt(y[3] * y[3] + y[2] * y[2] + y[1] * y[1] + y[0] * y[0]);",
        "n = hypot(hypot(y[0], y[1]), hypot(y[2], y[3]));",
        "n = sqrt((y[0] * y[0] + y[1] * y[1]) + (y[2] * y[2] + y[3] * y[3]));",
    ),
    "k[0] = -(b * x + c * v + d * z) / 2;": (
        "k[0] = -b * x / 2 - c * v / 2 - d * z / 2;",
        "k[0] = -(d * z + c * v + b * x) / 2;",
    ),
    "k[1] = (a * x + c * z - d * v) / 2;": ("k[1] = (c * z - d * v + a * x) / 2;", "k[1] = (a * x - d * v + c * z) / 2;"),
    "k[3] = (a * z + b * v - c * x) / 2;": ("k[3] = (b * v - c * x + a * z) / 2;",),
    "k[4] = ((J2 - J3) * v * z + m2 * gz - m3 * gy) / J1;": (
        "k[4] = (J2 - J3) / J1 * v * z + (m2 * gz - m3 * gy) / J1;",
        "k[4] = 1 / J1 * (J2 * v * z - J3 * v * z + m2 * gz - m3 * gy);",
        "k[4] = (m2 * gz - m3 * gy + (J2 - J3) * (z * v)) / J1;",
    ),
    "k[5] = ((J3 - J1) * z * x + m3 * gx - m1 * gz) / J2;": (
        "k[5] = (J3 - J1) / J2 * (z * x) + (m3 * gx - m1 * gz) / J2;",
        "k[5] = (J3 * z * x - J1 * x * z - m1 * gz + m3 * gx) * (1 / J2);",
    ),
    "k[6] = ((J1 - J2) * x * v + m1 * gy - m2 * gx) / J3;": (
        "k[6] = (J1 - J2) / J3 * x * v + m1 / J3 * gy - m2 / J3 * gx;",
        "k[6] = -((J2 - J1) * v * x + m2 * gx - m1 * gy) / J3;",
    ),
    "gz = b * b + c * c - a * a - d * d": (
        "gz = 2 * (b * b + c * c) - (a * a + b * b + c * c + d * d)",
        "gz = (b - a) * (b + a) + (c - d) * (c + d)",
    ),
    "h / 6 * (k[0][i] + 2 * k[1][i] + 2 * k[2][i] + k[3][i])": (
        "(k[0][i] + 2 * (k[1][i] + k[2][i]) + k[3][i]) * h / 6",
        "h / 6 * k[0][i] + h / 3 * k[1][i] + h / 3 * k[2][i] + h / 6 * k[3][i]",
        "h * ((k[3][i] + k[0][i]) / 6 + (k[1][i] + k[2][i]) / 3)",
    ),
    f"{LOOP}u[i] = y[i] + h / 2 * k[0][i];": (
        f"{LOOP}u[i] = y[i] + h * (k[0][i] / 2);",
        f"{LOOP}u[i] = y[i] + k[0][i] * h * (real)0.5;",
    ),
    f"{LOOP}u[i] = y[i] + h * k[2][i];": (f"{LOOP}u[i] = fma(h, k[2][i], y[i]);",),
    "for (i = 4; i < 7; i++) y[i] = y[i] + h * k[0][i];": ("for (i = 4; i < 7; i++) y[i] = fma(k[0][i], h, y[i]);",),
    "for (i = 0; i < 4; i++) y[i] = y[i] + h * k[1][i];": (
        "for (i = 0; i < 4; i++) y[i] = y[i] + (h + h) * k[1][i] * (real)0.5;",
    ),
}  # fmt: skip
W0, MOMENTS, SHOWN = 'number(line, "w0", i - 4)', 'number(line, "moments", 0)', "(double)y[skip + i]"
WEIGHT, DT = 'weight = number(line, "mass", 0)', 'h = number(line, "dt", 0)'
GYROSCOPIC = ("(J2 - J3) * v * z", "(J3 - J1) * z * x", "(J1 - J2) * x * v")
MISTAKES = {
    "no gyroscopic term": dict.fromkeys(GYROSCOPIC, "0"),
    "sign of the gyroscopic term": {term: f"-{term}" for term in GYROSCOPIC},
    "sign of the field": {WEIGHT: WEIGHT.replace("=", "= -")},
    "without the field": {WEIGHT: WEIGHT.replace("=", "= 0 *")},
    "inverted inertia": {f"J{i} = number": f"J{i} = 1 / number" for i in (1, 2, 3)},
    "moments about the centre of mass": {f'"moments", {i}': f'"moments_com", {i}' for i in range(3)},
    "time in ms": {DT: f"{DT} / 1000"},
    "start in degrees": {W0: f"{W0} * acos(-1) / 180"},
    "rates in degrees": {SHOWN: f"{SHOWN} * (skip ? 180 / acos(-1) : 1)"},
    "transposed": {SHOWN: f"{SHOWN} * (skip || !i ? 1 : -1)"},
    "order xyzw": {SHOWN: "(double)y[skip ? skip + i : (i + 1) % 4]"},
    "half a step late": {"for (n = 0;": "h /= -2, step(y), h *= -2; for (n = 0;"},
    "damping": {"n = sqrt(": "for (i = 4; i < 7; i++) y[i] = y[i] * (1 - h / 20); n = sqrt("},
}
"""Physical mistakes by their keys, and the replaced texts."""
FLAGS = ("-O0", "-O3 -ffast-math", "-O2 -mfma -ffp-contract=fast", "-O1")


def build(folder: Path, name: str, *flags: str, changes: dict[str, str] | None = None) -> Path:
    """Return the program, compiled with some of its texts replaced."""
    source = PROGRAM.read_text()
    for old, new in (changes or {}).items():
        assert old in source, old
        source = source.replace(old, new)
    (folder / f"{name}.c").write_text(source)
    subprocess.run(["cc", "-O2", *flags, f"{name}.c", "-o", name, "-lm"], cwd=folder, check=True, timeout=PATIENCE)
    return folder / name


def rewrite(number: int) -> tuple[tuple[str, ...], dict[str, str]]:
    """Return the flags and replaced texts of a change. Even numbers are of float, and each second pair is of Euler's method."""
    basic = (f"-DREAL={PRECISIONS[number % 2]}", *filter(None, [METHODS[number // 2 % 2]]))
    single = list(chain.from_iterable([(old, new) for new in texts] for old, texts in REWRITES.items()))
    if number < len(single):
        old, new = single[number]
        method = () if "k[" not in new or "u[" in new or "6" in new else basic[1:]
        return (basic[0], *(("-DEULER",) if old.startswith("for (i = 4") or "(h + h)" in new else method)), {old: new}
    rng = random.Random(number)
    changes = {old: rng.choice(texts) for old, texts in REWRITES.items() if rng.random() < 0.5}
    return (*basic, *rng.choice(FLAGS).split()), changes
