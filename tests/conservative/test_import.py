"""Importing the package is cheap, and its public names exist."""

import ast
import pickle
import re
import subprocess
import sys
from pathlib import Path

import pytest

import conservative

from ..environments import run_python

FORBIDDEN = ("numba", "llvmlite", "mujoco", "pinocchio", "heyoka", "pandas", "scipy", "altair")
OURS = "[name for name in sys.modules if name.partition('.')[0] == 'conservative']"


def printed(code):
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip()


def test_importing_the_package_imports_nothing_else():
    found = printed(f"import conservative, sys; print(sorted({OURS}), 'numpy' in sys.modules)")
    assert found == "['conservative', 'conservative.version'] False"


METHOD_INFO = """
import conservative as cv, numpy as np
s = cv.scenes.brick_flip()
t = cv.Trajectory(s, np.zeros(1), s.R_WB0[None], s.w_WB_B0[None], "x")
repr(t), t._repr_html_()
"""


@pytest.mark.parametrize("code", ["from conservative import *\n", METHOD_INFO], ids=["public names", "method_info"])
def test_public_names_and_cards_import_no_compiler_no_engine_and_no_tables(code):
    assert printed(f"{code}import sys; print([m for m in {FORBIDDEN!r} if m in sys.modules])") == "[]"


@pytest.mark.parametrize("name", conservative.__all__)
def test_a_public_name_is_there(name):
    found = getattr(conservative, name)
    assert getattr(found, "__module__", "conservative").startswith("conservative")
    assert getattr(conservative, name) is found


def test_type_checkers_see_the_public_names():
    # A name in a stub is public to type checkers only as `import X as X`.
    stub = Path(conservative.__file__).with_suffix(".pyi").read_text(encoding="utf-8")
    typed = {alias.asname for node in ast.parse(stub).body if isinstance(node, ast.ImportFrom) for alias in node.names}
    assert typed == set(conservative.__all__)


def test_classes_come_back_from_a_pickle():
    assert pickle.loads(pickle.dumps(conservative.Reduced)) is conservative.Reduced


def test_modules_that_the_pages_name_are_there_without_an_import_of_their_own():
    """`conservative.registry.method("exact")` of a page works after `import conservative`."""
    root = Path(__file__).parents[2]
    pages = [page for page in root.rglob("*.md") if page.name != "CHANGELOG.md"]
    found = re.findall(r"\b(?:conservative|cv)\.([a-z_]+)\.[A-Za-z_]+", "\n".join(map(Path.read_text, pages)))
    modules = {"registry", *found} & {path.stem for path in (root / "conservative").iterdir()}
    assert len(modules) >= 3
    missing = "[name for name in sys.argv[1:] if not hasattr(conservative, name)]"
    code = f"import conservative, sys; print({missing}, hasattr(conservative, 'no_such_module'))"
    assert run_python(code, *sorted(modules))[1] == "[] False\n"


INTERRUPTED = """
import signal, sys
def interrupt(event, arguments):
    if event == "import" and arguments[0] == sys.argv[1] and not done:
        done.append(signal.raise_signal(signal.SIGINT))
done = []
sys.addaudithook(interrupt)
import conservative as cv
for _ in range(2):
    try:
        print(eval(sys.argv[2]))
    except KeyboardInterrupt:
        print("interrupted")
"""
FLIP = "cv.integrate(cv.scenes.brick_flip(), dt=0.01, t_end=0.1, method='moser_veselov')"


@pytest.mark.parametrize(
    ("module", "call", "value"),
    [
        ("numpy.linalg", "cv.integrate.__name__", "integrate"),
        ("numba.core.types", f"{FLIP}.ok", "True"),
        ("pandas.core.frame", f"len({FLIP}.to_pandas())", "11"),
    ],
)
def test_ctrl_c_in_an_import_leaves_no_half_of_it(module, call, value):
    assert run_python(INTERRUPTED, module, call) == (0, f"interrupted\n{value}\n", "")
