"""The table of mistakes and where they are named: a row for each, and cells as verifications of planted mistakes say."""

import re

import pytest

from conservative.benchmarks.verification.mistakes import BY_KEY
from conservative.reports.documentation import mistakes

ROWS = mistakes.read_rows()
REASONS = {
    *mistakes.UNSEEN.values(), mistakes.OF_LOADERS, mistakes.NO_MOTION, mistakes.NO_CLOCK, mistakes.OF_RECORDERS,
    mistakes.ALL_DIGITS, mistakes.OF_FILES, mistakes.OF_PAIRS, "it does not change the rates",
    "no exact motion shows it", "rates of a body in a field do not determine its motion",
}  # fmt: skip
QUICK = ("transposed",)


def test_the_table_has_a_row_for_each_mistake_of_the_catalogue_and_a_cell_for_each_door():
    assert list(ROWS) == list(BY_KEY)
    assert {tuple(row) for row in ROWS.values()} == {mistakes.COLUMNS}
    answers = {mistakes.NAMED, mistakes.WITH_OTHERS, mistakes.NOT_NAMED, mistakes.NOT_MEASURED, "right", "undecided"} | REASONS
    other = {row[door] for row in ROWS.values() for door in mistakes.DOORS} - answers
    assert {key for cell in other for key in re.fullmatch(r"as (.*)", cell)[1].split(" + ")} <= set(BY_KEY)


def test_test_files_name_what_the_table_says():
    found = {key: row["test files"] for key, row in ROWS.items() if row["test files"] != mistakes.NOT_MEASURED}
    assert found == {key: mistakes.in_test_files(key) for key in found}


@pytest.mark.parametrize("key", [pytest.param(key, marks=[pytest.mark.attack] * (key not in QUICK)) for key in BY_KEY])
def test_a_planted_mistake_is_named_in_a_recording_as_the_table_says(key):
    for door, attitudes in (("recording", True), (mistakes.RATES, False)):
        if ROWS[key][door] != mistakes.NOT_MEASURED:
            assert mistakes.in_recording(key, attitudes) == ROWS[key][door]


@pytest.mark.attack
@pytest.mark.parametrize("key", BY_KEY)
def test_a_planted_mistake_is_named_in_a_program_as_the_table_says(key):
    if ROWS[key]["program, engine or gate"] == mistakes.NOT_MEASURED:
        pytest.skip("not measured")
    assert mistakes.in_program(key) == ROWS[key]["program, engine or gate"]


def test_the_table_is_written_as_it_is_read(tmp_path, monkeypatch):
    text = mistakes.FILE.read_text(encoding="utf-8")
    monkeypatch.setattr(mistakes, "FILE", tmp_path / "mistakes.csv")
    mistakes.write_rows(ROWS)
    assert mistakes.FILE.read_text(encoding="utf-8") == text
