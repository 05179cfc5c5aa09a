"""Signals end commands: nothing half-written and no process is left, and the exit code tells which signal it was."""

import gc
import json
import os
import signal
import subprocess
import sys
import time
import weakref

import psutil
import pytest
from click.testing import CliRunner
from llvmlite import binding
from llvmlite.binding import ffi

from conservative.posix import unstoppable
from conservative.reports.cli.main import main
from conservative.reports.terminal import interrupts
from conservative.reports.terminal.interrupts import Interrupted, handle_signals

from ..environments import PATIENCE, ROOT, programs, variables, wait_until
from ..sampling import sampled

CLI = [sys.executable, "-m", "conservative"]
SWEEP = ["sweep", "brick_flip", "--spread", "rate=1%", "--starts", "1e5", "--t-end", "600", "--dt", "1e-3", "--out", "s.zarr"]
COMMANDS = {
    "run": ["run", "brick_flip", "--t-end", "1e6", "--dt", "1e-4", "-m", "reduced", "--csv", "r.csv"],
    "sweep": SWEEP,
    "watch": ["watch", "brick_flip", "--t-end", "2e5", "--dt", "1e-3", "-m", "reduced,taylor", "--out", "w.html"],
    "watch.gif": ["watch", "brick_flip", "--t-end", "100", "--dt", "1e-3", "-m", "reduced", "--out", "w.gif"],
    "report": ["report", "--quick", "--scenes", "brick_flip", "--methods", "moser_veselov:order=2", "--out", "r"],
}


def start(popen, arguments, folder, code=None):
    """Return a command that is at work: it has made a temporary file or folder."""
    process = popen(
        [sys.executable, "-c", code] if code else [*CLI, *arguments],
        cwd=folder,
        env=variables(PYTHONPATH=str(ROOT)),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    wait_until(lambda: temporaries(folder) or process.poll() is not None)
    time.sleep(0.2)  # s, so that it is usually further on; a signal that comes earlier has to end it as well
    return process


def temporaries(folder):
    return [path.name for path in folder.iterdir() if path.name.startswith(".")]


@pytest.mark.parametrize(
    ("command", "number"),
    [
        ("run", signal.SIGTERM),
        pytest.param("run", signal.SIGINT, marks=pytest.mark.slow),
        pytest.param("run", signal.SIGHUP, marks=pytest.mark.slow),
        pytest.param("watch", signal.SIGINT, marks=pytest.mark.slow),
        pytest.param("watch.gif", signal.SIGINT, marks=pytest.mark.slow),
        pytest.param("sweep", signal.SIGINT, marks=pytest.mark.slow),
        pytest.param("report", signal.SIGTERM, marks=pytest.mark.slow),
    ],
)
def test_a_signal_ends_a_command_and_leaves_nothing(command, number, tmp_path):
    with programs() as popen:
        process = start(popen, COMMANDS[command], tmp_path)
        children = psutil.Process(process.pid).children(recursive=True)
        process.send_signal(number)
        out, err = process.communicate(timeout=PATIENCE)
        assert psutil.wait_procs(children, timeout=PATIENCE)[1] == []
    assert (process.returncode, out) == (128 + number, "")
    assert err.splitlines()[-1].startswith("Interrupted")
    assert "Traceback" not in err
    assert temporaries(tmp_path) == []
    assert not any((tmp_path / name).exists() for name in ("r", "r.csv", "s.svg", "w.html", "w.gif"))


def test_a_second_ctrl_c_ends_at_once(tmp_path):
    code = (
        "import time, pathlib\nfrom conservative.reports.terminal.interrupts import handle_signals\nhandle_signals()\n"
        "try: pathlib.Path('.busy').touch(), time.sleep(600)\nexcept KeyboardInterrupt:\n"
        "    pathlib.Path('tidying').touch()\n    time.sleep(600)"
    )
    with programs() as popen:
        process = start(popen, [], tmp_path, code)
        for name in (".busy", "tidying"):
            wait_until(lambda name=name: (tmp_path / name).exists() or process.poll() is not None)
            process.send_signal(signal.SIGTERM)  # the second one of these is ignored
            time.sleep(0.1)
        assert process.poll() is None
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=PATIENCE)
    assert process.returncode == -signal.SIGINT


def test_work_in_another_process_ends_with_its_command(tmp_path):
    code = (
        "import os, pathlib\nfrom conservative.references.worker.calls import run_within\n"
        "pathlib.Path('pid').write_text(str(run_within(1800, os.getpid)))\n"
        "run_within(600, lambda: (pathlib.Path('.busy').touch(), [None for _ in iter(int, 1)]))"
    )
    with programs() as popen:
        process = start(popen, [], tmp_path, code)
        worker = psutil.Process(int((tmp_path / "pid").read_text()))
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=PATIENCE)
        assert psutil.wait_procs([worker], timeout=PATIENCE)[1] == []


