import array
import os

METHOD = []
MISTAKE = os.environ.get("MISTAKE", "")
FLOAT = False
BOTH = "no gyroscopic term + damping 0.05"


def multiply(A, B):
    return [[dot(row, column) for column in zip(*B)] for row in A]


def transpose(A):
    return [list(row) for row in zip(*A)]


def apply(A, v):
    return [dot(row, v) for row in A]


def add(a, b, scale=1):
    return [x + scale * y for x, y in zip(a, b)]


def inverse(A):
    c = [cross(A[1], A[2]), cross(A[2], A[0]), cross(A[0], A[1])]
    d = dot(A[0], c[0])
    return [[x / d for x in row] for row in transpose(c)]


def matrix(q):
    n = dot(q, q)
    return transpose([rotate([x / n**0.5 for x in q], e) for e in ([1, 0, 0], [0, 1, 0], [0, 0, 1])])


def turning(q, w):
    q = [q[0], *(-x for x in q[1:])] if MISTAKE == "wrong side" else q
    turn = right_turning(q, w)
    return [-turn[0], *turn[1:]] if MISTAKE == "wrong side" else turn


def right_turning(q, w):
    return [-dot(q[1:], w) / 2, *(x / 2 for x in add([q[0] * x for x in w], cross(q[1:], w)))]


def slope(body, t, y):
    q, w, sign = y[:4], y[4:], {"no gyroscopic term": 0, BOTH: 0, "sign of the gyroscopic term": -1}.get(MISTAKE, 1)
    R = matrix(q)
    back, J, K = transpose(R), body["J"], body["K"]
    if MISTAKE == "R I for R I R'":
        J = multiply(J, R)
    if MISTAKE in ("inertia in world axes", "inertia of the start"):
        start = body["R0"] if MISTAKE == "inertia of the start" else [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
        J = multiply(back, multiply(multiply(start, multiply(J, transpose(start))), R))
    if J is not body["J"]:
        K = inverse(J)
    G = [[x * (i == k) for k, x in enumerate(row)] for i, row in enumerate(J)] if MISTAKE == "diagonal gyroscopic term" else J
    T = [sign * x for x in cross(add(apply(G, w), body["rotor"]), w)]
    T = add(add(add(T, body["torque_B"]), apply(back, body["torque_W"])), apply(body["damping"], w), -1)
    field, n = {"sign of the field": -1, "without the field": 0}.get(MISTAKE, 1), body["orbit"]
    T = add(T, cross(R[2], body["arm"]), field)
    if n:
        angle = 0 if MISTAKE == "turning of the field" else n * t
        u = apply(back, [math.cos(angle), math.sin(angle), 0])
        T = add(T, cross(u, apply(body["J"], u)), field * 3 * n * n)
    return turning(q, w) + apply(K, T)


def step(body, t, h, y):
    s, old = int(METHOD[0]), y
    A, b, k = [METHOD[1 + i * s : 1 + i * s + s] for i in range(s)], METHOD[1 + s * s :], [[0] * 7 for _ in range(s)]
    for _ in range(s if A[0][0] == 0 and A[-1][-1] == 0 else 30):
        for i in range(s):
            Y = y
            for a, each in zip(A[i], k):
                Y = add(Y, each, h * a) if a else Y
            k[i] = slope(body, t + sum(A[i]) * h, Y)
    for weight, each in zip(b, k):
        y = add(y, each, h * weight)
    if MISTAKE == "attitude by normalisation":
        y = add(old[:4], turning(old[:4], y[4:]), h) + y[4:]
    if MISTAKE == "stale rates":
        speed = math.hypot(*old[4:])
        turn = turning(old[:4], old[4:])
        y = [math.cos(h * speed / 2) * a + math.sin(h * speed / 2) * 2 / speed * c for a, c in zip(old, turn)] + y[4:]
    size, speed = math.hypot(*y[:4]), math.hypot(*y[4:])
    scale = math.exp(-h * float(MISTAKE.partition("damping 0")[2] or 0)) if "damping 0" in MISTAKE else 1
    if MISTAKE == "rate limit 100" and speed > 100:
        scale = 100 / speed
    if MISTAKE == "sleep" and speed < 0.5:
        scale = 0
    y = [x / size for x in y[:4]] + [x * scale for x in y[4:]]
    return list(array.array("f", y)) if FLOAT else y


def simulate(m, h, steps, samples):
    J, zero = [list(row) for row in m["inertia_B"]], [0, 0, 0]
    for i in range(3):
        for k in range(3):
            if i != k:
                J[i][k] *= {"no products of inertia": 0, "sign of the products of inertia": -1}.get(MISTAKE, 1)
    if MISTAKE == "smallest moments" and J[0][0] < 1e-6:
        J = [[1e-6 * (i == k) for k in range(3)] for i in range(3)]
    torque = {"without the torque": 0, "sign of the torque": -1}.get(MISTAKE, 1)
    names = ("torque_W", "torque_B") if MISTAKE == "axes of the torque" else ("torque_B", "torque_W")
    rotor = {"without the rotor": 0, "sign of the rotor": -1}.get(MISTAKE, 1)
    damping = m.get("damping") if MISTAKE != "without the damping" else None
    body = {"J": J, "K": inverse(J), "R0": matrix(m["quaternion_wxyz0"]), "orbit": m.get("orbit", 0)}
    body["damping"] = damping or [zero] * 3
    body["rotor"] = [rotor * x for x in m.get("rotor_momentum_B", zero)]
    body["arm"] = [m.get("weight", 0) * x for x in m.get("com_B", zero)]
    body["torque_B"], body["torque_W"] = ([torque * x for x in m.get(name, zero)] for name in names)
    y, t, states = m["quaternion_wxyz0"] + m["w_WB_B0"], 0, []
    for i in range(samples):
        for n in range(steps):
            size = h / 2 if MISTAKE == "half a step late" and i + n == 0 else h
            y, t = step(body, t, size, y), t + size
        q, w = y[:4], y[4:]
        if MISTAKE == "transposed":
            q = [q[0], -q[1], -q[2], -q[3]]
        if "order xyzw" in MISTAKE:
            q = [*q[1:], q[0]]
        w = {"reversed rates": [-x for x in w], "world rates": apply(matrix(y[:4]), w)}.get(MISTAKE, w)
        states.append((q, w))
    return states
