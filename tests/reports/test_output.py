import json
import os
import stat

import pytest

from conservative import BadInput
from conservative.files import text_file
from conservative.reports.terminal.report_folder import MANIFEST, report_folder


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
    with pytest.raises(BadInput, match=r"out: got .*; allowed: a folder"), report_folder(place):
        pytest.fail("work was begun")
    assert tree(tmp_path) == before


@pytest.mark.skipif(os.geteuid() == 0, reason="nothing is forbidden to root")
def test_forbidden_folder(tmp_path):
    tmp_path.chmod(0o500)
    with pytest.raises(BadInput, match=r"Permission denied"), report_folder(tmp_path / "report"):
        pytest.fail("work was begun")


def test_text_file_is_whole_or_as_before(tmp_path):
    target = tmp_path / "run.csv"
    with text_file(target, "csv") as stream:
        stream.write("first")
    with pytest.raises(KeyboardInterrupt):
        interrupted(text_file(target, "csv"), lambda stream: stream.write("half"))
    assert target.read_text() == "first"
    assert tree(tmp_path) == ["run.csv"]


def test_a_text_file_takes_the_place_of_the_one_before_and_is_not_written_over_it(tmp_path):
    path = tmp_path / "kept.txt"
    path.write_text("before")
    with path.open() as reader:  # as somebody who reads it at that moment
        with text_file(path, "out") as stream:
            stream.write("after")
        assert reader.read() == "before"
    assert path.read_text() == "after"


@pytest.mark.parametrize("place", [".", "missing/run.csv"])
def test_text_file_that_cannot_be(tmp_path, place):
    with pytest.raises(BadInput, match=r"csv: got .*; allowed: a file"), text_file(tmp_path / place, "csv"):
        pytest.fail("work was begun")
