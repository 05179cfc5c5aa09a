"""Ensembles on disk are read as they were run, after interrupts and damage too; other files are not changed."""

import json
import os
import pickle
import shutil
import signal
import subprocess
import sys
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest

import conservative as cv
from conservative.integration import blocks, store
from conservative.integration.inputs import read_bodies
from conservative.version import VERSION

from ..environments import PATIENCE

zarr = pytest.importorskip("zarr")

N = 22
"""Number of bodies: three blocks, and the last is not full."""


@pytest.fixture(autouse=True)
def _small_blocks(monkeypatch):
    monkeypatch.setattr(blocks, "MOST_BODIES", 8)


def starts(n=N):
    """Return rates (n, 3), rad/s; the fourth is too fast for any step."""
    w = np.random.default_rng(14).normal(size=(n, 3)) * 3
    w[3] = 1e9
    return w


def run(path=None, **changes):
    """Run tops in uniform gravity with different weights."""
    given = {
        "w_WB_B0": starts(),
        "dt": 0.05,
        "t_end": 0.5,
        "parameters": {"weight": np.linspace(1.0, 2.0, N)},
        "threads": 1,
        "method": "convected",
    }
    return cv.integrate_many(**({"scene": cv.scenes.lagrange_top()} | given | changes), path=path)


def digest(folder):
    """Return the digests of the files in a folder by path."""
    return {str(p.relative_to(folder)): sha256(p.read_bytes()).hexdigest() for p in sorted(folder.rglob("*")) if p.is_file()}


def stop_after(count):
    """Return a progress function that interrupts a run after `count` blocks."""

    def tell(progress):
        tell.calls += 1
        if tell.calls == count:
            raise KeyboardInterrupt

    tell.calls = 0
    return tell


@pytest.fixture(scope="module")
def in_memory():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(blocks, "MOST_BODIES", 8)
        return run()


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Return the folder of a run without a break."""
    place = tmp_path_factory.mktemp("store") / "whole.zarr"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(blocks, "MOST_BODIES", 8)
        run(place)
    return place


def assert_same(found, wanted):
    assert np.array_equal(found.R_WB[:], wanted.R_WB[:], equal_nan=True)
    assert np.array_equal(found.w_WB_B[:], wanted.w_WB_B[:], equal_nan=True)
    assert found.drifts.keys() == wanted.drifts.keys()
    assert all(np.array_equal(found.drifts[name], wanted.drifts[name], equal_nan=True) for name in wanted.drifts)
    assert {i: str(each) for i, each in found.failures.items()} == {i: str(each) for i, each in wanted.failures.items()}
    assert {i: vars(each) for i, each in found.failures.items()} == {i: vars(each) for i, each in wanted.failures.items()}
    assert (found.label, found.grid, len(found)) == (wanted.label, wanted.grid, len(wanted))


def test_an_ensemble_is_read_as_it_was_run(whole, in_memory):
    found = cv.open_ensemble(whole)
    assert_same(found, in_memory)
    assert list(found.failures) == [3]
    assert isinstance(found.failures[3], cv.NotConverged)
    assert np.array_equal(found[4].energy, in_memory[4].energy)  # of its own weight
    assert repr(found.bodies.take(4)) == repr(in_memory.bodies.take(4))
    assert repr(found) == repr(in_memory)


def test_samples_stay_on_the_disk(whole):
    found = cv.open_ensemble(whole)
    assert isinstance(found.R_WB, zarr.Array)
    (whole / "R_WB/c/2/0/0/0").rename(whole / "away")  # slices of other blocks do not read it
    try:
        assert np.isfinite(found.R_WB[8:16, -1]).all()
        assert np.isnan(found.R_WB[16:]).all()
    finally:
        (whole / "away").rename(whole / "R_WB/c/2/0/0/0")


def test_an_ensemble_in_memory_is_written_to_the_same_bytes(whole, in_memory, tmp_path):
    in_memory.to_zarr(tmp_path / "copy.zarr")
    assert digest(tmp_path / "copy.zarr") == digest(whole)


def test_an_open_ensemble_is_written_to_the_same_bytes(whole, tmp_path):
    cv.open_ensemble(whole).to_zarr(tmp_path / "copy.zarr")
    assert digest(tmp_path / "copy.zarr") == digest(whole)


@pytest.mark.parametrize("threads", [1, 2])
def test_an_interrupted_run_continues_to_the_same_bytes(whole, tmp_path, threads):
    place = tmp_path / "a.zarr"
    with pytest.raises(KeyboardInterrupt):
        run(place, progress=stop_after(1), threads=threads)
    assert digest(place) != digest(whole)
    with pytest.raises(cv.BadInput, match=r"22 bodies of which 14 were not integrated, .*resume=True"):
        cv.open_ensemble(place)
    seen = []
    run(place, resume=True, progress=seen.append, threads=threads)
    assert len(seen) == 2
    assert digest(place) == digest(whole)
    run(place, resume=True, progress=seen.append)  # there is nothing to do
    assert len(seen) == 2


KILLED = """
import os, signal, sys
sys.path.insert(0, sys.argv[1])
import zarr
from conservative.integration import blocks
from tests.conservative.test_store import run
blocks.MOST_BODIES = 8
put = zarr.storage._local._put

