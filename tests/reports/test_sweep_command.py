"""The command `sweep`: its figures are those of `integrate_many`, its folder can be gone on with, its errors are one line."""

import json
import re
import shutil

import numpy as np
import pytest
from click.testing import CliRunner

import conservative as cv
from conservative.integration.distributions import angle_quantiles, mean_attitudes
from conservative.reports.cli.main import main
from conservative.reports.run import sweep as work

from ..sampling import sampled

SPREAD = ("--spread", "attitude=5deg,rate=2%", "--seed", "3")
COMMON = ("brick_flip", "--starts", "1500", *SPREAD, "-m", "taylor", "--dt", "0.1", "--t-end", "1.15", "--samples", "5")


def conservative(*arguments):
    return CliRunner().invoke(main, ["sweep", *(str(argument) for argument in arguments)])


def same():
    """The ensemble that the command makes."""
    scene = cv.scenes.brick_flip()
    return cv.integrate_many(
        scene,
        **cv.spread(scene, 1500, attitude="5deg", rate="2%", seed=3),
        dt=0.1,
        t_end=1.15,
        sample_every=3,
        method="taylor",
    )


@pytest.fixture(scope="module")
def answered(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sweep")
    return conservative(*COMMON, "--out", folder / "sweep.zarr", "--picture", folder / "sweep.svg", "--json"), folder


def test_the_samples_are_those_of_integrate_many(answered):
    done, folder = answered
    assert done.exit_code == 0, done.output
    found, expected = cv.open_ensemble(folder / "sweep.zarr"), same()
    np.testing.assert_array_equal(found.R_WB[:], expected.R_WB)
    np.testing.assert_array_equal(found.w_WB_B[:], expected.w_WB_B)


def test_json_has_outcomes_drifts_spread_and_rates(answered):
    done, folder = answered
    content, expected = json.loads(done.stdout), same()
    assert content["outcomes"] == {"ok": 1500}
    assert content["spread"] == {"attitude": "5deg", "rate": "2%"}
    assert (content["bodies"], content["seed"], content["samples"], content["steps"]) == (1500, 3, 5, 12)
    for name, values in expected.drifts.items():
        body = int(np.argmax(values))
        assert content["drift"][name] == {"largest": values[body], "body": body, "median": np.median(values)}
    quantiles = angle_quantiles(expected.R_WB, mean_attitudes(expected.R_WB))
    rows = content["angle_from_mean"]
    assert [row["t"] for row in rows] == expected.t.tolist()
    assert [[row["p5"], row["p50"], row["p95"]] for row in rows] == quantiles.tolist()
    assert content["body_steps_per_second"] == pytest.approx(12 * content["bodies_per_second"])
    assert content["bodies_per_second"] > 1500 / content["wall_time"] > 0
    assert (content["out"], content["picture"]) == (str(folder / "sweep.zarr"), str(folder / "sweep.svg"))


def test_only_files_that_are_named_are_written_and_their_size_is_announced(answered):
    done, folder = answered
    assert sorted(path.name for path in folder.iterdir()) == ["sweep.svg", "sweep.zarr"]
    shown = f"Writing 720 kB to {folder / 'sweep.zarr'}: 1,500 bodies, 5 samples each"
    assert shown in done.stderr.splitlines()  # on a busy machine beside lines of progress
    chunks = [path for name in ("R_WB", "w_WB_B") for path in (folder / "sweep.zarr" / name / "c").rglob("*") if path.is_file()]
    assert sum(path.stat().st_size for path in chunks) == pytest.approx(2048 / 1500 * 720e3, rel=1e-3)  # whole chunks
    picture = (folder / "sweep.svg").read_text()
    for part in ("<svg", "1,500 bodies", "Body axis 3 at t = 1.2 s"):
        assert part in picture


def test_no_file_next_to_the_folder_is_replaced(tmp_path):
    mine, small = tmp_path / "photo.svg", ("brick_flip", "--starts", "2", "--spread", "rate=1%", "--t-end", "1")
    mine.write_text("mine")
    assert conservative(*small, "--out", tmp_path / "photo.zarr").exit_code == 0
    done = conservative(*small, "--picture", mine)
    assert (done.exit_code, mine.read_text()) == (2, "mine")
    assert "--force" in done.stderr
    for _ in range(2):  # the second time it is an earlier result
        assert conservative(*small, "--picture", tmp_path / "new.svg").exit_code == 0
    for out in (mine, tmp_path, tmp_path / "photo.zarr"):
        assert conservative(*small, "--out", out, "--force").exit_code == 2
    assert sorted(path.name for path in tmp_path.iterdir()) == ["new.svg", "photo.svg", "photo.zarr"]


def test_a_lost_chunk_is_computed_again_and_its_bodies_are_not_called_ok(answered, tmp_path):
    out = tmp_path / "sweep.zarr"
    shutil.copytree(answered[1] / "sweep.zarr", out)
    (out / "R_WB/c/1/0/0/0").unlink()
    done = conservative(*COMMON, "--out", out, "--resume", "--json")
    assert done.exit_code == 0, done.output
    assert json.loads(done.stdout)["found_before"] == 1024
    assert np.isfinite(cv.open_ensemble(out).R_WB[:]).all()


@pytest.mark.parametrize("change", [("--seed", "4"), ("--t-end", "1.3"), ("--samples", "4"), ("--dt", "0.05")])
def test_another_sweep_is_not_resumed(answered, change):
    out = answered[1] / "sweep.zarr"
    done = conservative(*COMMON, *change, "--out", out, "--resume")
    assert done.exit_code == 2
    assert "an ensemble of another run" in done.stderr


def test_an_interrupted_sweep_is_resumed(answered, tmp_path, monkeypatch):
    _, folder = answered

    def stop(rate):
        raise KeyboardInterrupt

    out = tmp_path / "sweep.zarr"
    with monkeypatch.context() as context:
        context.setattr(work, "rate_text", stop)
        done = conservative(*COMMON, "--out", out, "--threads", "1")
    assert done.exit_code == 130
    kept = rf"(1,024|476) of 1,500 bodies are finished in {re.escape(str(out))}; the same command with --resume does the rest"
    told = re.search(f"\nInterrupted; {kept}\n$", done.stderr)
    assert [path.name for path in tmp_path.iterdir()] == ["sweep.zarr"]
    again = conservative(*COMMON, "--out", out, "--resume", "--json")
    assert again.exit_code == 0, again.output
    assert json.loads(again.stdout)["found_before"] == int(told[1].replace(",", ""))
    np.testing.assert_array_equal(cv.open_ensemble(out).R_WB[:], cv.open_ensemble(folder / "sweep.zarr").R_WB[:])


def test_text_has_the_same_figures_without_a_folder_and_bodies_that_fail_are_listed():
    done = conservative("brick_flip", "--starts", "2", "--spread", "rate=1%", "-m", "convected:1e-29", "--t-end", "0.05")
    assert done.exit_code == 1
    for part in ("bodies", "2: 0 ok, 2 ", "rate=1%; seed 0", "none: no body has this invariant, or all bodies failed"):
        assert part in done.stdout
    assert "body 1 " in done.stdout
    (error,) = [line for line in done.stderr.splitlines() if "bodies/s" not in line]  # without the progress of a slow machine
    assert "2 of 2 bodies failed, the first of them number 0: " in error


def test_an_error_instead_of_a_step():
    done = conservative("brick_flip", "--starts", "3", "--spread", "rate=1%", "--error", "1e-3", "--t-end", "0.2", "--json")
    assert done.exit_code == 0, done.output
    content = json.loads(done.stdout)
    assert content["error"]["asked"] == 1e-3
    assert content["error"]["estimate"] < 1e-3
    assert content["error"]["reached"]
    assert content["samples"] == 6  # by default


@pytest.mark.parametrize(("dt", "error"), [(0.01, 3.1), (0.002, 0.24), (1e-4, 6e-4)])
def test_the_error_of_a_sweep_without_a_target_is_said(dt, error):
    """It is measured where runs of two steps differ completely, and estimated elsewhere; up to 0.1 rad a motion is accurate."""
    arguments = ("lagrange_top", "--starts", "2", "--spread", "rate=1%", "--dt", dt, "-m", "reduced", "--t-end", "0.3")
    content = json.loads(conservative(*arguments, "--json").stdout)
    assert content["error"]["estimate"] == pytest.approx(error, rel=0.1)
    assert content["error"]["reached"] is (error < 0.1)
    assert ("the motions are inaccurate" in conservative(*arguments).stdout) is (error > 0.1)


def test_an_error_that_is_not_reached_is_said():
    arguments = ("brick_flip", "--starts", "2", "--spread", "rate=1%", "--error", "1e-18", "--t-end", "0.2")
    content = json.loads(conservative(*arguments, "--json").stdout)
    assert content["error"]["reached"] is False
    assert content["error"]["estimate"] > content["error"]["asked"] == 1e-18
    assert "target: 1e-18 rad, so the target is not reached" in " ".join(conservative(*arguments).stdout.split())


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        (["brick_flipp", *SPREAD], ["scene: got 'brick_flipp'", "'brick_flip' (nearest)"]),
        (["brick_flip", "--spread", "attitude"], ["spread: got 'attitude'", "attitude=5deg"]),
        (["brick_flip", "--spread", "atitude=5deg"], ["spread: got 'atitude'", "'attitude' (nearest)", "potential."]),
        (["brick_flip", "--spread", "rate=1%,rate=2%"], ["spread: got 'rate=2%' after rate=1%", "once"]),
        (["brick_flip", "--spread", "attitude=5"], ["spread: got 'attitude=5'", "attitude=5deg or attitude=0.1rad"]),
        (["brick_flip", "--spread", "rate=1e-2"], ["spread: got 'rate=1e-2'", "rate=0.1rad/s"]),
        (["brick_flip", "--spread", "potential.weight=2%"], ["parameters: got 'weight'", "none"]),
        (["brick_flip", *SPREAD, "--starts", "1e11"], ["starts: got 100000000000", "fit in memory"]),
        (["brick_flip", *SPREAD, "--error", "1e-6", "--dt", "0.1"], ["dt: got 0.1", "none together with --error"]),
        (["brick_flip", *SPREAD, "--resume"], ["resume: got no folder", "--out"]),
        (["brick_flip", *SPREAD, "--out", "missing/sweep.zarr"], ["out: got", "missing/sweep.zarr'", "No such file"]),
        (["brick_flip", *SPREAD, "--out", "a.svg", "--picture", "a.svg"], ["picture: got 'a.svg'", "another name"]),
        (["brick_flip", *SPREAD, "--out", "."], ["out: got", "not an ensemble"]),
        (["brick_flip", *SPREAD, "--out", "kept"], ["out: got", "kept'", "not an ensemble"]),
        (["brick_flip", *SPREAD, "--scheduler", "nonsense"], ["scheduler: got 'nonsense'", "address of a Dask scheduler"]),
    ],
)
def test_mistakes_end_in_one_clear_line_before_any_work(arguments, parts, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "kept").mkdir()
    (tmp_path / "kept" / "mine").write_text("mine")
    done = conservative(*arguments)
    assert done.exit_code == 2, done.output
    assert done.stdout == ""
    assert done.stderr.startswith("Error: ")
    assert done.stderr.count("\n") == 1
    assert [part for part in parts if part not in done.stderr] == []
    assert [path.name for path in tmp_path.rglob("*")] == ["kept", "mine"]


