"""What `conservative recommend` shows: what to use, what that costs and does, and the probe runs behind it."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from conservative import registry
from conservative.benchmarks.recommendation.advice import Advice
from conservative.benchmarks.recommendation.extrapolation import Drift
from conservative.benchmarks.recommendation.probe import Probe
from conservative.benchmarks.recommendation.question import ask
from conservative.benchmarks.recommendation.recommend import Recommendation, recommend
from conservative.benchmarks.studies.selection import tolerance_setting
from conservative.errors import BadInput

from ..labels import shown
from ..terminal.atomic_files import text_file
from ..terminal.progress import Step

REACHING = ("method", "setting", "µs per simulated s", "error to expect, rad", "drift to expect")
FAILING = ("method", "nearest setting", "µs per simulated s", "keeps the error for", "to expect, rad", "drift to expect")
PROBES = ("method", "setting", "run, s", "error, rad", "to expect, rad")
KEPT = 1e-13
"""Relative drift up to which a quantity is called kept."""
FILES = ("recommendation.json", "recommendation.svg")


def run(
    scene_name: str, error: float, duration: float | None, engines: Sequence[str], limit: float, out: Path | None, step: Step
) -> Recommendation:
    """Return the recommendation; with `out` it is left there as JSON and as a picture, too.

    Raises
    ------
    BadInput
        A name, a number or the folder cannot be used; found before any work.
    MissingEngine
        An engine that is named is not installed.
    """
    asked = ask(registry.scene(scene_name), error, duration, engines or None, limit)
    with ExitStack() as files:
        streams = [files.enter_context(text_file(path, "out")) for path in _paths(out)]
        found = recommend(asked, step)
        if streams:
            from ..charts.recommendation import svg

            for stream, content in zip(streams, (as_json(found), svg(found)), strict=True):
                stream.write(content)
    return found


def _paths(out: Path | None) -> list[Path]:
    """Return the files of a recommendation; their folder is made if it is not there."""
    if out is None:
        return []
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInput("out", f"{str(out)!r} ({error.strerror})", "a folder that exists or can be made") from None
    return [out / name for name in FILES]


def setting(probe: Probe) -> str:
    """Return the setting of a probe as text: a step or a tolerance."""
    name = tolerance_setting(probe.method)
    return f"dt = {probe.dt:.7g} s" if name is None else f"{name} = {probe.setting:.0e}"


def called(advice: Advice) -> str:
    """Return what to call the method of an advice, with its engine's version, without the setting looked for."""
    if advice.best is None:
        return shown(advice.line, "")
    method = advice.best.method
    name = shown(method.name, method.label)
    tolerance = tolerance_setting(method)
    return (
        name if tolerance is None else name.replace(f"{tolerance}={advice.best.setting:g}", "").replace(" ,", " ").strip(" ,")
    )


def finite(value: float) -> float | None:
    """Return the value, None where JSON has no number for it."""
    return value if math.isfinite(value) else None


def as_json(found: Recommendation) -> str:
    """Return everything as JSON; null stands for what could not be measured, and for an attitude that is lost."""
    conditions, amplified = found.conditions, found.conditions.amplification
    content = {
        "scene": conditions.scene.name,
        "error": conditions.error,
        "duration": conditions.duration,
        "cost_limit": conditions.cost_limit,
        "cheapest": found.cheapest.line if found.cheapest else None,
        "recommendations": [_advice(advice) for advice in found.advice],
        "not_installed": list(found.missing),
        "truth": {
            "by": found.truth.names[0],
            "checked_by": found.truth.names[1],
            "agreement": found.truth.agreement_rad,
            "checked_until": found.truth.checked_until,
            "until": conditions.truth_until,
        },
        "motion": {
            "unstable": amplified.unstable,
            "disturbance": amplified.disturbance,
            "becomes": amplified.becomes,
            "lost": amplified.lost,
            "measured_until": amplified.until,
            "by": amplified.label,
        },
    }
    return json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False)


def _advice(advice: Advice) -> dict[str, Any]:
    order = advice.order
    return {
        "name": advice.line,
        "called": called(advice),
        "role": advice.role,
        "reached": advice.reached,
        "reason": advice.reason,
        "cost": finite(advice.cost),
        "observed_order": finite(order.slope) if order else None,
        "best": _probe(advice.best) if advice.best else None,
        "probes": [_probe(probe) for probe in advice.probes],
    }


def _probe(probe: Probe) -> dict[str, Any]:
    tolerance = tolerance_setting(probe.method)
    return {
        "method": probe.method.name,
        tolerance or "dt": probe.setting,
        "length": probe.length,
        "error": finite(probe.error),
        "expected": finite(probe.expected),
        "law": probe.law,
        "holds": finite(probe.holds),
        "drift": {d.name: {"measured": d.measured, "expected": d.expected, "secular": d.secular} for d in probe.drifts},
        "status": str(probe.outcome),
    }


