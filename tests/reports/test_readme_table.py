"""The README's table: the cheapest of each group, exact steps apart, and a dash where nothing gets there."""

import sys
from pathlib import Path

import pytest

from conservative.reports.documentation import readme_table
from conservative.reports.documentation.readme_table import ERRORS, rows
from conservative.reports.tables.work_precision import points

from .rows import point, table

ROOT = Path(__file__).parents[2]
OURS = [point("gauss", "ours", error, time, dt=dt) for error, time, dt in ((1e-2, 1e-6, 2), (1e-7, 4e-6, 1))]
EXACT = point("lame", "ours", 1e-15, 2e-6)
MUJOCO = [point("mujoco", "engine", 1e-4, 1e-6, dt=dt, version="4.0.0", setting="RK4") for dt in (1, 2)]


def written(*groups):
    return list(rows(points(table(*groups))))


def test_each_cell_is_the_cheapest_of_its_group():
    header, *body = written(*OURS, EXACT, *MUJOCO)
    assert header == ["scene", "error, rad", "ours", "ours, exact step", "mujoco 4.0.0"]
    assert [row[:2] for row in body] == [["made_up", f"{error:.0e}"] for error in ERRORS]
    assert body[0][3:] == ["2 lame", "**1** RK4"]
    assert body[1][2:] == ["3.03 gauss", "**2** lame", "–"]
    assert body[2][2:] == ["–", "**2** lame", "–"]


def test_a_step_that_a_tolerance_divides_is_not_exact():
    adaptive = point("taylor:tolerance=1e-06", "ours", 1e-10, 1e-6)
    assert written(adaptive, EXACT)[1][2:] == ["**1** taylor tolerance=1e-06", "2 lame"]


def test_without_an_engine_there_is_no_column_of_one():
    assert written(EXACT)[0] == ["scene", "error, rad", "ours", "ours, exact step"]


def test_the_command_prints_markdown(tmp_path, monkeypatch, capsys):
    table(*OURS, EXACT, *MUJOCO).to_csv(tmp_path / "measurements.csv", index=False)
    monkeypatch.setattr(sys, "argv", ["readme_table", str(tmp_path)])
    readme_table.main()
    lines = capsys.readouterr().out.splitlines()
    assert lines[1] == "| --- | --- | --- | --- | --- |"
    assert len(lines) == 2 + len(ERRORS)


@pytest.mark.parametrize("scene", ["brick_flip", "lagrange_top", "asymmetric_top"])
def test_the_readme_has_a_row_for_each_scene_and_error(scene):
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert text.count(f"| {scene} | ") == len(ERRORS)
    assert "python -m conservative.reports.documentation.readme_table" in text