def test_samples_that_do_not_fit_in_memory(monkeypatch):
    monkeypatch.setattr("conservative.integration.memory.most_samples", lambda: 1)
    done = conservative("brick_flip", *SPREAD, "--starts", "3")
    assert done.exit_code == 2
    assert "Error: samples: got 18 samples of 3 bodies; expected fewer samples or bodies, or a path (--out):" in done.stderr


def test_a_turning_field_and_an_inertia_that_varies(tmp_path):
    """A gravity gradient has the inertia of the scene's body; other turning fields act on every body."""
    done = conservative("tumbling_satellite", "--starts", "2", "--spread", "inertia=2%")
    assert done.exit_code == 2
    assert "inertia: got a spread in a turning field with the inertia of the scene's body" in done.stderr
    scene = tmp_path / "turning.toml"
    scene.write_text(
        "t_end = 0.5\ndt = 0.01\n[body]\ninertia = [3.0, 2.0, 4.0]\n[start]\nw_WB_B = [0.6, -0.4, 1.2]\n"
        '[potential]\nkind = "uniform_gravity"\nweight = 9\ncom_B = [0.1, -0.3, 0.6]\n[orbit]\nrate = 3\nnormal_W = [1, 2, 0]\n'
    )
    run = ("--starts", "3", "--spread", "inertia=5%", "--out", tmp_path / "a.zarr", "--dt", "0.01", "--t-end", "0.5")
    done = conservative(scene, *run, "--samples", "51", "--json")
    assert done.exit_code == 0, done.output
    given = cv.registry.scene(str(scene))
    J = cv.spread(given, 3, inertia="5%")["inertia"]
    assert np.ptp(J, axis=0).min() > 0.01
    for i, found in enumerate(cv.open_ensemble(tmp_path / "a.zarr")):
        alone = cv.Scene("alone", cv.RigidBody(J[i]), given.R_WB0, given.w_WB_B0, 0.5, given.potential)
        expected = cv.integrate(
            alone, 0.001, cv.Gauss(stages=4) if cv.Gauss(4).unsupported(alone) is None else cv.Taylor(), sample_every=10
        )
        np.testing.assert_allclose(found.R_WB, expected.R_WB, rtol=0, atol=1e-8)


