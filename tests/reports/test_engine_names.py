"""Names of engines with and without a version, in both spellings, in every command that takes one."""

import json
import re
import shlex
import sys
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import fields, is_dataclass
from types import SimpleNamespace

import click
import pytest
from click.testing import CliRunner

from conservative import deferred_imports, registry
from conservative.benchmarks.verification.finding import Verification
from conservative.errors import BadInput
from conservative.method import Method
from conservative.method_info import settings_text
from conservative.programs import list_programs
from conservative.references.environments import environment, folders
from conservative.registry import read_name
from conservative.reports.cli.main import main

from .. import conftest
from ..sampling import sampled

TAKEN = ("methods", "engines", "engine", "names", "command", "subjects")
"""Parameters of commands that take names of engines."""
COMMAND_LINE = ("engines add", "command")
"""The parameter among them that takes a command line only."""
GIVEN = {"scene": "brick_flip", "spread": "rate=1%", "name": "motion", "against": "HEAD", "versions": "9.9"}
"""Values of other parameters: those that are required, and those in `NEEDS`."""
NEEDS = {"gate": "against", "track": "versions"}
TABLES = ("recommend", "report", "study", "verify")
"""Commands that show all settings of a name."""
CAPTURED = {
    "engines install": ("references.environments.pip.Pip.resolve",),
    "engines remove": ("references.environments.install.drop", "references.environments.install.register"),
    "gate": (),
    "recommend": ("benchmarks.recommendation.recommend.recommend",),
    "report": ("reports.report.write",),
    "run": ("reports.run.single_run.Planned",),
    "study": ("reports.run.single_study.measure_study",),
    "sweep": ("reports.run.sweep.run_sweep",),
    "track": ("references.environments.install.find_environment",),
    "verify": (
        "benchmarks.verification.programs.verify_method",
        "benchmarks.verification.programs.verify_program",
        "benchmarks.verification.bodies.loaded.Program.check",
    ),
    "watch": ("reports.run.single_run.Planned",),
}
"""Functions that get what a command has selected, before any work. `gate` refuses versions."""
GREETING = {
    "settings": {"integrator": "rk4", "fixed": False},
    "orders": {"rk4": 4, "euler": 1},
    "method_info": {"variants": ["euler", "rk4"], "as_installed": ["euler,fixed=true"]},
    "formats": ["urdf"],
}


class Captured(Exception):
    """A function was not called."""


def leaves(group, before=""):
    for name, command in group.commands.items():
        yield from leaves(command, f"{name} ") if isinstance(command, click.Group) else [(before + name, command)]


CELLS = [
    pytest.param(name, command, parameter, id=f"{name} {parameter.name}")
    for name, command in leaves(main)
    for parameter in command.params
    if parameter.name in TAKEN and (name, parameter.name) != COMMAND_LINE
]


def crossed(texts, size):
    """Cells with texts: all cells and all texts are in the sample."""
    all_of = [pytest.param(*cell.values, text, id=f"{cell.id} {text}") for cell in CELLS for text in texts]
    return sampled(all_of, size)


@pytest.fixture(autouse=True, scope="module")
def engines(tmp_path_factory):
    """A program in version 1.0 as the engine `double`, an environment of `mujoco` in version 0.1, and no other."""
    folder = tmp_path_factory.mktemp("project")
    greeting = {"protocol": 1, "program": "double", "version": "1.0", "framing": "lines", "engine": GREETING}
    (folder / "double.py").write_text(f"input()\nprint({json.dumps(greeting)!r}, flush=True)\ninput()\n")
    line = json.dumps(shlex.join([sys.executable, str(folder / "double.py")]))
    (folder / "conservative.toml").write_text(f"[engines]\ndouble = {line}\n")
    with pytest.MonkeyPatch.context() as patch:
        for kind in ("CONFIG", "CACHE"):
            patch.setenv(f"XDG_{kind}_HOME", str(folder / kind))
        patch.setenv("CONSERVATIVE_PROJECT", str(folder))
        patch.chdir(folder)
        place = folders.folder_of_all() / "mujoco" / "0.1"
        place.mkdir(parents=True)
        record = {"engine": "mujoco", "version": "0.1", "runtime": "Python 3.11.7", "packages": ["mujoco==0.1"]}
        (place / environment.RECORD).write_text(json.dumps(record))
        deferred_imports.list_entries.cache_clear()
        yield
    deferred_imports.list_entries.cache_clear()


def methods_in(value):
    """Yield the methods in a value and its parts."""
    if isinstance(value, Method):
        yield value
    elif is_dataclass(value) and not isinstance(value, type):
        for field in fields(value):
            yield from methods_in(getattr(value, field.name))
    elif isinstance(value, Mapping | tuple | list):
        for each in value.values() if isinstance(value, Mapping) else value:
            yield from methods_in(each)


