"""No file but a method's own knows the method by its name or class, but for those listed here with what they know and why."""

import ast
import inspect
import re
from pathlib import Path

import pytest

from conservative import registry

from .environments import ROOT
from .test_house import sources

ALLOWED = {
    "conservative/__init__.py": ("convected gauss lame moser_veselov projected reduced substepped taylor", "the public names"),
    "conservative/deferred_imports.py": ("reduced", "the default of every option that names a method"),
    "conservative/errors.py": ("heyoka mujoco pinocchio", "packages that an extra brings"),
    "conservative/integration/one.py": ("reduced", "the default of `integrate`"),
    "conservative/methods/moser_veselov.py": ("exact", "one of its orders"),
    "conservative/methods/substepped.py": ("reduced", "the default that it divides"),
    "references/engines/model_reader.py": ("mujoco pinocchio", "formats of files, each read by the package that defines it"),
    "references/heyoka_equations/forms.py": ("heyoka", "the package whose expressions it writes"),
    "references/precise.py": ("heyoka", "the package that it runs on"),
    "references/truth.py": ("exact precise scipy", "which truth a scene has, by the table at its top"),
    "benchmarks/recommendation/motion.py": ("exact", "the closed form, where a motion has one"),
    "benchmarks/studies/paper_figures.py": ("convected exact reduced", "the paper's figures show the paper's map"),
    "benchmarks/studies/random.py": ("precise", "the truth of a body in any field"),
    "benchmarks/studies/throughput.py": ("heyoka", "the truth of many bodies, at a tolerance below round-off"),
    "benchmarks/verification/comparison_alarms.py": ("moser_veselov reduced", "the rows that are slowed"),
    "benchmarks/verification/hostile_bodies.py": (
        "convected exact gauss moser_veselov reduced substepped",
        "what moves random bodies, and the truth that it is compared with",
    ),
    "benchmarks/verification/hostile_scales.py": (
        "convected exact gauss heyoka lame moser_veselov mujoco pinocchio precise projected reduced scipy substepped",
        "what moves a body of any scale",
    ),
    "benchmarks/verification/interrupts.py": ("scipy", "a run that stays in Python for long"),
    "benchmarks/verification/kills.py": ("moser_veselov", "the method of the report that is killed"),
    "benchmarks/measures/measure.py": ("newton", "the word for an iteration, which is an engine's name, too"),
    "benchmarks/verification/report_kills.py": ("exudyn", "default of an option"),
    "benchmarks/verification/round_off.py": ("reduced", "default of an option"),
    "benchmarks/suite/test_speed.py": ("convected mujoco reduced", "whose steps are compared, and the goals"),
    "benchmarks/verification/third_truth.py": ("exact orekit precise", "the solutions that are compared, and who decides"),
    "benchmarks/verification/worker_kills.py": ("exudyn", "default of an option"),
    "reports/run/provenance.py": ("heyoka mujoco scipy", "packages whose versions a report names"),
}
"""Names that a file has beside those of its own methods, no more and no fewer, and why."""
PATHS = [path.relative_to(ROOT).as_posix() for path in sources(ROOT)]


def names_of_its_own(path):
    """Return the names of the methods that a file has the class of."""
    families = [*registry.list_families().items(), *((name, registry.engine(name)) for name in registry.list_engines())]
    return {name for name, family in families if Path(inspect.getfile(family)).resolve() == ROOT / path}


def names_of_methods(source):
    """Return the names of registered methods that a source has, or has the class of, in texts or imports; not in docstrings."""
    families = registry.list_families()
    classes = {family.__name__: name for name, family in families.items()}
    names = families.keys() | set(registry.list_engines())
    tree = ast.parse(source)
    prose = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in prose:
            found |= names & {re.split(r"[:\s=]", node.value)[0]}
        else:
            found |= {classes[name] for name in identifiers(node) if name in classes}
    return found


def identifiers(node):
    """Return the names that a node of a syntax tree refers to or imports."""
    if isinstance(node, ast.ImportFrom | ast.Import):
        return [alias.name for alias in node.names]
    return [node.id] if isinstance(node, ast.Name) else [node.attr] if isinstance(node, ast.Attribute) else []


@pytest.mark.parametrize("path", PATHS)
def test_no_method_is_known_by_name(path):
    found = names_of_methods((ROOT / path).read_text(encoding="utf-8")) - names_of_its_own(path)
    assert found == set(ALLOWED.get(path, ("",))[0].split())


def test_what_is_allowed_is_a_file():
    assert ALLOWED.keys() <= set(PATHS)


def test_a_method_may_name_itself():
    assert names_of_its_own("conservative/methods/gauss.py") == {"gauss"}
    assert names_of_its_own("reports/tables/scene.py") == set()


BREACHES = {
    "COLOURS = {'reduced': BLUE}": {"reduced"},
    "rows = table['method'].str.startswith('mujoco')": {"mujoco"},
    "GOALS = ('mujoco:RK4', 100)": {"mujoco"},
    "from .gauss import Gauss": {"gauss"},
    "if isinstance(method, methods.Projected): pass": {"projected"},
    "'''reduced, in prose'''\nexact = reduced = 1": set(),
}


@pytest.mark.parametrize("source", BREACHES)
def test_a_name_is_found(source):
    assert names_of_methods(source) == BREACHES[source]
