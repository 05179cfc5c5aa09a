"""A recommendation as text, rows and JSON: what to use, what that costs and does, and the probe runs behind it."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from typing import Any

from conservative.benchmarks.recommendation.extrapolation import Drift
from conservative.benchmarks.recommendation.probe import Probe
from conservative.benchmarks.recommendation.recommend import Advice, Recommendation
from conservative.benchmarks.studies.method_names import names_of
from conservative.benchmarks.studies.selection import tolerance_setting

from ..labels import display_name
from ..terminal.tables import TerminalTable
from .cells import finite_or_none, outcome_record
from .classes import MethodClass, class_of

REACHING = ("method", "setting", "µs per simulated s", "error to expect, rad", "drift to expect")
FAILING = ("method", "nearest setting", "µs per simulated s", "keeps the error for", "to expect, rad", "drift to expect")
PROBES = ("method", "setting", "run, s", "error, rad", "to expect, rad")
NEGLIGIBLE = 1e-13
"""Relative drift up to which a quantity is called kept."""


def setting_text(probe: Probe) -> str:
    """Return the setting of a probe as text: a step or a tolerance."""
    name = tolerance_setting(probe.method)
    return f"dt = {probe.dt:.7g} s" if name is None else f"{name} = {probe.setting:.0e}"


def method_text(advice: Advice) -> str:
    """Return what to call the method of an advice, with its engine's version, without the setting looked for."""
    if advice.best is None:
        return advice.line.replace(":", " ")
    names = names_of(advice.best.method)
    return display_name(names.family, names.version, names.series_setting)


def json_text(recommendation: Recommendation) -> str:
    """Return everything as JSON; null stands for what could not be measured, and for an attitude that is lost."""
    content = _question(recommendation) | {
        "cheapest": recommendation.cheapest.line if recommendation.cheapest else None,
        "recommendations": [_advice(advice) for advice in recommendation.advice],
        "not_installed": list(recommendation.missing),
        "truth": _truth(recommendation),
        "motion": _motion(recommendation),
    }
    return json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False)


def _question(recommendation: Recommendation) -> dict[str, Any]:
    conditions = recommendation.conditions
    return {
        "scene": conditions.scene.name,
        "error": conditions.error,
        "duration": conditions.duration,
        "cost_limit": conditions.cost_limit,
    }


def _truth(recommendation: Recommendation) -> dict[str, Any]:
    truth = recommendation.truth
    return {
        "by": truth.names[0],
        "checked_by": truth.names[1],
        "agreement": truth.agreement_rad,
        "checked_until": truth.checked_until,
        "until": recommendation.conditions.truth_until,
    }


def _motion(recommendation: Recommendation) -> dict[str, Any]:
    amplified = recommendation.conditions.amplification
    return {
        "unstable": amplified.unstable,
        "disturbance": amplified.disturbance,
        "becomes": amplified.final_size,
        "lost": amplified.is_lost,
        "measured_until": amplified.end,
        "by": amplified.label,
    }


def _advice(advice: Advice) -> dict[str, Any]:
    order = advice.order
    return {
        "name": advice.line,
        "called": method_text(advice),
        "role": advice.role,
        "reached": advice.reached,
        "reason": advice.reason,
        "cost": finite_or_none(advice.cost),
        "observed_order": finite_or_none(order.slope) if order else None,
        "best": _probe(advice.best) if advice.best else None,
        "probes": [_probe(probe) for probe in advice.probes],
    }


def _probe(probe: Probe) -> dict[str, Any]:
    tolerance = tolerance_setting(probe.method)
    return {
        "method": probe.method.name,
        tolerance or "dt": probe.setting,
        "length": probe.length,
        "error": finite_or_none(probe.error),
        "expected": finite_or_none(probe.expected),
        "law": probe.law,
        "holds": finite_or_none(probe.holds),
        "drift": {d.name: {"measured": d.measured, "expected": d.expected, "secular": d.secular} for d in probe.drifts},
        "outcome": outcome_record(probe.outcome),
    }


def question_text(recommendation: Recommendation) -> str:
    """Return what was asked, with an empty line below it."""
    conditions = recommendation.conditions
    return f"{conditions.scene.name}: attitude error of at most {conditions.error:g} rad over {conditions.duration:g} s\n"


