"""README.md is generated from measurements and is current."""

import importlib.util
import subprocess
import sys

import pandas as pd
import pytest

from .pages import ROOT

FOLDER = ROOT / ".ci" / "readme"


def load(name):
    spec = importlib.util.spec_from_file_location(f"readme_{name.strip('_')}", FOLDER / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_readme_is_current():
    done = subprocess.run([sys.executable, FOLDER, "--check"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_a_changed_measurement_makes_it_stale(tmp_path, monkeypatch):
    program = load("__main__")
    text = program.ROWS.read_text(encoding="utf-8")
    (line,) = [line for line in text.splitlines() if line.startswith("brick_flip,MuJoCo,time,")]
    fields = line.split(",")
    fields[3] = str(3 * float(fields[3]))
    (tmp_path / "measured.csv").write_text(text.replace(line, ",".join(fields)), encoding="utf-8")
    monkeypatch.setattr(program, "ROWS", tmp_path / "measured.csv")
    monkeypatch.setattr(sys, "argv", ["readme", "--check"])
    with pytest.raises(SystemExit, match=r"python \.ci/readme"):
        program.main()


@pytest.mark.parametrize(
    ("value", "text"), [(4e-16, "< 1e-15"), (3.2e-12, "3e-12"), (1.7e-6, "2e-6"), (0.0547, "0.05"), (0.72, "0.7"), (3.1, "3")]
)
def test_small_numbers(value, text):
    assert load("__main__").small(value) == text


def timed(series, error, time, method=None, dt=0.1):
    """Return the two rows of a timed setting; `time` in s per simulated second."""
    common = {"series": series, "method": method or series, "dt": dt, "outcome": "ok"}
    return [
        common | {"measure": "attitude error max", "value": error},
        common | {"measure": "time per simulated second", "value": time},
    ]


def test_the_fastest_setting_at_an_error_is_found_between_its_points():
    rows = [
        *timed("a", 1e-4, 1e-6, dt=0.2),
        *timed("a", 1e-8, 1e-4, dt=0.1),
        *timed("b", 1e-7, 3e-5),
        *timed("c", 1e-5, 1e-7),  # does not reach the error
    ]
    time, name = load("measure").fastest(pd.DataFrame(rows), 1e-6)
    assert name == "a"
    assert time == pytest.approx(1e-5)
    assert load("measure").fastest(pd.DataFrame(rows), 1e-10) == (float("inf"), "")


def test_ratios_on_random_bodies_are_geometric_means_over_bodies_with_both_times():
    rows = []
    for index, (ours, heyoka) in enumerate([(1e-6, 2e-6), (1e-6, 8e-6), (None, 1e-6)]):
        scene = f"random_body:field=spring,seed=1,index={index}"
        for role, time in (("ours", ours), ("engine", heyoka)):
            names = {"scene": scene, "field": "spring", "role": role}
            rows += [row | names for row in timed(role, 1e-13 if time else 1.0, time or 1.0)]
    found = {(row["scene"], row["quantity"]): row["value"] for row in load("measure")._random(pd.DataFrame(rows))}
    assert found["spring 1e-06 rad", "heyoka's time over ours"] == pytest.approx(4)
    assert found["all fields", "cases"] == 12
    assert found["all fields", "cases where heyoka is faster"] == 4
