"""The page on mistakes and where they are named: a row for each mistake, and cells as verifications of planted mistakes say."""

import re

import pytest

from conservative.benchmarks.verification.mistakes import BY_KEY
from conservative.reports.documentation import mistakes

PAGE = mistakes.read_rows(mistakes.PAGE.read_text(encoding="utf-8"))
REASONS = {
    *mistakes.UNSEEN.values(), mistakes.OF_LOADERS, mistakes.NO_MOTION, mistakes.NO_CLOCK, "it does not change the rates",
    "no exact motion shows it", "rates of a body in a field do not determine its motion",
}  # fmt: skip
QUICK = ("transposed",)


def test_the_page_has_a_row_for_each_mistake_of_the_catalogue_and_a_cell_for_each_door():
    assert list(PAGE) == list(BY_KEY)
    assert {len(row) for row in PAGE.values()} == {1 + len(mistakes.DOORS)}
    answers = {mistakes.NAMED, mistakes.WITH_OTHERS, mistakes.NOT_NAMED, mistakes.NOT_MEASURED, "right", "undecided"} | REASONS
    other = {cell for row in PAGE.values() for cell in row[1:]} - answers
    assert {key for cell in other for key in re.fullmatch(r"as `(.*)`", cell)[1].split(" + ")} <= set(BY_KEY)


def test_test_files_name_what_the_page_says():
    found = {key: row[4] for key, row in PAGE.items() if row[4] != mistakes.NOT_MEASURED}
    assert found == {key: mistakes.in_test_files(key) for key in found}


@pytest.mark.parametrize("key", [pytest.param(key, marks=[pytest.mark.attack] * (key not in QUICK)) for key in BY_KEY])
def test_a_planted_mistake_is_named_in_a_recording_as_the_page_says(key):
    for cell, attitudes in zip(PAGE[key][1:3], (True, False), strict=True):
        if cell != mistakes.NOT_MEASURED:
            assert mistakes.in_recording(key, attitudes) == cell


@pytest.mark.attack
@pytest.mark.parametrize("key", BY_KEY)
def test_a_planted_mistake_is_named_in_a_program_as_the_page_says(key):
    if PAGE[key][3] == mistakes.NOT_MEASURED:
        pytest.skip("not measured")
    assert mistakes.in_program(key) == PAGE[key][3]


def test_the_page_is_written_as_it_is_read():
    text = mistakes.PAGE.read_text(encoding="utf-8")
    assert mistakes.render(mistakes.read_rows(text), text) == text
