"""Made-up measurements, for which the contents of tables and pictures are known beforehand."""

from conservative.benchmarks.measures import measurement
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.measures.measurement import Measurement
from conservative.method import Role
from conservative.outcome import OK, Outcome, OutcomeKind
from conservative.reports.rows.names import with_names


def row(study, method, measure, value, dt=0.1, **fields):
    """A row of a made-up study; `measure` may be a text such as `energy drift max`."""
    quantity = fields.pop("quantity", "")
    if isinstance(measure, str):
        if " drift " in measure:
            quantity, measure = measure.split(" drift ")
            measure = f"drift {measure}"
        measure = Measure.from_text(measure)
    outcome = fields.pop("outcome", OK)
    common = {"scene": "made_up", "label": method, "role": Role.OURS, "series": method, **parts(method), **fields}
    common["role"] = Role(common["role"])
    common.setdefault("series_setting", common["setting"])
    common.setdefault("engine", common["family"] if common["role"] == Role.ENGINE else "")
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


def parts(method):
    """Family and setting of a method without a version."""
    family, _, setting = method.partition(":")
    return {"family": family, "version": "", "setting": setting}


def point(line, role, error, time, dt=0.1, **fields):
    """Error and time of a made-up point of a line; it may have another `method`."""
    method = fields.pop("method", line)
    return [
        row("work_precision", method, measure, value, dt, role=role, **{"series": line, **fields})
        for measure, value in ((Measure.ATTITUDE_MAX, error), (Measure.TIME, time))
    ]


def table(*groups):
    return frame([row for group in groups for row in group])


def frame(rows):
    """The table of rows with the names of their methods."""
    return with_names(measurement.frame(rows))


def texts(table):
    """The rows of a table of a document as text."""
    return [list(map(str, row)) for row in table.rows]
