from functools import cache

import numpy as np
import pytest

from conservative import registry
from conservative.benchmarks.measures import measurement, samples
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.measures.measurement import Measurement
from conservative.benchmarks.measures.samples import Samples
from conservative.benchmarks.studies import studies
from conservative.benchmarks.studies.study import Study
from conservative.reports.tables import lines, paper


@cache
def study():
    """Rows and lines of the study of the paper's figures."""
    scenes = tuple(map(registry.scene, ("brick_flip", "lagrange_top")))
    found = list(studies.findings(Study("paper_figures", scenes, (registry.method("reduced"),))))
    samples_of = [each for each in found if isinstance(each, Samples)]
    return measurement.frame(each for each in found if isinstance(each, Measurement)), samples.frame(samples_of)


def test_body_rates_reverse_twice():
    rates = lines.body_rates(study()[1])
    spin = rates[rates["component"] == "ω3"]["rate"].to_numpy()
    assert np.count_nonzero(np.diff(np.sign(spin))) == 2
    assert np.abs(spin).max() == pytest.approx(10, abs=1e-3)  # measured 10 - 4e-6


def test_conservation_within_the_papers_figures():
    errors = lines.conservation_errors(study()[1]).set_index("method")[["energy", "momentum"]].abs()
    assert errors.loc["convected"].max().max() < 1e-10  # measured 1.5e-15
    assert errors.loc["reduced"].max().max() < 1e-13  # measured 7e-16


def test_centre_of_mass_has_two_steps_and_the_analytical_line():
    positions = lines.centre_of_mass(study()[1])
    assert set(positions["run"]) == {"Δt = 0.01 s", "Δt = 0.005 s", "analytical"}
    last = positions[positions["run"] == "Δt = 0.01 s"].iloc[-1]
    # Centre of mass of the paper's scheme after 63 steps
    assert abs(last["x1"] + 0.0589061) < 1e-7  # measured 5e-9, the digits printed there
    assert abs(last["x2"] + 0.02962542) < 1e-7  # measured 3e-9


def test_position_errors_fall_by_the_papers_factor():
    table = study()[0]
    found = {measure: table[table["measure"] == measure.text]["value"].round(4).tolist() for measure in Measure}
    assert found[Measure.PERIOD_X1] == [0.06, 0.0205, 0.005]
    assert found[Measure.PERIOD_DISTANCE] == [0.0696, 0.0206, 0.0051]
    assert [row[2:] for row in paper.position_errors(table)[1]] == [
        ["0.0600", "0.0696"],
        ["0.0205", "0.0206"],
        ["0.0050", "0.0051"],
    ]
