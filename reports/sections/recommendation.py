"""A recommendation: the settings that reach an error, their costs, and the probe runs."""

from __future__ import annotations

import math
import shlex
from collections.abc import Iterator, Sequence
from typing import Any

from conservative.benchmarks.measures.errors import LOST, is_lost
from conservative.benchmarks.recommendation.growth import ExpectedDrift
from conservative.benchmarks.recommendation.probe import Probe
from conservative.benchmarks.recommendation.recommend import PROBE_LIMIT, Advice, Recommendation
from conservative.benchmarks.studies.selection import tolerance_setting

from ..document.cells import DASH, angle, bound, number
from ..document.model import Block, Document, Emphasis, Items, Paragraph, Section, Table
from ..rows.names import method_text, setting_text

REACHING = ("method", "setting", "µs per simulated s", "error to expect, rad", "drift to expect")
FAILING = ("method", "nearest setting", "µs per simulated s", "reaches the error for", "to expect, rad", "drift to expect")
PROBES = ("method", "setting", "run, s", "error, rad", "to expect, rad")
NEGLIGIBLE = 1e-13
"""Relative drift up to which the tables show `conserved`."""


def build(recommendation: Recommendation, scene: str, verbose: bool) -> Document:
    """Return the document of a recommendation for a scene by its name or file; its picture is in `charts.recommendation`.

    The terminal shows the answer and the settings, and with `verbose` also the probe runs and the basis of the numbers.
    """
    conditions = recommendation.conditions
    title = f"{conditions.scene.name}: attitude error of at most {conditions.error:g} rad over {conditions.duration:g} s"
    settings, probes = list(tables(recommendation)), probe_table(recommendation)
    basis = Section("Basis of the numbers", [Items.of(notes(recommendation))])
    answer = [Paragraph(f"{title}\n", Emphasis.LEAD), Paragraph("\n".join([*answer_lines(recommendation, scene), ""]))]
    more = [probes, basis] if verbose else [Paragraph("--verbose shows the probe runs and the basis of the numbers.")]
    truth, amplified = conditions.reference, conditions.amplification
    data = {
        "scene": conditions.scene.name,
        "error": conditions.error,
        "duration": conditions.duration,
        "cost_limit": conditions.cost_limit,
        **{name: getattr(advice, "line", None) for name, advice in recommendation.winners.items()},
        "recommendations": [_advice(advice) for advice in recommendation.advice],
        "not_installed": conditions.missing,
        "truth": {
            "by": truth.names[0],
            "checked_by": truth.names[1],
            "agreement": truth.agreement_rad,
            "checked_until": truth.checked_until,
            "until": conditions.truth_until,
        },
        "motion": {
            "unstable": amplified.unstable,
            "disturbance": amplified.disturbance,
            "becomes": amplified.final_size,
            "lost": amplified.ends,
            "measured_until": float(amplified.t[-1]),
            "by": amplified.label,
        },
    }
    blocks: list[Block] = [*settings, probes, basis]
    return Document("conservative recommend", title, blocks, brief=[*answer, *settings, *more], data=data)


def answer_lines(recommendation: Recommendation, scene: str) -> Iterator[str]:
    """Yield the recommendation for a scene, by its name or file: the fastest setting, its command, and the fastest engine."""
    conditions, winners = recommendation.conditions, recommendation.winners
    best, engine = winners["cheapest"], winners["cheapest_engine"]
    if best is None or best.best is None:
        yield f"No method reaches it at up to {conditions.cost_limit:g} s of wall time per simulated second (--cost-limit)."
        return
    probe = best.best
    yield (
        f"Use {method_text(best)} with {setting_text(probe)}. To expect: attitude error {angle(probe.expected)} rad, drift: "
        f"{drift_text(probe.drifts)}; {best.cost * 1e6:.3g} µs per simulated second."
    )
    scene = shlex.quote(scene)
    yield f"Run: conservative run {scene} -m {probe.method.name} --dt {probe.dt:.7g} --t-end {conditions.duration:g}"
    if engine is not None and engine is not best and engine.best is not None:
        ratio = engine.cost / best.cost
        name = f"{method_text(engine)} with {setting_text(engine.best)}"
        yield f"Fastest engine: {name}, which takes {number(ratio)} times as long."
    if conditions.amplification.unstable:
        yield "The motion is unstable and amplifies errors: --verbose shows by how much."


def _advice(advice: Advice) -> dict[str, Any]:
    return {
        "name": advice.line,
        "called": method_text(advice),
        "role": advice.role,
        "reached": advice.reached,
        "reason": advice.reason,
        "cost": advice.cost,
        "observed_order": advice.order.slope if advice.order else None,
        "best": _probe(advice.best) if advice.best else None,
        "probes": [_probe(probe) for probe in advice.probes],
    }


