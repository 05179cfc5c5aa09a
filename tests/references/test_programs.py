"""Programs of users: registered by a name, they are engines wherever a name of an engine is taken."""

import json
import os
import shlex
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

import conservative as cv
from conservative import deferred_imports, registry
from conservative.benchmarks.recommendation.recommend import list_engines
from conservative.benchmarks.studies.engine_selection import list_installed, select_engines
from conservative.programs import list_programs, user_file
from conservative.reports.cli.main import main

PROGRAMS = Path(__file__).parent / "programs"
PLAIN = shlex.join([sys.executable, "-I", str(PROGRAMS / "engine.py")])


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """Return an empty working directory, in which no program is registered."""
    for name in ("CONFIG", "CACHE"):
        monkeypatch.setenv(f"XDG_{name}_HOME", str(tmp_path / name))
    (tmp_path / "project").mkdir()
    monkeypatch.chdir(tmp_path / "project")
    deferred_imports.list_entries.cache_clear()
    yield tmp_path / "project"
    deferred_imports.list_entries.cache_clear()


def run(*arguments):
    done = CliRunner().invoke(main, arguments)
    return done.exit_code, done.output


def test_a_program_is_an_engine_until_it_is_removed(folder):
    code, text = run("engines", "add", PLAIN, "--name", "mine")
    assert (code, text.endswith("conservative.toml): added\n")) == (0, True)
    assert not list(folder.iterdir())  # of the user
    assert "mine" in list_installed()
    (method,) = select_engines(["mine"])
    assert (method.label, method.order) == ("mine==1/mine", 4)
    assert [engine.name for engine in list_engines(["mine"])] == ["mine"]
    code, text = run("run", "brick_flip", "--methods", "mine", "--t-end", "1", "--json")
    assert (code, json.loads(text)["outcome"]["kind"]) == (0, "ok")
    assert run("engines", "list")[1].startswith("mine: ")
    assert "mine: " in run("engines", "remove", "mine")[1]
    assert run("run", "brick_flip", "--methods", "mine")[0] == 2


def test_paths_in_the_file_of_a_project_are_relative_to_it(folder, monkeypatch):
    """The rest of the file stays as it is, and the command works in folders below it."""
    before = '# ours\n[engines]  # programs\nother = "node other.js"\n'
    (folder / "conservative.toml").write_text(before)
    (folder / ".git").mkdir()
    (folder / "src").mkdir()
    (folder / "src" / "my-engine.py").write_text((PROGRAMS / "engine.py").read_text())
    monkeypatch.chdir(folder / "src")
    assert run("engines", "add", f"{sys.executable} my-engine.py", "--project")[0] == 0
    line = f'my_engine = "{sys.executable} ./src/my-engine.py"\n'
    assert (folder / "conservative.toml").read_text() == before.replace("other", line + "other", 1)
    assert cv.integrate(cv.scenes.brick_flip(t_end=1.0), 0.01, registry.method("my_engine")).ok
    assert run("engines", "remove", "my_engine")[0] == 0
    assert (folder / "conservative.toml").read_text() == before


GREETING = '{"protocol": 1, "program": "x", "version": "2.1", "framing": "lines", "engine": %s}'


def speak(folder, engine):
    """Register a program that says how it is described, and nothing else."""
    (folder / "p.py").write_text(f"input()\nprint({GREETING % json.dumps(engine)!r}, flush=True)\ninput()\n")
    return run("engines", "add", shlex.join([sys.executable, "p.py"]))


def test_a_program_describes_its_settings(folder):
    assert speak(folder, {"settings": {"integrator": "rk4", "substeps": 2}, "orders": {"rk4": 4, "euler": 1}})[0] == 0
    assert (registry.method("p").order, registry.method("p@2.1:euler,substeps=3").order) == (4, 1)
    with pytest.raises(cv.BadInput, match="integrator: got 'rk5'; expected one of 'rk4'"):
        registry.method("p:rk5")
    with pytest.raises(cv.MissingEngine, match="p@3 is not installed"):
        registry.method("p@3")


def test_the_program_of_the_project_is_that_of_its_name(folder):
    """The user has another one of the same name."""
    user_file().parent.mkdir(parents=True, exist_ok=True)
    for file, words in ((user_file(), "user"), (folder / "conservative.toml", "project")):
        file.write_text(f'[engines]\nmine = "{words}"\n')
    assert list_programs()["mine"].command == "project"


UNUSABLE = "its answer to `hello` cannot be used"


