"""The CSV of `conservative run` is right for `conservative verify`, whole and with its start cut off."""

import json

import pytest
from click.testing import CliRunner

from conservative import registry
from conservative.reports.cli.main import main

QUICK = ("brick_flip", "offset_brick", "separatrix", "stabilised_brick", "tiny_body")


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] * (name not in QUICK)) for name in registry.list_scenes()]
)
def test_the_csv_of_a_scene_is_right_whole_and_without_its_start(name, tmp_path):
    whole, rest = tmp_path / "whole.csv", tmp_path / "rest.csv"
    done = CliRunner().invoke(main, ["run", name, "--method", "taylor", "--no-truth", "--csv", str(whole)])
    assert done.exit_code == 0, done.output
    header, *rows = whole.read_text().splitlines()
    rest.write_text("\n".join([header, *rows[len(rows) // 3 :], ""]))
    for path in (whole, rest):
        done = CliRunner().invoke(main, ["verify", str(path), "--body", name, "--json"])
        (found,) = json.loads(done.stdout)["subjects"]
        assert (found["verdict"], done.exit_code) == ("right", 0), found["sentence"]
        details = found["details"]
        assert details["compared"] == details["in_file"] == len(rows) - (path == rest) * (len(rows) // 3)
