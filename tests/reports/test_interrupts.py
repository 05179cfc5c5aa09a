"""What a signal becomes where a process handles its signals itself, as in a notebook; for commands see test_supervision.py."""

import signal
import sys
import time
import weakref

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


class Name:
    pass


def test_an_interrupt_is_not_lost_where_no_exception_can_be_raised():
    name = Name()
    kept = weakref.ref(name, lambda gone: signal.raise_signal(signal.SIGINT))  # an import has such a callback for its lock

    def work(names):
        names.pop()
        for _ in range(600):
            time.sleep(0.1)
            assert kept() is None

    names = [name]
    del name
    with pytest.raises(KeyboardInterrupt), interruptible(signal.SIGINT):
        work(names)


def test_what_others_ignore_is_told_as_before(monkeypatch):
    told = []
    monkeypatch.setattr(sys, "unraisablehook", lambda what: told.append(what.exc_value))
    name, error = Name(), ZeroDivisionError()

    def fail(gone):
        raise error

    kept = weakref.ref(name, fail)
    with interruptible(signal.SIGINT):
        del name
    assert kept() is None
    assert told == [error]


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
