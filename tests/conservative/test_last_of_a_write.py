"""What a crash of the machine must not undo: contents are on the disk before they take the place of what was there."""

import os

from conservative import files


def test_contents_are_on_the_disk_before_they_take_their_place(tmp_path, monkeypatch):
    target, seen, synchronise = tmp_path / "samples.csv", [], os.fsync
    target.write_text("before")

    def record(handle):
        seen.append((os.fstat(handle).st_size, target.read_text()))
        synchronise(handle)

    monkeypatch.setattr(os, "fsync", record)
    files.write_text(target, "contents", "csv")
    assert seen[0] == (len("contents"), "before")
    assert target.read_text() == "contents"
