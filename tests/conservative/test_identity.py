"""`Scene.key`: equal for equal motions, another one for any change, and equal to itself only for what cannot be followed."""

from __future__ import annotations

import ctypes
import decimal
import functools
import io
import itertools
import math
import operator
import os
import random
import sys
import time
import weakref
from collections import defaultdict, deque
from dataclasses import dataclass, fields, is_dataclass, replace
from types import ModuleType, SimpleNamespace

import numba
import numpy as np
import pytest
from scipy.interpolate import BSpline, CubicSpline, PchipInterpolator, RegularGridInterpolator, interp1d
from scipy.spatial.transform import Rotation

import conservative as cv
from conservative.check import replace_unchecked
from conservative.features import Feature
from conservative.identity import digest, fields_of_motion, identify

from ..crossing import ROWS, OwnField

MODULE = "gains_of_the_tests"
K = 1.0


@pytest.fixture(autouse=True)
def gains(monkeypatch):
    """Return a module with the number k, a module inside, and a function of another module that reads k."""
    made, inner = ModuleType(MODULE), ModuleType(f"{MODULE}.inner")
    made.k = inner.k = K
    made.inner, made.np, made.settings = inner, np, SimpleNamespace(k=K)
    exec("def helper(t):\n    return k * t", vars(made))
    monkeypatch.setitem(sys.modules, MODULE, made)
    monkeypatch.setitem(sys.modules, f"{MODULE}.inner", inner)
    monkeypatch.setitem(globals(), "gains", made)
    monkeypatch.setitem(globals(), "K", K)
    return made


def imports(t):
    import gains_of_the_tests

    return gains_of_the_tests.k * t


def imports_a_name(t):
    from gains_of_the_tests import k

    return k * t


def imports_as(t):
    import gains_of_the_tests.inner as other

    return (lambda: other.k)() * t


def imports_inside(t):
    import gains_of_the_tests.inner

    return gains_of_the_tests.inner.k * t


READS = {
    "an attribute of a module": (lambda: lambda t: gains.k * t, "k"),
    "an attribute of a module in a comprehension": (lambda: lambda t: [gains.k * each for each in (t,)], "k"),
    "a module inside of a module": (lambda: lambda t: gains.inner.k * t, "inner"),
    "an attribute of an object in a module": (lambda: lambda t: gains.settings.k * t, "settings"),
    "a function of a module": (lambda: lambda t: gains.helper(t), "k"),
    "a function of another module": (lambda: gains.helper, "k"),
    "a partial of it": (lambda: functools.partial(gains.helper), "k"),
    "an import": (lambda: imports, "k"),
    "an import of a name": (lambda: imports_a_name, "k"),
    "an import under another name": (lambda: imports_as, "inner"),
    "an import of a module inside": (lambda: imports_inside, "inner"),
    "a default": (lambda: lambda t, settings=gains.settings: settings.k * t, "settings"),
    "a keyword default": (lambda: lambda t, *, settings=gains.settings: settings.k * t, "settings"),
}


@pytest.mark.parametrize("kind", READS)
def test_a_function_is_another_one_when_what_it_reads_changes(kind, gains):
    make, name = READS[kind]
    function, place = make(), getattr(gains, name) if name != "k" else gains
    before = identify(function)
    assert not before.unknown
    assert digest(make()) == before.text
    place.k = 2.0
    assert digest(function) != before.text
    place.k = K
    assert digest(function) == before.text


def test_globals_are_read_in_nested_functions_and_comprehensions():
    makers = (lambda: lambda t: K * t, lambda: lambda t: (lambda: K)() * t, lambda: lambda t: sum(K * each for each in (t,)))
    functions = [make() for make in makers]
    before = [digest(function) for function in functions]
    assert [digest(make()) for make in makers] == before
    globals()["K"] = 2.0
    assert not {*before} & {digest(function) for function in functions}


def closure(k):
    return lambda t: k * t


def closure_over(function):
    return lambda t: function(t)


def attribute_of(settings):
    return lambda t: settings.k * t


def with_numpy(k):
    import numpy as xp

    return lambda t: xp.array([0, 0, k * xp.sin(t)])


def keyword(k):
    return lambda t, *, gain=k: gain * t


def keyword_list(k):
    return lambda t, *, gain=[k]: gain[0] * t  # on purpose


