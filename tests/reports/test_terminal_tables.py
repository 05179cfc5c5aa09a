"""Tables on terminals of any width."""

import pytest

from conservative.reports.terminal.tables import TerminalTable, fit_columns, print_tables

HEADER = ("method", "outcome", "drift of energy", "attitude error, rad")
ROWS = [("projected:order=4", "ok", "1.1e-16", "2.3e-9"), ("pinocchio", "unsupported: no gravity", "–", "–")]


@pytest.mark.parametrize("width", [12, 30, 40, 50, 60, 80, 200])
def test_no_word_is_broken_and_no_line_too_long(width, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", str(width))
    print_tables([TerminalTable("Runs", HEADER, ROWS)])
    lines = capsys.readouterr().out.splitlines()
    shown = len(fit_columns([HEADER, *ROWS], width))
    words = [word for row in (HEADER, *ROWS) for cell in row[:shown] for word in cell.split()]
    if width >= 30:
        assert max(map(len, lines)) <= width
        assert all(any(word in line for line in lines) for word in words)
    assert shown == {12: 1, 30: 1, 40: 2, 50: 3, 60: 4}.get(width, 4)


def test_a_wide_terminal_shows_every_cell_in_a_line():
    assert fit_columns([HEADER, *ROWS], 200) == [17, 23, 15, 19]
