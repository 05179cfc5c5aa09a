"""Measure the figures, and say of each: reproduced, off by how much, or why it cannot be done."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from conservative import registry
from conservative.attitude import Array
from conservative.errors import BadInput, IntegrationFailed, MissingEngine
from conservative.method import Method, Role
from conservative.references.environments.environment import list_environments

from .figure import TRUTH, Figure, Relation
from .quantities import QUANTITIES, Quantity, Runs

EVERY_ENGINE = "all"


class Verdict(StrEnum):
    """What came of a figure."""

    REPRODUCED = "reproduced"
    EXPLAINED = "differs, explained"
    UNEXPLAINED = "differs, not explained"
    NEEDLESS = "explained, but reproduced"
    CANNOT = "cannot be done"


FAILURES = (Verdict.UNEXPLAINED, Verdict.NEEDLESS)
"""Verdicts that end the command with exit code 1."""


@dataclass(frozen=True)
class Beside:
    """What one engine finds for a figure of the motion itself, at the figure's step.

    Attributes: the engine's `label`; `off`, its largest difference from the printed numbers, None where it has none; `reason`.
    """

    label: str
    off: float | None
    reason: str = ""


@dataclass(frozen=True)
class Finding:
    """A figure, what was measured here, and the verdict.

    Attributes
    ----------
    figure, verdict
        The printed figure, and what came of it.
    label
        What it was measured with; empty where it was not.
    measured
        The numbers, empty where there are none.
    off
        By how much the measured numbers miss what is printed; 0 within a bound, None where there are none.
    reason
        Why it cannot be done.
    beside
        What engines find for the same motion.
    """

    figure: Figure
    verdict: Verdict
    label: str = ""
    measured: tuple[float, ...] = ()
    off: float | None = None
    reason: str = ""
    beside: tuple[Beside, ...] = ()


def select_figures(figures: Sequence[Figure], sources: Sequence[str]) -> tuple[Figure, ...]:
    """Return the figures of some sources, by default of all.

    Raises
    ------
    BadInput
        A source is unknown.
    """
    known = dict.fromkeys(figure.source.key for figure in figures)
    for source in sources:
        if source not in known:
            raise BadInput("only", repr(source), f"sources: {', '.join(known)}")
    return tuple(figure for figure in figures if not sources or figure.source.key in sources)


def check_engines(names: Sequence[str]) -> None:
    """Raise `BadInput` for an engine that is unknown."""
    known = (EVERY_ENGINE, "none", *sorted({*registry.list_engines(), *registry.list_methods()}))
    for name in names:
        if name not in known:
            raise BadInput("engines", repr(name), f"one of {', '.join(known)}")


def evaluate(figures: Iterable[Figure], engines: Sequence[str] = (EVERY_ENGINE,)) -> Iterator[Finding]:
    """Yield a finding for each figure, measured now.

    Parameters
    ----------
    figures
        The figures.
    engines
        Families of engines that may run, or "all"; figures of others cannot be done then.
    """
    for figure in figures:
        if figure.method == TRUTH and not figure.cannot:
            yield _find_motion(figure, engines)
        else:
            yield _find(figure, engines)


def _find_motion(figure: Figure, engines: Sequence[str]) -> Finding:
    found = judge(figure, "the two truths", *_measure(figure, None))
    beside = tuple(_beside(figure, method) for method in best_methods(engines))
    return Finding(figure, found.verdict, found.label, found.measured, found.off, found.reason, beside)


def _find(figure: Figure, engines: Sequence[str]) -> Finding:
    if figure.cannot:
        return Finding(figure, Verdict.CANNOT, reason=figure.cannot)
    missing = _not_registered(figure.method) or _not_registered(figure.other)
    if missing:
        return Finding(figure, Verdict.CANNOT, reason=missing)
    try:
        method = registry.method(figure.method)
    except MissingEngine as error:
        return Finding(figure, Verdict.CANNOT, reason=describe_missing(error))
    if method.role is Role.ENGINE and not named(method.family, engines):
        return Finding(figure, Verdict.CANNOT, reason=f"{method.family} is left out by --engines")
    return judge(figure, method.label, *_measure(figure, method))


def describe_missing(error: MissingEngine) -> str:
    """Return that an engine is not installed, and the line that installs it."""
    wanted = str(error).partition("got '")[2].partition("'")[0]
    return f"{wanted} is not installed: {str(error).partition('allowed after: ')[2]}"


def named(engine: str, engines: Sequence[str]) -> bool:
    """Return whether an engine, of whatever version, is among those that may run."""
    return EVERY_ENGINE in engines or engine.partition("@")[0] in engines


def _not_registered(name: str) -> str:
    engine = name.partition(":")[0].partition("@")[0]
    known = {"", *registry.list_engines(), *registry.list_methods()}
    return "" if engine in known else f"there is no adapter for {engine}"


def _measure(figure: Figure, method: Method | None) -> tuple[Array | None, str]:
    """Return what is measured, or None and the reason."""
    quantity, scene = QUANTITIES[figure.quantity], figure.motion
    assert scene is not None
    reason = None if method is None else method.unsupported(scene)
    if reason is not None:
        return None, reason
    try:
        other = registry.method(figure.other) if figure.other else None
        return _run(quantity, Runs(scene, method, figure.dt, other)), ""
    except BadInput as error:  # what it does not support, or a step that is too long for it
        return None, str(error)
    except IntegrationFailed as failure:
        return None, f"the run {failure.outcome}"


def _run(quantity: Quantity, runs: Runs) -> Array:
    with np.errstate(all="ignore"):  # runs that diverge are figures, too
        return quantity(runs)


def judge(figure: Figure, label: str, measured: Array | None, reason: str) -> Finding:
    """Return the finding of a figure from what was measured of it, or from the reason why nothing was."""
    if measured is None:
        return Finding(figure, Verdict.CANNOT, label, reason=reason)
    off = distance(figure, measured)
    same = off <= (figure.allowed if figure.relation is Relation.EQUALS else 0.0)
    verdicts = (Verdict.UNEXPLAINED, Verdict.EXPLAINED), (Verdict.REPRODUCED, Verdict.NEEDLESS)
    verdict = verdicts[same][bool(figure.explanation)]
    return Finding(figure, verdict, label, tuple(measured.tolist()), off)


def distance(figure: Figure, measured: Array) -> float:
    """Return by how much measured numbers (n,) miss the printed ones, in their unit; infinite where they are of other kinds."""
    printed = np.array(figure.values)
    if measured.shape != printed.shape or not np.isfinite(measured).all():
        return float("inf")
    ways: dict[Relation, Callable[[], Array]] = {
        Relation.EQUALS: lambda: np.abs(measured - printed),
        Relation.BELOW: lambda: np.maximum(measured - printed, 0.0),
        Relation.ABOVE: lambda: np.maximum(printed - measured, 0.0),
    }
    return float(ways[figure.relation]().max())


def best_methods(engines: Sequence[str]) -> list[Method]:
    """Return, of each engine that is named and has an environment, its setting with fixed steps that has the highest order.

    Where all of its settings choose their own steps, or need none, it is the first of those.
    """
    there = {environment.engine for environment in list_environments()}
    families = [registry.engine(name) for name in registry.list_engines() if name in there and named(name, engines)]
    return [max(family.variants(), key=lambda method: method.order or 0) for family in families]


def _beside(figure: Figure, method: Method) -> Beside:
    measured, reason = _measure(figure, method)
    return Beside(method.label, None if measured is None else distance(figure, measured), reason)


def passed(findings: Iterable[Finding]) -> bool:
    """Return whether every difference has an explanation, and every explanation a difference."""
    return not any(finding.verdict in FAILURES for finding in findings)
