"""`conservative engines`: output and exit codes."""

import json

import pytest
from click.testing import CliRunner

from conservative.references.environments import environment, folders
from conservative.reports.cli.main import main


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return folders.folder_of_all()


def run(*arguments):
    done = CliRunner().invoke(main, ["engines", *arguments])
    return done.exit_code, done.output


def write_record(cache, version):
    folder = cache / "exudyn" / version
    folder.mkdir(parents=True)
    record = {"engine": "exudyn", "version": version, "python": "3.11.7", "packages": [f"exudyn=={version}", "numpy==2.4.6"]}
    (folder / environment.RECORD).write_text(json.dumps(record))


def test_the_list_shows_environments_and_engines_without_one(cache):
    write_record(cache, "1.9.0")
    write_record(cache, "1.10.0")
    code, text = run("list")
    assert code == 0
    lines = text.splitlines()
    place = lines.index("exudyn@1.9.0: Python 3.11.7, exudyn==1.9.0, numpy==2.4.6")
    assert lines[place + 1].startswith("exudyn@1.10.0: ")
    assert "bsk: no environment" in lines


def test_the_list_as_json_has_every_version(cache):
    write_record(cache, "1.9.0")
    found = json.loads(run("list", "--json")[1])
    assert found["environments"][0]["packages"] == ["exudyn==1.9.0", "numpy==2.4.6"]
    assert "drake" in found["engines"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("install", "exudin"), "engine: got 'exudin'; expected 'exudyn' (nearest)"),
        (("install", "exudyn; true"), "engine: got 'exudyn; true'; expected 'exudyn' (nearest)"),
        (("install", "exudyn", "drake==1.0 2.0"), "engine: got 'drake==1.0 2.0'; expected NAME"),
        (("remove", "exudyn==1.9.0"), "expected an installed engine (none is installed)"),
        (("remove", "../exudyn"), "engine: got '../exudyn'; expected an installed engine"),
        (("add", "exudyn"), "Run: conservative engines install exudyn"),
        (("add", "pinocchio"), "To verify this engine, run: conservative verify pinocchio"),
        (("add", ""), "command: got ''; expected an executable"),
        (("add", "my 'engine"), 'command: got "my \'engine" (No closing quotation)'),
    ],
)
def test_a_bad_name_is_one_line_and_exit_code_2(arguments, message):
    code, text = run(*arguments)
    assert code == 2
    assert message in text
    assert len(text.splitlines()) == 1


def test_remove_removes(cache):
    write_record(cache, "1.9.0")
    assert run("remove", "exudyn") == (0, "exudyn@1.9.0: removed\n")
    assert environment.list_environments() == ()


def test_removed_environments_are_available_as_json(cache):
    write_record(cache, "1.9.0")
    (gone,) = json.loads(run("remove", "exudyn", "--json")[1])
    assert (gone["version"], gone["packages"]) == ("1.9.0", ["exudyn==1.9.0", "numpy==2.4.6"])
