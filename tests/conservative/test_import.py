import ast
import pickle
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

import conservative

FORBIDDEN = ("numba", "llvmlite", "mujoco", "pinocchio", "heyoka", "pandas", "scipy", "altair")
OURS = "[name for name in sys.modules if name.partition('.')[0] == 'conservative']"


def printed(code):
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip()


def test_importing_the_package_imports_nothing_else():
    assert printed(f"import conservative, sys; print({OURS}, 'numpy' in sys.modules)") == "['conservative'] False"


def test_all_public_names_import_no_compiler_no_engine_and_no_tables():
    assert printed(f"from conservative import *; import sys; print([m for m in {FORBIDDEN!r} if m in sys.modules])") == "[]"


def typed_names():
    """Names that type checkers see, each with the module it is from."""
    tree = ast.parse(Path(conservative.__file__).read_text(encoding="utf-8"))
    (block,) = (node for node in tree.body if isinstance(node, ast.If))
    return {alias.asname: found.module for found in block.body for alias in found.names if alias.asname == alias.name}


def test_type_checkers_and_the_interpreter_see_the_same_names():
    typed = typed_names()
    assert set(typed) == set(conservative.__all__) == {*conservative._PLACES, *conservative._MODULES}
    assert {name: place for name, place in typed.items() if place is not None} == conservative._PLACES


@pytest.mark.parametrize("name", conservative.__all__)
def test_a_public_name_is_that_of_its_module(name):
    module = import_module("conservative" if name in conservative._MODULES else f"conservative.{conservative._PLACES[name]}")
    assert getattr(conservative, name) is getattr(module, name)


def test_the_package_lists_its_names():
    assert printed("import conservative; print(set(conservative.__all__) <= set(dir(conservative)))") == "True"
    assert conservative.__version__ == conservative.VERSION


def test_a_name_that_is_not_there_is_an_attribute_error():
    with pytest.raises(AttributeError, match="module 'conservative' has no attribute 'Phantom'"):
        _ = conservative.Phantom


def test_classes_come_back_from_a_pickle():
    assert pickle.loads(pickle.dumps(conservative.Reduced)) is conservative.Reduced
