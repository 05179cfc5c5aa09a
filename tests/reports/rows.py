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
        measure = Measure.named(measure)
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


def point(line, role, error, time, dt=0.1, scene="made_up", **fields):
    """Error and time of a method, both at one step; by default the method, its label and its line have one name."""
    method = fields.pop("method", line)
    common = {"dt": dt, "scene": scene, "label": method, "role": role, "series": line, **fields}
    return [
        row("work_precision", method, Measure.ATTITUDE_MAX, error, **common),
        row("work_precision", method, Measure.TIME, time, **common),
    ]


def table(*groups):
    return frame([row for group in groups for row in group])
