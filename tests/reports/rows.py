"""Made-up measurements, so that what tables and pictures say of them is known beforehand."""

from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.measures.measurement import Measurement, frame
from conservative.method import Role
from conservative.outcome import OK, Outcome, OutcomeKind


def row(study, method, measure, value, dt=0.1, **fields):
    """A row of a made-up study; `measure` may be a text such as `energy drift max`."""
    quantity = ""
    if isinstance(measure, str):
        if " drift " in measure:
            quantity, measure = measure.split(" drift ")
            measure = f"drift {measure}"
        measure = Measure.from_text(measure)
    outcome = fields.pop("outcome", OK)
    common = {"scene": "made_up", "label": method, "role": Role.OURS, "series": method, **fields}
    common["role"] = Role(common["role"])
    return Measurement(
        study=study,
        method=method,
        dt=dt,
        quantity=quantity,
        measure=measure,
        value=value,
        outcome=outcome if isinstance(outcome, Outcome) else Outcome(OutcomeKind(outcome)),
        **common,
    )


def point(line, role, error, time, dt=0.1, scene="made_up", label=None, method=None, outcome="ok"):
    method = method or line
    common = {"dt": dt, "scene": scene, "label": label or method, "role": role, "series": line, "outcome": outcome}
    return [
        row("work_precision", method, Measure.ATTITUDE_MAX, error, **common),
        row("work_precision", method, Measure.TIME, time, **common),
    ]


def table(*groups):
    return frame([row for group in groups for row in group])
