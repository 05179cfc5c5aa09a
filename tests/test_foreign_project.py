"""A project with packages called `benchmarks`, `references` and `reports` works in an environment with our package."""

import re

import pytest

from .environments import Environment

pytestmark = pytest.mark.slow

OWN = """
def test_own():
    import benchmarks, references, reports

    assert {package.OWNER for package in (benchmarks, references, reports)} == {"this project"}


def test_plain():
    pass
"""
CONFTEST = "import benchmarks\n\nassert benchmarks.OWNER == 'this project'\n"
RUNS = {
    "pytest": (["pytest"], {}),
    "python -m pytest": (["python", "-m", "pytest"], {}),
    "pythonpath": (["pytest"], {"pytest.ini": "[pytest]\npythonpath = .\n"}),
    "conftest": (["pytest"], {"conftest.py": CONFTEST}),
}
"""Commands that run its tests, and the files they need."""
SUMMARY = re.compile(r"^(?:PASSED|FAILED|ERROR) .*$", re.MULTILINE)


@pytest.fixture(scope="module")
def with_us(wheel, tmp_path_factory):
    return Environment.create(tmp_path_factory.mktemp("with") / "env", wheel)


@pytest.fixture(scope="module")
def without_us(tmp_path_factory):
    return Environment.create(tmp_path_factory.mktemp("without") / "env")


@pytest.fixture
def project(tmp_path):
    """Return the folder of a project for asv whose packages have an OWNER."""
    for name in ("benchmarks", "references", "reports"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text('OWNER = "this project"\n')
    (tmp_path / "benchmarks" / "benchmarks.py").write_text("class TimeSuite:\n    def time_sum(self):\n        sum(range(9))\n")
    (tmp_path / "tests").mkdir()
    (tmp_path / "tests" / "test_own.py").write_text(OWN)
    (tmp_path / "pytest.ini").write_text("[pytest]\n")
    return tmp_path


@pytest.mark.parametrize("name", RUNS)
def test_its_tests_end_as_without_us(with_us, without_us, project, name):
    command, files = RUNS[name]
    for file, text in files.items():
        (project / file).write_text(text)
    (code, text), expected = (env.run([*command, "-rA", "-p", "no:cacheprovider"], project) for env in (with_us, without_us))
    assert (code, SUMMARY.findall(text)) == (expected[0], SUMMARY.findall(expected[1])), text
    assert len(SUMMARY.findall(text)) == 2
    assert code == (1 if name == "pytest" else 0)  # by itself pytest does not put the project's root onto the path


def test_our_command_line_does_not_take_its_packages(with_us, project):
    code, text = with_us.run(["conservative", "list"], project, PYTHONPATH=".")
    assert code == 0, text
    assert "brick_flip" in text


def test_the_name_of_the_command_alone_says_what_can_be_done(with_us, tmp_path):
    code, text = with_us.run(["conservative"], tmp_path)
    assert code == 0, text
    assert {line.split()[0] for line in text.splitlines()} == {"conservative"}


def test_our_suite_runs_next_to_its_packages(with_us, project):
    options = ["--benchmark", "--benchmark-max-time=0.001", "-k", "brick_flip-scipy"]
    code, text = with_us.run(["python", "-m", "pytest", *options], project)
    assert code == 0, text
    assert "1 passed" in text
