"""A system that is neither Linux nor macOS, as far as Python can be told: put this folder first on PYTHONPATH.

What is missing or refused: modules and functions of POSIX, its signals, /proc, opened folders, links, `Popen` with options of
POSIX, and, as on Windows, to rename or remove an open file or a folder with one. Modules of the standard library that need what
is missing are imported before. Python processes that start from here are on the same system.
"""

import asyncio  # noqa: F401
import builtins
import ctypes  # noqa: F401
import errno
import io
import multiprocessing.connection  # noqa: F401
import os
import select
import shutil  # noqa: F401
import signal
import subprocess
import sys
import tempfile  # noqa: F401
import uuid  # noqa: F401
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

for name in ("psutil", "platformdirs"):  # they have a part for each system, and none for an unknown one
    if find_spec(name):
        import_module(f"{name}.unix" if name == "platformdirs" else name)

MODULES = ("fcntl", "grp", "posix", "pty", "pwd", "resource", "syslog", "termios", "tty")
FUNCTIONS = (
    "chown chroot confstr ctermid eventfd fchmod fchown fork forkpty getegid geteuid getgid getgrouplist getgroups "
    "getloadavg getpgid getpgrp getpriority getresgid getresuid getsid getuid initgroups killpg lchown lockf "
    "memfd_create mkfifo mknod nice openpty pathconf pidfd_open posix_fadvise posix_spawn posix_spawnp pread preadv "
    "pwrite pwritev register_at_fork sched_getaffinity sched_setaffinity sendfile set_blocking setegid seteuid "
    "setgid setgroups setpgid setpriority setsid setuid statvfs sync sysconf tcgetpgrp tcsetpgrp ttyname uname "
    "unshare wait wait3 wait4 waitid O_NOFOLLOW O_ASYNC O_NONBLOCK O_DIRECTORY O_CLOEXEC "
).split()
KEPT = {"SIGINT", "SIGTERM", "SIGABRT", "SIGFPE", "SIGILL", "SIGSEGV"}
OPTIONS = ("pass_fds", "start_new_session", "process_group", "preexec_fn", "umask", "user", "group", "extra_groups")
kill_number = signal.SIGKILL

for name in MODULES:
    sys.modules[name] = None  # an import raises ImportError
for module, names in ((os, FUNCTIONS), (select, ("poll", "epoll", "PIPE_BUF"))):
    for name in names:
        if hasattr(module, name):
            delattr(module, name)
for name in [name for name in dir(signal) if name.startswith("SIG") and name[3:].isalnum() and name not in KEPT]:
    delattr(signal, name)
for name in ("alarm", "setitimer", "getitimer", "pthread_kill", "pthread_sigmask", "sigwait", "siginterrupt", "sigpending"):
    delattr(signal, name)

real = {
    name: getattr(os, name) for name in ("open", "stat", "lstat", "listdir", "scandir", "readlink", "access", "kill", "fstat")
}


def is_hidden(path):
    return isinstance(path, (str, os.PathLike)) and os.fspath(path).split("/")[:2] == ["", "proc"]


def hide(function):
    def hidden(path=".", *arguments, **options):
        if is_hidden(path):
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path))
        return function(path, *arguments, **options)

    return hidden


def is_open(path):
    """Return whether this process has opened a file, or a file of a folder."""
    place = os.path.realpath(path)
    for number in real["listdir"]("/proc/self/fd"):
        try:
            target = real["readlink"](f"/proc/self/fd/{number}")
        except OSError:
            continue
        if target == place or target.startswith(f"{place}/"):
            return True
    return False


def keep_open_files(function, replaces=True):
    def checked(path, *arguments, **options):
        ours = sys._getframe(1).f_globals.get("__name__") != "tempfile"  # which has another way on Windows
        if ours and isinstance(path, (str, os.PathLike)) and not os.path.islink(path):
            if is_open(path):
                raise PermissionError(errno.EACCES, "the file is open", str(path))
            if not replaces and os.path.exists(arguments[0]):
                raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(arguments[0]))
        return function(path, *arguments, **options)

    return checked


def open_file(path, *arguments, **options):
    if is_hidden(path):
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path))
    if isinstance(path, (str, os.PathLike)) and os.path.isdir(path):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))
    return real["open"](path, *arguments, **options)


def refuse(*arguments, **options):
    raise OSError(errno.EPERM, os.strerror(errno.EPERM))


def kill(process, number):
    if number in (signal.SIGINT, signal.SIGTERM) and sys._getframe(1).f_globals.get("__name__") == "subprocess":
        return real["kill"](process, number)
    raise OSError(errno.EINVAL, "os.kill ends the process, or sends Ctrl-C to all of its console")


os.open, os.kill, os.symlink, os.link = open_file, kill, refuse, refuse
builtins.open = io.open = hide(io.open)
for name in ("stat", "lstat", "listdir", "scandir", "readlink", "access"):
    setattr(os, name, hide(real[name]))
os.rename, os.replace = keep_open_files(os.rename, replaces=False), keep_open_files(os.replace)
os.unlink = keep_open_files(os.unlink)
os.remove = os.unlink


def start(popen, *arguments, _start=subprocess.Popen.__init__, **options):
    if refused := [name for name in OPTIONS if options.get(name) not in (None, False, -1, ())]:
        raise ValueError(f"{refused[0]} is not supported on this system")
    _start(popen, *arguments, **options)


subprocess.Popen.__init__ = start
subprocess.Popen.kill = lambda self: self.poll() is None and real["kill"](self.pid, kill_number)
assert not hasattr(os, "fork")
assert not Path("/proc/self").exists()
sys.platform = "unknown"  # last, because the modules above look at it
