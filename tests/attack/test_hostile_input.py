"""Calls of the public API with hostile arguments: each returns a correct, finite result or raises a documented exception.

One to three valid arguments of a call are replaced by numbers beyond floats, texts with NUL, nan, wrong shapes, functions that
fail and objects without a `repr`. Names, scene files and model files are scrambled.
"""

import inspect
import math
import signal
import time
import warnings
from dataclasses import replace
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, note
from hypothesis import strategies as st

import conservative as cv
from conservative import registry
from conservative.attitude import orthonormality
from conservative.check import describe
from conservative.references.exact.method import free_body, lagrange_top
from conservative.references.model_files.scene_bodies import body_from_mjcf, body_from_urdf
from conservative.scene_files import scene_file

from ..environments import PATIENCE
from .effort import tries

pytestmark = pytest.mark.attack
REFUSALS = (cv.BadInput, cv.IntegrationFailed, cv.PotentialFailed, cv.MissingEngine)
SECONDS = PATIENCE  # a try that takes longer hangs
GROSS = 1e-6  # error of R'R - 1, and of the energy relative to the scene's scale
BRICK = cv.integrate(cv.scenes.brick_flip(), 0.01, t_end=0.1)


class Unprintable:
    def __repr__(self):
        raise RuntimeError("no text")

    def __float__(self):
        raise RuntimeError("no number")

    def __array__(self, *arguments, **settings):
        raise RuntimeError("no array")


def fail(*_):
    raise RuntimeError("an exception of the user")


HUGE = 10**400
# fmt: off
NUMBERS = [
    0, 1, -1, 0.3, -0.0, HUGE, -HUGE, 10**5000, math.nan, math.inf, -math.inf, 1e200, -1e200, 1e-200, 5e-324, 1e31, 1e-31,
    1e30, 1e-30, Fraction(HUGE), Fraction(1, HUGE), Decimal("1e999"), Decimal("1.5"), Decimal("nan"), True, None,
    1j, np.float32(2), np.int64(3), np.bool_(True), np.longdouble("1e4000"), np.array(1.0), np.array([1.0, 2.0]),
    np.array([object()]), np.datetime64("2026-01-01"),
]
TEXTS = ["", "1", "abc", "\0", "a\0.toml", "\ud800", "x" * 10**5, "no.toml", "../..", "\n", b"bytes", "nan", "1e400"]
OBJECTS = [[], {}, (), set(), [[]], object(), Unprintable(), int, len, lambda *_: None, iter(()), {"a": 1}, range(3)]
VECTORS = [
    [1, 2], [1, 2, 3, 4], [[1, 2, 3]], [[1], [2, 3]], np.zeros((3, 0)), np.full(3, np.nan), [1, 2, math.inf], [HUGE, 1, 1],
    ["1", "2", "3"], [None, 1, 1], [True, False, True], [1j, 1, 1], [Fraction(HUGE), 1, 1], [Decimal("1e999"), 1, 1], "123",
    [1e200, 1, 1], [1e-200] * 3, [0, 0, 0], [1e30, 1e-30, 1], [5e-324, 1, 1], np.eye(3), -np.eye(3), 1e200 * np.eye(3),
    np.zeros((3, 3)), np.ones((3, 3)), np.eye(3)[None], np.eye(3, dtype=complex), np.array([1, 2, 3], dtype=object),
    np.array([[1, 1e-16, 0], [0, 1, 0], [0, 0, 1]]), [1, 1e-15, 1], [object(), 1, 2], [[[]]],
]
FUNCTIONS = [
    fail, lambda *_: "text", lambda *_: [1.0], lambda *_: None, lambda *_: np.nan, lambda *_: 1j, lambda *_: HUGE,
    lambda *_: np.zeros((3, 3)), lambda *_: np.full((3, 3), np.inf), lambda *_: 1e300, lambda: 1.0, lambda *_: True,
    lambda *_: [["a"] * 3] * 3, lambda *_: Unprintable(), lambda *_: 0.0,
]
# fmt: on


def hostile(rng, usual):
    """Return a hostile value in place of a usual one, mostly of its kind."""
    own = NUMBERS
    if isinstance(usual, str):
        own = TEXTS
    elif callable(usual):
        own = FUNCTIONS
    elif not isinstance(usual, int | float | None):
        own = VECTORS
    return rng.choice(own if rng.random() < 0.7 else NUMBERS + TEXTS + OBJECTS)


def swap(rng, function, arguments):
    """Return a call in which one to three arguments are hostile."""
    names = rng.sample(list(arguments), k=min(len(arguments), rng.choice((1, 1, 1, 2, 3))))
    given = {name: hostile(rng, arguments[name]) for name in names}
    note(f"{function.__name__}({', '.join(f'{name}={describe(value)}' for name, value in given.items())})")
    return lambda: function(**arguments | given)


def scramble(rng, text):
    """Return a text in which something is cut out, doubled, or replaced by characters that do not belong there."""
    at, length = rng.randrange(len(text) + 1), rng.randint(0, 20)
    piece = text[at : at + length]
    others = ("", piece * 2, "\0", "\ud800", "9" * 400, "[[[[", "1e400", "\n", '"', "é", "-", "99999999999999999999", "nan")
    return text[:at] + rng.choice(others) + text[at + length :]