def attribute(k):
    def torque(t):
        return torque.k * t

    torque.k = k
    return torque


class Bound:
    def __init__(self, k):
        self.k = k
        self.table = np.loadtxt(io.StringIO("1 2"))  # how it was made does not matter

    def torque(self, t):
        return self.k * t

    def __call__(self, t):
        return self.k * t


class Slots:
    __slots__ = ("k",)

    def __init__(self, k):
        self.k = k

    def __call__(self, t):
        return self.k * t


class Child(Bound):
    def __call__(self, t):
        return super().__call__(t)


@dataclass
class Numbers:
    k: float

    def __call__(self, t):
        return self.k * t


def property_of(k):
    class Own:
        @property
        def gain(self):
            return k

        def __call__(self, t):
            return self.gain * t

    return Own()


def metaclass(k):
    class Meta(type):
        gain = k

    class Own(metaclass=Meta):
        def __call__(self, t):
            return type(self).gain * t

    return Own()


def compared(k):
    class Own:
        def __eq__(self, other):
            return other == k

        __hash__ = object.__hash__

        def __call__(self, t):
            return float(self == 1.0) * t

    return Own()


def printed(k):
    class Own:
        def __str__(self):
            return repr(k)

        def __call__(self, t):
            return float(str(self)) * t

    return Own()


def assigned(k):
    class Own:
        def __setattr__(self, name, value):
            object.__setattr__(self, name, k * value)

        def __call__(self, t):
            self.gain = t
            return self.gain

    return Own()


def made_again(how):
    """Return a maker of objects whose constructor multiplies by k, and whose calls make another one."""

    def make(k):
        @dataclass
        class Own:
            of: float

            def __post_init__(self):
                self.gain = k * self.of

            __call__ = how

            @classmethod
            def another(cls, of):
                return cls(of)

        made = object.__new__(Own)
        vars(made).update(of=1.0, gain=1.0)
        return made

    return make


def wrapped(k):
    @functools.wraps(lambda t: k * t)
    def torque(t):
        return torque.__wrapped__(t)

    return torque


def hidden(k):
    made = Bound(1.0)
    made._callback = lambda t: k * t
    return made


def list_with_attribute(k):
    class Own(list):
        def __call__(self, t):
            return self.k * t

    made = Own([1.0])
    made.k = k
    return made


def matrix(k):
    return np.diag([1.0, 2.0, k])


X = np.linspace(0, 1, 6)
MADE = {
    "a closure": closure,
    "a closure over numpy": with_numpy,
    "a default": lambda k: lambda t, gain=k: gain * t,
    "a keyword default": keyword,
    "a list as a keyword default": keyword_list,
    "an attribute of a function": attribute,
    "a bound method": lambda k: Bound(k).torque,
    "a bound method of C": lambda k: matrix(k).dot,
    "another bound method of C": lambda k: matrix(k).__getitem__,
    "a bound method of a dictionary": lambda k: {0.0: k}.get,
    "a callable object": Bound,
    "an object of a derived class": Child,
    "an object with slots": Slots,
    "a dataclass": Numbers,
    "a property": property_of,
    "a class with a metaclass": metaclass,
    "a list with an attribute": list_with_attribute,
    "a class with a comparison": compared,
    "a class with a text": printed,
    "a class with assignments": assigned,
    "an object of the same type": made_again(lambda self, t: type(self)(t).gain),
    "an object of the same class": made_again(lambda self, t: self.__class__(t).gain),
    "a copy with another field": made_again(lambda self, t: replace(self, of=t).gain),
    "a class method": made_again(lambda self, t: self.another(t).gain),
    "a constructor that is called again": made_again(lambda self, t: self.__post_init__() or self.gain * t),
    "a wrapped function": wrapped,
    "an attribute with a function": hidden,
    "a dictionary with a default": lambda k: defaultdict(float, {0.0: k}).__getitem__,
    "a queue": lambda k: deque([k]).__getitem__,
    "a partial": lambda k: functools.partial(operator.mul, k),
    "a partial with a keyword": lambda k: functools.partial(lambda t, gain: gain * t, gain=k),
    "an item getter": lambda k: operator.itemgetter(int(k)),
    "a method caller": lambda k: operator.methodcaller("__mul__", k),
    "an interpolation": lambda k: interp1d(X, k * X**2),
    "the call of an interpolation": lambda k: interp1d(X, k * X**2).__call__,
    "a cubic spline": lambda k: CubicSpline(X, k * X**2),
    "a monotone spline": lambda k: PchipInterpolator(X, k * X**2),
    "a B-spline": lambda k: BSpline(X, [k, 1.0, 2.0], 2),
    "an interpolation on a grid": lambda k: RegularGridInterpolator((X,), k * X**2),
    "a function that calls a spline": lambda k: closure_over(CubicSpline(X, k * X**2)),
    "a polynomial": lambda k: np.poly1d([k, 1.0]),
    "a newer polynomial": lambda k: np.polynomial.Polynomial([k, 1.0]),
    "a vectorized function": lambda k: np.vectorize(closure(k)),
    "a rotation": lambda k: Rotation.from_rotvec([0, 0, k]).apply,
    "a namespace": lambda k: attribute_of(SimpleNamespace(k=k)),
    "a masked array": lambda k: np.ma.array([k, 1.0], mask=[False, True]).__getitem__,
}


