"""Files that a command writes: it replaces its own earlier results, and nothing else unless --force says so."""

import click
from click.testing import CliRunner

from conservative import BadInput
from conservative.reports.cli.main import main
from conservative.reports.cli.options import OutputCommand, OutputFile, OutputFolder, require_replaceable

SCENE = CliRunner().invoke(main, ["new"]).output


def conservative(*arguments):
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


def test_a_persons_file_is_replaced_only_with_force(tmp_path):
    notes = tmp_path / "notes.txt"
    notes.write_text("mine")
    for command in (("run", "brick_flip"), ("study", "speed")):
        done = conservative(*command, "--csv", notes)
        assert (done.exit_code, notes.read_text()) == (2, "mine")
        assert "--force" in done.stderr
    assert conservative("run", "brick_flip", "--csv", notes, "--force").exit_code == 0
    assert "mine" not in notes.read_text()
    assert conservative("run", "brick_flip", "--csv", notes).exit_code == 0  # now it is an earlier result


def test_the_input_of_a_run_is_never_replaced(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE)
    for arguments in (("scene.toml", "--csv", scene), ("--csv", "scene.toml", "--force", "./scene.toml")):
        done = conservative("run", *arguments)
        assert (done.exit_code, scene.read_text()) == (2, SCENE)


def test_a_folder_with_a_persons_file_of_that_name_is_left_alone(tmp_path):
    (tmp_path / "study.md").write_text("my notes")
    done = conservative("study", "random", "--bodies", "1", "--methods", "gauss", "--out", tmp_path)
    assert done.exit_code == 2
    assert (tmp_path / "study.md").read_text() == "my notes"
    assert [path.name for path in tmp_path.iterdir()] == ["study.md"]


def test_a_dash_is_not_the_name_of_a_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert conservative("study", "random", "--csv", "-").exit_code == 2
    assert list(tmp_path.iterdir()) == []


def test_two_options_cannot_write_one_file(tmp_path):
    @click.command(cls=OutputCommand)
    @click.option("--one", type=OutputFile("1"))
    @click.option("--two", type=OutputFolder({"a": "2"}))
    def both(one, two):
        """Write both."""

    (tmp_path / "a").write_text("1 and 2")
    result = CliRunner().invoke(both, ["--one", str(tmp_path / "a"), "--two", str(tmp_path)])
    assert isinstance(result.exception, BadInput)
    assert CliRunner().invoke(both, ["--one", str(tmp_path / "a")]).exit_code == 0


def test_new_empty_and_special_files_may_be_written(tmp_path):
    (tmp_path / "empty").touch()
    for name in (tmp_path / "empty", tmp_path / "new", tmp_path / "/dev/null", tmp_path / ("long" * 100)):
        require_replaceable(name, "mark", "out")