@pytest.mark.parametrize(
    ("engine", "words"),
    [
        ({"colour": "red"}, UNUSABLE),
        ({"settings": 5}, UNUSABLE),
        ({"orders": ["rk4"]}, UNUSABLE),
        ("fast", "answers `hello` with `engine`: 'fast'; expected an object"),
        ({"card": 3}, "`card` is 3; expected an object"),  # a former name, as it was sent
        ({"ways": [1]}, "`ways` is [1]; expected a list of texts"),
    ],
)
def test_a_description_that_cannot_be_used_is_reported(engine, words, folder):
    code, text = speak(folder, engine)
    assert code == 2
    assert "p, a program of" in text
    assert words in text
    assert not (folder.parent / "CONFIG").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["./missing"],
            "missing cannot be started: No such file or directory). Build it or change it as PROTOCOL.md describes",
        ),
        (["false"], "conservative.toml: crashed (exit code 1). Build it"),
        (["sh -c 'echo hi; sleep 5'"], "an answer that cannot be read from sh, which should speak version 1"),
        ([PLAIN, "--name", "mujoco"], "name: got 'mujoco'; expected letters"),
        ([PLAIN, "--name", "my-engine"], "name: got 'my-engine'; expected letters"),
        ([""], "command: got ''; expected an executable"),
    ],
)
def test_a_program_that_cannot_be_used_is_not_registered(arguments, message, folder):
    code, text = run("engines", "add", *arguments)
    assert (code, len(text.splitlines())) == (2, 1)
    assert message in text
    assert not (folder.parent / "CONFIG").exists()


def test_a_program_that_is_gone_is_named_with_file_and_remedy(folder):
    (folder / "conservative.toml").write_text('[engines]\nmine = "build/mine"\n')
    code, text = run("run", "brick_flip", "--methods", "mine")
    problem = f"{folder}/conservative.toml: crashed (build/mine cannot be started: No such file or directory)"
    remedy = "Build it or change it as PROTOCOL.md describes, or run: conservative engines remove mine"
    assert (code, text) == (2, f"Error: mine, a program of {problem}. {remedy}\n")
    assert select_engines(["mine"], skip_missing=True)[0].family == "missing"
    assert "expected an engine with a package" in run("engines", "install", "mine")[1]


@pytest.mark.parametrize(
    "text", ["[engines]\nmine = 3\n", "[engines\n", "engines = 3\n", 'engines = "x"', f"a{'.a' * 20_000} = 1\n"]
)
def test_a_file_that_cannot_be_used_is_named(text, folder):
    (folder / "conservative.toml").write_text(text)
    code, text = run("engines", "list")
    assert (code, "conservative.toml, line " in text) == (2, True)


HOSTILE = '[engines]\nmine = "touch ran"\n'


def test_only_a_project_file_that_others_cannot_have_written_is_read(folder, monkeypatch):
    def is_read():
        deferred_imports.list_entries.cache_clear()
        return "mine" in registry.list_engines()

    file, below = folder / "conservative.toml", folder / "below"
    below.mkdir()
    file.write_text(HOSTILE)
    assert is_read()
    monkeypatch.chdir(below)
    assert not is_read()  # in a folder above it, without a repository
    monkeypatch.setenv("HOME", str(folder))
    assert is_read()
    monkeypatch.setenv("HOME", str(folder.parent / "elsewhere"))
    (folder / ".git").mkdir()
    assert is_read()
    for place, mode in ((file, 0o666), (folder, 0o777)):
        before = place.stat().st_mode
        place.chmod(mode)
        with pytest.warns(UserWarning, match=f"{file} is not read"):
            assert not is_read()
        place.chmod(before)
    another = os.geteuid() + 1
    monkeypatch.setattr(os, "geteuid", lambda: another)
    with pytest.warns(UserWarning, match=f"set CONSERVATIVE_PROJECT={folder}"):
        assert not is_read()
    for name in (str(folder), os.path.relpath(folder)):
        monkeypatch.setenv("CONSERVATIVE_PROJECT", name)
        assert is_read()


@pytest.mark.parametrize("name", ["mujoco", "bullet", "reduced"])
def test_a_project_cannot_take_an_installed_name(name, folder):
    (folder / "conservative.toml").write_text(HOSTILE.replace("mine", name))
    code, text = run("run", "brick_flip", "-m", name)
    assert (code, f"conservative.toml: got {name!r}, the name of a method or an engine" in text) == (2, True)
    assert not (folder / "ran").exists()
