"""JUnit reports of documents with checks, for continuous integration."""

from __future__ import annotations

from xml.etree import ElementTree

from .model import Document


def render(document: Document) -> str:
    """Return the checks of a document as one test suite."""
    failures = sum(bool(case.failure) for case in document.checks)
    skipped = sum(bool(case.skipped) for case in document.checks)
    counts = {"tests": str(len(document.checks)), "failures": str(failures), "errors": "0", "skipped": str(skipped)}
    root = ElementTree.Element("testsuites")
    element = ElementTree.SubElement(root, "testsuite", {"name": document.command, **counts})
    for case in document.checks:
        child = ElementTree.SubElement(element, "testcase", {"classname": case.group, "name": case.name})
        if failure := _printable(case.failure):
            ElementTree.SubElement(child, "failure", {"message": failure}).text = failure
        if case.skipped:
            ElementTree.SubElement(child, "skipped", {"message": _printable(case.skipped)})
        if case.output:
            ElementTree.SubElement(child, "system-out").text = _printable(case.output)
    ElementTree.indent(root)
    return ElementTree.tostring(root, "unicode", xml_declaration=True) + "\n"


def _printable(text: str) -> str:
    """Return a text without the characters that XML does not allow, which messages of engines may contain."""
    return "".join(char if char.isprintable() or char in "\n\t" else "?" for char in text)