HOOK = np.array((0.0, 0.1, 0.4))
BOX, ORBIT = cv.shapes.box((1, 2, 3), mass=1), cv.Orbit(1.0, (0, 0, 1))
SCENE = {
    "name": "s",
    "body": cv.RigidBody((1.0, 2.0, 2.5)),
    "R_WB0": np.eye(3),
    "w_WB_B0": (0.1, 0.2, 3.0),
    "t_end": 1.0,
    "potential": None,
}
CONSTRUCTORS = {
    cv.RigidBody: {"inertia": (1.0, 2.0, 2.5)},
    cv.Scene: {**SCENE, "dt": 0.05, "extra_invariants": (), "group": "g", "source": "s"},
    cv.UniformGravity: {"weight": 1.0, "com_B": (0, 0, 0.1)},
    cv.LinearSpring: {"stiffness": 1.0, "point_B": (1, 0, 0), "anchor_W": (0, 0, 1), "rest_length": 0.5},
    cv.PointAttraction: {"strength": 1.0, "point_B": (1, 0, 0), "anchor_W": (0, 0, 2)},
    cv.GravityGradient: {"rate": 1.0, "inertia": (1.0, 2.0, 2.5), "direction_W": (0, 0, 1)},
    cv.FunctionPotential: {
        "energy": lambda R: float(R[2] @ HOOK) ** 4,
        "gradient": lambda R: np.outer([0, 0, 1], 4 * float(R[2] @ HOOK) ** 3 * HOOK),
        "scale": 1.0,
        "axis_W": (0, 0, 1),
    },
    cv.Orbit: {"rate": 1.0, "normal_W": (0, 0, 1)},
    cv.Turning: {"potential": cv.UniformGravity(1.0, (0, 0, 0.1)), "orbit": cv.Orbit(1.0, (1, 0, 0))},
    ORBIT.gravity_gradient: {"inertia": (1.0, 2.0, 2.5), "direction_W": (1, 0, 0)},
    cv.Invariant: {"name": "i", "unit": "J", "scale": 1.0, "evaluate": lambda R, w: w[:, 0]},
    cv.Grid: {"dt": 0.1, "n_steps": 10, "every": 2},
    cv.shapes.box: {"size": (1, 2, 3), "mass": 1.0, "density": None},
    cv.shapes.ellipsoid: {"semi_axes": (1, 2, 3), "mass": None, "density": 1.0},
    cv.shapes.cylinder: {"radius": 1.0, "height": 2.0, "mass": None, "density": 1.0},
    cv.shapes.cone: {"radius": 1.0, "height": 2.0, "mass": 1.0, "density": None},
    cv.shapes.MassDistribution: {"mass": 1.0, "com_B": (0, 0, 1), "inertia_com": (1, 2, 2.5)},
    BOX.rotate: {"R_BS": np.eye(3)},
    BOX.about: {"com_B": (0, 0, 1)},
    BOX.gravity: {"g": 9.81},
}


def construct(rng, folder):
    """Call a constructor and use its value: the body of a shape, the times of a grid, a run in a potential."""
    made = swap(rng, *rng.choice(list(CONSTRUCTORS.items())))

    def use():
        value = made()
        if isinstance(value, cv.shapes.MassDistribution):
            return value.body
        if isinstance(value, cv.Grid):
            return value.n_samples < 10**6 and value.t
        if isinstance(value, cv.FunctionPotential | cv.Turning):
            return cv.integrate(cv.Scene(**SCENE | {"potential": value}), 0.1, t_end=0.2)
        return value

    return use


def parameters(function):
    return {name: each.default for name, each in inspect.signature(function).parameters.items()}


def method_settings(rng, folder):
    names = [name for name in registry.list_methods() if parameters(registry.list_families()[name])]
    family = registry.list_families()[rng.choice(names)]
    return swap(rng, family, parameters(family))


def integrate(rng, folder):
    scene = rng.choice((cv.scenes.brick_flip, cv.scenes.lagrange_top, cv.scenes.sprung_body))()
    method = rng.choice((None, cv.Reduced(), cv.Gauss(2), cv.MoserVeselov(), cv.Lame(), cv.Projected(), cv.Substepped()))
    arguments = {"scene": scene, "dt": 0.05, "method": method, "t_end": 0.3, "sample_every": 2, "on_failure": "return"}
    if rng.random() < 0.1:
        arguments |= {"error": 1e-6, "method": None}
    return swap(rng, cv.integrate, arguments)


def name(rng, folder):
    look = rng.choice((registry.scene, registry.method))
    names = registry.list_scenes() if look is registry.scene else registry.list_methods()
    settings = ["", ":", ":1e400", ":none", ":true", f":{'9' * 400}", ":nan", ":x=1", ":-1", ":0", ":[]", ":\0", ":1,2,3,4"]
    text = rng.choice(names) + rng.choice(settings)
    text = hostile(rng, "s") if rng.random() < 0.2 else scramble(rng, text) if rng.random() < 0.3 else text
    note(f"registry.{look.__name__}({describe(text)})")
    return lambda: look(text)


