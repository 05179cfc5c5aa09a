import numpy as np
import pytest

from conservative.benchmarks.studies import paper_figures


def test_body_rates_reverse_twice():
    rates = paper_figures.body_rates()
    spin = rates[rates["component"] == "ω3"]["rate"].to_numpy()
    assert np.count_nonzero(np.diff(np.sign(spin))) == 2
    assert np.abs(spin).max() == pytest.approx(10, abs=1e-3)  # measured 10 - 4e-6


def test_conservation_within_the_papers_figures():
    errors = paper_figures.conservation().set_index("method")[["energy", "momentum"]].abs()
    assert errors.loc["convected"].max().max() < 1e-10  # measured 1.5e-15
    assert errors.loc["reduced"].max().max() < 1e-13  # measured 7e-16


def test_centre_of_mass_has_two_steps_and_the_analytical_line():
    positions = paper_figures.centre_of_mass()
    assert positions["run"].unique().tolist() == ["Δt = 0.01 s", "Δt = 0.005 s", "analytical"]
    last = positions[positions["run"] == "Δt = 0.01 s"].iloc[-1]
    # method.md, section 3: centre of mass after 63 steps
    assert abs(last["x1"] + 0.0589061) < 1e-7  # measured 5e-9, the digits printed there
    assert abs(last["x2"] + 0.02962542) < 1e-7  # measured 3e-9


def test_position_errors_fall_by_the_papers_factor():
    errors = paper_figures.position_errors()
    assert errors["x1"].round(4).tolist() == [0.06, 0.0205, 0.005]
    assert errors["distance"].round(4).tolist() == [0.0696, 0.0206, 0.0051]
