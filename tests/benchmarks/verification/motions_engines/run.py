"""Put an engine into the tests of references/motions, build them, and return what they print."""

import functools
import os
import re
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import conservative as cv

from ....environments import PATIENCE

MOTIONS = Path(cv.__file__).parents[1] / "references" / "motions"
HERE = Path(__file__).parent
MARK = re.compile(r"^ *(/\*|//|#) YOUR ENGINE.*?^ *(/\* END \*/|// END|# END)$", re.DOTALL | re.MULTILINE)
ALL = "rotor, torque, damping, fixed point, orbit"
STRICT = ("-Wall", "-Wextra", "-Werror", "-pedantic")
COMPILERS = {"C": "gcc", "C++": "g++", "Rust": "rustc", "JavaScript": "node", "Python": sys.executable, "C#": "mcs"}
"""The program that each language needs."""
LANGUAGES = {
    "C": ("rotation_test.c", "engine.h", ("gcc", "-std=c99", *STRICT, "rotation_test.c", "-lm"), ("./a.out",)),
    "C++": ("rotation_test.c", "engine.h", ("g++", "-std=c++11", *STRICT, "-x", "c++", "rotation_test.c"), ("./a.out",)),
    "Rust": ("rotation_test.rs", "engine.rs", ("rustc", "rotation_test.rs"), ("./rotation_test",)),
    "JavaScript": ("rotation.test.mjs", "engine.mjs", (), ("node", "rotation.test.mjs")),
    "Python": ("test_rotation.py", "engine.py", (), (sys.executable, "test_rotation.py")),
    "C#": ("RotationTest.cs", "engine.cs", ("mcs", "-warnaserror", "RotationTest.cs"), ("mono", "RotationTest.exe")),
}
"""The test of each language, the engine, and the commands that build and run it."""


@dataclass(frozen=True)
class Engine:
    """A Runge-Kutta method (none: the test as it is), and what is declared: order, |w| h, single precision and features."""

    method: tuple[float, ...]
    order: int
    angle: float = 0.01
    single: bool = False
    rounds: bool = False
    """Single precision that is not declared."""
    has: str = ALL
    code: str = ""
    """The function `simulate`, instead of a method."""


def missing(language):
    """Return why the tests of a language cannot run here, or None."""
    return None if shutil.which(COMPILERS[language]) else f"{COMPILERS[language]} is not installed"


def write(language, folder, engine):
    """Write the test with an engine and its settings into a folder."""
    name, own, _, _ = LANGUAGES[language]
    code, numbers, rounds = (
        (HERE / own).read_text(),
        ", ".join(repr(float(x)) for x in engine.method),
        engine.single or engine.rounds,
    )
    text = (MOTIONS / name).read_text()
    text = MARK.sub(lambda _: engine.code or code, text, count=1) if engine.method or engine.code else text
    yes = {"C": "1", "C++": "1", "Python": "True"}.get(language, "true")
    for pattern, new in (
        (r"\bORDER(: u32)? = 2\b", rf"ORDER\1 = {engine.order}"),
        (r"\bANGLE(: f64)? = 0.01", rf"ANGLE\1 = {engine.angle}"),
        (r'\bHAS(: &str|\[\])? = ""', rf'HAS\1 = "{engine.has}"'),
        *[(r"\bSINGLE(: bool)? = ([fF]alse|0)\b", rf"SINGLE\1 = {yes}")] * engine.single,
        *[(r"\bFLOAT = [fF]alse", f"FLOAT = {yes}"), (r"type Real = f64", "type Real = f32")] * rounds,
        (r"METHOD(: ..Real.)? = (&?\[\]|{})", lambda m: f"METHOD{m[1] or ''} = {m[2][:-1]}{numbers}{m[2][-1]}"),
    ):
        text = re.sub(pattern, new, text)
    settings = [f"#define METHOD {numbers}", *["#define FLOAT"] * rounds] if own.endswith("h") and engine.method else []
    (folder / name).write_text("\n".join([*settings, text]))


@functools.cache
def build_once(language, parent, engine):
    """Return a new folder in `parent`, which all tests of a process have in common, with the program of a language."""
    folder = Path(tempfile.mkdtemp(dir=parent))
    write(language, folder, engine)
    if build := LANGUAGES[language][2]:
        subprocess.run(build, check=True, cwd=folder)
    return folder


def start(language, folder, engine, mistake="", *arguments, **environment):
    """Return the finished program of a language, in a folder of a test, without a file of known errors if none is asked for."""
    made, (program, *rest) = build_once(language, folder.parent, engine), LANGUAGES[language][3]
    parts = [made / program if program.startswith("./") else program, *(made / name for name in rest)]
    own = {name: text for name, text in os.environ.items() if not name.startswith("ROTATION_")}
    return subprocess.run(
        [*map(str, parts), *map(str, arguments)],
        text=True, capture_output=True, timeout=PATIENCE, cwd=folder, env=own | {"MISTAKE": mistake} | environment,
    )  # fmt: skip


def run(language, folder, engine, mistake="", share=1.0, embedded=False):
    """Return the lines that the test of a language prints with an engine: with all files, or with the embedded motions.

    `share` is a factor of all tolerances of the files.
    """
    files = [] if embedded else sorted(MOTIONS.glob("*.csv"))
    if share != 1:
        files = [scaled(path, folder, share) for path in files]
    done = start(language, folder, engine, mistake, *files)
    assert done.returncode in (0, 1), done.stdout + done.stderr
    return done.stdout.splitlines()


def scaled(path, folder, share):
    """Write a motion with tolerances times a factor, and return its path."""
    rows = [line.split(",") for line in path.read_text().splitlines()]
    for row in rows:
        if row[0] == "tolerance":
            row[4:] = [str(share * float(x)) for x in row[4:]]
    (folder / path.name).write_text("\n".join(map(",".join, rows)) + "\n")
    return folder / path.name
