import json
import shlex

import pytest
from click.testing import CliRunner

from conservative.reports.cli.main import main

COMMON = ("--error", "1e-4", "--t-end", "0.4")


def conservative(*arguments):
    return CliRunner(env={"COLUMNS": "400"}).invoke(main, ["recommend", *(str(argument) for argument in arguments)])


@pytest.fixture(scope="module")
def answered(tmp_path_factory):
    folder = tmp_path_factory.mktemp("scene") / "answer"
    scene = folder.parent / "my_body.toml"
    scene.write_text("[body]\ninertia = [[2, 0.3, 0], [0.3, 1.5, 0.1], [0, 0.1, 1.1]]\n[start]\nw_WB_B = [1, -2, 9]\n")
    text = scene.read_text()
    scene.write_text("t_end = 1.0\n" + text)
    return conservative(scene, *COMMON, "--engines", "mujoco,heyoka:1e-6", "--json", "--out", folder), folder


def test_json_has_the_recommendation_and_its_basis(answered):
    done, _ = answered
    assert done.exit_code == 0, done.output
    content = json.loads(done.stdout)
    assert content["scene"] == "my_body"
    assert content["error"] == 1e-4
    named = {entry["name"]: entry for entry in content["recommendations"]}
    assert len(named) == 8  # two of ours, five integrators of MuJoCo, one line of heyoka
    assert content["cheapest"].partition(":")[0] in ("moser_veselov", "taylor")  # a run of 0.4 s is mostly its call
    assert content["cheapest_general"].startswith("taylor")
    assert content["cheapest_engine"] == "heyoka"
    best = named["mujoco"]["best"]
    assert best["expected"] < 1e-4
    assert best["dt"] > 0
    assert best["law"] == "measured over all 0.4 s"
    assert set(best["drift"]) == {"energy", "momentum"}
    assert best["outcome"] == {"kind": "ok", "reason": "", "step": None, "time": None, "residual": None}
    assert named["heyoka"]["called"].endswith(" body")
    assert named["mujoco"]["cost"] > 0
    assert len(named["mujoco:integrator=Euler"]["probes"]) > 1
    assert "tol" in named["heyoka"]["best"]
    assert content["truth"]["agreement"] < 1e-12  # measured 1e-15


def test_folder_has_the_answer_and_the_picture(answered):
    done, folder = answered
    assert sorted(path.name for path in folder.iterdir()) == ["recommendation.json", "recommendation.svg"]
    assert json.loads((folder / "recommendation.json").read_text()) == json.loads(done.stdout)
    picture = (folder / "recommendation.svg").read_text()
    for part in ("<svg", "error to expect, rad", "wall time per simulated second", "mujoco", "RK4"):
        assert part in picture


def test_the_answer_has_a_command_that_reaches_the_error(answered, tmp_path):
    scene = answered[1].parent / "my_body.toml"
    lines = conservative(scene, *COMMON, "--engines", "heyoka:1e-6").stdout.splitlines()
    assert any(line.startswith("Use ") for line in lines[:4])
    assert not any("probe runs;" in line for line in lines)  # without --verbose
    (command,) = [line.removeprefix("Run: conservative ") for line in lines if line.startswith("Run: ")]
    done = CliRunner().invoke(main, [*shlex.split(command), "--json"])
    assert json.loads(done.stdout)["error"]["attitude"] < 1e-4, done.output


def test_a_method_that_does_not_reach_the_error_has_its_limit():
    done = conservative(
        "brick_flip", "--error", "1e-9", "--t-end", "0.5", "--engines", "mujoco:Euler", "--cost-limit", "0.01", "-v"
    )
    assert done.exit_code == 0, done.output
    assert "Methods that do not, at up to 0.01 s of wall time per simulated second" in done.stdout
    assert "anything finer costs more than 0.01 s" in " ".join(done.stdout.split())
    assert "probe runs;" in done.stdout


def test_an_unstable_motion_is_reported():
    text = " ".join(conservative("unstable_spin", "--engines", "heyoka:1e-6", "--t-end", "20", "-v").stdout.split())
    assert "and by any angle after that" in text
    assert "the motion is unstable and amplifies errors" in text


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        (["brick_flipp"], ["scene: got 'brick_flipp'", "'brick_flip' (nearest)"]),
        (["brick_flip", "--cost-limit", "0"], ["cost_limit: got 0.0", "above 0"]),
        (["brick_flip", "--out", "kept.txt"], ["out: got 'kept.txt'", "folder"]),
        (["no_such_file.toml"], ["no_such_file.toml"]),
    ],
)
def test_mistakes_end_in_one_clear_line_before_any_work(arguments, parts, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "kept.txt").write_text("mine")
    done = conservative(*arguments)
    assert done.exit_code == 2, done.output
    assert done.stdout == ""
    assert "probing" not in done.stderr
    assert done.stderr.count("Error: ") == 1
    assert all(part in done.stderr for part in parts)
    assert [path.name for path in tmp_path.iterdir()] == ["kept.txt"]
