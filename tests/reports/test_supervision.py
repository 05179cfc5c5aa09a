"""A command and the process that waits for it: tried with real signals, at moments when Python could not handle them."""

import os
import pty
import select
import signal
import subprocess
import sys
import time

import psutil
import pytest

from conservative.benchmarks.verification import interrupts
from conservative.benchmarks.verification.processes import COMMAND, temporaries
from conservative.reports.terminal.supervision import SharedStatus

from ..environments import ROOT, variables

HANG = 120
"""Time, s, after which a process hangs for sure."""
SUPERVISED = """
import os, signal, sys, time
from pathlib import Path
from conservative.files import remove_leftovers
from conservative.reports.terminal.supervision import list_places, supervise, tell
supervise(lambda place: remove_leftovers(Path(place)))
assert list_places()
"""
WORK = {
    "a loop in C": "print('at work', flush=True); sum(range(10**14))",
    "an import": "open('slow.py', 'w').write('import time; print(\"at work\", flush=True); time.sleep(600)'); "
    "sys.path.insert(0, '.'); import slow",
    "an except that takes everything": "print('at work', flush=True)\n"
    "while True:\n    try: time.sleep(600)\n    except BaseException: pass",
    "what it has started": "import subprocess; subprocess.run(['sh', '-c', 'echo at work; sleep 600'])",
    "its end": "import atexit; atexit.register(time.sleep, 600); print('at work', flush=True)",
}


def started(code, folder, **options):
    """Return a supervised process that is at work, and the end of a pipe that says when all of it is gone."""
    alive, theirs = os.pipe()
    process = subprocess.Popen(
        [sys.executable, "-c", SUPERVISED + code],
        cwd=folder,
        env=variables(PYTHONPATH=str(ROOT)),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        pass_fds=(theirs,),
        **options,
    )
    os.close(theirs)
    assert process.stdout.readline() == "at work\n"
    return process, alive


def ended(process, alive):
    """Return the exit code and what was said, once the process and all that it started are gone."""
    _, err = process.communicate(timeout=HANG)
    assert select.select([alive], [], [], HANG)[0]
    assert os.read(alive, 1) == b""
    os.close(alive)
    return process.returncode, err


@pytest.mark.parametrize("closed", ["2>&-", "1>&- 2>&-", "0<&- 1>&- 2>&-"])
def test_a_command_whose_streams_are_closed_ends_as_any_other(closed, tmp_path):
    shell = ["sh", "-c", f'exec "$0" -c "$1" run nonsense {closed}', sys.executable, COMMAND]
    assert subprocess.run(shell, cwd=tmp_path, env=variables(PYTHONPATH=str(ROOT)), timeout=HANG).returncode == 2


@pytest.mark.parametrize("work", WORK)
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_ends_a_command_in_the_middle_of_anything(number, code, work, tmp_path):
    process, alive = started(WORK[work], tmp_path)
    os.killpg(process.pid, number)
    assert ended(process, alive) == (code, "Interrupted\n")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_work_in_a_process_of_its_own_ends_with_its_command(number, tmp_path):
    code = (
        "from conservative.references.worker import run_within\nprint('at work', flush=True)\n"
        "print(run_within(60, os.getpid), flush=True)\nrun_within(600, lambda: [None for _ in iter(int, 1)])"
    )
    process, alive = started(code, tmp_path)
    worker = psutil.Process(int(process.stdout.readline()))
    time.sleep(1.0)
    process.send_signal(number)
    ended(process, alive)
    assert psutil.wait_procs([worker], timeout=HANG)[0] == [worker]


def test_what_is_kept_is_said_and_what_was_being_written_goes(tmp_path):
    writing = (
        "from conservative.files import text_file\ntell('one thing is kept')\n"
        "with text_file(Path('run.csv'), 'csv') as stream: stream.write('half'); print('at work', flush=True); time.sleep(600)"
    )
    process, alive = started(writing, tmp_path)
    assert len(temporaries(tmp_path)) == 1
    process.send_signal(signal.SIGINT)
    assert ended(process, alive) == (130, "Interrupted; one thing is kept\n")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGHUP, signal.SIGQUIT])
def test_nothing_outlives_the_process_that_waits(number, tmp_path):
    process, alive = started(WORK["a loop in C"], tmp_path)
    process.send_signal(number)
    assert ended(process, alive) == (-number, "")


@pytest.mark.parametrize("number", [signal.SIGSEGV, signal.SIGKILL])
def test_a_crash_is_passed_on_and_says_what_is_kept(number, tmp_path):
    crash = f"tell('all is kept'); print('at work', flush=True); os.kill(os.getpid(), {int(number)})"
    assert ended(*started(crash, tmp_path)) == (-number, f"Ended by {number.name}; all is kept\n")