def put_and_die(path, value, exclusive=False):
    if path.match("w_WB_B/c/1/0/0"):
        path.parent.mkdir(parents=True)
        path.with_name(".0123456789abcdef.partial").write_bytes(b"part of a chunk")
        os.kill(os.getpid(), signal.SIGKILL)
    return put(path, value, exclusive)

zarr.storage._local._put = put_and_die
run(sys.argv[2])
"""


@pytest.mark.slow
def test_a_killed_run_continues_to_the_same_bytes(whole, tmp_path):
    place = tmp_path / "a.zarr"
    command = [sys.executable, "-c", KILLED, str(Path(__file__).parents[2]), str(place)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert done.returncode == -signal.SIGKILL, done.stderr
    assert (place / "R_WB/c/1/0/0/0").exists()  # of a block that is not done
    seen = []
    run(place, resume=True, progress=seen.append)
    assert len(seen) == 2
    assert digest(place) == digest(whole)


def test_a_full_disk_leaves_the_finished_blocks(whole, tmp_path, monkeypatch):
    place, put, files = tmp_path / "a.zarr", zarr.storage._local._put, []

    def fill_up(path, value, exclusive=False):
        if path.is_relative_to(place):
            files.append(path)
            if len(files) > 9:
                raise OSError(28, os.strerror(28))
        return put(path, value, exclusive)

    monkeypatch.setattr(zarr.storage._local, "_put", fill_up)
    with pytest.raises(cv.NotWritten, match=r"No space left on device.*finished blocks stay there, and resume=True"):
        run(place)
    monkeypatch.undo()
    monkeypatch.setattr(blocks, "MOST_BODIES", 8)
    assert (place / "R_WB/c/1/0/0/0").exists()
    with pytest.raises(cv.BadInput, match="22 bodies of which 14 were not integrated"):
        cv.open_ensemble(place)
    run(place, resume=True)
    assert digest(place) == digest(whole)


def truncate(file):
    file.write_bytes(file.read_bytes()[:-9])


def empty(file):
    file.write_bytes(b"")


def flip_a_bit(file):
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 1
    file.write_bytes(content)


CHUNKS = {
    "R_WB/c/1/0/0/0": [Path.unlink, truncate, empty, flip_a_bit],
    "w_WB_B/c/2/0/0": [Path.unlink, truncate],
    "drifts/c/0/0": [Path.unlink, flip_a_bit],
    "outcome/c/1": [Path.unlink, flip_a_bit],
    "failure/c/0": [Path.unlink, truncate],
    "start/w_WB_B0/c/2/0": [Path.unlink],
    "parameters/weight/c/1": [flip_a_bit],
}


@pytest.mark.parametrize(("chunk", "damage"), [(chunk, damage) for chunk, each in CHUNKS.items() for damage in each])
def test_a_damaged_block_is_not_opened_and_is_computed_again(whole, tmp_path, chunk, damage):
    place = tmp_path / "a.zarr"
    shutil.copytree(whole, place)
    damage(place / chunk)
    if damage is flip_a_bit and chunk.startswith(("R_WB", "parameters")):  # arrays on the disk are checked when they are read
        found = cv.open_ensemble(place)
        with pytest.raises(ValueError, match="checksum"):
            np.asarray((found.R_WB if chunk.startswith("R_WB") else found.bodies.parameters["weight"])[:])
    else:
        with pytest.raises(cv.BadInput, match=r"^path: got .* damaged.*resume=True computes the rest"):
            cv.open_ensemble(place)
    seen = []
    run(place, resume=True, progress=seen.append)
    assert len(seen) == 1
    assert digest(place) == digest(whole)


READINGS = {
    "values": lambda found: [np.asarray(each) for each in (found.R_WB, found.w_WB_B, found.supplied)],
    "last samples": lambda found: [each[:, -1] for each in (found.R_WB, found.w_WB_B, found.supplied)],
    "a body": lambda found: found[9],
    "another body of its block": lambda found: found[14],
    "all bodies": list,
    "some bodies": lambda found: found[5:12],
    "some of some bodies": lambda found: found[:][9],
    "to_pandas": lambda found: found.to_pandas(),
    "bodies of to_pandas": lambda found: found.to_pandas("bodies"),
    "to_zarr": lambda found: found.to_zarr("copy.zarr"),
    "pickle": lambda found: pickle.dumps(found[:10]),
}
OF_MOTIONS = {"plot": lambda found: found.plot()}
"""Ways that read attitudes or rates, and no work of loads."""


@pytest.mark.parametrize("array", ["R_WB", pytest.param("w_WB_B", marks=pytest.mark.slow), "supplied"])
def test_each_way_of_reading_finds_a_flipped_bit(array, tmp_path, monkeypatch):
    """A block of motions is read after it is opened. Its bodies 8 to 15 have a flipped bit; body 9 has failed."""
    monkeypatch.chdir(tmp_path)
    scene, place, w = replace(cv.scenes.lagrange_top(), torque=cv.Torque((0.0, 0.1, 0.2))), tmp_path / "a.zarr", starts()
    w[[3, 9]] = w[[9, 3]]
    run(place, scene=scene, w_WB_B0=w, method="reduced")
    (chunk,) = (file for file in (place / array / "c" / "1").rglob("*") if file.is_file())
    flip_a_bit(chunk)
    found = cv.open_ensemble(place)
    ways = READINGS if array == "supplied" else READINGS | OF_MOTIONS
    missed = []
    for name, read in ways.items():
        try:
            read(found)
            missed.append(name)
        except ValueError as damage:
            assert "checksum" in str(damage)  # noqa: PT017
    assert missed == ["plot"] * (array == "w_WB_B")  # which shows attitudes
    assert found[7].ok
    assert found[16].ok  # of other blocks


@pytest.mark.parametrize("lost", ["R_WB/zarr.json", "zarr.json"])
def test_an_ensemble_without_its_metadata_is_refused(whole, tmp_path, lost):
    place = tmp_path / "a.zarr"
    shutil.copytree(whole, place)
    (place / lost).unlink()
    for use in (cv.open_ensemble, lambda path: run(path, resume=True)):
        with pytest.raises(cv.BadInput, match=r"^path: got"):
            use(place)


def change(place, array="", **attributes):
    """Change the attributes of a group or an array, or other metadata of an array."""
    file = place / array / "zarr.json"
    content = json.loads(file.read_text())
    for name, value in attributes.items():
        (content if name in content else content["attributes"])[name] = value
    file.write_text(json.dumps(content))


def write(array, value):
    """Return a function that writes the values of an array for body 3, which has failed."""
    return lambda place: zarr.open_group(place, mode="r+")[array].__setitem__(3, value)


def enlarge(place):
    """Make everything consistent, but 10^12 bodies."""
    change(place, bodies=10**12)
    for file in place.rglob("*/zarr.json"):
        content = json.loads(file.read_text())
        if content["node_type"] == "array" and content["shape"][0] == N:
            change(place, file.parent.relative_to(place), shape=[10**12, *content["shape"][1:]])


WRONG = {
    "bodies": lambda place: change(place, bodies=10**12),
    "bodies in all arrays": enlarge,
    "negative": lambda place: change(place, bodies=-N),
    "text": lambda place: change(place, bodies=str(N)),
    "block 0": lambda place: change(place, block=0),
    "other blocks": lambda place: change(place, block=5),
    "no steps": lambda place: change(place, n_steps=-1),
    "more steps": lambda place: change(place, n_steps=100),
    "dt": lambda place: change(place, dt="short"),
    "method": lambda place: change(place, method=3),
    "scene": lambda place: change(place, scene="top"),
    "fields of the scene": lambda place: change(place, scene={"type": "conservative.scene:Scene", "fields": 3}),
    "digests": lambda place: change(place, digests=3),
    "input": lambda place: change(place, digests={"R_WB": ""}),
    "parameter": lambda place: (
        shutil.move(place / "parameters" / "weight", place / "parameters" / "mass")
        and change(place, digests={"start/w_WB_B0": "", "parameters/mass": ""})
    ),
    "names": lambda place: change(place, "drifts", names=["energy"]),
    "no names": lambda place: change(place, "drifts", names=3),
    "outcome": write("outcome", 77),
    "another outcome": write("outcome", 2),
    "failure": write("failure", "crashed"),
    "argument": write("failure", '{"type": "Diverged", "when": 3}'),
    "kind": write("failure", '{"type": "", "kind": "tired"}'),
    "number": write("failure", "3"),
}


@pytest.mark.parametrize("wrong", WRONG)
def test_a_store_with_values_that_no_run_has_is_refused(wrong, whole, tmp_path):
    place = tmp_path / "a.zarr"
    shutil.copytree(whole, place)
    WRONG[wrong](place)
    with pytest.raises(cv.BadInput, match=r"^path: got '.*a\.zarr"):
        cv.open_ensemble(place)
    if "outcome" not in wrong and wrong not in ("failure", "argument", "kind", "number", "names"):
        with pytest.raises(cv.BadInput, match=r"^path: got '.*a\.zarr"):
            run(place, resume=True)


def list_stored(folder):
    """Return the attributes and the arrays of a folder as pairs of a path and the name of an attribute, None for values."""
    for file in sorted(folder.rglob("zarr.json")):
        content, path = json.loads(file.read_text()), str(file.parent.relative_to(folder))
        yield from ((path, name) for name in content["attributes"] if name != "checksum")
        yield from ((path, name) for name in ("dimension_names", "fill_value") if content["node_type"] == "array")
        yield from [(path, None)] if content["node_type"] == "array" else []


def other(value):
    """Return another value of the same kind."""
    if isinstance(value, dict):
        name = next(iter(value))
        return {**value, name: other(value[name])}
    if isinstance(value, list):
        return [other(value[0]), *value[1:]]
    return value + "x" if isinstance(value, str) else not value if isinstance(value, bool) else value + 1


def edit_value(place, path):
    array = zarr.open_group(place, mode="r+")[path]
    at = (0,) * array.ndim
    array[at] = array[at] + "x" if path == "failure" else array[at] + 1


def test_each_attribute_and_each_value_that_is_edited_is_found(whole, tmp_path):
    """Earlier versions opened all of these: Zarr gives an edited chunk a new checksum."""
    stored, opened = list(list_stored(whole)), []
    assert {("R_WB", None), ("t", None), ("start/w_WB_B0", None), (".", "version"), ("drifts", "names")} <= {*stored}
    for number, (path, name) in enumerate(stored):
        place = tmp_path / str(number)
        shutil.copytree(whole, place)
        if name is None:
            edit_value(place, path)
        else:
            content = json.loads((place / path / "zarr.json").read_text())
            change(place, path, **{name: other(content["attributes"].get(name, content.get(name)))})
        try:
            cv.open_ensemble(place)
            opened.append((path, name))
        except cv.BadInput as refused:
            assert refused.argument == "path"  # noqa: PT017
    assert not opened


def test_an_edited_block_is_computed_again(whole, tmp_path):
    place, seen = tmp_path / "a.zarr", []
    shutil.copytree(whole, place)
    edit_value(place, "R_WB")
    run(place, resume=True, progress=seen.append)
    assert len(seen) == 1
    assert digest(place) == digest(whole)


def test_a_folder_of_an_earlier_version_has_no_checksums_and_opens(whole, in_memory, tmp_path):
    place, seen = tmp_path / "a.zarr", []
    shutil.copytree(whole, place)
    shutil.rmtree(place / "checksums")
    content = json.loads((place / "zarr.json").read_text())
    del content["attributes"]["checksum"]
    (place / "zarr.json").write_text(json.dumps(content))
    assert_same(cv.open_ensemble(place), in_memory)
    (place / "drifts/c/0/0").unlink()
    run(place, resume=True, progress=seen.append)
    assert len(seen) == 1
    assert_same(cv.open_ensemble(place), in_memory)


def test_every_row_of_the_inputs_is_compared():
    w = np.random.default_rng(1).normal(size=(70_000, 3))
    scene, other = cv.scenes.brick_flip(), w.copy()
    other[-1, 2] *= 1 + 1e-15
    bodies = [read_bodies(scene, None, each, None, None) for each in (w, w.copy(), other)]
    one, same, changed = (store.describe_run("a method", body, cv.Grid(0.1, 5)) for body in bodies)
    assert one == same
    assert one["digests"] != changed["digests"]


def stiff(k):
    """Return a field that pulls a point of the body upwards with a constant force."""
    return cv.FunctionPotential(lambda R: -k * R[2, 0], lambda R: np.array([[0, 0, 0], [0, 0, 0], [-k, 0, 0]]))


def test_scenes_with_functions_are_identified_by_their_code(tmp_path):
    def scene(k):
        return cv.scenes.brick_flip().rename("pulled", potential=stiff(k))

    place, given = tmp_path / "a.zarr", {"w_WB_B0": np.eye(3), "dt": 0.05, "t_end": 0.1, "method": "convected"}
    made = cv.integrate_many(scene(0.5), **given, path=place)
    with pytest.raises(cv.BadInput, match="scene: got None; expected the scene of the run"):
        cv.open_ensemble(place)
    with pytest.raises(cv.BadInput, match="expected the scene of the run, 'pulled'"):
        cv.open_ensemble(place, scene(0.25))
    with pytest.raises(cv.BadInput, match="another run: another scene"):
        cv.integrate_many(scene(0.25), **given, path=place, resume=True)
    assert np.array_equal(cv.open_ensemble(place, scene(0.5)).R_WB[:], made.R_WB[:])
    assert len(cv.integrate_many(scene(0.5), **given, path=place, resume=True)) == 3


CHANGES = {
    "dt": ({"dt": 0.02}, "dt 0.05 there, 0.02 here; n_steps 10 there, 25 here"),
    "method": ({"method": "reduced"}, f"method 'conservative=={VERSION}/convected' there, 'conservative=={VERSION}/reduced"),
    "start": ({"w_WB_B0": starts() * (1 + 1e-15)}, "another w_WB_B0;"),
    "parameters": ({"parameters": {"weight": np.linspace(1.0, 2.1, N)}}, "another weight;"),
    "inertia": ({"inertia": np.ones((N, 3))}, "another inertia;"),
    "samples": ({"sample_every": 2}, "sample_every 1 there, 2 here"),
    "duration": ({"t_end": 0.6}, "n_steps 10 there, 12 here"),
    "field": ({"scene": cv.scenes.lagrange_top(height=0.2)}, "another scene"),
    "number": ({"w_WB_B0": starts(4), "parameters": None}, "bodies 22 there, 4 here"),
}


@pytest.mark.parametrize("change", CHANGES)
def test_another_run_is_not_resumed(whole, change):
    before, (changes, said) = digest(whole), CHANGES[change]
    with pytest.raises(cv.BadInput) as refused:
        run(whole, resume=True, **changes)
    assert said in str(refused.value)
    assert digest(whole) == before


def test_an_existing_folder_is_not_changed(whole, tmp_path):
    before = digest(whole)
    with pytest.raises(cv.BadInput, match="where an ensemble is; expected a new folder, or resume=True"):
        run(whole)
    assert digest(whole) == before
    (tmp_path / "file").write_text("mine")
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder/file").write_text("mine")
    for name, said in (("file", "a file"), ("folder", "which is not an ensemble"), ("file/below", "a file")):
        with pytest.raises(cv.BadInput, match=said):
            run(tmp_path / name, resume=True)
    assert [path.read_text() for path in sorted(tmp_path.rglob("file"))] == ["mine", "mine"]


def test_an_unwritable_place_is_refused_before_any_work(tmp_path):
    def fail(progress):
        raise AssertionError("a block was run")

    for place in (tmp_path / "missing/a.zarr", tmp_path / "a\0b", "/proc/a.zarr"):
        with pytest.raises(cv.NotWritten, match="path: got"):
            run(place, progress=fail)
    for wrong, argument in (({"path": 3}, "path"), ({"resume": True}, "resume"), ({"path": "a", "resume": 1}, "resume")):
        with pytest.raises(cv.BadInput, match=f"^{argument}: got"):
            cv.integrate_many(cv.scenes.brick_flip(), **wrong)


def test_two_do_not_write_to_one_folder(whole, in_memory):
    what = in_memory.label, in_memory.bodies, in_memory.grid, True
    with store.write_store(whole, *what), pytest.raises(cv.BadInput, match="which another process writes to"):  # noqa: SIM117
        with store.write_store(whole, *what):
            pass


def test_other_folders_and_files_are_not_opened(tmp_path):
    for place in (tmp_path, tmp_path / "missing", Path(__file__)):
        with pytest.raises(cv.BadInput, match="not an ensemble"):
            cv.open_ensemble(place)
    zarr.create_group(tmp_path / "a.zarr", attributes={"format": "conservative ensemble", "format_version": 99})
    with pytest.raises(cv.BadInput, match="version 99 of its format; expected version 1"):
        cv.open_ensemble(tmp_path / "a.zarr")
