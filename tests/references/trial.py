"""The adapter of the test engine: it integrates free bodies, and fails on request in every way that engines fail."""

import ctypes
import os
import signal
import sys
import time

import numpy as np

ENGINE = {
    "package": "trial",
    "module": "numpy",
    "settings": {"do": "integrate", "at": "run"},  # what it does, and whether in `prepare` or in `run`
    "order": 4,
}


def prepare(given):
    given.stages = 4
    if given.do == "as_packaged":
        given.do, given.at, given.stages = read_package()
    if given.at == "prepare":
        misbehave(given.do)
    inertia = given.moments

    def derivative(y):
        q, w = y[:4], y[4:]
        spin = np.concatenate([[-q[1:] @ w], q[0] * w + np.cross(q[1:], w)]) / 2
        return np.concatenate([spin, np.cross(inertia * w, w) / inertia])

    def run():
        if given.at == "run":
            misbehave(given.do)
        states = march(derivative, np.concatenate([given.q0, given.w0]), given)
        if given.do == "shape":
            states = states[1:]
        if given.do == "diverge":
            states[len(states) // 2 :] = np.nan
        return {"q": states[:, :4], "w": states[:, 4:], "steps": given.n_steps, "evaluations": 4 * given.n_steps}

    if given.do == "renew":
        run.renew = lambda: time.sleep(0.2)
    if given.do == "loop":
        run.loop = lambda: time.sleep(0.1)
    return run


def march(derivative, y, given):
    states, dt = [y], given.dt
    for n_steps in np.diff(given.steps):
        for _ in range(n_steps):
            k1 = derivative(y)
            k2 = derivative(y + dt / 2 * k1)
            if given.stages == 2:
                y = y + dt * k2
                continue
            k3 = derivative(y + dt / 2 * k2)
            k4 = derivative(y + dt * k3)
            y = y + dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        states.append(y)
    return np.array(states)


def read_package():
    """Return the behaviour of the installed version, where it occurs, and the stages of its integrator."""
    import trial

    return trial.DO, trial.AT, trial.STAGES


def misbehave(do):
    wrongs = {
        "segfault": lambda: ctypes.string_at(0),
        "abort": os.abort,
        "exit": lambda: os._exit(3),
        "kill": lambda: os.kill(os.getpid(), signal.SIGKILL),
        "rest": lambda: time.sleep(0.05),
        "sys_exit": sys.exit,
        "raise": lambda: {}["no such key"],
        "refuse": refuse,
        "hang": lambda: time.sleep(1e6),
        "spin": spin,
        "lock": lambda: ctypes.PyDLL(None).usleep(10**9),
        "print": print_garbage,
        "flood": flood,
        "babble": babble,
        "allocate": allocate,
        "leave": lambda: open("left_behind", "w").write("x"),  # noqa: PTH123, SIM115
        "import": lambda: __import__("dies_at_import"),
    }
    wrongs.get(do, lambda: None)()


def refuse():
    raise NotImplementedError("this version turns no bodies")


def spin():
    while True:
        pass


def print_garbage():
    print("garbage on stdout \x00\xff" * 100, flush=True)
    os.write(1, bytes(range(256)) * 1000)
    os.write(2, b"garbage on stderr")


def flood():
    line = b"x" * (1 << 20)
    for _ in range(400):
        os.write(1, line)


def babble():
    """Write into every open pipe, including the pipe of answers."""
    for descriptor in range(3, 64):
        try:
            os.write(descriptor, b"no message at all, but rather long")
        except OSError:
            continue


def allocate():
    hold = []
    while True:
        hold.append(np.ones(1 << 24))
