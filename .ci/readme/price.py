"""The rows of the table of prices: what a run to an attitude error costs in a new process, with imports, search, compilation.

The scenes are random bodies, two in each field. Ours is `integrate(scene, error=1e-6)`, and then the chosen method and step
size; heyoka is built and run with a tolerance that is safe for this error (see `price_program`). Further runs of a body start
with other rates, one after the other. The error of the final attitude is measured for both.

On the first body of each field ours also runs with an empty cache of compiled kernels, as right after the installation. The
other runs have a full one, as all later processes. heyoka has no cache.
"""

from __future__ import annotations

import datetime
import json
import os
import statistics
import subprocess
import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import price_program  # beside this file

from conservative import registry
from conservative.attitude import angle_between
from conservative.grid import Grid
from conservative.references.truth import reference
from conservative.scene import Scene
from conservative.scenes.random_body import FIELDS

OURS, EMPTY, HEYOKA = "conservative", "conservative, empty cache", "heyoka"
COLUMNS = {"once": "one run", "thousand": f"{price_program.RUNS:,} runs", "other": "first run of another body"}
"""Names of the times, s, by those of the program."""
LIMIT = 300.0
"""Largest wall time of a process, s."""
COMMAND = "python .ci/readme --price"


def pairs() -> list[tuple[Scene, Scene]]:
    """Return two random bodies in each field."""
    names = [[f"random_body:field={field},index={index}" for index in (0, 1)] for field in FIELDS]
    return [(registry.scene(first).rename(first), registry.scene(second).rename(second)) for first, second in names]


def measure_pairs() -> dict[str, list[dict[str, float]]]:
    """Return the times and errors of each side on all bodies; of two in a field, each is the other body of the other one."""
    found: dict[str, list[dict[str, float]]] = defaultdict(list)
    for pair in pairs():
        with TemporaryDirectory() as cache:
            for scene, other in (pair, pair[::-1]):
                for side in [EMPTY] * (scene is pair[0]) + [OURS, HEYOKA]:
                    found[side].append(measure_side(side, scene, other, cache))
    return found


def measure_side(side: str, scene: Scene, other: Scene, cache: str) -> dict[str, float]:
    """Return times, s, and the error, rad, of one side on a scene, in a process with a folder for compiled kernels."""
    program = "heyoka" if side == HEYOKA else "ours"
    command = [sys.executable, "-P", str(Path(price_program.__file__)), program, scene.name, other.name]
    variables = {**os.environ, "NUMBA_CACHE_DIR": cache}
    done = subprocess.run(command, env=variables, timeout=LIMIT, check=True, capture_output=True, text=True)
    times = json.loads(done.stdout.splitlines()[-1])
    truth = reference(scene, Grid(scene.t_end, 1)).trajectory.R_WB[-1]
    error = float(angle_between(truth, np.reshape(times["final"], (3, 3))))
    return {**{name: times[name] for name in COLUMNS}, "error": error}


def price_rows(found: dict[str, list[dict[str, float]]]) -> Iterator[dict[str, Any]]:
    """Yield the medians of the times and the largest error of each side."""
    today = datetime.date.today().isoformat()
    common = {"scene": "price", "method": "", "version": "", "command": COMMAND, "date": today}
    for side, bodies in found.items():
        for name, quantity in COLUMNS.items():
            value = statistics.median(each[name] for each in bodies)
            yield common | {"name": side, "quantity": quantity, "unit": "s", "value": value}
        worst = max(each["error"] for each in bodies)
        yield common | {"name": side, "quantity": "largest error", "unit": "rad", "value": worst}
