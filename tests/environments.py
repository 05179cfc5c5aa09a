"""Build the package, install it into an environment of its own, and run programs there."""

import os
import re
import signal
import subprocess
import sys
import sysconfig
import time
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parent.parent
PATIENCE = 1800.0
"""Time limit, s, of what must end by itself: only a hang reaches it, on however busy a machine."""
LEAN = {"numpy", "scipy", "numba", "mpmath", "lazy-loader", "click", "rich"}
"""Required packages without an extra."""
PYTEST = "import sys\nfrom pytest import console_main\nsys.exit(console_main())\n"


def wait_until(ready):
    """Wait until a condition holds."""
    end = time.monotonic() + PATIENCE
    while not ready():
        assert time.monotonic() < end
        time.sleep(0.01)


def build(source, target, folder):
    """Return the wheel or sdist that hatchling builds of a folder; no network."""
    command = [sys.executable, "-m", "hatchling", "build", "-t", target, "-d", folder]
    subprocess.run(command, cwd=source, env=variables(), check=True, capture_output=True, timeout=PATIENCE)
    (built,) = folder.glob("*.whl" if target == "wheel" else "*.tar.gz")
    return built


def variables(**changed):
    """Return environment variables of a process that finds packages only where its interpreter has them."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHONPATH", "PYTEST"))}
    return kept | changed


def run_python(code, *arguments, **changed):
    """Run code in a fresh interpreter, with this checkout in front; return its exit code, output and errors."""
    command = [sys.executable, "-c", code, *arguments]
    environment = variables(**{"PYTHONPATH": str(ROOT), **changed})
    done = subprocess.run(command, env=environment, cwd="/", capture_output=True, text=True, timeout=PATIENCE, check=False)
    return done.returncode, done.stdout, done.stderr


@contextmanager
def programs():
    """Yield a function that starts programs as `subprocess.Popen` does, each in a process group of its own.

    All groups are killed at the end of the block. `os.killpg(process.pid, number)` sends a signal to a whole group.
    """
    started = []

    def popen(command, **options):
        process = subprocess.Popen(command, start_new_session=True, **options)
        started.append(process)
        return process

    try:
        yield popen
    finally:
        for process in started:
            with suppress(ProcessLookupError):  # all of the group may have ended
                os.killpg(process.pid, signal.SIGKILL)
            with process:  # closes its pipes and waits for it
                pass


@dataclass(frozen=True)
class Environment:
    """A virtual environment with the packages of this one except ours."""

    folder: Path

    @classmethod
    def create(cls, folder, *wheels):
        """Make an environment with the packages of this one, and wheels."""
        subprocess.run([sys.executable, "-m", "venv", "--without-pip", folder], check=True, timeout=PATIENCE)
        environment = cls(folder)
        links = folder / "packages"
        links.mkdir()
        for place in dict.fromkeys(sysconfig.get_paths()[name] for name in ("purelib", "platlib")):
            for entry in Path(place).iterdir():
                if not re.match(r"_?conservative", entry.name):
                    (links / entry.name).symlink_to(entry)
        (site,) = folder.glob("lib/python*/site-packages")
        (site / "packages.pth").write_text(f"import site; site.addsitedir({str(links)!r})\n")
        script = folder / "bin" / "pytest"
        script.write_text(f"#!{environment.python}\n{PYTEST}")
        script.chmod(0o755)
        if wheels:
            pip = [sys.executable, "-m", "pip", "--python", environment.python]
            options = ["--quiet", "--disable-pip-version-check", "--no-deps", "--no-index"]
            subprocess.run([*pip, "install", *options, *wheels], env=variables(), check=True, timeout=PATIENCE)
        return environment

    @property
    def python(self):
        return self.folder / "bin" / "python"

    def run(self, command, cwd, **changed):
        """Return exit code and output of a command of this environment, such as `pytest -q`."""
        program, *arguments = command
        path = {"PATH": f"{self.folder / 'bin'}{os.pathsep}{os.environ['PATH']}"}
        done = subprocess.run(
            [self.folder / "bin" / program, *arguments],
            cwd=cwd,
            env=variables(**path, **changed),
            capture_output=True,
            text=True,
            timeout=PATIENCE,
            check=False,
        )
        return done.returncode, done.stdout + done.stderr
