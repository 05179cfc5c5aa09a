"""The files of motions, JSON and CSV."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

import numpy as np

import conservative
from conservative.attitude import Array
from conservative.files import make_folder, write_text

from . import search
from .motion import GRAVITY, KINDS, SAMPLE, Motion, load
from .programs import ANGLES, PARTS, QUANTITIES, Measured, error, measure, sizes
from .signatures import Samples, signatures

FACTOR = 2.0
"""Smallest error of a mistake that is listed, over the tolerance of order 2 at the smallest step."""
ROUND_OFF = 1e-11
"""Errors that depend on the machine."""


def describe(motion: Motion, measured: Measured, signature: dict[str, Samples]) -> dict[str, Any]:
    """Return a motion as the keys and values of its JSON file; README.md of references/motions explains them."""
    exact = motion.exact
    parts = {key: getattr(motion, key) for key in (*KINDS, "com_B") if getattr(motion, key) is not None}
    return {
        "name": motion.name,
        **({} if motion.seed is None else {"seed": motion.seed}),
        "about": motion.about,
        "features": motion.features,
        "inertia_B": motion.inertia_B,
        "R_WB0": exact["R_WB"][0].tolist(),
        "quaternion_wxyz0": exact["quaternion_wxyz"][0].tolist(),
        "w_WB_B0": [float(x) for x in motion.rates],
        **parts,
        **({"gravity_W": [0.0, 0.0, -GRAVITY]} if motion.weight else {}),
        "t": motion.t,
        **{name: exact[name][1:].tolist() for name in SAMPLE},
        "scale": dict(zip(QUANTITIES[1:], (float(f"{x:.6g}") for x in measured.scale), strict=True)),
        "tolerance": [
            {"order": order, "angle": angle, "steps": motion.steps * PARTS[at % 3], **_named(values)}
            for at, ((order, angle), values) in enumerate(measured.tolerances.items())
        ],
        "single": _short(measured.single),
        "catches": catches(motion, measured.tolerances[2, ANGLES[-1]], signature),
    }


def catches(motion: Motion, allowed: Array, signature: dict[str, Samples]) -> list[dict[str, Any]]:
    """Return the mistakes that the tolerances of order 2 show, with their errors, first the one with the largest error."""
    (scale,) = sizes([motion])
    made = {name: error(motion, scale, samples) for name, samples in signature.items()}
    made = {name: np.where(size < ROUND_OFF, 0.0, size) for name, size in made.items() if (size / allowed).max() >= FACTOR}
    return [
        {"mistake": name, **_named(sizes)}
        for name, sizes in sorted(made.items(), key=lambda item: -float(f"{item[1].max():.1e}"))
    ]


def _short(x: float) -> float:
    return float(f"{x:.2g}")


def _named(values: Any) -> dict[str, float]:
    return dict(zip(QUANTITIES, map(_short, values), strict=True))


def as_csv(keys: dict[str, Any]) -> str:
    """Return a motion as lines of a key and its values, matrices by rows; a line for each sample, tolerance and mistake."""
    lines = ["key,values"]
    for key, value in keys.items():
        if key == "t":
            lines += [_line("sample", t, [keys[name][i] for name in SAMPLE]) for i, t in enumerate(value)]
        elif key in ("tolerance", "catches"):
            lines += [_line(key, row) for row in value]
        elif key not in SAMPLE:
            lines.append(_line(key, value))
    return "\n".join([*lines, ""])


def _line(*values: Any) -> str:
    return ",".join(str(x).replace(",", ";") for x in _flat(values))


def _flat(value: Any) -> Iterator[Any]:
    for x in value.values() if isinstance(value, dict) else value if isinstance(value, list | tuple) else ():
        yield from _flat(x) if isinstance(x, dict | list | tuple) else [x]


def as_json(keys: dict[str, Any]) -> str:
    """Return a motion as JSON, a line for each key, sample, tolerance and mistake."""
    texts = []
    for key, value in keys.items():
        rows = isinstance(value, list) and value and isinstance(value[0], list | dict)
        text = "[\n" + ",\n".join(map(json.dumps, value)) + "\n]" if rows else json.dumps(value)
        texts.append(f'"{key}": {text}')
    return "{\n" + ",\n".join(texts) + "\n}\n"


def of_seed(seed: int | None) -> Sequence[Motion]:
    """Return the published motions (None), or the fresh motions of a seed. Raise `BadInput` for another seed."""
    return load() if seed is None else search.fresh(seed)


def descriptions(seed: int | None = None) -> Iterator[dict[str, Any]]:
    """Yield the published motions, or those of a seed, as the keys and values of their JSON files, solved and measured."""
    motions = of_seed(seed)
    for motion, measured, signature in zip(motions, measure(motions), signatures(motions), strict=True):
        yield describe(motion, measured, signature)


def contents(seed: int | None = None) -> Iterator[tuple[str, str]]:
    """Yield the names and texts of the files of all motions."""
    for keys in descriptions(seed):
        yield f"{keys['name']}.json", as_json(keys)
        yield f"{keys['name']}.csv", as_csv(keys)


def read(name: str) -> dict[str, Any]:
    """Return a motion from its file in this package."""
    folder = Path(conservative.__file__).parent / "references" / "motions"
    return json.loads((folder / f"{name}.json").read_text(encoding="utf-8"))


def tolerance(motion: Motion, order: int | None, single: bool = False) -> tuple[float, float]:
    """Return the largest allowed errors of a program of an order at |w| h = 0.01: of the attitude, rad, and relative, of rates.

    Order 3 and a program that chooses its steps (None) have the tolerances of order 2. Published motions have those of their
    files. Fresh ones, and those of a user's body, have tolerances that are measured here, in the axes of the given motion.
    """
    order = tested_order(order)
    if motion.own:
        attitude, rates, more = _own_limits(motion)[motion.name, order]
    elif motion.seed is not None:
        attitude, rates, more = _limits(motion.seed)[motion.name, order]
    else:
        attitude, rates, more = _published(motion.name, order)
    return (attitude + more, rates + more) if single else (attitude, rates)


def _published(name: str, order: int) -> tuple[float, float, float]:
    kept = read(name)
    (row,) = (row for row in kept["tolerance"] if (row["order"], row["angle"]) == (order, ANGLES[-1]))
    return row["attitude"], row["rates"], kept["single"]


@cache
def _limits(seed: int) -> dict[tuple[str, int], tuple[float, float, float]]:
    """Return the tolerances of attitude and rates, and what single precision may add, by motion of a seed and order."""
    return _measured(search.fresh(seed))


@lru_cache(maxsize=16)
def _own_limits(motion: Motion) -> dict[tuple[str, int], tuple[float, float, float]]:
    return _measured([motion])


def _measured(motions: Sequence[Motion]) -> dict[tuple[str, int], tuple[float, float, float]]:
    limits = dict[tuple[str, int], tuple[float, float, float]]()
    for motion, measured in zip(motions, measure(motions, PARTS[-1:]), strict=True):
        for (order, _), tolerances in measured.tolerances.items():
            attitude, rates = map(_short, tolerances[:2])
            limits[motion.name, order] = attitude, rates, _short(measured.single)
    return limits


def tested_order(order: int | None) -> int:
    """Return the order whose tolerances a program of an order has to meet; None is a program that chooses its steps."""
    return {1: 1, 2: 2, 3: 2, None: 2}.get(order, 4)


def marks(seed: int | None = None) -> Iterator[tuple[str, str]]:
    """Yield the names of all files, and a text in the beginning of each, which files of another seed do not have."""
    names, json_key, row = (
        ([motion.name for motion in load()], '"about"', "about")
        if seed is None
        else (list(search.FAMILIES), f'"seed": {seed},\n', f"seed,{seed}\n")
    )
    for name in names:
        yield f"{name}.json", f'"name": "{name}",\n{json_key}'
        yield f"{name}.csv", f"key,values\nname,{name}\n{row}"


def write(folder: Path, seed: int | None = None) -> list[str]:
    """Write the files into a folder and return their names. Raise `NotWritten` if that is not possible."""
    make_folder(folder, "out")
    texts = dict(contents(seed))
    for name, text in texts.items():
        write_text(folder / name, text, "out")
    return list(texts)
