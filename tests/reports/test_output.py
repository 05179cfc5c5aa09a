"""Files and folders that a command writes: whole or as before, and only earlier results are replaced without --force."""

import errno
import json
import os
import stat

import click
import pytest
from click.testing import CliRunner

from conservative import BadInput
from conservative.errors import NotWritten
from conservative.reports.cli.main import main
from conservative.reports.cli.options import Output, OutputCommand, require_replaceable
from conservative.reports.terminal.report_folder import MANIFEST, recover, report_folder


def write_report(folder, *names):
    for name in names:
        (folder / name).write_text(name)
    (folder / MANIFEST).write_text(json.dumps({"files": [*names, MANIFEST]}))


def interrupted(writer, work):
    with writer as place:
        work(place)
        raise KeyboardInterrupt


def tree(folder):
    return sorted(path.name for path in folder.iterdir())


def test_report_appears_whole(tmp_path):
    target = tmp_path / "deep" / "report"
    with report_folder(target) as fresh:
        write_report(fresh, "a.svg")
        assert not target.exists()
    assert tree(target) == ["a.svg", MANIFEST]
    assert tree(target.parent) == ["report"]
    assert stat.S_IMODE(target.stat().st_mode) & 0o500 == 0o500


def test_report_failing_half_way_leaves_the_earlier_one(tmp_path):
    target = tmp_path / "report"
    with report_folder(target) as fresh:
        write_report(fresh, "a.svg")
    with pytest.raises(KeyboardInterrupt):
        interrupted(report_folder(target), lambda fresh: (fresh / "b.svg").write_text("half"))
    assert tree(target) == ["a.svg", MANIFEST]
    assert tree(tmp_path) == ["report"]


def test_earlier_report_goes_and_a_persons_notes_stay(tmp_path):
    target = tmp_path / "report"
    with report_folder(target) as fresh:
        write_report(fresh, "a.svg")
    (target / "notes.txt").write_text("mine")
    with report_folder(target) as fresh:
        write_report(fresh, "b.svg")
    assert tree(target) == ["b.svg", MANIFEST, "notes.txt"]
    assert tree(tmp_path) == ["report"]


def test_a_link_to_a_folder_stays_one(tmp_path):
    (tmp_path / "report").symlink_to(tmp_path / "disk" / "real")
    for name in ("a.svg", "b.svg"):
        with report_folder(tmp_path / "report") as fresh:
            write_report(fresh, name)
        assert tree(tmp_path / "disk" / "real") == [name, MANIFEST]
    assert (tmp_path / "report").is_symlink()
    assert tree(tmp_path) == ["disk", "report"]


def test_a_persons_file_outlives_a_swap_that_fails(tmp_path):
    target = tmp_path / "report"
    with report_folder(target) as fresh:
        write_report(fresh, "a.svg")
    (target / "notes.txt").write_text("mine")

    def in_the_way():
        with report_folder(target) as fresh:
            write_report(fresh, "b.svg")
            (fresh / "notes.txt").mkdir()

    with pytest.raises(OSError, match=r"notes\.txt"):
        in_the_way()
    assert [path.read_text() for path in tmp_path.rglob("notes.txt") if path.is_file()] == ["mine"]


def test_empty_folder_is_taken(tmp_path):
    with report_folder(tmp_path / ".") as fresh:
        write_report(fresh)
    assert tree(tmp_path) == [MANIFEST]


@pytest.mark.parametrize("kind", ["file", "folder with other things", "below a file", "damaged manifest"])
def test_no_place_for_a_report(tmp_path, kind):
    target = tmp_path / "out"
    if kind in ("file", "below a file"):
        target.write_text("mine")
    else:
        target.mkdir()
        (target / ("mine.txt" if kind == "folder with other things" else MANIFEST)).write_text("mine")
    before = tree(tmp_path)
    place = target / "report" if kind == "below a file" else target
    with pytest.raises(BadInput, match=r"out: got .*; expected a folder"), report_folder(place):
        pytest.fail("work was begun")
    assert tree(tmp_path) == before


@pytest.mark.skipif(os.geteuid() == 0, reason="nothing is forbidden to root")
def test_forbidden_folder(tmp_path):
    tmp_path.chmod(0o500)
    with pytest.raises(BadInput, match=r"Permission denied"), report_folder(tmp_path / "report"):
        pytest.fail("work was begun")


# A swap takes three steps; these are the states that a kill between them leaves.

DEAD = "0123456789ab"


