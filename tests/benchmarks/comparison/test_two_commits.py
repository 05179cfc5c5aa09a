"""The method of somebody else's package, in two commits, compared by the command: in real environments, without a network."""

import json

import pytest
from click.testing import CliRunner

from conservative.benchmarks.comparison import version
from conservative.references.environments.environment import Environment
from conservative.reports.cli.main import main

from ... import environments
from .projects import commit, write_project

pytestmark = pytest.mark.slow

EXAMPLE = environments.ROOT / "tests" / "example_package" / "example_integrator.py"
ENTRY = "[conservative.methods]\\nexample = example_integrator:Example\\n"
STEP = "middle = w + h / 2 * inverse @ (hat(J @ w) @ w)"
OPTIONS = ("--scenes", "brick_flip:t_end=1", "--methods", "example", "--processes", "3")


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    """The project at its first commit."""
    folder = tmp_path_factory.mktemp("project")
    write_project(folder, "example-integrator", "example_integrator", EXAMPLE.read_text(), ENTRY)
    commit(folder)
    return folder


@pytest.fixture(scope="module")
def install(wheel, tmp_path_factory):
    """What makes an environment of a wheel out of what is installed here, with us, from a wheel as well."""
    home, made = tmp_path_factory.mktemp("environments"), {}

    def environment_of(wheel_of_project, requirements, source):
        key = wheel_of_project.parent.name
        if key not in made:
            made[key] = environments.Environment.create(home / key, wheel)
            made[key]._install(wheel_of_project)
        return Environment("example-integrator", key, made[key].folder, "3", ())

    return environment_of


@pytest.fixture
def gate(project, install, tmp_path, monkeypatch):
    """Return exit code and answer of the command, for the project with its module changed."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(version, "environment_of", install)

    def run(before, after):
        text = EXAMPLE.read_text()
        assert before in text
        (project / "example_integrator.py").write_text(text.replace(before, after))
        done = CliRunner().invoke(main, ["gate", "--against", "HEAD", "--project", str(project), *OPTIONS, "--json"])
        assert done.exit_code in (0, 1), done.output
        return done.exit_code, json.loads(done.stdout)

    return run


def measures(answer):
    return {each["measure"] for each in answer["violations"]}


def test_a_change_of_a_comment_passes(gate):
    code, answer = gate("for free bodies only.", "for free bodies alone.")
    assert (code, answer["violations"]) == (0, [])
    (row,) = answer["rows"]
    assert row["is"]["values"] == row["was"]["values"]
    assert row["is"]["values"]["observed order"] == pytest.approx(2, abs=0.1)
    assert row["time"]["first"]["processes"] >= 3


def test_a_step_of_another_order_fails(gate):
    code, answer = gate(STEP, "middle = w")
    assert code == 1
    assert {"attitude error max", "energy drift max", "observed order"} <= measures(answer)


def test_a_slower_step_fails(gate):
    # About twice the work: three processes of each are enough for that on a busy machine.
    code, answer = gate(STEP, f"{STEP}\n                for _ in range(12):\n                    hat(w)")
    assert (code, measures(answer)) == (1, {"time of a step"})
    assert answer["rows"][0]["time"]["again"]["low"] > 1.05


def test_a_step_that_raises_fails(gate):
    code, answer = gate(STEP, "raise ZeroDivisionError('no step')")
    assert (code, measures(answer)) == (1, {"row"})
    assert any("ZeroDivisionError: no step" in note for note in answer["notes"])
