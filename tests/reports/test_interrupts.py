"""What a signal becomes where a process handles its signals itself, as in a notebook; for commands see test_supervision.py."""

import signal

import pytest
from click.testing import CliRunner

from conservative.reports.cli.main import main
from conservative.reports.terminal.interrupts import Terminated, interruptible, unstoppable


@pytest.mark.parametrize(("stop", "code"), [(KeyboardInterrupt, 130), (Terminated, 143)])
def test_every_command_says_that_it_was_interrupted(stop, code, monkeypatch):
    def stopping(*arguments):
        raise stop

    monkeypatch.setattr("conservative.reports.cli.recommend._answer", stopping)
    done = CliRunner().invoke(main, ["recommend", "brick_flip"])
    assert (done.exit_code, done.stdout, done.stderr) == (code, "", "Interrupted\n")


def test_sigterm_is_an_interrupt_only_inside():
    before = signal.getsignal(signal.SIGTERM)
    with pytest.raises(Terminated), interruptible(signal.SIGTERM):
        signal.raise_signal(signal.SIGTERM)
    assert signal.getsignal(signal.SIGTERM) == before


def lost(number):
    try:
        signal.raise_signal(number)
    except BaseException as error:
        other = SystemError("what numba makes of it while it loads compiled code")
        other.add_note("kept")
        raise other from error


@pytest.mark.parametrize(("number", "kind"), [(signal.SIGINT, KeyboardInterrupt), (signal.SIGTERM, Terminated)])
def test_an_interrupt_is_not_lost_in_another_exception(number, kind):
    with pytest.raises(kind) as caught, interruptible(number):
        lost(number)
    assert caught.value.__notes__ == ["kept"]


def test_what_is_ignored_stays_ignored():
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with interruptible(signal.SIGINT):
            signal.raise_signal(signal.SIGINT)
    finally:
        signal.signal(signal.SIGINT, before)


def test_interrupts_wait_outside_of_what_belongs_together():
    with unstoppable():
        signal.raise_signal(signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