@pytest.mark.parametrize("kind", MADE)
def test_a_function_with_another_number_is_another_one(kind):
    make = MADE[kind]
    one, same, other = (identify(make(k)) for k in (1.0, 1.0, 2.0))
    assert not one.unknown
    assert one == same
    assert one.text != other.text


def test_a_view_that_changes_makes_another_function():
    base = np.zeros(3)
    torque = functools.partial(np.add, base[:])
    before = digest(torque)
    base[2] = 1.0
    assert digest(torque) != before


def test_libraries_are_followed_by_name_and_their_replacements_by_code(monkeypatch):
    same = [np.sin, np.cross, np.dot, math.sin, math.cos, np.linalg.norm, operator.mul, CubicSpline, np.float64]
    assert len({digest(each) for each in same}) == len(same)
    assert [digest(each) for each in same] == [digest(each) for each in same]
    torque = functools.partial(lambda t: math.sin(t) * np.pi)
    before = identify(torque)
    assert not before.unknown
    monkeypatch.setattr(math, "sin", math.cos)
    assert digest(torque) != before.text


def counting():
    calls = 0

    def torque(t):
        nonlocal calls
        calls += 1
        return calls * t

    return torque


def counting_globally(t):
    global K  # on purpose
    K += 1.0
    return K * t


@functools.lru_cache
def remembered(t):
    return gains.k * t


@numba.njit
def compiled(t):
    return K * t


FACTORS = [1.0, 2.0]
"""A list, which can change after a cache has stored what follows from it."""


@functools.lru_cache
def remembered_default(t, factors=FACTORS):
    return factors[0] * t


@functools.lru_cache
def remembered_keyword_default(t, *, factors=FACTORS):
    return factors[0] * t


def generator():
    yield 1.0


def alias(t):
    place = gains
    return place.k * t


UNKNOWN = {
    "a dictionary of modules": lambda: lambda t: sys.modules[MODULE].k * t,
    "a module that is passed on": lambda: lambda t: getattr(gains, "k") * t,  # noqa: B009  # on purpose
    "a module under another name": lambda: alias,
    "a module in a partial": lambda: functools.partial(lambda t, xp: xp.random.rand() * t, xp=np),
    "a module as a default": lambda: lambda t, place=gains: place.k * t,
    "the dictionary of globals": lambda: lambda t: globals()["K"] * t,
    "the globals of a function": lambda: lambda t: alias.__globals__["K"] * t,
    "a counter": counting,
    "a global counter": lambda: counting_globally,
    "a cache": lambda: remembered,
    "a cache with a list as a default": lambda: remembered_default,
    "a cache with a list as a keyword default": lambda: remembered_keyword_default,
    "compiled code that reads a global": lambda: compiled,
    "random numbers": lambda: closure_over(np.random.default_rng(0).normal),
    "global random numbers": lambda: lambda t: random.random() * t,
    "random numbers of numpy": lambda: lambda t: np.random.rand() * t,  # noqa: NPY002  # on purpose
    "a clock": lambda: lambda t: time.time() * t,
    "numbers of a precision that the process sets": lambda: lambda t: float(decimal.Decimal(1) / 3) * t,
    "the environment": lambda: lambda t: float(os.environ.get("K", "1")) * t,
    "a file": lambda: lambda t: float(open("k").read()) * t,  # noqa: PTH123, SIM115  # on purpose
    "a file of numbers": lambda: lambda t: np.loadtxt("k") * t,
    "an open file": lambda: io.StringIO("1").read,
    "a generator": lambda: generator().__next__,
    "an iterator": lambda: iter([1.0]).__next__,
    "a counter of itertools": lambda: functools.partial(next, itertools.count()),
    "a weak reference": lambda: weakref.ref(alias),
    "a pointer": lambda: ctypes.CFUNCTYPE(ctypes.c_double)(lambda: 1.0),
    "a memory view": lambda: memoryview(bytearray(3)).__getitem__,
    "a function of numpy made of Python": lambda: np.frompyfunc(lambda t: t, 1, 1),
    "a module with attributes made when they are read": lambda: lambda t: gains.unknown * t,
}


