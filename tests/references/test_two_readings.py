"""The two readings of a model file share no function of this package, over all models of the package."""

import sys
import types
from contextlib import suppress
from pathlib import Path

import pytest

import conservative
from conservative.benchmarks.verification.bodies.identify import accelerations, identify, make_cases
from conservative.benchmarks.verification.bodies.loaded import CATALOGUE
from conservative.references.model_files.files import kind_of
from conservative.references.model_files.mjcf import NotRead
from conservative.references.model_files.pieces import Reading, join_links
from conservative.references.model_files.readers import FIRST, REFERENCE, SECOND
from conservative.references.model_files.reference import Refused
from conservative.references.model_files.robots import split

pytest.importorskip("lxml")
pytest.importorskip("pxr")
pytest.importorskip("pinocchio")

PACKAGE = str(Path(conservative.__file__).resolve().parents[1])
TESTS = str(Path(__file__).resolve().parents[1])
MODELS = sorted(path for path in CATALOGUE.iterdir() if path.suffix not in (".obj", ".md"))
SHARED: set[str] = set()
"""Functions of this package that both readings may execute. Dataclasses that hold a result have generated functions."""


class Trace:
    """The functions of this package that run within it, as file, name and line. Generated functions have no file."""

    def __enter__(self):
        self.functions = set()

        def note(frame, event, _):
            code = frame.f_code
            if event == "call" and code.co_filename.startswith(PACKAGE) and not code.co_filename.startswith(TESTS):
                self.functions.add(f"{Path(code.co_filename).stem}.{code.co_name} (line {code.co_firstlineno})")

        sys.setprofile(note)
        return self

    def __exit__(self, *_):
        sys.setprofile(None)


def trace_both(path, kind):
    """Return the functions of the first and of the second reading of a file with one body."""
    with Trace() as first, suppress(Refused):
        if kind in FIRST:
            FIRST[kind][3](path)
    with Trace() as second, suppress(NotRead, ValueError):
        join_links(SECOND[kind](path, [path.parent], Reading()))
    return first.functions, second.functions


def test_the_two_readings_share_no_function(tmp_path):
    """All models: 0 shared. Before, both of USD executed 13 named functions, both of MJCF 12, both of URDF none."""
    first, second = {kind: set() for kind in SECOND}, {kind: set() for kind in SECOND}
    read = 0
    for path in MODELS:
        kind = kind_of(path)
        folder = tmp_path / path.name
        folder.mkdir()
        for body in split(path, kind, folder, [path.parent]):
            one, two = trace_both(body.path, kind)
            first[kind] |= one
            second[kind] |= two
            read += 1
    assert read >= len(MODELS) >= 130
    # Drake reads SDF in its own process; what this package does with its answer is the identification from accelerations.
    with Trace() as by_motion:
        part = join_links(SECOND["sdf"](CATALOGUE / "products_of_inertia.sdf", [], Reading()))
    assert by_motion.functions <= second["sdf"]
    cases = make_cases(part)
    measured = accelerations(part, cases)
    with Trace() as by_motion:
        identify(make_cases(part), measured, part)
        accelerations(part, cases)
    first["sdf"] |= by_motion.functions
    for kind in SECOND:
        assert second[kind], kind
        assert not (first[kind] & second[kind]) - SHARED, kind
    assert {"usd", "mjcf", "sdf"} <= {kind for kind in first if first[kind]}


def test_a_shared_function_would_be_seen(tmp_path, monkeypatch):
    """The negative control: a reference reading that takes a pose or a number from the second one."""
    from conservative.references.model_files import reference, usd

    path = CATALOGUE / "turned_inertial_frame.usda"
    real = FIRST["usd"][3]

    def lazy(file):
        stage = usd.Stage(file)
        stage.pose(stage.bodies[0])
        return real(file)

    monkeypatch.setitem(FIRST, "usd", (*FIRST["usd"][:3], lazy))
    one, two = trace_both(path, "usd")
    assert any(name.startswith("usd.pose ") for name in one & two)
    assert isinstance(reference.by_usd_core, types.FunctionType)


def test_every_format_has_two_readings():
    assert set(SECOND) == set(REFERENCE) == {*FIRST, "sdf"}