def show(found: Recommendation) -> None:
    """Print what was asked, what reaches it, what does not, the probes, and what all that rests on."""
    from rich.console import Console

    console = Console(soft_wrap=False)
    conditions = found.conditions
    asked = f"{conditions.scene.name}: attitude error of at most {conditions.error:g} rad over {conditions.duration:g} s\n"
    console.print(asked, style="bold", markup=False)
    reaching = sorted((advice for advice in found.advice if advice.reached), key=lambda advice: advice.cost)
    failing = [advice for advice in found.advice if advice.best and not advice.reached]
    limit = f"What does not, at up to {conditions.cost_limit:g} s of computing per simulated second"
    if reaching:
        console.print(_table("What reaches it, cheapest first", REACHING, [_reaching(advice) for advice in reaching]))
    if failing:
        console.print(_table(limit, FAILING, [_failing(advice) for advice in failing]))
    probed = [row for advice in found.advice for row in _probed(advice)]
    console.print(_table("The probe runs; <- is what is in the tables above", PROBES, probed))
    console.print("\n".join(notes(found)), markup=False, highlight=False)


def notes(found: Recommendation) -> list[str]:
    """Return in words what the figures rest on: laws of growth, truth, stability, what could not be tried."""
    conditions, truth, amplified = found.conditions, found.truth, found.conditions.amplification
    lines = [f"{called(a)}: {a.best.law}." for a in found.advice if a.best]
    lines.append(
        f"Truth: {truth.names[0]}, which agrees with {truth.names[1]} to {truth.agreement_rad:.1e} rad over the first "
        f"{truth.checked_until:.3g} s; errors are measured over up to {conditions.truth_until:.4g} s."
    )
    stable = "the motion is unstable and amplifies errors" if amplified.unstable else "no more than in proportion to time"
    after = ", and by anything after that" if amplified.lost else ""
    lines.append(
        f"A start with rates off by {amplified.disturbance:g} of their size is off by up to {amplified.becomes:.2g} rad within "
        f"{amplified.until:.4g} s{after} ({amplified.label}): {stable}."
    )
    lines.append("Cost: the fastest of interleaved runs in this machine's own time; ratios are what lasts.")
    lines += [f"{called(a)}: {a.reason}." for a in found.advice if not a.reached]
    lines += [f"{name}: not installed." for name in found.missing]
    return lines


def _reaching(advice: Advice) -> tuple[str, ...]:
    assert advice.best is not None  # what reaches an error has run
    probe = advice.best
    return called(advice), setting(probe), _microseconds(advice.cost), f"{probe.expected:.1e}", drift_text(probe.drifts)


def _failing(advice: Advice) -> tuple[str, ...]:
    assert advice.best is not None  # the caller leaves out those without
    probe = advice.best
    expected = f"{probe.expected:.1e}" if probe.expected < math.pi else "lost"
    cost, drift = _microseconds(advice.cost), drift_text(probe.drifts)
    return called(advice), setting(probe), cost, f"{probe.holds:.2g} s", expected, drift


def _probed(advice: Advice) -> Iterator[tuple[str, ...]]:
    order = "" if advice.order is None else "no order seen" if advice.order.reason else f"order {advice.order.slope:.2f}"
    for i, probe in enumerate(advice.probes):
        error = f"{probe.error:.2e}" if probe.outcome.ok else str(probe.outcome)
        expected = f"{probe.expected:.1e}" if probe.expected < math.pi else "lost"
        name = (called(advice), order)[i] if i < 2 else ""
        yield name, setting(probe) + (" <-" if probe is advice.best else ""), f"{probe.length:.4g}", error, expected


def drift_text(drifts: Sequence[Drift]) -> str:
    """Return the drifts to expect, relative: an arrow marks one that goes on, `kept` stands for a few rounding units."""
    moved = [f"{d.name} {d.expected:.0e}{' ↗' if d.secular else ''}" for d in drifts if d.expected > KEPT]
    return ", ".join(moved) or "kept"


def _microseconds(cost: float) -> str:
    return "" if math.isnan(cost) else f"{cost * 1e6:.3g}"


def _table(title: str, header: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> object:
    from rich import box
    from rich.markup import escape
    from rich.table import Table

    table = Table(title=escape(title), box=box.SIMPLE_HEAD, title_justify="left", title_style="bold")
    for name in header:
        table.add_column(name)
    for row in rows:
        table.add_row(*(escape(cell) for cell in row))
    return table