@pytest.mark.parametrize("closed", sampled(["2>&-", "1>&- 2>&-", "0<&- 1>&- 2>&-"], 1, ["0<&- 1>&- 2>&-"]))
def test_a_command_with_closed_streams_ends_normally(closed, tmp_path):
    shell = ["sh", "-c", f'exec "$0" -m conservative run nonsense {closed}', sys.executable]
    assert subprocess.run(shell, cwd=tmp_path, env=variables(PYTHONPATH=str(ROOT)), timeout=PATIENCE).returncode == 2


@pytest.fixture
def handled():
    """Signals that are handled as in a command."""
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    hook = sys.unraisablehook
    handle_signals()
    yield
    for number, handler in before.items():
        signal.signal(number, handler)
    sys.unraisablehook = hook
    interrupts.received.clear()


def lost(*arguments):
    try:
        signal.raise_signal(signal.SIGTERM)
    except BaseException as error:
        other = SystemError("what numba raises where it is interrupted while it loads compiled code")
        other.add_note("kept")
        raise other from error


def test_an_interrupt_is_not_lost_in_another_exception(handled, monkeypatch):
    monkeypatch.setattr("conservative.reports.sections.catalogue.scenes", lost)
    done = CliRunner().invoke(main, ["list"])
    assert (done.exit_code, done.stdout, done.stderr) == (143, "", "Interrupted; kept\n")


class Name:
    pass


def test_an_interrupt_is_not_lost_where_no_exception_can_be_raised(handled):
    name = Name()
    kept = weakref.ref(name, lambda gone: signal.raise_signal(signal.SIGINT))  # an import has such a callback for its lock

    def work(names):
        names.pop()
        for _ in range(600):
            time.sleep(0.1)
            assert kept() is None

    names = [name]
    del name
    with pytest.raises(Interrupted):
        work(names)


def test_what_llvm_has_freed_is_not_freed_again_after_an_interrupt(handled, monkeypatch):
    freed, library = [], ffi.lib

    def free(string):
        freed.append(string)
        if len(freed) == 1:
            signal.raise_signal(signal.SIGINT)

    class Library:
        def __getattr__(self, name):
            return free if name == "LLVMPY_DisposeString" else getattr(library, name)

    monkeypatch.setattr(ffi, "lib", Library())
    with pytest.raises(Interrupted):
        [binding.get_default_triple(), time.sleep(60)]
    interrupts.received.clear()  # the exception has the string in its traceback
    gc.collect()
    assert len(freed) == 1


def test_an_ignored_signal_stays_ignored():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        handle_signals()
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    finally:
        for number, handler in {signal.SIGHUP: before, **handlers}.items():
            signal.signal(number, handler)
        sys.unraisablehook = sys.__unraisablehook__


def test_a_signal_waits_until_the_end_of_a_protected_block(handled):
    done = []

    def rename():
        with unstoppable():
            os.kill(os.getpid(), signal.SIGINT)
            done.append("first")
            done.append("second")

    with pytest.raises(Interrupted):
        rename()
    assert done == ["first", "second"]


def test_output_of_compiled_code_does_not_damage_json():
    code = (
        "import os\nfrom conservative.reports.sections import catalogue\nbefore = catalogue.build\n"
        "def noisy():\n    os.write(1, b'a log of an engine')\n    return before()\ncatalogue.build = noisy\n"
        "import sys; sys.argv = ['conservative', 'list', '--json']\n"
        "from conservative.reports.cli.launch import launch\nlaunch()"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], env=variables(PYTHONPATH=str(ROOT)), capture_output=True, timeout=PATIENCE
    )
    assert json.loads(done.stdout)["scenes"]
    assert b"a log of an engine" in done.stderr


SIGNS = """
import sys
from conservative.reports.sections import catalogue
from conservative.reports.document.model import Document, Table
catalogue.build = lambda: Document("", "", [Table(("µs", "done"), [("1", "✓")], "times")])
sys.argv = ["conservative", "list"]
from conservative.reports.cli.launch import launch
launch()
"""


@pytest.mark.parametrize(("encoding", "sign"), [("latin-1", b"\\u2713"), ("utf-8", "✓".encode())])
def test_an_encoding_without_our_signs_is_no_error(encoding, sign):
    environment = variables(PYTHONPATH=str(ROOT), PYTHONIOENCODING=encoding)
    done = subprocess.run([sys.executable, "-c", SIGNS], env=environment, capture_output=True, timeout=PATIENCE)
    assert (done.returncode, done.stderr) == (0, b"")
    assert sign in done.stdout
