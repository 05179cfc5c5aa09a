"""Reports in the format of JUnit, which continuous integration reads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from xml.etree import ElementTree


@dataclass(frozen=True)
class TestCase:
    """A case: its group and name, its output, and the reason why it failed; empty if it did not."""

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
        child = ElementTree.SubElement(element, "testcase", {"classname": case.group, "name": case.name})
        if failure := _printable(case.failure):
            ElementTree.SubElement(child, "failure", {"message": failure}).text = failure
        if case.output:
            ElementTree.SubElement(child, "system-out").text = _printable(case.output)
    ElementTree.indent(root)
    return ElementTree.tostring(root, "unicode", xml_declaration=True) + "\n"


def _printable(text: str) -> str:
    """Return a text without the characters that XML does not allow, which messages of engines can contain."""
    return "".join(char if char.isprintable() or char in "\n\t" else "?" for char in text)