@pytest.mark.parametrize("code", [0, 1, 2, 77])
def test_an_exit_code_is_passed_on(code, tmp_path):
    assert ended(*started(f"print('at work', flush=True); sys.exit({code})", tmp_path)) == (code, "")


def test_what_is_ignored_stays_ignored(tmp_path):
    def ignore():
        signal.signal(signal.SIGINT, signal.SIG_IGN)

    process, alive = started("print('at work', flush=True); time.sleep(0.5)", tmp_path, preexec_fn=ignore)
    process.send_signal(signal.SIGINT)
    assert ended(process, alive) == (0, "")


def stopped(pid):
    return os.waitid(os.P_PID, pid, os.WSTOPPED | os.WNOHANG | os.WNOWAIT) is not None


def test_a_pause_holds_until_it_is_continued(tmp_path):
    process, alive = started("for k in range(10**9): print('at work', flush=True); time.sleep(0.01)", tmp_path)
    process.send_signal(signal.SIGTSTP)
    end = time.monotonic() + HANG
    while not stopped(process.pid) and time.monotonic() < end:
        time.sleep(0.01)
    assert stopped(process.pid)
    while select.select([process.stdout], [], [], 0.5)[0]:
        os.read(process.stdout.fileno(), 1 << 16)  # what was written before it paused
    process.send_signal(signal.SIGCONT)
    assert select.select([process.stdout], [], [], HANG)[0]
    process.send_signal(signal.SIGTERM)
    assert ended(process, alive)[0] == 143


def test_a_terminal_gets_its_line_and_its_cursor_back():
    ours, theirs = pty.openpty()
    bar = (
        "\nfrom conservative.reports.terminal.progress import progress"
        "\nwith progress() as step:\n    step(0.5, 'at work'); time.sleep(600)"
    )
    environment = variables(PYTHONPATH=str(ROOT), TERM="xterm-256color")
    process = subprocess.Popen(
        [sys.executable, "-c", SUPERVISED + bar], stderr=theirs, stdout=theirs, env=environment, start_new_session=True
    )
    os.close(theirs)
    found = b""
    while b"at work" not in found:
        found += os.read(ours, 4096)
    os.killpg(process.pid, signal.SIGINT)
    while (more := read(ours)) != b"":
        found += more
    os.close(ours)
    assert process.wait(HANG) == 130
    assert found.endswith(b"\r\x1b[2K\x1b[?25hInterrupted\r\n")


def read(terminal):
    """Return what is on a terminal, nothing when nobody has it open any more."""
    try:
        return os.read(terminal, 4096)
    except OSError:  # what Linux says then
        return b""


def test_a_board_has_the_last_words_whole_or_none():
    status = SharedStatus()
    assert status.read() == ("", [])
    status.tell("kept")
    status.list_places(["/a b", "/c"])
    assert status.read() == ("kept", ["/a b", "/c"])
    status.tell("")
    status.list_places([])
    assert status.read() == ("", [])
    status.tell("x" * 10**6)
    assert status.read() == ("", [])


@pytest.mark.parametrize("moment", [0.3, 1.0, 2.5])
@pytest.mark.parametrize("command", [interrupts.COMMANDS[0], interrupts.COMMANDS[1]], ids=["run", "report"])
def test_ctrl_c_at_any_moment(command, moment):
    found = interrupts.attempt(command, moment)
    assert found is None or list(found.complaints) == []


@pytest.mark.parametrize(
    ("ended", "left", "expected"),
    [
        ((130, "", "Interrupted\n", 0.1, False), [], []),
        ((-2, "", "Traceback", 0.1, False), [], []),
        ((-2, "", 'Traceback\n  File "/x/reports/cli/main.py"', 0.1, False), [], ["exit code -2", "said"]),
        ((0, "", "", 0.1, False), [], ["exit code 0", "said ''"]),
        ((130, "", "Interrupted\nException ignored in x\n", 0.1, False), [], ["said"]),
        ((130, "", "Interrupted\n", 0.1, True), [".a-0123456789ab"], ["processes went on", "left .a-0123456789ab"]),
    ],
)
def test_the_attack_sees_what_leaks(ended, left, expected):
    found = list(interrupts.Try(("list",), 1.0, interrupts.Ended(*ended), left).complaints)
    assert len(found) == len(expected)
    assert all(complaint.startswith(words) for complaint, words in zip(found, expected, strict=True))


@pytest.mark.parametrize(
    ("ended", "expected"),
    [((0, "all", "", 0.1, False), True), ((0, "all", "", 0.6, False), False), ((130, "", "Interrupted\n", 0.1, False), False)],
)
def test_the_attack_knows_what_ended_by_itself_from_what_lost_a_signal(ended, expected):
    assert interrupts.came_too_late(interrupts.Ended(*ended)) == expected
