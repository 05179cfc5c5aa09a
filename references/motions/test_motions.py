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
NEAR = 0.8  # sum of the squares of four logarithms: errors over the errors of a mistake that explains them


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
    """Return the errors of the attitude, rad, and of rates, energy and momentum relative to the scales of the motion."""
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


def worst(m, steps):
    """Return the largest errors of a motion with so many steps before each sample."""
    states = simulate(m, m["t"][0] / steps, steps, len(m["t"]))
    rows = zip(*(errors(m, i, list(q), list(w)) for i, (q, w) in enumerate(states)))
    return [max(math.inf if math.isnan(x) else x for x in column) for column in rows]


def distance(found, limit, known):
    """Return the distance of errors above the tolerance from the errors of a mistake."""
    return sum(math.log(max(x, y) / max(known[name], y)) ** 2 for x, y, name in zip(found, limit, NAMES))


tested: list[str] = []
# Of each motion that fails: the mistakes that explain it with their distances, and the exponent of the step.
failing: dict[str, tuple[dict[str, float], float]] = {}


@pytest.mark.parametrize("path", sorted(Path(__file__).parent.glob("*.json")), ids=lambda path: path.stem)
def test_motion(path):
    m = json.loads(path.read_text())
    if missing := set(m["features"]) - HAS:
        pytest.skip(f"it has {', '.join(missing)}")
    tested.append(m["name"])
    (allowed,) = (row for row in m["tolerance"] if row["order"] == ORDER and row["angle"] == ANGLE)
    limit = [allowed[name] + SINGLE * m["single"] for name in NAMES]
    found = worst(m, allowed["steps"])
    most = max(range(4), key=lambda k: found[k] / limit[k])
    if (ratio := found[most] / limit[most]) <= 1:
        return
    near = {mistake["mistake"]: distance(found, limit, mistake) for mistake in m["catches"]}
    near = {name: apart for name, apart in near.items() if apart < NEAR}
    half = worst(m, 2 * allowed["steps"])[most]
    falls = math.log2(found[most] / half) if 0 < half < math.inf and found[most] < math.inf else 0.0
    text = f"{m['name']}: {NAMES[most]} error {found[most]:.1e}, tolerance {limit[most]:.1e}"
    if falls >= ORDER - 0.5 and (ratio <= 2 or not near):
        print(f"{text}: {100 * (ratio - 1):.0f} % above the tolerance, falls as h^{falls:.1f}: right")
        return
    failing[m["name"]] = near, falls
    pytest.fail(text, pytrace=False)


def summary():
    """Return the mistakes that explain most of the failing motions, and the order if it is lower than declared."""
    lines, rest = [f"{len(failing)} of {len(tested)} motions failed"], dict(failing)
    for _ in range(3):
        votes = {}
        for near, _falls in rest.values():
            for name, apart in near.items():
                votes.setdefault(name, []).append(apart)
        if not votes:
            break
        best = max(votes, key=lambda name: (len(votes[name]), -sum(votes[name])))
        if 10 * len(votes[best]) < len(failing):
            break
        lines.append(f'"{best}" explains {len(votes[best])} of them')
        rest = {name: explained for name, explained in rest.items() if best not in explained[0]}
    order = sorted(falls for _, falls in failing.values())[len(failing) // 2]
    if 2 * len(rest) > len(failing) and 0.5 <= order < ORDER - 0.5:
        lines.append(f"this program has order {order:.1f}, {ORDER} was declared")
    if rest:
        lines.append(f"{len(rest)} not explained by a mistake of the list: {', '.join(list(rest)[:5])}")
    return lines


def test_summary():
    if failing:
        pytest.fail("\n".join(summary()), pytrace=False)
