"""An engine in plain Python, in the framing "lines" of PROTOCOL.md: Euler's equations of a free body by the method RK4."""

import json
import sys
import time


def derivative(y, moments):
    a, b, c, d, x, v, z = y
    J1, J2, J3 = moments
    attitude = [
        -(b * x + c * v + d * z) / 2,
        (a * x + c * z - d * v) / 2,
        (a * v + d * x - b * z) / 2,
        (a * z + b * v - c * x) / 2,
    ]
    return [*attitude, (J2 - J3) * v * z / J1, (J3 - J1) * z * x / J2, (J1 - J2) * x * v / J3]


def add(y, h, k):
    return [a + h * b for a, b in zip(y, k, strict=True)]


def step(y, h, J):
    k1 = derivative(y, J)
    k2 = derivative(add(y, h / 2, k1), J)
    k3 = derivative(add(y, h / 2, k2), J)
    k4 = derivative(add(y, h, k3), J)
    return [a + h / 6 * (p + 2 * (q + r) + s) for a, p, q, r, s in zip(y, k1, k2, k3, k4, strict=True)]


def integrate(given):
    y, samples = [*given["q0"], *given["w0"]], []
    for n in range(given["n_steps"] + 1):
        if n in given["steps"]:
            samples.append(y)
        y = step(y, given["dt"], given["moments"])
    if given["settings"].get("lose_samples"):
        samples[len(samples) // 2 :] = [["nan"] * 7] * (len(samples) - len(samples) // 2)
    return {"q": [y[:4] for y in samples], "w": [y[4:] for y in samples], "evaluations": 4 * given["n_steps"]}


runs = {}


def answer(request):
    for number in request.get("forget", []):
        del runs[number]
    if request["do"] == "hello":
        return {"protocol": 1, "program": "plain", "version": "1", "framing": "lines", "engine": {"order": 4}}
    if request["do"] == "prepare":
        if not request["free"]:
            return {"error": "unsupported", "message": "only free bodies"}
        runs[len(runs) + 1] = request
        return {"run": len(runs)}
    if request["do"] == "run":
        return integrate(runs[request["run"]])
    if request["do"] == "time":
        integrate(runs[request["run"]])  # a Python program needs no more to warm up
        start = time.perf_counter()
        for _ in range(request["calls"]):
            integrate(runs[request["run"]])
        return {"seconds": time.perf_counter() - start}
    return {"runs": sorted(runs)} if request["do"] == "list" else {}


for line in sys.stdin:
    try:
        response = answer(json.loads(line))
    except Exception as error:
        response = {"error": type(error).__name__, "message": str(error)}
    print(json.dumps(response), flush=True)