LOADED = """
name = "pushed"
t_end = 0.6
dt = 0.02
[body]
inertia = [13.0, 5.0, 10.0]
[rotor]
momentum = [0.0, 0.0, 20.0]
[start]
w_WB_B = [0.6, -0.4, 1.2]
[torque]
times = [0.0, 0.3, 0.6]
values = [[0, 0, 0], [90, 0, 0], [0, 50, 0]]
[damping]
matrix = [[5, 0, 0], [0, 3, 0], [0, 0, 7]]
"""


@pytest.mark.parametrize("name", sampled(["loaded", "stabilised_brick", "tumbling_satellite", "thrown_box"], 1))
def test_every_part_of_a_scene_acts_on_the_bodies_of_a_sweep(name, tmp_path):
    scene = name
    if name == "loaded":
        scene = tmp_path / "loaded.toml"
        scene.write_text(LOADED)
    given, run = cv.registry.scene(str(scene)), ("--starts", "3", *SPREAD, "--out", tmp_path / "a.zarr")
    more = ("--picture", tmp_path / "a.svg", "--dt", given.dt, "--t-end", 20 * given.dt, "--samples", "21", "--json")
    done = conservative(scene, *run, *more)
    assert done.exit_code == 0, done.output
    content, starts = json.loads(done.stdout), cv.spread(given, 3, attitude="5deg", rate="2%", seed=3)
    assert all(each["largest"] < 1e-14 for each in content["drift"].values())  # measured 4e-15
    for i, found in enumerate(cv.open_ensemble(tmp_path / "a.zarr")):
        alone = given.rename("alone", R_WB0=starts["R_WB0"][i], w_WB_B0=starts["w_WB_B0"][i])
        expected = cv.integrate(alone, given.dt, t_end=20 * given.dt)
        np.testing.assert_allclose(found.R_WB, expected.R_WB, rtol=0, atol=1e-14)  # measured 1e-15, lanes
        np.testing.assert_array_equal(*(np.asarray(each.supplied, dtype=float) for each in (found, expected)))
        np.testing.assert_array_equal(*(np.asarray(each.p_WB, dtype=float) for each in (found, expected)))
    size = {"loaded": "8.06 kB"}.get(name, "6.05 kB")
    assert done.stderr.startswith(f"Writing {size} to")