def ask(monkeypatch, name, command, parameter, text):
    """Return the methods and settings that a command selects for a name, or its refusal; "==" is written as "@" in it."""

    seen = list[tuple]()

    def capture(*values, **others):
        seen.append((*values, *others.values()))
        raise Captured

    def verify(*values, **others):  # is called for each setting
        with suppress(Captured):
            capture(*values, **others)
        return Verification("", "method", [])

    for place in CAPTURED[name]:
        replaced = verify if place.startswith("benchmarks.verification.programs") else capture
        monkeypatch.setattr(f"conservative.{place}", replaced)
    monkeypatch.setattr(
        "conservative.benchmarks.verification.bodies.loaded.read_files", lambda *_: [SimpleNamespace(kind="", label="")]
    )
    others = [param for param in command.params if param is not parameter and (param.required or param.name == NEEDS.get(name))]
    words = name.split()
    for each in sorted([parameter, *others], key=command.params.index):
        value = text if each is parameter else GIVEN[each.name]
        words += [each.opts[0], value] if isinstance(each, click.Option) else [value]
    done = CliRunner().invoke(main, words)
    if not seen:
        assert done.exit_code == 2, (done.output, done.exception)
        return done.output.replace("==", "@").splitlines()[-1], None
    found = {each for each in methods_in(seen) if each.family == read_name(text).family}
    if found:
        return {each.label for each in found}, sorted(settings_text(each) for each in found)
    texts = (getattr(each, "label", each) for each in seen[-1] if not callable(each))
    return ", ".join(map(str, texts)).replace("==", "@"), None


def test_every_command_with_an_engine_is_known():
    assert {cell.values[0] for cell in CELLS} == set(CAPTURED)


@pytest.mark.parametrize(("name", "command", "parameter", "engine"), crossed(["double@1.0", "mujoco@0.1"], len(CELLS)))
def test_both_spellings_of_a_version_select_the_same(monkeypatch, name, command, parameter, engine):
    found, settings = ask(monkeypatch, name, command, parameter, engine)
    assert (found, settings) == ask(monkeypatch, name, command, parameter, engine.replace("@", "=="))
    if settings is not None:
        assert settings == ask(monkeypatch, name, command, parameter, engine.partition("@")[0])[1]
        method = registry.method(engine)
        expected = method.settings_in_tables() if name in TABLES else (method,)
        assert settings == sorted(map(settings_text, expected))
        assert len(settings) == (1 if name not in TABLES else 3 if "double" in engine else 5)


REFUSED = ["mujoco=3.12.0", "mujoco@", "@3", "mujoco @3.12.0", "MuJoCo@3.12.0", "reduced@1.0"]
REFUSED += ["mujoco@0.2", "double@2.0"]  # versions that are not there


@pytest.mark.parametrize(("name", "command", "parameter", "text"), crossed(REFUSED, 2 * len(CELLS)))
def test_a_name_of_nothing_is_refused_by_name(monkeypatch, name, command, parameter, text):
    refusal, settings = ask(monkeypatch, name, command, parameter, text)
    assert (refusal, settings) == ask(monkeypatch, name, command, parameter, text.replace("@", "=="))
    if text == "mujoco@0.2" and name in ("engines install", "track"):
        assert "0.2" in refusal  # it would be installed
    else:
        assert refusal.startswith("Error: ")
        assert (text.partition("@")[0] or text) in refusal


def test_a_program_cannot_have_a_name_that_no_command_reads(tmp_path, monkeypatch):
    monkeypatch.setenv("CONSERVATIVE_PROJECT", str(tmp_path))
    for name in ("mine@1", "mine=", "mine:1", "a,b", "a b"):
        (tmp_path / "conservative.toml").write_text(f'[engines]\n"{name}" = "program"\n')
        with pytest.raises(BadInput, match=re.escape(repr(name))):
            list_programs()


@pytest.mark.parametrize("given", ["mujoco@3.6.0,exudyn", "mujoco==3.6.0, exudyn"])
def test_tests_of_engines_are_selected_by_both_spellings(given):
    def skipped(engine):
        mark = pytest.mark.engine(engine).mark
        item = SimpleNamespace(iter_markers=lambda: [mark], get_closest_marker=lambda name: None, added=[])
        item.add_marker = item.added.append
        options = {"--engines": given, "--all": False, "--browser": False, "--attack": False}
        conftest.pytest_collection_modifyitems(SimpleNamespace(getoption=options.get), [item])
        return bool(item.added)

    wanted = ["mujoco@3.6.0", "exudyn", "exudyn@1.9"]
    assert [skipped(each) for each in (*wanted, "mujoco@3.7.0", "mujoco")] == [False] * 3 + [True] * 2
    with pytest.raises(pytest.UsageError, match=r"'mujoco=3\.6\.0'"):
        conftest.pytest_collection_modifyitems(SimpleNamespace(getoption={"--engines": "mujoco=3.6.0"}.get), [])