@pytest.mark.parametrize("kind", UNKNOWN)
def test_what_cannot_be_followed_equals_nothing(kind):
    value = UNKNOWN[kind]()
    assert identify(value).unknown
    assert digest(value) != digest(value)
    assert digest([value]) != digest([value])


def test_pure_compiled_code_is_followed():
    @numba.njit
    def torque(t):
        return np.array([0.0, 0.0, 0.1 * math.sin(t)])

    @functools.lru_cache
    def cached(t):
        return (0, 0, 0.1 * math.sin(t))

    for each in (torque, cached):
        assert not identify(each).unknown
        assert digest(each) == digest(each)


def scene(torque, **changes):
    given = {"t_end": 10.0, "torque": cv.Torque(torque)} | changes
    return cv.Scene("tuned", cv.RigidBody((1.0, 2.0, 2.5)), np.eye(3), (0.3, 0.2, 0.5), **given)


def tuned(t):
    return np.array([0.0, 0.0, gains.k * np.sin(t)])


def error_of(run):
    """Return the largest distance from a run with short steps, rad."""
    fine = cv.integrate(run.scene.rename("fine"), run.t[-1] / 2000, "projected")
    return float(np.linalg.norm(run.R_WB[-1] - fine.R_WB[-1]) / np.sqrt(2))


@pytest.mark.parametrize("again", [True, False], ids=["the same scene", "a new scene"])
def test_trials_of_another_torque_are_not_used(again, gains):
    """It was 1.6e-2 rad off, with an estimate of 2.3e-7 and the step of the first torque."""
    built = scene(tuned)
    for gains.k in (0.05, 5.0):
        built = built if again else scene(tuned)
        assert error_of(cv.integrate(built, error=1e-6)) < 1e-6  # measured: 3e-8


def test_break_points_follow_a_global(gains):
    built = scene(lambda t: (0, 0, float(t > gains.k)))
    for gains.k in (1.0, 3.123, 4.5):
        found = cv.integrate(built, 0.1, "projected")
        alone = cv.integrate(scene(lambda t: (0, 0, float(t > gains.k))), 0.1, "projected")
        assert np.array_equal(found.R_WB, alone.R_WB)
        assert built.breaks == pytest.approx([gains.k], abs=1e-12)


def test_a_scene_of_the_environment_equals_itself_and_is_not_cached(monkeypatch):
    def torque(t):
        return (0, 0, float(os.environ["TEST_GAIN"]) * math.sin(t))

    monkeypatch.setenv("TEST_GAIN", "0.05")
    built = scene(torque)
    assert built.key == built.key
    assert len({built.key, scene(torque).key, built.rename("other").key}) == 3
    for size in ("0.05", "5.0"):
        monkeypatch.setenv("TEST_GAIN", size)
        assert error_of(cv.integrate(built, error=1e-6)) < 1e-6  # measured: 3e-8


def test_a_function_that_counts_its_calls_equals_itself_only():
    class Counter:
        n = 0

        def __call__(self, t):
            self.n += 1
            return (0, 0, 0.1 * t)

    one, other = scene(Counter()), scene(Counter())
    assert one.identity.unknown
    assert one.key == one.key != other.key


def test_pure_functions_keep_their_trials(monkeypatch):
    spline = CubicSpline(X * 10, np.column_stack([X, 0 * X, np.sin(X)]))
    made = [scene(lambda t: 0.1 * spline(t)) for _ in range(2)]
    assert made[0].key == made[1].key
    assert made[0].now() is made[0]
    chosen = cv.integrate(made[0], error=1e-6).choice

    def fail(*arguments):
        raise AssertionError("a trial run was repeated")

    again = cv.integrate(made[1], error=1e-6).choice
    assert (again.method, again.dt, again.estimate) == (chosen.method, chosen.dt, chosen.estimate)