def _probe(probe: Probe) -> dict[str, Any]:
    return {
        "method": probe.method.name,
        tolerance_setting(probe.method) or "dt": probe.setting,
        "length": probe.length,
        "error": probe.error,
        "expected": probe.expected,
        "law": probe.law,
        "holds": probe.holds,
        "drift": {d.name: {"measured": d.measured, "expected": d.expected, "secular": d.secular} for d in probe.drifts},
        "outcome": probe.outcome,
    }


def tables(recommendation: Recommendation) -> Iterator[Table]:
    """Yield the methods that reach the error, and those that do not."""
    reaching, failing = [], []
    for advice in sorted(recommendation.advice, key=lambda advice: advice.cost if advice.reached else 0.0):
        if (probe := advice.best) is None:
            continue
        cost = "" if math.isnan(advice.cost) else f"{advice.cost * 1e6:.3g}"
        names, drift = (method_text(advice), setting_text(probe), cost), drift_text(probe.drifts)
        if advice.reached:
            reaching.append((*names, angle(probe.expected), drift))
        else:
            failing.append((*names, f"{number(probe.holds)} s", expected_text(probe), drift))
    if reaching:
        yield Table(REACHING, reaching, "Settings that reach the error, fastest first")
    if failing:
        limit = f"Methods that do not, at up to {recommendation.conditions.cost_limit:g} s of wall time per simulated second"
        limit += f" and {PROBE_LIMIT:g} s for a probe"
        yield Table(FAILING, failing, limit)


def probe_table(recommendation: Recommendation) -> Table:
    """Return the probe runs."""
    probes = [row for advice in recommendation.advice for row in _probe_rows(advice)]
    return Table(PROBES, probes, "The probe runs; <- marks the settings of the tables above")


def notes(recommendation: Recommendation) -> list[str]:
    """Return the fastest methods, and the basis of the numbers: growth of errors, reference solution, stability."""
    advice, conditions = recommendation.advice, recommendation.conditions
    truth, amplified = conditions.reference, conditions.amplification
    after = ", and by any angle after that" if amplified.ends else ""
    kinds = {"cheapest": "of all", "cheapest_general": "of our general integrators", "cheapest_engine": "of the engines"}
    winners = ((kinds[kind], method_text(winner) if winner else "none") for kind, winner in recommendation.winners.items())
    fastest = ", ".join(map(" ".join, winners))
    growth = "the motion is unstable and amplifies errors" if amplified.unstable else "no more than in proportion to time"
    return [
        f"Fastest: {fastest}.",
        *(f"{method_text(a)}: {a.best.law}." for a in advice if a.best),
        f"conserved: relative drifts below {NEGLIGIBLE:g}; grows: steadily; lost: an attitude error above {LOST:g} rad.",
        f"Reference solution: {truth.names[0]}, which agrees with {truth.names[1]} to {bound(truth.agreement_rad)} rad over "
        f"the first {truth.checked_until:.3g} s; errors are measured over up to {conditions.truth_until:.4g} s.",
        f"A relative change of the initial rates by {amplified.disturbance:g} changes the attitude by up to "
        f"{angle(amplified.final_size)} rad within {amplified.t[-1]:.4g} s{after} ({amplified.label}): {growth}.",
        "Times: the fastest of interleaved runs on this machine; ratios are comparable across machines, times are not.",
        *(f"{method_text(a)}: not a general integrator; it solves integrable motions only." for a in advice if not a.general),
        *(f"{method_text(a)}: {a.reason}." for a in advice if not a.reached),
        *(f"{name}: not installed." for name in conditions.missing),
    ]


def _probe_rows(advice: Advice) -> Iterator[tuple[str, ...]]:
    order = "" if advice.order is None else "no order seen" if advice.order.reason else f"order {advice.order.slope:.2f}"
    for i, probe in enumerate(advice.probes):
        error = angle(probe.error, 3) if probe.outcome.ok else str(probe.outcome)
        name = (method_text(advice), order)[i] if i < 2 else ""
        setting = setting_text(probe) + (" <-" if probe is advice.best else "")
        yield name, setting, f"{probe.length:.4g}", error, expected_text(probe)


def expected_text(probe: Probe) -> str:
    """Return the expected error as text. An error that is too large to extrapolate is a lower limit."""
    if not math.isinf(probe.expected):
        return "lost" if is_lost(probe.expected) else angle(probe.expected)
    if not probe.outcome.ok:
        return DASH
    return "lost" if is_lost(probe.error) else f"above {number(probe.error, 2)}"


def drift_text(drifts: Sequence[ExpectedDrift]) -> str:
    """Return the relative drifts to expect; an arrow marks a steady drift, `conserved` stands for round-off."""
    large = [f"{d.name} {bound(d.expected, 1)}{' (grows)' if d.secular else ''}" for d in drifts if d.expected > NEGLIGIBLE]
    return ", ".join(large) or "conserved"
