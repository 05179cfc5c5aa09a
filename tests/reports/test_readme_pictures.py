"""The README's pictures: one command draws them, and those that are linked are there and small."""

import re
import sys
from pathlib import Path

from conservative.reports.documentation import readme_pictures
from conservative.reports.documentation.readme_pictures import FOLDER

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "benchmarks" / "README.md"]
LINKED = [
    page.parent / link for page in PAGES for link in re.findall(r"!\[[^\]]+\]\(([^)]+)\)", page.read_text(encoding="utf-8"))
]
LARGEST = 150_000
"""Bytes."""


def test_the_command_measures_and_draws(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(readme_pictures, "TIMED_SCENE", "brick_flip")
    monkeypatch.setattr(readme_pictures, "TIMED", ("reduced", "moser_veselov"))
    monkeypatch.setattr(readme_pictures, "DRIFTING", ("reduced", "mujoco:RK4"))
    monkeypatch.setattr(readme_pictures, "SEEN", ("exact", "mujoco:implicit"))
    monkeypatch.setattr(sys, "argv", ["readme_pictures", "--quick", str(tmp_path / "pictures")])
    readme_pictures.main()
    written = [Path(line) for line in capsys.readouterr().out.splitlines()]
    assert [path.name for path in written] == ["time_against_error.svg", "drift_of_energy.svg", "polhodes.svg"]
    timed, drift, polhodes = (path.read_text(encoding="utf-8") for path in written)
    assert all(text.startswith("<svg") for text in (timed, drift, polhodes))
    assert "moser_veselov" in timed
    assert "drift of energy" in drift
    assert "RK4" in drift
    assert "implicit" in polhodes
    assert all(path.stat().st_size < LARGEST for path in written)


def test_every_picture_that_is_checked_in_is_linked_once():
    assert sorted(link.resolve() for link in LINKED) == sorted(path.resolve() for path in FOLDER.iterdir())
    assert len(LINKED) == 3
    assert LINKED[0].parents[2] == ROOT  # the README shows one of them
    told = (ROOT / ".github" / "CONTRIBUTING.md").read_text(encoding="utf-8")
    assert "python -m conservative.reports.documentation.readme_pictures" in told


def test_pictures_are_small_and_white_so_that_they_read_on_any_page():
    for path in FOLDER.iterdir():
        assert path.stat().st_size < LARGEST
        assert 'fill="white"' in path.read_text(encoding="utf-8")[:2000], "no background: dark text would vanish in dark mode"
