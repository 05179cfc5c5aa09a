"""What to use of one method, and why, or why not."""

from __future__ import annotations

import math
from dataclasses import dataclass

from conservative.method import Role
from conservative.outcome import Outcome

from ..measures.convergence_order import Order, observed_order
from ..studies.selection import tolerance_setting
from .probe import Conditions, Probe
from .search import Refinement, at_round_off


@dataclass(frozen=True)
class Advice:
    """What to use of one method.

    Attributes
    ----------
    line
        Name of the method without the setting that is being looked for.
    best
        The probe at the recommended setting; where nothing reaches the error, at the setting that gets nearest.
    reached
        Whether the wanted error may be expected.
    cost
        Wall time per simulated second at that setting, s/s, interleaved minimum; nan where it could not be timed.
    order
        Observed order in the step; None for adaptive methods and those without truncation error.
    probes
        All runs, coarse to fine.
    reason
        Why the method cannot be used at all, or why it does not reach the error; empty where it does.
    """

    line: str
    role: Role
    best: Probe | None
    reached: bool
    cost: float
    order: Order | None
    probes: tuple[Probe, ...]
    reason: str


def advise(conditions: Conditions, line: str, role: Role, refinement: Refinement | Outcome, cost: float | None) -> Advice:
    """Return what to say about one line of settings; an outcome instead of probes is why there are none."""
    if isinstance(refinement, Outcome):
        return Advice(line, role, None, False, math.nan, None, (), refinement.reason)
    probe = refinement.best(conditions.target)
    reached = probe.expected <= conditions.error
    order = None if probe.method.order is None else observed_order(*refinement.converging())
    reason = "" if reached else explain_shortfall(conditions, refinement, probe)
    return Advice(line, role, probe, reached, math.nan if cost is None else cost, order, refinement.probes, reason)


def explain_shortfall(conditions: Conditions, refinement: Refinement, probe: Probe) -> str:
    """Return why nothing finer was found."""
    last = refinement.last
    if not probe.outcome.ok:
        return str(probe.outcome)
    if math.isinf(conditions.amplification.excess(probe.length, conditions.duration)):
        return "the motion amplifies errors without bound"
    if at_round_off(last):
        return "finer settings do not help any more: round-off"
    if last[-1].cost > conditions.cost_limit / 2:
        return f"anything finer costs more than {conditions.cost_limit:g} s per simulated second"
    if tolerance_setting(probe.method) is not None:
        return "it has no tighter tolerance"
    return f"not within {len(last)} probes"