def killed(folder, *, step):
    """Leave the files of a kill after a step of a swap; the earlier report is `report`, with a person's notes."""
    earlier, fresh = folder / "report", folder / f".report-{DEAD}"
    earlier.mkdir()
    write_report(earlier, "a.svg")
    (earlier / "notes.txt").write_text("mine")
    fresh.mkdir()
    write_report(fresh, "b.svg")
    if step >= 1:
        earlier.rename(folder / f".report-{DEAD[::-1]}-old")
    if step >= 2:
        fresh.rename(folder / "report")


@pytest.mark.parametrize(
    ("step", "expected"),
    [(0, ["a.svg", MANIFEST, "notes.txt"]), (1, ["a.svg", MANIFEST, "notes.txt"]), (2, ["b.svg", MANIFEST, "notes.txt"])],
)
def test_a_kill_in_a_swap_loses_nothing(step, expected, tmp_path):
    killed(tmp_path, step=step)
    recover(tmp_path / "report")
    assert tree(tmp_path / "report") == expected
    assert tree(tmp_path) == ["report"]
    assert (tmp_path / "report" / "notes.txt").read_text() == "mine"


@pytest.mark.parametrize("step", [0, 1, 2])
def test_the_next_report_tidies_up_after_a_kill(step, tmp_path):
    killed(tmp_path, step=step)
    with report_folder(tmp_path / "report") as fresh:
        write_report(fresh, "c.svg")
    assert tree(tmp_path / "report") == ["c.svg", MANIFEST, "notes.txt"]
    assert tree(tmp_path) == ["report"]


def test_two_reports_into_one_folder_leave_that_of_the_last(tmp_path):
    with report_folder(tmp_path / "report") as first:
        write_report(first, "a.svg")
        with report_folder(tmp_path / "report") as second:
            write_report(second, "b.svg")
            assert tree(tmp_path) == sorted([first.name, second.name])
        assert tree(tmp_path / "report") == ["b.svg", MANIFEST]
    assert tree(tmp_path / "report") == ["a.svg", MANIFEST]
    assert tree(tmp_path) == ["report"]


def test_a_file_added_during_a_report_stays(tmp_path):
    with report_folder(tmp_path / "report") as fresh:
        write_report(fresh, "a.svg")
    with report_folder(tmp_path / "report") as fresh:
        write_report(fresh, "b.svg")
        (tmp_path / "report" / "notes.txt").write_text("mine")
    assert tree(tmp_path / "report") == ["b.svg", MANIFEST, "notes.txt"]


def test_the_error_of_a_full_disk_names_the_folder(tmp_path):
    def fill():
        with report_folder(tmp_path / "report") as fresh:
            raise NotWritten("out", fresh / "a.svg", OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)))

    with pytest.raises(BadInput, match=r"report' \(No space left on device\); expected a folder"):
        fill()
    assert tree(tmp_path) == []


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
    @click.option("--one", type=Output("1"))
    @click.option("--two", type=Output({"a": "2"}))
    def both(one, two):
        """Write both."""

    (tmp_path / "a").write_text("1 and 2")
    result = CliRunner().invoke(both, ["--one", str(tmp_path / "a"), "--two", str(tmp_path)])
    assert isinstance(result.exception, BadInput)
    assert CliRunner().invoke(both, ["--one", str(tmp_path / "a")]).exit_code == 0


def test_new_empty_and_special_files_may_be_written(tmp_path):
    (tmp_path / "empty").touch()
    (tmp_path / "full").write_text("mine")
    refused = []
    for name in ("empty", "new", "/dev/null", "long" * 100, "full"):
        try:
            require_replaceable(tmp_path / name, "mark", "out")
        except BadInput:
            refused.append(name)
    assert refused == ["full"]


@pytest.mark.parametrize(
    "arguments",
    [
        ["run", "brick_flip", "--csv", "out.svg", "--picture", "./out.svg"],
        ["run", "brick_flip", "--csv", "there/out.svg", "--picture", "link/out.svg"],
        ["study", "convergence", "--out", "there", "--csv", "there/study.csv"],
    ],
)
def test_two_options_never_write_the_same_file(arguments, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there").mkdir()
    (tmp_path / "link").symlink_to("there")
    done = CliRunner().invoke(main, arguments)
    assert (done.exit_code, ": got '" in done.output, "; expected another file" in done.output) == (2, True, True)
    assert tree(tmp_path / "there") == []


def test_two_options_can_write_to_the_same_device():
    @click.command(cls=OutputCommand)
    @click.option("--csv", type=Output("mark"))
    @click.option("--markdown", type=Output("mark"))
    def write(**files):
        pass

    done = CliRunner().invoke(write, ["--csv", "/dev/null", "--markdown", "/dev/null"])
    assert done.exit_code == 0, done.output
