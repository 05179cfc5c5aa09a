"""Code on the pages runs, and links and commands on them are valid."""

import importlib.util
import re
import subprocess
import sys
import tomllib

import click
import nbformat
import pytest
import yaml
from nbclient import NotebookClient

import conservative as cv
from conservative import registry
from conservative.benchmarks.measures.measurement import COLUMNS
from conservative.reports.cli.main import main

from .environments import PATIENCE
from .pages import ROOT, blocks, dead_links, pages, shell_lines

NOTEBOOKS = ROOT / "reports" / "documentation"


def cases(language):
    """Return a parameter for each block of a language on each page."""
    found = [(page, code) for page in pages() for code in blocks(page.read_text(encoding="utf-8"), language)]
    return [pytest.param(page, code, id=f"{name_of(page)}-{number}") for number, (page, code) in enumerate(found)]


def name_of(page):
    return page.relative_to(ROOT).as_posix()


@pytest.mark.parametrize(("page", "block"), cases("python"))
def test_code_on_a_page_runs(page, block, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    exec(compile(block, name_of(page), "exec"), {"__name__": "__page__"})


@pytest.mark.parametrize(("page", "block"), cases("toml"))
def test_toml_on_a_page_is_a_scene_or_entry_points(page, block, tmp_path):
    if "[body]" in block:
        (tmp_path / "my_body.toml").write_text(block)
        assert cv.integrate(registry.scene(str(tmp_path / "my_body.toml")), t_end=0.05).ok
    else:
        assert set(tomllib.loads(block)["project"]["entry-points"]) <= {registry.METHODS, registry.SCENES}


def test_the_pages_of_all_rooms_are_found():
    names = {name_of(page) for page in pages()}
    assert {"README.md", *(f"{room}/README.md" for room in ("conservative", "references", "benchmarks", "reports"))} <= names
    assert len(pages()) == len({page.resolve() for page in pages()})


@pytest.mark.parametrize("page", pages(), ids=name_of)
def test_links_lead_somewhere(page):
    assert not dead_links(page)


def test_dead_links_are_found(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("# One `word`, two\n[a](#one-word-two) [b](#three) [c](page.md#one-word-two) ![d](no.svg)\n\n    [e](x)\n")
    assert dead_links(page) == ["#three", "no.svg"]


@pytest.fixture(scope="module")
def pytest_options():
    told = subprocess.run(
        [sys.executable, "-m", "pytest", "--help", "-p", "no:hypothesispytest", "-p", "no:anyio"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    return set(re.findall(r"--[\w-]+", told.stdout))


@pytest.mark.parametrize("page", pages(), ids=name_of)
def test_commands_on_a_page_are_known(page, pytest_options):
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    for words in shell_lines(page.read_text(encoding="utf-8")):
        check_command(words, pytest_options, extras)


def check_command(words, options, extras):
    """Raise an exception if the option, the command, the module or the extra does not exist."""
    match words:
        case ["conservative", name, *arguments]:
            main.commands[name].make_context(name, arguments)
        case ["python", "-m", module, *_]:
            assert importlib.util.find_spec(module), module
        case ["pytest", *arguments]:
            assert {word.partition("=")[0] for word in arguments if word.startswith("--")} <= options, words
        case ["pip", "install", *arguments]:
            named = re.findall(r"\[([\w,]+)\]", " ".join(arguments))
            assert {extra for names in named for extra in names.split(",")} <= set(extras), words


@pytest.mark.parametrize(
    "line",
    [
        "conservative report --fast",
        "conservative conserve",
        "python -m conservative.reports.nothing",
        "pytest --benchmark --gait",
        "pip install '.[evrything]'",
    ],
)
def test_unknown_commands_are_found(line):
    with pytest.raises((click.UsageError, KeyError, AssertionError)):
        check_command(*(shell_lines(f"    {line}\n")), {"--benchmark", "--gate"}, {"all": []})


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("from_body_to_verdict", ("moser_veselov", "mujoco")),
        ("satellite_with_loads", ("momentum balance", "Animation")),
        ("figures_of_the_paper", ("0.0696", "0.0206", "0.0051")),
    ],
)
def test_a_notebook_runs_and_is_checked_in_without_outputs(name, expected, tmp_path):
    notebook = nbformat.read(NOTEBOOKS / f"{name}.ipynb", as_version=4)
    nbformat.validate(notebook)
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert not [cell.id for cell in cells if cell.outputs or cell.execution_count]
    NotebookClient(notebook, timeout=PATIENCE, kernel_name="python3", resources={"metadata": {"path": tmp_path}}).execute()
    shown = "".join(str(cell.outputs[-1].get("data")) for cell in cells if cell.outputs)
    for part in expected:
        assert part in shown


def test_every_column_of_a_row_is_explained():
    _, _, rest = (ROOT / "benchmarks" / "README.md").read_text(encoding="utf-8").partition("| column | meaning |")
    lines = [line for line in rest.partition("\n\n")[0].splitlines() if line.startswith("| `")]
    assert [name for line in lines for name in re.findall(r"`(\w+)`", line.split("|")[1])] == list(COLUMNS)


def test_the_paper_is_cited_with_one_title_and_its_conference():
    paper, later = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))["references"]
    assert (paper["type"], paper["year"], paper["conference"]["city"]) == ("conference-paper", 2013, "Kos")
    assert paper["collection-title"].startswith("COMPDYN 2013: 4th ECCOMAS Thematic Conference")
    assert (later["type"], later["year"], later["volume"]) == ("article", 2014, 269)
    for page in ("README.md", "conservative/methods/DERIVATION.md", "benchmarks/published.md"):
        text = " ".join((ROOT / page).read_text(encoding="utf-8").split())
        assert paper["title"] in text, page
        assert "COMPDYN 2013" in text, page


def test_the_paper_cites_what_its_bibliography_has():
    entries = re.findall(r"^@\w+\{(\w+),$", (NOTEBOOKS / "paper.bib").read_text(encoding="utf-8"), re.MULTILINE)
    text = (NOTEBOOKS / "paper.md").read_text(encoding="utf-8")
    assert set(re.findall(r"\[@(\w+)\]", text)) == set(entries)
