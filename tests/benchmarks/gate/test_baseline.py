"""A baseline: what is none, what is accepted into it, and how its times are taken and limited."""

import numpy as np
import pytest
from click.testing import CliRunner
from scipy import stats

import conservative as cv
from conservative.benchmarks.gate import baseline, results, yardstick
from conservative.benchmarks.gate.results import Row, Status
from conservative.reports.cli.main import main

from .gate_rows import COMPILE_REFERENCE, SECOND, with_row


def test_the_yardstick_is_compiled_from_the_loop_that_is_hashed():
    assert COMPILE_REFERENCE()(3, 0.1) == pytest.approx(yardstick.step_reference_body(3, 0.1), rel=1e-14)  # measured 0
    assert "def turn" in yardstick.definition()


@pytest.mark.parametrize(
    ("repeats", "taken", "least"), [([9.0, 9.0, 9.0], 3, 9.0), ([0.9, 9.0, 9.0], 1, 0.9), ([1.5, 1.2, 1.1], 3, 1.1)]
)
def test_what_looks_too_slow_is_measured_again(repeats, taken, least, monkeypatch):
    monkeypatch.setattr(yardstick, "sleep", lambda pause: None)
    rest = iter(repeats)
    assert yardstick.confirm(9.5, 1.0, lambda: next(rest)) == least
    assert len(list(rest)) == len(repeats) - taken
    assert yardstick.confirm(0.5, 1.0, lambda: pytest.fail("within its limit")) == 0.5


@pytest.mark.parametrize(
    ("damage", "name"),
    [
        (lambda text: text[: len(text) // 2], "truncated"),
        (lambda text: text.replace('"limit": ', '"limit": 1', 1), "edited by hand"),
        (lambda text: "{}", "another format"),
        (None, "no baseline"),
    ],
)
def test_a_damaged_baseline_is_none(kept, untouched, tmp_path, damage, name):
    path, found = tmp_path / "baseline.json", tmp_path / "results.json"
    results.write(untouched, found)
    baseline.write(kept, path)
    arguments = ["gate", "--baseline", str(path), str(found)]
    assert CliRunner().invoke(main, arguments).exit_code == 0
    if damage:
        path.write_text(damage(path.read_text()))
    else:
        path.unlink()
    ended = CliRunner().invoke(main, arguments)
    assert ended.exit_code == 2
    assert name in ended.output


def test_the_command_compares_and_accepts(kept, untouched, tmp_path):
    path, found = tmp_path / "baseline.json", tmp_path / "results.json"
    baseline.write(kept, path)
    results.write(with_row(untouched, SECOND, values={"rate error max": 0.5}), found)
    arguments = ["gate", "--baseline", str(path), str(found)]
    ended = CliRunner().invoke(main, arguments)
    assert ended.exit_code == 1
    assert "rate error max, brick_flip, reduced: was 0.00" in ended.output
    assert CliRunner().invoke(main, [*arguments, "--update", " "]).exit_code == 2
    assert CliRunner().invoke(main, [*arguments, "--update", "wanted so"]).exit_code == 0
    assert CliRunner().invoke(main, arguments).exit_code == 0
    assert [entry["reason"] for entry in baseline.read(path).history] == ["the first one", "wanted so"]
    assert len(baseline.read(path).history[-1]["changed"]) == 1


@pytest.mark.parametrize(
    "changes",
    [{"status": Status.FAILED}, {"values": {"rate error max": float("nan")}}, {"values": {"iterations": float("inf")}}],
)
def test_what_failed_cannot_be_accepted(kept, untouched, changes):
    with pytest.raises(cv.BadInput):
        baseline.update_baseline(kept, [with_row(untouched, SECOND, **changes)], "no")


def test_the_largest_spread_that_was_measured_counts():
    runs = [
        results.Results(
            "here", {"a": Row("a", "s", "m", Status.PASSED, "", "d", {"energy drift max": 1.0}, {"energy drift max": s})}
        )
        for s in (0.1, 0.3, 0.2)
    ]
    found = baseline.update_baseline(None, runs, "why").rows["a"].measures["energy drift max"]
    assert (found.spread, found.limit) == (0.3, pytest.approx(1 + baseline.SPREADS * 0.3, rel=1e-15))


def test_the_spread_of_times_is_a_standard_deviation():
    ratios = np.exp(0.008 * np.array([-2, -1, 0, 0, 1, 2]))  # half of them within 0.008
    found = baseline.time_limit(ratios.tolist(), 10)
    assert found.spread == pytest.approx(0.008 / stats.norm.ppf(0.75), rel=1e-4)
    quantile = stats.t.ppf(1 - baseline.FALSE_ALARMS / 10, 5)
    assert found.limit - 1 == pytest.approx(quantile * found.spread * (1 + 1 / 6) ** 0.5, rel=1e-12)  # between the bounds


def test_the_limit_of_a_time_follows_from_repeats():
    calm = baseline.time_limit([1.0, 1.001, 0.999, 1.0, 1.002, 0.998], 10)
    assert calm.limit == pytest.approx(1.05, rel=1e-3)
    noisy = baseline.time_limit([1.0, 1.01, 0.98, 1.02, 0.99, 1.0], 10)
    assert 1.05 < noisy.limit / noisy.value <= 1.10
    assert baseline.time_limit([1.0, 1.0], 10).limit == pytest.approx(1.10)
    spell = baseline.time_limit([1.0, 1.001, 0.999, 1.0, 1.002, 1.4], 10)
    assert spell.limit == pytest.approx(1.05, rel=1e-2)  # one repeat in a slow spell of the machine widens nothing
