"""Progress and tables on terminals of any width."""

import os
import pty
import re
import subprocess
import sys
from select import select

import pytest

from conservative.reports.cli.launch import show_warning
from conservative.reports.document.model import Table
from conservative.reports.document.terminal import fit_columns, print_table
from conservative.reports.terminal import progress

from ..environments import PATIENCE, programs

STEPS = """
import sys
from itertools import count
from select import select
from conservative.reports.terminal.progress import progress
with progress() as step:
    for k in count(1):
        step(0.9 * k / (k + 1), "a study: a scene, with a long name")
        if select([sys.stdin], [], [], 0.05)[0]: break
"""
WAITING = """
import sys
from conservative.reports.terminal import progress
progress.DELAY = 0.1
with progress.show_waiting("a scene: a method"):
    sys.stdin.read()
"""
QUICK = WAITING.replace("DELAY = 0.1", "DELAY = 1e6")


def on_a_terminal(code, shown="", columns=80):
    """Return the output of a program on a terminal of that width, whose input is closed once it shows a pattern."""
    ours, theirs = pty.openpty()
    environment, found = {**os.environ, "COLUMNS": str(columns), "TERM": "xterm-256color"}, ""
    with programs() as start:
        process = start([sys.executable, "-c", code], stdin=subprocess.PIPE, stderr=theirs, stdout=theirs, env=environment)
        os.close(theirs)
        read = b""
        while True:
            if re.search(shown, found):
                process.stdin.close()
            assert select([ours], [], [], PATIENCE)[0], found
            try:
                part = os.read(ours, 4096)
            except OSError:  # what Linux says when the other end is closed
                break
            if not part:
                break
            read += part
            found = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", read.decode(errors="replace"))
        os.close(ours)
        assert process.wait(PATIENCE) == 0
    return found


@pytest.mark.parametrize("columns", [50, 140])
def test_a_terminal_shows_share_time_spent_and_time_left(columns):
    times = r" \d\d% \d:\d\d:\d\d left \d:\d\d:\d\d a study"
    lines = re.split(r"[\r\n]+", on_a_terminal(STEPS, times, columns))
    assert any(re.search(times, line) for line in lines), lines
    assert max(map(len, lines)) <= columns - len("^C")  # or the terminal's ^C breaks the line, which then stays


def test_a_single_piece_of_work_that_takes_long_is_shown():
    time = r"\d:\d\d:\d[1-9] .* a scene: a method"
    assert re.search(time, on_a_terminal(WAITING, time))


def test_fast_work_shows_nothing():
    assert on_a_terminal(QUICK).strip() == ""


def test_elsewhere_there_is_nothing(capsys):
    with progress.progress() as step:
        step(0.5, "a study")
    with progress.show_waiting("a scene"):
        pass
    assert capsys.readouterr() == ("", "")


HEADER = ("method", "outcome", "drift of energy", "attitude error, rad")
ROWS = [("projected:order=4", "ok", "1.1e-16", "2.3e-9"), ("pinocchio", "unsupported: no gravity", "–", "–")]


@pytest.mark.parametrize("width", [12, 30, 40, 50, 60, 80, 200])
def test_no_word_is_broken_and_no_line_too_long(width, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", str(width))
    print_table(Table(HEADER, ROWS, "Runs"))
    lines = capsys.readouterr().out.splitlines()
    shown = len(fit_columns([HEADER, *ROWS], width))
    words = [word for row in (HEADER, *ROWS) for cell in row[:shown] for word in cell.split()]
    if width >= 30:
        assert max(map(len, lines)) <= width
        assert all(any(word in line for line in lines) for word in words)
    assert shown == {12: 1, 30: 1, 40: 2, 50: 3, 60: 4}.get(width, 4)


def test_a_wide_terminal_shows_every_cell_in_a_line():
    assert fit_columns([HEADER, *ROWS], 200) == [17, 23, 15, 19]


def test_a_table_in_a_log_of_continuous_integration_has_at_most_100_columns(monkeypatch, capsys):
    monkeypatch.delenv("COLUMNS", raising=False)
    monkeypatch.setenv("CI", "true")
    print_table(Table([f"a column {i}" for i in range(30)], [["some words"] * 30]))
    assert 80 < max(len(line.rstrip()) for line in capsys.readouterr().out.splitlines()) <= 100


def test_a_warning_of_several_methods_is_one_line(capsys):
    for text in ("steps do not resolve it", "steps do not resolve it", "another one"):
        show_warning(UserWarning(text), UserWarning, "file.py", 1)
    assert capsys.readouterr().err == "Warning: steps do not resolve it\nWarning: another one\n"
