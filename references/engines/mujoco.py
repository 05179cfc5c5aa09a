"""MuJoCo with one of its integrators, in its own loop.

The loop is `mujoco.rollout` if samples are close, and `mj_step(m, d, nstep)` from sample to sample otherwise. The body's
principal axes are MuJoCo's body axes. A free body has a free joint at its centre of mass, as in the models of MuJoCo's users.
In free flight the joint is at the origin of the body frame. A body in a field has a ball joint at its fixed point. A spring is
a spatial tendon between two sites. An attraction, a gravity gradient and fields that turn are a passive force: a C function
that MuJoCo calls in each evaluation, `mjcb_passive`, made by numba. Every part of a step that such a body does not need is
switched off.

Parameters
----------
integrator
    "Euler", "RK4", "implicit", "implicitfast" or "discrete", which versions before 3.13 do not have.
threads
    Threads of `mujoco.rollout` if many bodies run at once, each with its own model.

References
----------
Integrators and flags: https://mujoco.readthedocs.io/en/stable/XMLreference.html#option
Programming, `mj_step`, rollout, callbacks: https://mujoco.readthedocs.io/en/stable/python.html
Tendons: https://mujoco.readthedocs.io/en/stable/XMLreference.html#tendon-spatial
"""

import ctypes
from contextlib import contextmanager, nullcontext
from functools import lru_cache
from tempfile import TemporaryDirectory
from threading import Lock
from time import perf_counter

import numpy as np

from .shared import FIELDS, LATER, compile_torque, description_of, mujoco_moments, pack_field, write_mjcf

INTEGRATORS = ("Euler", "RK4", "implicit", "implicitfast", "discrete")
# Keys: see `EngineData` in environments/adapter.py.
ENGINE = {
    "package": "mujoco",
    "module": "mujoco",
    "oldest": "3.6",
    "settings": {"integrator": "RK4", "threads": 1},
    "orders": {name: 4 if name == "RK4" else 1 for name in INTEGRATORS},
    "fields": FIELDS,
    "descriptions": (
        "frame",
        "offset",
        "file",
        "setter",
        "child",
        "joints",
        "world",
        "time",
        "damping",
        "saved",
        "rewritten",
        "mass",
        "scaled",
    ),
    "method_info": {
        "variants": INTEGRATORS,
        "report": ("Euler", ""),
        "suite": ("Euler", "RK4"),
        "many": ("RK4", "RK4,threads=2", "Euler", "implicit", "implicitfast", "discrete"),
        "pictures": ("Euler", "RK4", "implicit"),
        "as_installed": ("Euler",),
        "usual_dt": 0.002,
        "colour": "vermilion",
        "flight": True,
    },
}

# Parts of a step that one body without contacts, actuators, springs or sensors does not need. Bits that a version does not have
# are skipped. Autoreset would restart a diverged run.
SWITCHED_OFF = (
    *("CONSTRAINT", "EQUALITY", "FRICTIONLOSS", "LIMIT", "CONTACT", "DAMPER", "CLAMPCTRL", "WARMSTART"),
    *("FILTERPARENT", "ACTUATION", "REFSAFE", "SENSOR", "MIDPHASE", "EULERDAMP", "AUTORESET", "NATIVECCD", "ISLAND"),
    "MULTICCD",
)
PASSIVE = ("SPRING", "PASSIVE")
"""Parts that are also switched off, unless there is a field."""
FIELD = 20131013.0
"""An arbitrary number that nothing else contains. It marks our field in a model, so that the callback, which is the process's,
leaves all other models alone, and it finds the time in memory.
"""
# Reading a sample out costs about as much as one Euler step; storing every step inside the engine's loop costs a tenth of one.
# Largest number of steps per sample for a rollout.
ROLLOUT_UP_TO = 8
# Numbers that a rollout of many bodies stores at a time: 32 MiB.
ROOM = 1 << 22