def scene_function(rng, folder):
    function = getattr(cv.scenes, rng.choice([name for name in registry.list_scenes() if hasattr(cv.scenes, name)]))
    return swap(rng, function, parameters(function))


def scene_text(rng, folder):
    lines, path = scene_file.template().splitlines(), folder / "scene.toml"
    number = rng.choice([i for i, line in enumerate(lines) if "=" in line and not line.startswith("#")])
    values = ["1e400", "nan", "-inf", "[1, 2]", "true", "1979-05-27", "{}", "1e-200", "[[1e300]]", "9" * 400, '"text"', ""]
    lines[number] = lines[number].partition("=")[0] + "= " + rng.choice(values)
    text = "\n".join(lines)
    text = scramble(rng, text) if rng.random() < 0.5 else text
    note(text)
    path.write_text(text, encoding="utf-8", errors="surrogatepass")
    return lambda: scene_file.load(path)


MODELS = {
    body_from_mjcf: '<mujoco><worldbody><body name="arm"><joint type="ball"/><geom size="0.1"/></body></worldbody></mujoco>',
    body_from_urdf: '<robot name="r"><link name="arm"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" '
    'ixz="0" iyz="0"/></inertial></link></robot>',
}


def model_file(rng, folder):
    read, text = rng.choice(list(MODELS.items()))
    path, arguments = folder / "model.xml", {"path": str(folder / "model.xml"), "name": "arm"}
    text = scramble(rng, text)
    note(text)
    path.write_text(text, encoding="utf-8", errors="surrogatepass")
    return swap(rng, read, arguments) if rng.random() < 0.5 else lambda: read(**arguments)


def closed_form(rng, folder):
    arguments = {"body": cv.RigidBody((1, 1, 2)), "R_WB0": np.eye(3), "w_WB_B0": (1, 2, 3), "t": [0.0, 1.0]}
    if rng.random() < 0.5:
        return swap(rng, free_body, arguments)
    return swap(rng, lagrange_top, {**arguments, "potential": cv.UniformGravity(1, (0, 0, 1))})


class Hang(BaseException):
    """Raised by the alarm; not an `Exception`, so that no handler on the way catches it."""


def attempt(call, seconds=SECONDS):
    """Make a call; raise an exception unless it is refused or its result is right."""

    def ring(number, frame):
        raise Hang

    before = signal.signal(signal.SIGALRM, ring)
    try:
        try:
            signal.setitimer(signal.ITIMER_REAL, seconds)
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                warnings.simplefilter("ignore", cv.AccuracyNotReached)
                value = call()
        finally:  # an alarm may come until here, and has to be caught below
            signal.setitimer(signal.ITIMER_REAL, 0)
    except REFUSALS:
        return
    except Hang:
        raise AssertionError(f"no answer after {seconds:g} s") from None
    finally:
        signal.signal(signal.SIGALRM, before)
    if isinstance(value, cv.Trajectory) and value.ok:
        assert len(value) >= 2
        assert value.t[0] == 0
        assert (np.diff(value.t) > 0).all()
        assert np.isfinite(value.R_WB).all()
        assert np.isfinite(value.w_WB_B).all()
        assert orthonormality(value.R_WB).max() <= GROSS
        if value.label.startswith("conservative=="):
            assert np.abs(value.energy - value.energy[0]).max() <= GROSS * value.scene.energy_scale
    if isinstance(value, cv.Scene):
        assert all(map(math.isfinite, (value.energy_scale, value.dt, value.t_end, value.kinetic_energy0)))
    if isinstance(value, cv.RigidBody):
        assert value.moments.min() > 0
        assert np.isfinite(value.inverse).all()


KINDS = {
    **{construct: 400, method_settings: 200, integrate: 200, name: 200, scene_function: 200, scene_text: 200, closed_form: 200},
    model_file: 5,  # each starts a process
}


@pytest.mark.parametrize(("kind", "usual"), KINDS.items(), ids=[kind.__name__ for kind in KINDS])
def test_hostile_calls_are_refused_or_right(kind, usual, tmp_path_factory):
    folder = tmp_path_factory.mktemp("hostile")

    @tries(usual)
    @given(st.randoms(use_true_random=False))
    def attack(rng):
        attempt(kind(rng, folder))

    attack()


FAULTS = {
    "another exception": fail,
    "a warning": lambda: np.array([1e308]) * 10,
    "not finite": lambda: replace(BRICK, w_WB_B=np.full_like(BRICK.w_WB_B, np.nan)),
    "not orthonormal": lambda: replace(BRICK, R_WB=1.001 * BRICK.R_WB),
    "lost energy": lambda: replace(BRICK, w_WB_B=np.linspace(1, 1.1, len(BRICK))[:, None] * BRICK.w_WB_B),
    "times": lambda: replace(BRICK, t=BRICK.t[::-1]),
    "a hang": lambda: time.sleep(PATIENCE),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_found(fault):
    with pytest.raises((AssertionError, RuntimeError, RuntimeWarning)):
        attempt(FAULTS[fault], 0.1)
