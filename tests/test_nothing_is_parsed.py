"""Rows are the only contract: no name, label or message is taken apart in benchmarks/ and reports/."""

import ast
from collections.abc import Iterator
from dataclasses import fields

import pytest

from conservative.benchmarks.gate.results import Row
from conservative.benchmarks.measures.measurement import Subject
from conservative.benchmarks.verification.finding import Cause, Finding

from .pages import ROOT

TAKE_APART = {
    *("partition", "rpartition", "split", "rsplit", "removeprefix", "removesuffix"),
    *("startswith", "endswith", "strip", "lstrip", "rstrip", "find", "index", "replace"),
}
"""Methods of texts that take one apart, or look into it."""
OF_RE = {"match", "fullmatch", "search", "split", "sub", "findall", "finditer"}
NUMBERS = {"values", "spreads", "seconds", "error", "allowed", "unit", "left", "of", "numbers", "causes", "seed", "body", "dt"}
TEXTS = {field.name for kind in (Subject, Row, Finding, Cause) for field in fields(kind)} - NUMBERS | {
    *("name", "label", "message", "reason", "sentence", "status", "title", "caption", "quantity", "pair", "how", "allowed"),
    *("status_of", "setting_text", "method_text", "display_name"),
}
"""Columns of rows, fields of findings, and other texts that are made for readers."""
READS = {
    "benchmarks/gate/pytest_gate.py": "node ids of pytest",
    "benchmarks/measures/origin.py": "the subject of a commit, which GitHub wrote",
    "benchmarks/verification/recordings/": "names of columns in the files of others",
    "benchmarks/versions/inside.py": "names of packages and methods, in a version that may have no parser of names",
    "reports/charts/style.py": "the order of a legend, in which numbers in names count as numbers",
    "reports/cli/": "what a user types",
    "reports/run/sweep.py": "what a user types",
    "reports/documentation/": "pages in Markdown and HTML",
    "reports/terminal/report_folder.py": "names of folders",
}
"""Files that read what others write, and what it is."""


def list_places(source: str) -> Iterator[str]:
    """Yield the expressions of a module that take a name, label or message apart, or a text that was made in place."""
    for node in ast.walk(ast.parse(source)):
        texts: list[ast.expr] = []
        match node:
            case ast.Call(ast.Attribute(value, method), arguments) if is_spelling(method, arguments):
                pass
            case ast.Call(ast.Attribute(ast.Name("re"), method), arguments) if method in OF_RE:
                texts = arguments[1:]
            case ast.Call(ast.Attribute(value, method), arguments) if method in TAKE_APART:
                texts = [value] if arguments or not isinstance(value, ast.JoinedStr) else []
            case ast.Compare(ast.Constant(str()), [ast.In() | ast.NotIn()], right):
                texts = right
        if any(isinstance(text, ast.JoinedStr) or last_name(text) in TEXTS for text in texts):
            yield ast.unparse(node)


def is_spelling(method: str, arguments: list[ast.expr]) -> bool:
    """Return whether a call only spells a name: with or without underscores, such as in the name of a file, or drops spaces."""
    texts = [ast.unparse(argument) for argument in arguments]
    if not texts:
        return "strip" in method
    return (method, texts[0]) == ("replace", "'_'") or (method, texts[1:2]) == ("sub", ["'_'"])


def last_name(node: ast.expr) -> str:
    """Return the name of what an expression is: of a variable, an attribute, a column, or a function."""
    match node:
        case ast.Attribute(value, "str") | ast.Call(ast.Name("str"), [value]):  # of pandas, or a conversion
            return last_name(value)
        case ast.Subscript(_, ast.Constant(str(name))) | ast.Name(name) | ast.Attribute(attr=name):
            return name
        case ast.Subscript(value) | ast.Call(value):
            return last_name(value)
        case _:
            return ""


def test_no_name_label_or_message_is_taken_apart():
    files = {str(path.relative_to(ROOT)): path for top in ("benchmarks", "reports") for path in (ROOT / top).rglob("*.py")}
    assert all(any(file.startswith(read) for file in files) for read in READS)
    places = {file: list(list_places(path.read_text(encoding="utf-8"))) for file, path in files.items()}
    assert {file: found for file, found in places.items() if found and not file.startswith(tuple(READS))} == {}


@pytest.mark.parametrize(
    "line",
    [
        'family = method.name.partition(":")[0]',
        'rows = rows[rows["quantity"].str.startswith("drift of ")]',
        'text = str(row.label).split("/")[0]',
        'verb = "are" if " and " in finding.sentence else "is"',
        'short = status_of(summary).partition(":")[0]',
        'found = re.search("order=(.)", point.setting)',
        'name = f"{check}: {case}".removesuffix(": ")',
        'kind = each.pair.partition(" x ")[0]',
        'allowed = error.allowed.replace("resume=True", "--resume")',
    ],
)
def test_what_was_taken_apart_before_is_found(line):
    assert list(list_places(line))