def prepare(given):
    """Return a run of one body."""
    import mujoco as mj

    model = _model(mj, given)
    data = mj.MjData(model)
    start = _start(mj, model, data, given)
    march = _roll_out if given.every <= ROLLOUT_UP_TO else _step_to_samples
    evaluations = given.n_steps * (4 if given.integrator == "RK4" else 1)
    callback = _find_callback(mj, model, data)

    def run():
        with _quiet(mj, _ignore), _passive(mj, callback) if callback else nullcontext():
            qpos, qvel, reason = march(mj, model, data, start, given)
        samples = {"q": qpos[:, -4:], "w": qvel[:, -3:], "reason": reason, "evaluations": evaluations}
        return samples | {"p": qpos[:, :3], "v": qvel[:, :3]} if hasattr(given, "p_WB0") else samples

    loop = _bind_loop(mj, model, data, start, given)
    run.loop = _with_callback(mj, callback, loop) if callback else loop
    return run


def _with_callback(mj, callback, loop):
    """Return the loop with its callback. `wall_time` installs it once, as users do."""

    def call():
        with _passive(mj, callback):
            return loop()

    def wall_time(calls):
        with _passive(mj, callback):
            began = perf_counter()
            for _ in range(calls):
                loop()
            return perf_counter() - began

    call.wall_time = wall_time
    return call


def _bind_loop(mj, model, data, start, given):
    """Return the loop as users write it, for a run that does not fail: it returns qpos and qvel."""
    if len(given.steps) > 2:
        march = _roll_out if given.every <= ROLLOUT_UP_TO else _step_to_samples
        return lambda: march(mj, model, data, start, given)
    step, n_steps, qpos, qvel = mj.mj_step, given.n_steps, data.qpos, data.qvel
    mj.mj_setState(model, data, start, mj.mjtState.mjSTATE_FULLPHYSICS)
    q0, v0, end, turning = qpos.copy(), qvel.copy(), (qpos, qvel), given.turn.any()

    def loop():
        qpos[:], qvel[:] = q0, v0
        if turning:
            data.time = 0.0
        step(model, data, n_steps)
        return end

    return loop


