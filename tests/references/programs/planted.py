"""An engine of free and heavy bodies in plain Python, "rk4" or "euler" (semi-implicit), with the mistakes in its arguments."""

import json
import math
import random
import sys
import time

METHOD, *MISTAKES = sys.argv[1:]


def matrix(w, x, y, z):
    return [
        [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ]


def transpose(R):
    return [list(column) for column in zip(*R, strict=True)]


def turn(R, v):
    return [sum(a * b for a, b in zip(row, v, strict=True)) for row in R]


TO_Y_UP, TO_Z_UP = ([math.sqrt(0.5), sign * math.sqrt(0.5), 0, 0] for sign in (-1, 1))


def product(p, q):
    a, b, c, d = p
    s, x, y, z = q
    return [
        a * s - b * x - c * y - d * z,
        a * x + b * s + c * z - d * y,
        a * y - b * z + c * s + d * x,
        a * z + b * y - c * x + d * s,
    ]


def derivative(y, J, m):
    a, b, c, d, x, v, z = y
    gx, gy, gz = (-each for each in matrix(a, b, c, d)[2])
    gyroscopic = 0 if "no gyroscopic torque" in MISTAKES else 1
    return [
        -(b * x + c * v + d * z) / 2,
        (a * x + c * z - d * v) / 2,
        (a * v + d * x - b * z) / 2,
        (a * z + b * v - c * x) / 2,
        (gyroscopic * (J[1] - J[2]) * v * z + m[1] * gz - m[2] * gy) / J[0],
        (gyroscopic * (J[2] - J[0]) * z * x + m[2] * gx - m[0] * gz) / J[1],
        (gyroscopic * (J[0] - J[1]) * x * v + m[0] * gy - m[1] * gx) / J[2],
    ]


def step(y, h, *body):
    def add(h, k):
        return [a + h * b for a, b in zip(y, k, strict=True)]

    k1 = derivative(y, *body)
    if METHOD == "euler":
        new = [*y[:4], *add(h, k1)[4:]]
        y = [a + h * b for a, b in zip(new[:4], derivative(new, *body), strict=False)] + new[4:]
    else:
        k2 = derivative(add(h / 2, k1), *body)
        k3 = derivative(add(h / 2, k2), *body)
        k4 = derivative(add(h, k3), *body)
        y = add(h / 6, [a + 2 * (b + c) + d for a, b, c, d in zip(k1, k2, k3, k4, strict=True)])
    size = math.hypot(*y[:4])
    return [each / size for each in y[:4]] + y[4:]


def read(given):
    q, w, J, dt = given["q0"], given["w0"], given["moments"], given["dt"]
    m = [given["mass"] * given["gravity"] * each for each in given["com"]]
    if "reads x, y, z, w" in MISTAKES:
        q = [q[3], *q[:3]]
    if "reads w0 in world" in MISTAKES:
        w = turn(transpose(given["R0"]), w)
    if "inertia inverted" in MISTAKES:
        J = [1 / each for each in J]
    if "inertia about com" in MISTAKES:
        J = given["moments_com"]
    if "dt in ms" in MISTAKES:
        dt /= 1000
    if "gravity up" in MISTAKES:
        m = [-each for each in m]
    if "no gravity" in MISTAKES:
        m = [0, 0, 0]
    if "gravity along y" in MISTAKES:
        q = product(TO_Z_UP, q)
    return [*q, *w], dt, J, m


def sample(y, dt, *body):
    earlier = step(y, -dt / 2, *body)
    y = earlier if "half a step late" in MISTAKES else y
    q, w = y[:4], earlier[4:] if "rates late" in MISTAKES else y[4:]
    R = matrix(*q)
    if "gravity along y" in MISTAKES or "world y-up" in MISTAKES:
        q = product(TO_Y_UP, q)
    if "wrong turn" in MISTAKES:
        q = product(TO_Z_UP, q)
    if "all y-up" in MISTAKES:
        q, w = [q[0], q[1], q[3], -q[2]], [w[0], w[2], -w[1]]
    R = matrix(*q)
    if "matrices" in MISTAKES:
        return {"R": R, "w": w}
    w = turn(R, w) if "w in world" in MISTAKES else w
    w = [math.degrees(each) for each in w] if "w in deg" in MISTAKES else w
    if "R transposed" in MISTAKES:
        return {"R": transpose(R), "w": w}
    return {"q": [*q[1:], q[0]] if "x, y, z, w" in MISTAKES else q, "w": w}


def integrate(given):
    y, dt, J, m = read(given)
    if "goes on" in MISTAKES:
        y = given.get("end", y)
    samples = []
    for n in range(given["n_steps"] + 1):
        given["end"] = y
        if n in given["steps"]:
            samples.append(sample(y, dt, J, m))
        y = step(y, dt, J, m)
    answer = {name: [each[name] for each in samples] for name in samples[0]}
    if "few samples" in MISTAKES:
        del answer["q"][-1]
    if "texts" in MISTAKES:
        answer["w"][0] = ["fast"] * 3
    if "no rates" in MISTAKES:
        del answer["w"]
    if "random" in MISTAKES:
        answer["w"][-1] = [each + 1e-12 * random.random() for each in answer["w"][-1]]
    if "nan" in MISTAKES:
        answer["w"][-1] = ["nan"] * 3
    return answer


def answer(request):
    if request["do"] == "hello":
        order = 4 if METHOD == "rk4" and "no order" not in MISTAKES else 1
        return {
            "protocol": 1,
            "program": "planted",
            "version": "1",
            "framing": "lines",
            "engine": {"order": order, "fields": ["UniformGravity"]},
        }
    if request["do"] == "prepare":
        if "only tops" in MISTAKES and request["free"]:
            return {"error": "unsupported", "message": "only tops"}
        runs.append(request)
        return {} if "no number" in MISTAKES else {"run": len(runs) - 1}
    if "silent" in MISTAKES and request["do"] == "run":
        time.sleep(60)
    while "endless" in MISTAKES and request["do"] == "run":
        sys.stdout.write("[" * 100000)
    if "debugged" in MISTAKES:
        print("one step done")
    if request["do"] == "run":
        return integrate(runs[request["run"]])
    if "warm-up each time" in MISTAKES:
        time.sleep(0.02)
    start = time.perf_counter()
    for _ in range(1 if "one call" in MISTAKES else request["calls"]):
        integrate(runs[request["run"]])
    units = {"time in ms": 1000, "time nine times": 9, "less time": 0.1}
    unit = next((unit for name, unit in units.items() if name in MISTAKES), 1)
    return {"seconds": unit * (time.perf_counter() - start)}


runs = []
for line in sys.stdin:
    print(json.dumps(answer(json.loads(line))), flush=True)
