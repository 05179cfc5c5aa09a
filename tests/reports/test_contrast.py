"""Colours of lines can be seen on the page, light or dark."""

import pytest

from conservative.reports.charts.contrast import DARK_PAPER, LEAST, LIGHT_PAPER, colours_in, contrast, stand_ins
from conservative.reports.charts.style import _OTHERS, PALETTE

COLOURS = (*PALETTE.values(), *_OTHERS)


def test_contrast_is_that_of_the_guidelines():
    assert contrast("#000000", "#FFFFFF") == pytest.approx(21)
    assert contrast("#777777", "#FFFFFF") == pytest.approx(
        4.48, abs=0.01
    )  # the guidelines' own example of what is just too low
    assert contrast("#661100", DARK_PAPER) == pytest.approx(1.41, abs=0.03)  # why there are stand-ins


@pytest.mark.parametrize("paper", [LIGHT_PAPER, DARK_PAPER])
def test_every_colour_of_a_line_is_seen(paper):
    found = stand_ins(COLOURS, paper)
    assert found
    assert min(contrast(found.get(colour, colour), paper) for colour in COLOURS) >= LEAST
    assert all(contrast(colour, paper) < LEAST for colour in found)


def test_colours_are_found_in_a_text():
    assert colours_in('{"color": "#0072b2", "x": "#12345", "id": "#1234567"}') == {"#0072B2"}