def prepare_many(bodies):
    """Return a run of many bodies by `mujoco.rollout`, with a model and a state for each."""
    import mujoco as mj
    from mujoco.rollout import Rollout

    given, models = bodies[0], [_model(mj, body) for body in bodies]
    datas = [mj.MjData(models[0]) for _ in range(given.threads)]
    start = np.array([_start(mj, model, datas[0], body) for model, body in zip(models, bodies, strict=True)])
    room = np.empty((len(bodies), max(1, min(given.n_steps, ROOM // start.size)), start.shape[1]))
    callback = _find_callback(mj, models[0], datas[0])

    def run():
        states, installed = [start], _passive(mj, callback) if callback else nullcontext()
        with _quiet(mj, _ignore), installed, Rollout(nthread=given.threads if given.threads > 1 else 0) as pool:
            for n_steps in np.diff(given.steps).tolist():
                state = states[-1]
                while n_steps:  # in parts, because a rollout stores every step
                    part = np.ascontiguousarray(room[:, :n_steps])
                    pool.rollout(models, datas, state, nstep=part.shape[1], state=part)
                    state, n_steps = part[:, -1].copy(), n_steps - part.shape[1]
                states.append(state)
        states = np.stack(states, axis=1)
        # A rollout that fails keeps its state and its time.
        states[states[..., 0] < given.steps * given.dt * (1 - 1e-9)] = np.nan
        nq = 1 + models[0].nq
        return {"q": states[..., nq - 4 : nq], "w": states[..., nq + models[0].nv - 3 : nq + models[0].nv]}

    return run


def _model(mj, given):
    integrator = getattr(mj.mjtIntegrator, f"mjINT_{given.integrator.upper()}", None)
    if integrator is None:
        has = [kind[6:] for kind in dir(mj.mjtIntegrator) if kind.startswith("mjINT_")]
        raise NotImplementedError(f"MuJoCo {mj.__version__} has no integrator {given.integrator}, but {', '.join(has)}")
    spec = _read_file(mj, given) if description_of(given) in WRITTEN else mj.MjSpec()
    spec.option.timestep = given.dt
    spec.option.integrator = integrator
    spec.option.gravity = (0, 0, -given.gravity)
    field = pack_field(given)
    off = (*SWITCHED_OFF, *("GRAVITY",) * (given.gravity == 0), *PASSIVE * (not field.any()))
    spec.option.disableflags = sum(int(getattr(mj.mjtDisableBit, f"mjDSBL_{name}", 0)) for name in off)
    body = (
        spec.body("body") if description_of(given) in WRITTEN else spec.worldbody.add_body(name="body", explicitinertial=True)
    )
    if description_of(given) not in WRITTEN:
        body.mass, body.ipos, body.inertia, body.iquat = DUMMY if description_of(given) == "setter" else _inertial(given)
        body.add_joint(type=mj.mjtJoint.mjJNT_FREE if given.free else mj.mjtJoint.mjJNT_BALL)
    if given.stiffness and not given.turn.any():
        tendon = spec.add_tendon(name="spring", stiffness=given.stiffness, springlength=[given.rest_length] * 2)
        for name, owner, place in (("anchor", spec.worldbody, given.anchor), ("point", body, given.point)):
            owner.add_site(name=name, pos=place)
            tendon.wrap_site(name)
    elif field.any():
        spec.add_numeric(name="field", data=[FIELD, *field], size=1 + len(field))
    model = spec.compile()
    if description_of(given) == "setter":
        for name, value in zip(("mass", "ipos", "inertia", "iquat"), _inertial(given), strict=True):
            getattr(model, f"body_{name}")[1] = value
        mj.mj_setConst(model, mj.MjData(model))
    if description_of(given) == "mass":
        mj.mj_setTotalmass(model, given.mass)  # "Scale body masses and inertias to achieve specified total mass."
    if description_of(given) == "saved":
        with TemporaryDirectory() as folder:
            mj.mj_saveModel(model, f"{folder}/body.mjb", None)
            return mj.MjModel.from_binary_path(f"{folder}/body.mjb")
    return model


def _read_file(mj, given):
    """Return the body's file as a specification; for "rewritten", the file that MuJoCo writes after it has loaded it."""
    text = write_mjcf(given)
    if description_of(given) != "rewritten":
        return mj.MjSpec.from_string(text)
    with TemporaryDirectory() as folder:
        mj.mj_saveLastXML(f"{folder}/saved.xml", mj.MjModel.from_xml_string(text))
        return mj.MjSpec.from_file(f"{folder}/saved.xml")


WRITTEN = ("file", "child", "joints", "world", "damping", "rewritten", "mass", "scaled")
"""Descriptions of a body by a file."""
DUMMY = 1, (0.1, 0.2, 0.3), (2, 3, 4), (0.6, 0.8, 0, 0)
"""A body whose centre and axes differ from its frame: MuJoCo decides when it compiles a model whether they
coincide, so a body for which they did would keep the shortcut.
"""


def _inertial(given):
    return given.mass, given.com, mujoco_moments(given), given.q_com  # scalar first


def _find_callback(mj, model, data):
    """Return the passive force of a model in the form that C calls; None if it has none."""
    if not model.nnumeric:
        return None
    data.time = FIELD
    arrays = [(model, model.numeric_data), (data, data.xmat), (data, data.qfrc_passive)]
    addresses = [_find_word(owner, array.ctypes.data) for owner, array in arrays]
    addresses.append(_find_word(data, np.float64(FIELD).view(np.int64)))
    mj.mj_resetData(model, data)
    return _compile_callback(*addresses).ctypes


def _find_word(owner, value):
    """Return the place of an integer of 64 bits in one of MuJoCo's structures, whose layout changes with the version."""
    # At most 1 MiB is searched.
    return next(word for word in range(1 << 17) if ctypes.c_int64.from_address(owner._address + 8 * word).value == value)


@lru_cache(maxsize=1)
def _compile_callback(numeric, attitude, force, time):
    """Return the callback, for the places of pointers to `numeric_data`, `xmat` and `qfrc_passive`, and of the time."""
    try:
        from numba import cfunc, types
        from numba.extending import intrinsic
    except ImportError:
        raise NotImplementedError("this field needs numba next to MuJoCo") from None
    doubles, integers = types.CPointer(types.float64), types.CPointer(types.int64)
    torque = compile_torque()

    @intrinsic
    def read(typing, address):
        to_pointer = lambda context, builder, _, args: builder.inttoptr(args[0], context.get_value_type(doubles))  # noqa: E731
        return doubles(types.int64), to_pointer

    @cfunc(types.void(integers, integers))
    def passive(model, data):
        if model[numeric] == 0 or read(model[numeric])[0] != FIELD:
            return
        field, R, out = read(model[numeric] + 8), read(data[attitude] + 9 * 8), read(data[force])  # body 1, after the world
        t1, t2, t3 = torque(field, R, np.int64(data[time]).view(np.float64))
        out[0] += t1
        out[1] += t2
        out[2] += t3

    return passive


def _start(mj, model, data, given):
    """Return MuJoCo's state vector (time, qpos, qvel) at the start.

    qpos ends with the quaternion, scalar first, body to world; qvel ends with the angular velocity in body axes, for the free
    joint as for the ball joint. The free joint's position and velocity, both of its origin in world axes, are ahead of them:
    0 unless the scene is a free flight.
    """
    mj.mj_resetData(model, data)
    data.qpos[-4:], data.qvel[-3:] = given.q0, given.w0
    if hasattr(given, "p_WB0"):
        data.qpos[:3], data.qvel[:3] = given.p_WB0, given.v_WB0
    if description_of(given) == "time":
        data.time = LATER
    state = np.empty(mj.mj_stateSize(model, mj.mjtState.mjSTATE_FULLPHYSICS))
    mj.mj_getState(model, data, state, mj.mjtState.mjSTATE_FULLPHYSICS)
    return state


def _roll_out(mj, model, data, start, given):
    """Return qpos, qvel and a reason, from one call that stores every step."""
    from mujoco.rollout import rollout

    mj.mj_resetData(model, data)
    states = np.empty((1, given.n_steps, len(start)))
    rollout(model, data, start[None], nstep=given.n_steps, state=states)
    states = np.concatenate([start[None], states[0]])
    reason = _warning(mj, data)
    if reason:
        # After a failure the rollout repeats the last state, including its time.
        states[1:][np.diff(states[:, 0]) <= 0] = np.nan
    states = states[given.steps]
    return states[:, 1 : 1 + model.nq], states[:, 1 + model.nq : 1 + model.nq + model.nv], reason


def _step_to_samples(mj, model, data, start, given):
    """Return qpos, qvel and a reason, stepping from sample to sample inside the engine."""
    mj.mj_resetData(model, data)
    mj.mj_setState(model, data, start, mj.mjtState.mjSTATE_FULLPHYSICS)
    q, w = np.full((len(given.steps), model.nq), np.nan), np.full((len(given.steps), model.nv), np.nan)
    q[0], w[0] = data.qpos, data.qvel
    for sample, n_steps in enumerate(np.diff(given.steps), start=1):
        mj.mj_step(model, data, int(n_steps))
        reason = _warning(mj, data)
        if reason:
            return q, w, reason
        q[sample], w[sample] = data.qpos, data.qvel
    return q, w, ""


def _warning(mj, data):
    """Return MuJoCo's warning of a bad state; "" if there is none."""
    for kind in ("BADQPOS", "BADQVEL", "BADQACC"):
        if data.warning[int(getattr(mj.mjtWarning, f"mjWARN_{kind}"))].number:
            return f"MuJoCo warned of {kind}"
    return ""


def _ignore(message):
    """Do not write a warning to a file in the working directory; warnings are read from the data instead."""


class _Installed:
    """A function that MuJoCo calls during a run.

    The first of several runs at the same time replaces the user's own one, the last one restores it.
    """

    def __init__(self, name):
        self._name, self._lock, self._runs, self._before = name, Lock(), 0, None

    @contextmanager
    def __call__(self, mj, function):
        with self._lock:
            if self._runs == 0:
                self._before = getattr(mj, f"get_{self._name}")()
                getattr(mj, f"set_{self._name}")(function)
            self._runs += 1
        try:
            yield
        finally:
            with self._lock:
                self._runs -= 1
                if self._runs == 0:
                    getattr(mj, f"set_{self._name}")(self._before)


_quiet, _passive = _Installed("mju_user_warning"), _Installed("mjcb_passive")
