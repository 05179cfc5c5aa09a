"""Files are written whole or not at all: exceptions, kills, and a disk that is full."""

import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from conservative import files
from conservative.errors import BadInput, NotWritten

from ..environments import run_python

FULL = """
import resource, sys
from pathlib import Path
from conservative import files
resource.setrlimit(resource.RLIMIT_FSIZE, (5000, 5000))  # the system refuses the rest of a write, as a full disk does
try:
    {}
except files.NotWritten as error:
    print(error)
"""
WRITERS = {
    "text": "files.write_text(Path(sys.argv[1]), 'x' * 9000, 'csv')",
    "bytes": "files.write_bytes(Path(sys.argv[1]), b'x' * 9000, 'csv')",
    "stream, at its end": "with files.text_file(Path(sys.argv[1]), 'csv') as s: s.write('x' * 6000)",
    "stream, line by line": "with files.text_file(Path(sys.argv[1]), 'csv') as s: [s.write('x' * 99) for _ in range(999)]",
}
HOLDING = """
import sys, time
from pathlib import Path
from conservative import files
with files.text_file(Path(sys.argv[1]), "csv") as stream:
    stream.write("half"); stream.flush()
    print("writing", flush=True)
    time.sleep(600)
"""


def names(folder):
    return sorted(path.name for path in folder.iterdir())


@pytest.mark.parametrize("kind", WRITERS)
def test_a_full_disk_leaves_the_file_as_it_was(kind, tmp_path):
    target = tmp_path / "run.csv"
    target.write_text("before")
    code, out, err = run_python(FULL.format(WRITERS[kind]), str(target))
    assert (code, err) == (0, "")
    assert out.startswith(
        f"csv: got {str(target)!r} (File too large); expected a file in a folder that exists and can be written"
    )
    assert target.read_text() == "before"
    assert names(tmp_path) == ["run.csv"]


@pytest.mark.parametrize("error", [KeyboardInterrupt, ZeroDivisionError, OSError])
def test_an_exception_leaves_the_file_as_it_was(error, tmp_path):
    target = tmp_path / "run.csv"
    files.write_text(target, "before", "csv")

    def work():
        with files.text_file(target, "csv") as stream:
            stream.write("half" * 9000)
            raise error

    with pytest.raises(error):
        work()
    assert target.read_text() == "before"
    assert names(tmp_path) == ["run.csv"]


@pytest.mark.parametrize("place", [".", "missing/run.csv", "a\0b"])
def test_an_unwritable_place_is_named_before_any_work(place, tmp_path):
    with pytest.raises(BadInput, match=r"csv: got .*; expected a file"), files.text_file(tmp_path / place, "csv"):
        pytest.fail("work was begun")
    assert names(tmp_path) == []


def test_permissions_stay_and_are_ordinary_at_first(tmp_path):
    target, ordinary = tmp_path / "run.csv", tmp_path / "ordinary"
    ordinary.touch()
    files.write_text(target, "first", "csv")
    assert stat.S_IMODE(target.stat().st_mode) == stat.S_IMODE(ordinary.stat().st_mode)
    target.chmod(0o640)
    files.write_text(target, "second", "csv")
    assert stat.S_IMODE(target.stat().st_mode) == 0o640


def test_contents_are_on_the_disk_before_they_take_their_place(tmp_path, monkeypatch):
    target, seen, synchronise = tmp_path / "samples.csv", [], os.fsync
    target.write_text("before")
    reader = target.open()

    def record(handle):
        seen.append((os.fstat(handle).st_size, target.read_text()))
        synchronise(handle)

    monkeypatch.setattr(os, "fsync", record)
    files.write_text(target, "contents", "csv")
    assert seen[0] == (len("contents"), "before")
    with reader:  # opened before: the file is replaced, not overwritten
        assert reader.read() == "before"
    assert target.read_text() == "contents"


def test_a_link_stays_one(tmp_path):
    (tmp_path / "link").symlink_to(tmp_path / "real")
    for text in ("first", "second"):
        files.write_text(tmp_path / "link", text, "csv")
        assert (tmp_path / "real").read_text() == text
    assert (tmp_path / "link").is_symlink()
    assert names(tmp_path) == ["link", "real"]


def test_devices_and_pipes_are_written_directly():
    files.write_text(Path(os.devnull), "anything", "csv")
    assert not Path(os.devnull).is_file()
    reading, writing = os.pipe()
    files.write_text(Path(f"/dev/fd/{writing}"), "through a pipe", "csv")
    os.close(writing)
    assert os.read(reading, 100) == b"through a pipe"
    os.close(reading)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="Linux has a device that is always full")
def test_a_full_device_is_named():
    with pytest.raises(NotWritten, match=r"csv: got '/dev/full' \(No space left on device\)"):
        files.write_text(Path("/dev/full"), "anything", "csv")


def holding(start, target):
    """Return a process that is writing a file."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    process = start([sys.executable, "-c", HOLDING, target], stdout=subprocess.PIPE, text=True, env=environment)
    assert process.stdout.readline() == "writing\n"
    return process


def test_the_next_writing_removes_files_of_killed_writers_only(tmp_path, start):
    target = tmp_path / "run.csv"
    with holding(start, target) as dead:
        dead.kill()
    (left,) = names(tmp_path)
    with holding(start, target) as alive:
        assert left not in names(tmp_path)
        (live,) = names(tmp_path)
        files.write_text(target, "whole", "csv")
        assert names(tmp_path) == sorted([live, "run.csv"])
        alive.kill()
    files.write_text(target, "again", "csv")
    assert names(tmp_path) == ["run.csv"]
    assert target.read_text() == "again"


def test_files_of_others_stay(tmp_path):
    foreign = [".run.csv-notes", "run.csv-0123456789ab", ".other.csv-0123456789ab", ".run.csv-0123456789ab.txt"]
    for name in foreign:
        (tmp_path / name).write_text("mine")
    files.write_text(tmp_path / "run.csv", "whole", "csv")
    assert names(tmp_path) == sorted([*foreign, "run.csv"])


def test_a_temporary_file_removed_by_another_writer_is_made_again(tmp_path, monkeypatch):
    made = []

    def make(path):
        path.touch(exist_ok=False)
        made.append(path)
        if len(made) == 1:
            path.unlink()  # as another writer may do before it is locked

    with files.temporary(tmp_path / "run.csv", make) as fresh:
        assert fresh == made[1]
        assert fresh.exists()
    assert names(tmp_path) == []


@pytest.mark.parametrize(
    "name", ["a/b", "../../etc", "x" * 300, "木" * 60, "a\\b:c", ".", "brick_flip:disturbance=1e-6", "CON.svg"]
)
def test_every_name_has_a_file_of_its_own(name, tmp_path):
    (tmp_path / f"drift_{files.safe_name(name)}.svg").write_text("x")
    assert [path.parent for path in tmp_path.rglob("*")] == [tmp_path]
    assert files.safe_name(name + "1") != files.safe_name(name + "2")
