"""Pipes and devices in the place of files are refused by name, and none is waited for."""

import os

import pytest

import conservative as cv
from conservative.benchmarks.gate import baseline, results
from conservative.benchmarks.verification.recordings import table
from conservative.files import read_bytes
from conservative.programs import read_programs
from conservative.references.model_files.files import Unread
from conservative.references.model_files.files import read_bytes as read_model
from conservative.reports.run import checkpoint
from conservative.scene_files import scene_file

READERS = {
    "scene": scene_file.load,
    "programs": read_programs,
    "recording": lambda path: table.read(path, table.Options()),
    "baseline": baseline.read,
    "results": results.read,
    "unfinished report": checkpoint.read,
}


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no pipes in folders")
@pytest.mark.parametrize("kind", ["pipe", "/dev/zero"])
def test_every_reader_refuses_a_pipe_and_a_device(kind, tmp_path):
    place = tmp_path / "special.toml"
    if kind == "pipe":
        os.mkfifo(place)
    else:
        place.symlink_to(kind)
    for read in READERS.values():
        with pytest.raises(cv.BadInput, match=r"special\.toml.*a pipe or a device"):
            read(place)
    with pytest.raises(Unread, match="ordinary"):
        read_model(place)


def test_a_file_that_is_too_large_is_not_read(tmp_path):
    (tmp_path / "a").write_bytes(b"123")
    assert read_bytes(tmp_path / "a", 3) == b"123"
    with pytest.raises(OSError, match="more than 2 bytes"):
        read_bytes(tmp_path / "a", 2)
