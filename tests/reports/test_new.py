import json

from click.testing import CliRunner

from conservative.reports.cli.main import main


def test_new_writes_a_file_that_every_command_takes_for_a_scene(tmp_path):
    path = tmp_path / "my_body.toml"
    written = CliRunner().invoke(main, ["new"])
    assert written.exit_code == 0
    path.write_text(written.stdout)
    done = CliRunner().invoke(main, ["run", str(path), "--t-end", "0.1", "--json"])
    assert done.exit_code == 0
    summary = json.loads(done.stdout)
    assert (summary["scene"], summary["outcome"]["kind"], summary["dt"]) == ("my_body", "ok", 0.002)


def test_a_mistake_in_a_file_is_one_line_with_its_line_and_exit_code_2(tmp_path):
    path = tmp_path / "my_body.toml"
    path.write_text("t_end = 1\n\n[bdy]\ninertia = [1, 2, 3]\n")
    done = CliRunner().invoke(main, ["run", str(path)])
    assert done.exit_code == 2
    assert done.stdout == ""
    allowed = "'body' (nearest), or one of body, dt, name, orbit, potential, start, t_end"
    assert done.stderr == f"Error: {path}, line 3: bdy: got the unknown key 'bdy'; expected {allowed}\n"