def tables(recommendation: Recommendation) -> Iterator[TerminalTable]:
    """Yield what reaches the error, what does not, and the probe runs."""
    reaching = sorted((advice for advice in recommendation.advice if advice.reached), key=lambda advice: advice.cost)
    failing = [advice for advice in recommendation.advice if advice.best and not advice.reached]
    limit = f"What does not, at up to {recommendation.conditions.cost_limit:g} s of computing per simulated second"
    if reaching:
        yield TerminalTable("What reaches it, cheapest first", REACHING, [_reaching(advice) for advice in reaching])
    if failing:
        yield TerminalTable(limit, FAILING, [_failing(advice) for advice in failing])
    probes = [row for advice in recommendation.advice for row in _probe_rows(advice)]
    yield TerminalTable("The probe runs; <- is what is in the tables above", PROBES, probes)


def notes(recommendation: Recommendation) -> list[str]:
    """Return in words what the figures rest on: laws of growth, truth, stability, what could not be tried."""
    advice = recommendation.advice
    return [
        *(f"{method_text(a)}: {a.best.law}." for a in advice if a.best),
        _truth_text(recommendation),
        _stability_text(recommendation),
        "Cost: the fastest of interleaved runs in this machine's own time; ratios are what lasts.",
        *(f"{method_text(a)}: no general integrator; it solves integrable motions only." for a in advice if _is_solution(a)),
        *(f"{method_text(a)}: {a.reason}." for a in advice if not a.reached),
        *(f"{name}: not installed." for name in recommendation.missing),
    ]


def _is_solution(advice: Advice) -> bool:
    return advice.best is not None and class_of(advice.role, advice.best.method.name) is MethodClass.SOLUTION


def _truth_text(recommendation: Recommendation) -> str:
    truth, until = recommendation.truth, recommendation.conditions.truth_until
    return (
        f"Truth: {truth.names[0]}, which agrees with {truth.names[1]} to {truth.agreement_rad:.1e} rad over the first "
        f"{truth.checked_until:.3g} s; errors are measured over up to {until:.4g} s."
    )


def _stability_text(recommendation: Recommendation) -> str:
    amplified = recommendation.conditions.amplification
    stable = "the motion is unstable and amplifies errors" if amplified.unstable else "no more than in proportion to time"
    after = ", and by anything after that" if amplified.is_lost else ""
    return (
        f"A start with rates off by {amplified.disturbance:g} of their size is off by up to {amplified.final_size:.2g} rad "
        f"within {amplified.end:.4g} s{after} ({amplified.label}): {stable}."
    )


def _reaching(advice: Advice) -> tuple[str, ...]:
    assert advice.best is not None  # what reaches an error has run
    probe = advice.best
    cost, drift = _microseconds(advice.cost), drift_text(probe.drifts)
    return method_text(advice), setting_text(probe), cost, f"{probe.expected:.1e}", drift


def _failing(advice: Advice) -> tuple[str, ...]:
    assert advice.best is not None  # the caller leaves out those without
    probe = advice.best
    cost, drift = _microseconds(advice.cost), drift_text(probe.drifts)
    return method_text(advice), setting_text(probe), cost, f"{probe.holds:.2g} s", _expected(probe), drift


def _probe_rows(advice: Advice) -> Iterator[tuple[str, ...]]:
    order = "" if advice.order is None else "no order seen" if advice.order.reason else f"order {advice.order.slope:.2f}"
    for i, probe in enumerate(advice.probes):
        error = f"{probe.error:.2e}" if probe.outcome.ok else str(probe.outcome)
        name = (method_text(advice), order)[i] if i < 2 else ""
        setting = setting_text(probe) + (" <-" if probe is advice.best else "")
        yield name, setting, f"{probe.length:.4g}", error, _expected(probe)


def _expected(probe: Probe) -> str:
    return f"{probe.expected:.1e}" if probe.expected < math.pi else "lost"


def drift_text(drifts: Sequence[Drift]) -> str:
    """Return the drifts to expect, relative: an arrow marks one that goes on, `kept` stands for a few rounding units."""
    large = [f"{d.name} {d.expected:.0e}{' ↗' if d.secular else ''}" for d in drifts if d.expected > NEGLIGIBLE]
    return ", ".join(large) or "kept"


def _microseconds(cost: float) -> str:
    return "" if math.isnan(cost) else f"{cost * 1e6:.3g}"
