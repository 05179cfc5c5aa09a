"""Tab completion, asked for as click's script for a shell asks."""

import pytest
from click.shell_completion import BashComplete
from click.testing import CliRunner

from conservative.reports.cli.main import main


def completed(words):
    """Return type and value of the completions of the last word."""
    *before, last = words.split(" ")
    shell = BashComplete(main, {}, "conservative", "_CONSERVATIVE_COMPLETE")
    return [(item.type, item.value) for item in shell.get_completions(before, last)]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("my_body.toml", "my_notes.txt", "brick_of_mine.toml", ".hidden.toml", "tops/top.toml", "tops/readme.md"):
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.touch()
    (tmp_path / "tops" / "deeper").mkdir()
    return tmp_path


@pytest.mark.parametrize("command", ["run", "recommend", "report --scenes"])
@pytest.mark.parametrize(
    ("typed", "offered"),
    [
        ("my_", ["my_body.toml"]),
        ("bric", ["brick_flip", "brick_of_mine.toml"]),
        ("t", ["thrown_box", "tiny_body", "tumbling_box", "tumbling_satellite", "turned_brick", "turned_top", "tops/"]),
        ("tops/", ["tops/deeper/", "tops/top.toml"]),
        ("./m", ["./my_body.toml"]),
        (".", [".hidden.toml"]),
    ],
)
def test_files_and_names_are_completed(command, typed, offered, folder):
    assert completed(f"{command} {typed}") == [("plain", value) for value in offered]


def test_absolute_paths(folder):
    assert completed(f"run {folder}/my") == [("plain", f"{folder}/my_body.toml")]


@pytest.mark.parametrize("typed", ["to", "~/no_such", "no/such/folder/"])
def test_the_shell_completes_a_single_folder_and_unknown_paths(typed, folder):
    assert completed(f"run {typed}") == [("file", typed)]


def test_the_last_of_several_is_completed(folder):
    assert completed("report --scenes lagrange_top,my") == [("plain", "lagrange_top,my_body.toml")]
    assert completed("report --scenes my_body.toml,to") == [("plain", "my_body.toml,tops/")]
    assert completed("report --methods reduced,heyo") == [("plain", "reduced,heyoka")]


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        ("l", ("plain", "list")),
        ("run brick_flip --methods lame,re", ("plain", "lame,reduced")),
        ("recommend brick_flip --engines muj", ("plain", "mujoco")),
        ("report --re", ("plain", "--resume")),
        ("track exu", ("plain", "exudyn")),
        ("report --engines al", ("plain", "all")),
        ("report --engines exudyn,muj", ("plain", "exudyn,mujoco")),
        ("gate res", ("file", "res")),
        ("run brick_flip --csv s", ("file", "s")),
        ("sweep brick", ("plain", "brick_flip")),
        ("sweep lagrange_top --spread a", ("plain", "attitude=")),
        ("sweep lagrange_top --spread rate=1%,potential.w", ("plain", "rate=1%,potential.weight=")),
    ],
)
def test_everything_else_is_completed_too(words, offered):
    assert offered in completed(words)


def test_the_script_of_a_shell_gets_them(folder):
    environment = {"_CONSERVATIVE_COMPLETE": "bash_complete", "COMP_WORDS": "conservative run bric", "COMP_CWORD": "2"}
    done = CliRunner().invoke(main, [], env=environment, prog_name="conservative")
    assert done.stdout.splitlines() == ["plain,brick_flip", "plain,brick_of_mine.toml"]


def test_subjects_of_verify_are_names_and_files(folder):
    assert completed("verify reduc") == [("plain", "reduced"), ("file", "reduc")]
    assert ("file", "my_") in completed("verify my_")
