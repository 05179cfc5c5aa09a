"""The README's table: the cheapest of each class, solutions of integrable motions apart; a dash where nothing gets there."""

import sys
from pathlib import Path

import pytest

from conservative.reports.documentation import readme_table
from conservative.reports.documentation.readme_table import ERRORS, entries, rows

from .rows import point, row, table

ROOT = Path(__file__).parents[2]
OURS = [point("gauss", "ours", error, time, dt=dt) for error, time, dt in ((1e-2, 1e-6, 2), (1e-7, 4e-6, 1))]
EXACT = point("lame", "ours", 1e-15, 2e-6)
MUJOCO = [point("mujoco", "engine", 1e-4, 1e-6, dt=dt, version="4.0.0", setting="RK4") for dt in (1, 2)]


CLASSES = ["our general integrators", "our solutions of integrable motions"]


def written(*groups):
    return list(rows(entries(table(*groups))))


def each(line, role, kept, alone, error=1e-7, **fields):
    """A method that keeps each step of the made-up scene, and its times."""
    values = (
        ("attitude error max", error),
        ("time per simulated second, each step kept", kept),
        ("time per simulated second", alone),
    )
    return [row("each_step", line, measure, value, role=role, **fields) for measure, value in values]


def test_each_cell_is_the_cheapest_of_its_class():
    header, *body = written(*OURS, EXACT, *MUJOCO)
    assert header == ["scene", "error, rad", *CLASSES, "mujoco 4.0.0"]
    assert [line[:2] for line in body] == [["made_up", error] for error in ("1e-3", "1e-6", "1e-9")]
    assert body[0][3:] == ["2.0 lame", "**1.0** RK4"]
    assert body[1][2:] == ["3.0 gauss", "**2.0** lame", "–"]
    assert body[2][2:] == ["–", "**2.0** lame", "–"]


def test_what_solves_integrable_motions_alone_is_apart_whatever_its_order():
    of_order_ten = point("moser_veselov:order=10", "ours", 1e-10, 1e-6)
    assert written(of_order_ten, EXACT)[1][2:] == ["–", "**1.0** moser_veselov order=10"]


def test_the_last_rows_keep_each_step():
    header, *body = written(
        *OURS,
        EXACT,
        *MUJOCO,
        each("gauss", "ours", 9e-6, 7e-6),
        each("mujoco", "engine", 8e-6, 5e-6, version="4.0.0", setting="RK4"),
    )
    assert header == ["scene", "error, rad", *CLASSES, "mujoco 4.0.0"]
    assert body[3:] == [
        ["made_up", "1e-6, each 0.1 s kept", "9.0 gauss", "–", "**8.0** RK4"],
        ["made_up", "1e-6, each 0.1 s, the end kept", "7.0 gauss", "–", "**5.0** RK4"],
    ]


def test_without_an_engine_there_is_no_column_of_one():
    assert written(EXACT)[0] == ["scene", "error, rad", *CLASSES]


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
    assert text.count(f"| {scene} | ") >= len(ERRORS)  # and those of samples at each step
