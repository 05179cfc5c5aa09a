"""Reports in JUnit's format, which continuous integration reads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from xml.etree import ElementTree


@dataclass(frozen=True)
class TestCase:
    """A case: the group that it is in, its name, what there is to say of it, and why it failed; empty if it did not."""

    group: str
    name: str
    output: str = ""
    failure: str = ""


def junit_xml(suite: str, cases: Sequence[TestCase]) -> str:
    """Return a suite of cases as XML."""
    failures = sum(bool(case.failure) for case in cases)
    counts = {"tests": str(len(cases)), "failures": str(failures), "errors": "0", "skipped": "0"}
    root = ElementTree.Element("testsuites")
    element = ElementTree.SubElement(root, "testsuite", {"name": suite, **counts})
    for case in cases:
        _add(element, case)
    ElementTree.indent(root)
    return ElementTree.tostring(root, "unicode", xml_declaration=True) + "\n"


def _add(suite: ElementTree.Element, case: TestCase) -> None:
    element = ElementTree.SubElement(suite, "testcase", {"classname": case.group, "name": case.name})
    if case.failure:
        ElementTree.SubElement(element, "failure", {"message": _printable(case.failure)}).text = _printable(case.failure)
    if case.output:
        ElementTree.SubElement(element, "system-out").text = _printable(case.output)


def _printable(text: str) -> str:
    """Return a text without the characters that XML has no place for, which engines may have in their messages."""
    return "".join(char if char.isprintable() or char in "\n\t" else "?" for char in text)