def test_a_run_of_another_torque_is_not_resumed(gains, tmp_path):
    pytest.importorskip("zarr")
    run = {"w_WB_B0": np.eye(3), "dt": 0.1, "method": "projected", "threads": 1, "path": tmp_path / "a.zarr"}
    made = cv.integrate_many(scene(tuned, t_end=1.0), **run)
    assert np.array_equal(cv.integrate_many(scene(tuned, t_end=1.0), **run, resume=True).R_WB[:], made.R_WB[:])
    gains.k = 5.0
    with pytest.raises(cv.BadInput, match=r"another scene \(torque\)"):
        cv.integrate_many(scene(tuned, t_end=1.0), **run, resume=True)
    with pytest.raises(cv.BadInput, match="another torque"):
        cv.open_ensemble(run["path"], scene(tuned, t_end=1.0))


def test_a_run_of_a_torque_that_cannot_be_followed_is_not_resumed(tmp_path):
    pytest.importorskip("zarr")

    def torque(t):
        return (0, 0, float(os.environ.get("TEST_GAIN", "0.1")) * t)

    run = {"w_WB_B0": np.eye(3), "dt": 0.1, "method": "projected", "threads": 1, "path": tmp_path / "a.zarr"}
    built = scene(torque, t_end=1.0)
    made = cv.integrate_many(built, **run)
    with pytest.raises(cv.BadInput, match=r"resume: got True, for the scene 'tuned' with .*os\._Environ; expected False: "):
        cv.integrate_many(built, **run, resume=True)
    with pytest.warns(cv.SceneNotCompared, match=r"os\._Environ"):
        assert np.array_equal(cv.open_ensemble(run["path"], built).R_WB[:], made.R_WB[:])
    with pytest.raises(cv.BadInput, match="another body"), pytest.warns(cv.SceneNotCompared):
        cv.open_ensemble(run["path"], built.rename("other", body=cv.RigidBody((1.0, 2.0, 2.6))))


# Every field of every part, from the dataclasses themselves


def change(value):
    """Return another value of the same kind, as near as possible."""
    if isinstance(value, np.ndarray):
        changed = value.copy()
        if changed.size:
            changed.flat[-1] = np.nextafter(changed.flat[-1], np.inf)
        return changed if changed.size else np.ones(1)
    if isinstance(value, bool):
        return not value
    if isinstance(value, float):
        return math.nextafter(value, math.inf)
    if isinstance(value, str):
        return f"{value}x"
    if callable(value) and not is_dataclass(value):
        return lambda *arguments: value(*arguments)
    return {type(None): 1.0, OwnField: OwnField((1.0, 2.0, 3.0))}[type(value)]


def variants(value):
    """Yield the path of each field of motion in a value, and the value with another one."""
    if is_dataclass(value) and type(value).__module__.startswith("conservative."):
        for name in fields_of_motion(type(value)):
            for path, part in variants(getattr(value, name)):
                yield f"{type(value).__name__}.{name} {path}", replace_unchecked(value, **{name: part})
    elif isinstance(value, tuple):
        yield "longer", (*value, 1.0)
        for i, each in enumerate(value):
            for path, part in variants(each):
                yield f"{i} {path}", (*value[:i], part, *value[i + 1 :])
    else:
        yield "", change(value)


@pytest.mark.parametrize("feature", Feature, ids=str)
def test_a_change_of_any_number_or_function_changes_the_key(feature):
    built = ROWS[feature].scene()
    extra = cv.Invariant("made", "J", 1.0, lambda R, w: w[:, 0])
    built = replace_unchecked(built, extra_invariants=(extra,))
    keys = {"": built.key}
    for path, other in variants(built):
        assert other.key not in keys.values(), path
        keys[path] = other.key
    assert {path.partition(" ")[0] for path in keys} - {""} == {f"Scene.{name}" for name in fields_of_motion(cv.Scene)}
    assert {field.name for field in fields(cv.Scene)} - {*fields_of_motion(cv.Scene)} == {"name", "dt", "group", "source"}
    assert built.rename("other", group="x", source="y", dt=0.3).key == built.key
