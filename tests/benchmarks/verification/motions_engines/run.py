"""Put an engine into the tests of references/motions, build them, and return what they print."""

import functools
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import conservative as cv

from ....environments import PATIENCE

MOTIONS = Path(cv.__file__).parents[1] / "references" / "motions"
HERE = Path(__file__).parent
MARK = re.compile(r"^(/\*|//|#) YOUR ENGINE.*?^(/\* END \*/|// END|# END)$", re.DOTALL | re.MULTILINE)
SHIM = """
static const Motion *current;
static int get(const char *key, int, double *out) {
  if (!current->rows.count(key)) return 0;
  for (double x : current->rows.at(key)[0]) *out++ = x;
  return 1;
}
#include <cstdlib>
#include <cstring>
ENGINE
std::vector<State> simulate(const Motion &motion, double h, int steps, int samples) {
  double found[20][7];
  current = &motion;
  simulate(h, steps, samples, found);
  std::vector<State> states(samples);
  for (int i = 0; i < samples; i++) for (int k = 0; k < 7; k++) states[i][k] = found[i][k];
  return states;
}
"""
COMPILERS = {"C": "gcc", "C++": "g++", "Rust": "rustc", "JavaScript": "node", "Python": sys.executable, "C#": "mcs"}
"""The program that each language needs."""
PLUGINS = *("-p", "no:cacheprovider"), *("-p", "no:zarr"), *("-p", "no:hypothesispytest")
PYTEST = ("-m", "pytest", "-q", "--tb=short", "-rN", "-n0", *PLUGINS, "test_motions.py")
OWN = re.compile(r"^\w+: \w+ error |motions failed$|^\".+\" explains|not explained by|^this program has order")
"""Lines of the test in Python, among the lines of pytest."""
LANGUAGES = {
    "C": ("test.c", "engine.h", ("gcc", "-std=c99", "-Wall", "-Wextra", "-Werror", "test.c", "-lm"), ("./a.out",)),
    "C++": ("test.cpp", "engine.h", ("g++", "-std=c++17", "-Wall", "-Wextra", "-Werror", "test.cpp"), ("./a.out",)),
    "Rust": ("test.rs", "engine.rs", ("rustc", "test.rs", "-A", "dead_code"), ("./test",)),
    "JavaScript": ("test.mjs", "engine.mjs", (), ("node", "test.mjs")),
    "Python": ("test_motions.py", "engine.py", (), (sys.executable, *PYTEST)),
}
"""The test of each language, the engine, and the commands that build and run it."""


def missing(language):
    """Return why the tests of a language cannot run here, or None."""
    return None if shutil.which(COMPILERS[language]) else f"{COMPILERS[language]} is not installed"


def write(language, folder, method, order, angle, single):
    """Write the test with an engine and its settings into a folder."""
    name, engine, _, _ = LANGUAGES[language]
    own, numbers = (HERE / engine).read_text(), ", ".join(repr(float(x)) for x in method)
    text = MARK.sub(lambda _: SHIM.replace("ENGINE", own) if language == "C++" else own, (MOTIONS / name).read_text(), count=1)
    yes = {"C": str(int(single)), "Rust": str(float(single)), "Python": str(single)}.get(language, str(single).lower())
    for pattern, new in (
        (r"\bORDER(: f64)?( =)? 2\b", rf"ORDER\1\2 {order}"),
        (r"\bANGLE(: f64)?( =)? 0.01", rf"ANGLE\1\2 {angle}"),
        (r"\bSINGLE(: f64)?( =)? (0.0|0|[fF]alse)", rf"SINGLE\1\2 {yes}"),
        (r"FLOAT = [fF]alse", f"FLOAT = {yes}"),
        (r"type Real = f64", f"type Real = f{32 if single else 64}"),
        (r"METHOD(: ..Real.)? = &?\[\]", lambda m: f"METHOD{m[1] or ''} = {'&' if m[1] else ''}[{numbers}]"),
        (r"Path\(__file__\).parent", f"Path({str(MOTIONS)!r})"),
    ):
        text = re.sub(pattern, new, text)
    settings = [f"#define METHOD {numbers}", *["#define FLOAT"] * single] if engine.endswith("h") else []
    (folder / name).write_text("\n".join([*settings, text]))


@functools.cache
def build_once(language, parent, *settings):
    """Return a new folder in `parent`, which all tests of a process have in common, with the program of a language."""
    folder = Path(tempfile.mkdtemp(dir=parent))
    write(language, folder, *settings)
    if build := LANGUAGES[language][2]:
        subprocess.run(build, check=True, cwd=folder)
    return folder


def run(language, folder, mistake, method, order, angle=0.01, single=False, share=1.0):
    """Return the lines that the test of a language prints with an engine, in a folder of a test.

    `share` is a factor of all tolerances, for tests that read CSV files.
    """
    made = build_once(language, folder.parent, tuple(method), order, angle, single)
    files = sorted(MOTIONS.glob("*.csv"))
    if share != 1:
        files = [scaled(path, folder, share) for path in files]
    own = {"JavaScript": [MOTIONS], "Python": []}.get(language, files)
    command, env = [*LANGUAGES[language][3], *map(str, own)], os.environ | {"MISTAKE": mistake}
    done = subprocess.run(command, text=True, capture_output=True, timeout=PATIENCE, cwd=made, env=env)
    assert done.returncode in (0, 1), done.stderr
    if language != "Python":
        return done.stdout.splitlines()
    lines = [line for line in done.stdout.splitlines() if OWN.search(line)]
    return lines if any(line.endswith("motions failed") for line in lines) else [*lines, f"0 of {len(files)} motions failed"]


def scaled(path, folder, share):
    """Write a motion with tolerances times a factor, and return its path."""
    rows = [line.split(",") for line in path.read_text().splitlines()]
    for row in rows:
        if row[0] == "tolerance":
            row[4:] = [str(share * float(x)) for x in row[4:]]
    (folder / path.name).write_text("\n".join(map(",".join, rows)) + "\n")
    return folder / path.name
