"""Exact motions as a test of your engine: fill in `simulate`, then run pytest (CC0)."""

import json
import math
from pathlib import Path

import pytest

ORDER = 2  # the order of your integrator: 1, 2 or 4
ANGLE = 0.01  # |w| h, rad: 0.1, 0.03 or 0.01
SINGLE = False  # single precision
HAS = {"rotor", "torque", "damping", "fixed point", "orbit"}  # motions that need anything else are skipped
NAMES = "attitude", "rates", "energy", "momentum"


# YOUR ENGINE
def simulate(m, h, steps, samples):
    """Return (quaternion, rates) of the body of the motion `m` after each `steps` steps of h seconds.

    The quaternion has the scalar first and maps body to world. The rates are in body axes, rad/s.
    """
    states = []
    for _ in range(samples):
        for _ in range(steps):
            pass  # one step
        states.append((m["quaternion_wxyz0"], m["w_WB_B0"]))
    return states


# END


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def rotate(q, v):
    uv = cross(q[1:], v)
    return [x + 2 * (q[0] * y + z) for x, y, z in zip(v, uv, cross(q[1:], uv))]


def errors(m, i, q, w):
    """Return the error of the attitude, rad, and those of rates, energy and momentum relative to the scales of the motion."""
    L, exact, scale = [dot(row, w) for row in m["inertia_B"]], m["quaternion_wxyz"][i], m["scale"]
    energy = dot(L, w) / 2 + m.get("weight", 0) * rotate(q, m.get("com_B", [0, 0, 0]))[2]
    momentum = rotate(q, [x + y for x, y in zip(L, m.get("rotor_momentum_B", [0, 0, 0]))])
    apart = min(math.dist(q, exact), math.dist(q, [-x for x in exact]))
    return [
        4 * math.asin(min(1, apart / 2)),
        math.dist(w, m["w_WB_B"][i]) / scale["rates"],
        abs(energy - m["energy"][i]) / scale["energy"],
        math.dist(momentum, m["momentum_W"][i]) / scale["momentum"],
    ]


@pytest.mark.parametrize("path", sorted(Path(__file__).parent.glob("*.json")), ids=lambda path: path.stem)
def test_motion(path):
    m = json.loads(path.read_text())
    if missing := set(m["needs"]) - HAS:
        pytest.skip(f"it needs {', '.join(missing)}")
    (allowed,) = (each for each in m["tolerance"] if each["order"] == ORDER and each["angle"] == ANGLE)
    limit = [allowed[name] + SINGLE * m["single"] for name in NAMES]
    states = simulate(m, m["t"][0] / allowed["steps"], allowed["steps"], len(m["t"]))
    found = zip(*(errors(m, i, list(q), list(w)) for i, (q, w) in enumerate(states)))
    worst = [max(math.inf if math.isnan(x) else x for x in each) for each in found]
    most = max(range(4), key=lambda k: worst[k] / limit[k])
    near = []
    for each in m["catches"]:
        ratios = [max(x, y) / max(each[name], y) for x, y, name in zip(worst, limit, NAMES)]
        near.append((sum(math.log(x) ** 2 for x in ratios), each["mistake"]))
    apart, mistake = min(near, key=lambda each: each[0])
    advice = f"this is what a program does with: {mistake}" if apart < 0.5 else "no mistake of the list does this"
    assert worst[most] <= limit[most], (
        f"{m['name']}: {NAMES[most]} error {worst[most]:.1e}, tolerance {limit[most]:.1e}; {advice}"
    )
