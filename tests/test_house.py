"""The shape of the house, measured: entries of a room, lines of files and functions, parameters. Each rule is fed a breach.

Files of tests have as few lines and parameters; how long their functions are is not counted.
"""

import ast
import statistics
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
ROOMS = ("conservative", "references", "benchmarks", "reports")
ENTRIES = {"conservative": 28, "references": 14, "benchmarks": 14, "reports": 14}
"""Most entries at the top of a room, links and README included."""
LINES, PARAMETERS = 250, 7
"""Most lines of a file, and parameters of a function, outside the kernels."""
MEDIAN, NINETIETH = 5, 16
"""Most lines of a function without its docstring: at the median, and at the 90th percentile."""
TEMPORARY = {"__pycache__", ".DS_Store"}


def sources(root):
    """Return the Python files of all rooms, each once: the links below `conservative` are not followed."""
    return [path for room in ROOMS for path in sorted((root / room).rglob("*.py")) if not linked(path, root)]


def files_of_tests(root):
    return sorted((root / "tests").rglob("*.py"))


def linked(path, root):
    return any((root / parent).is_symlink() for parent in path.relative_to(root).parents)


def functions(path):
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)]


def lines_of(function):
    """Return the lines of a function from its signature on, without its docstring."""
    first = function.body[0]
    docstring = first.end_lineno - first.lineno + 1 if ast.get_docstring(function) else 0
    return function.end_lineno - function.lineno + 1 - docstring


def parameters_of(function):
    return len(function.args.posonlyargs + function.args.args + function.args.kwonlyargs)


def kernel(path):
    return "kernels" in path.parts


def breaches(root):
    """Yield what is too large, in words."""
    for room in ROOMS:
        entries = [entry.name for entry in (root / room).iterdir() if entry.name not in TEMPORARY]
        if len(entries) > ENTRIES[room]:
            yield f"{room}: {len(entries)} entries"
    found = {path: functions(path) for path in sources(root)}
    for path, members in [*found.items(), *((path, functions(path)) for path in files_of_tests(root))]:
        if not kernel(path):
            yield from breaches_of_file(path.relative_to(root).as_posix(), path, members)
    lengths = sorted(lines_of(function) for members in found.values() for function in members)
    if statistics.median(lengths) > MEDIAN:
        yield f"median function: {statistics.median(lengths)} lines"
    if lengths[int(0.9 * len(lengths))] > NINETIETH:
        yield f"90th percentile of functions: {lengths[int(0.9 * len(lengths))]} lines"


def breaches_of_file(name, path, members):
    length = len(path.read_text(encoding="utf-8").splitlines())
    if length > LINES:
        yield f"{name}: {length} lines"
    yield from (f"{name}: {f.name} has {parameters_of(f)} parameters" for f in members if parameters_of(f) > PARAMETERS)


def test_the_house_keeps_its_shape():
    # Measured at 03ca742: 35, 29, 19 and 36 entries, files of up to 292 lines, 4 and 14 lines, up to 11 parameters.
    assert not list(breaches(ROOT))


def test_every_source_is_counted_once():
    files = [path.resolve() for path in sources(ROOT)]
    assert len(files) == len(set(files))
    assert {path.relative_to(ROOT).parts[0] for path in files} == set(ROOMS)


SHORT = "def f():\n    return 1\n"
LONG = "def g():\n" + "    x = 1\n" * 20
BREACHES = {
    "reports: 15 entries": {f"reports/m{i}.py": SHORT for i in range(15)},
    "benchmarks/long.py: 251 lines": {"benchmarks/long.py": "x = 1\n" * 251},
    "tests/room/test_long.py: 251 lines": {"tests/room/test_long.py": "x = 1\n" * 251},
    "references/wide.py: wide has 8 parameters": {"references/wide.py": "def wide(a, b, c, d, e, f, *, g, h): return a\n"},
    "median function: 21 lines": {"conservative/a.py": LONG * 3},
    "90th percentile of functions: 21 lines": {"conservative/a.py": SHORT * 4 + LONG},
}


@pytest.mark.parametrize("what", BREACHES)
def test_a_breach_is_found(what, tmp_path):
    for room in ROOMS:
        (tmp_path / room).mkdir()
    (tmp_path / "conservative" / "kernels").mkdir()
    (tmp_path / "conservative" / "kernels" / "free.py").write_text(
        "def k(a, b, c, d, e, f, g, h, i): return a\n" + "x = 1\n" * 300
    )
    (tmp_path / "conservative" / "few.py").write_text(SHORT)
    for name, text in BREACHES[what].items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    assert what in list(breaches(tmp_path))
