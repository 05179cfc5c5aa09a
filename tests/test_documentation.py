"""What is public is documented, and what the documents show runs."""

import importlib
import inspect
import pkgutil
import re
from pathlib import Path

import pytest

import conservative

ROOT = Path(__file__).parent.parent
BLOCK = re.compile(r"^```python\n(.*?)^```", re.MULTILINE | re.DOTALL)


def modules():
    yield conservative.__name__
    for found in pkgutil.walk_packages(conservative.__path__, "conservative."):
        if not found.name.rpartition(".")[2].startswith("test_"):
            yield found.name


def public_members(module):
    for name, member in vars(module).items():
        if name.startswith("_") or getattr(member, "__module__", None) != module.__name__:
            continue
        if inspect.isclass(member):
            yield name, member
            # getdoc follows the protocol, so that a method which keeps its words need not repeat them
            yield from ((f"{name}.{n}", m) for n, m in vars(member).items() if not n.startswith("_") and is_code(m))
        elif inspect.isfunction(member):
            yield name, member


def is_code(member):
    return inspect.isfunction(member) or isinstance(member, property | classmethod | staticmethod)


@pytest.mark.parametrize("name", sorted(modules()))
def test_everything_public_has_a_docstring(name):
    module = importlib.import_module(name)
    assert module.__doc__, f"{name} has no docstring"
    bare = [n for n, member in public_members(module) if not documented(module, n, member)]
    assert not bare, f"{name}: no docstring on {bare}"


def documented(module, name, member):
    owner, _, attribute = name.partition(".")
    if not attribute:
        return bool(inspect.getdoc(member))
    return any(inspect.getdoc(vars(base)[attribute]) for base in vars(module)[owner].__mro__ if attribute in vars(base))


@pytest.mark.parametrize("block", BLOCK.findall((ROOT / "README.md").read_text()))
def test_code_in_the_readme_runs(block, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    exec(compile(block, "README.md", "exec"), {"__name__": "__readme__"})
