import math

import numpy as np
import pytest

from conservative.benchmarks.measures.measurement import COLUMNS, Measurement, frame

ROW = Measurement(
    "paper", "brick_flip", "reduced", "conservative==1/reduced", "ours", 0.01, "energy drift max", 1e-15, "1", "ok"
)
NUMBERS = ["dt", "value"]


def test_columns_and_their_types_do_not_depend_on_the_rows():
    full, empty = frame([ROW, ROW]), frame([])
    assert list(full.columns) == list(empty.columns) == list(COLUMNS)
    assert (full.dtypes == empty.dtypes).all()
    assert {name for name in COLUMNS if full[name].dtype == np.float64} == set(NUMBERS)
    assert len(full) == 2
    assert len(empty) == 0


def test_a_row_survives_the_table():
    found = frame([ROW]).iloc[0].to_dict()
    assert found == {name: getattr(ROW, name) for name in COLUMNS}
    assert found["detail"] == ""


def test_a_value_that_was_not_measured_is_nan():
    failed = Measurement(*[getattr(ROW, name) for name in COLUMNS[:7]], math.nan, "1", "missing")
    assert math.isnan(frame([failed])["value"][0])


def test_rows_are_frozen():
    with pytest.raises(AttributeError):
        ROW.value = 2.0
