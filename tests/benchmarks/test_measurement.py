import dataclasses
import json
import math

import numpy as np
import pytest

from conservative.benchmarks.measures import measurement
from conservative.benchmarks.measures.measure import Measure, Value, blanks
from conservative.benchmarks.measures.measurement import COLUMNS, Measurement, Samples, frame, from_flat, outcome_of
from conservative.method import Role
from conservative.outcome import OK, Outcome, OutcomeKind

ROW = Measurement(
    study="paper",
    scene="brick_flip",
    method="reduced",
    label="conservative==1/reduced",
    role=Role.OURS,
    series="reduced",
    dt=0.01,
    quantity="energy",
    measure=Measure.DRIFT_MAX,
    value=1e-15,
)
FAILED = dataclasses.replace(ROW, value=math.nan, outcome=Outcome(OutcomeKind.NOT_CONVERGED, "why", 3, 0.02, 0.5))
NUMBERS = {"seed", "body", "bodies", "process", "dt", "value", "step", "time", "residual"}
LINE = Samples(
    study="long_runs",
    scene="brick_flip",
    method="reduced",
    label="conservative==1/reduced",
    series="reduced",
    role=Role.OURS,
    dt=0.01,
    quantity="energy",
    t=np.array([0.1, 0.1 + 0.2]),
    value=np.array([1e-16, math.nan]),
)


def test_columns_and_their_types_do_not_depend_on_the_rows():
    full, empty = frame([ROW, FAILED]), frame([])
    assert list(full.columns) == list(empty.columns) == list(COLUMNS)
    assert (full.dtypes == empty.dtypes).all()
    assert {name for name in COLUMNS if full[name].dtype == np.float64} == NUMBERS
    assert len(full) == 2
    assert len(empty) == 0


def test_a_row_in_the_table():
    record = frame([ROW]).iloc[0]
    shown = record[["role", "quantity", "measure", "unit", "value", "outcome", "reason", "detail"]].tolist()
    assert shown == ["ours", "energy", "drift max", "1", 1e-15, "ok", "", ""]
    assert record[["step", "time", "residual"]].isna().all()


@pytest.mark.parametrize("row", [ROW, FAILED])
def test_a_row_survives_json(row):
    record = json.loads(json.dumps(measurement.flat(row)))
    again = from_flat(record)
    assert dataclasses.replace(again, value=0.0) == dataclasses.replace(row, value=0.0)
    assert str(again.value) == str(row.value)


def test_an_outcome_survives_the_table():
    assert [outcome_of(record) for _, record in frame([ROW, FAILED]).iterrows()] == [OK, FAILED.outcome]


@pytest.mark.parametrize("change", [{"measure": "drift mux"}, {"role": "nobody"}, {"outcome": "fine"}])
def test_a_record_of_something_else_is_refused(change):
    with pytest.raises((KeyError, ValueError)):
        from_flat(measurement.flat(ROW) | change)


def test_every_measure_is_found_by_its_text():
    assert [Measure.from_text(measure.text) for measure in Measure] == list(Measure)
    assert len({measure.text for measure in Measure}) == len(Measure)
    with pytest.raises(KeyError):
        Measure.from_text("energy drift max")


def test_samples_survive_json():
    again = measurement.samples_from_flat(json.loads(json.dumps(measurement.flat_samples(LINE))))
    assert (again.role, again.quantity, again.dt) == (LINE.role, LINE.quantity, LINE.dt)
    np.testing.assert_array_equal(again.t, LINE.t)
    np.testing.assert_array_equal(again.value, LINE.value)


def test_the_table_of_samples_has_a_row_for_each():
    full, empty = measurement.samples_frame([LINE, LINE]), measurement.samples_frame([])
    assert list(full.columns) == list(empty.columns) == list(measurement.SAMPLE_COLUMNS)
    assert (full.dtypes == empty.dtypes).all()
    assert full["t"].tolist() == [*LINE.t, *LINE.t]
    assert full.index.tolist() == list(range(2 * len(LINE.t)))


def test_the_name_of_a_value_has_the_quantity_of_a_drift():
    assert Value(Measure.DRIFT_MAX, 1.0, "energy").key == "energy drift max"
    assert [(blank.key, blank.value == blank.value) for blank in blanks(Measure.ORDER, Measure.TIME)] == [
        ("observed order", False),
        ("time per simulated second", False),
    ]
