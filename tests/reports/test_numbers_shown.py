"""Numbers as tables show them."""

import pytest

from conservative.reports.tables.cells import number


@pytest.mark.parametrize("value", [0.25, 12.0, 0.01, 3.1e-7, 5e4])
def test_a_number_below_nothing_is_shown_as_its_size_is(value):
    assert number(-value, 3) == "-" + number(value, 3)
