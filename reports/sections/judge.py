"""A recorded motion: the verdict, what was compared, what explains its error, and errors and drifts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ..document.cells import bound
from ..document.model import Document, Emphasis, Items, Paragraph, Table, filled

WORDS = {"right": "is right", "wrong": "is WRONG", "undecided": "is UNDECIDED"}
LISTED = 12
"""Hypotheses that the table lists."""


def build(summary: Mapping[str, Any], name: str) -> Document:
    """Return the document of `verdict.judge` on the file `name`."""

    def amount(errors: Sequence[float]) -> str:
        units = zip(errors, summary["units"], strict=True)
        return " and ".join(f"{bound(error * size)} {unit}" for error, (unit, size) in units if size)

    verdict = f"{name} {WORDS[summary['verdict']]}: its largest error is {amount(summary['error'])}"
    verdict += f"; {amount(summary['allowed'])} {'is' if sum(size > 0 for _, size in summary['units']) == 1 else 'are'} allowed"
    verdict += {"error": " by --error.", "digits": " by its digits.", "noise": " by its noise."}[summary["by"]]
    sentences = [verdict, *([f"{summary['shape']}."] if summary["shape"] else [])]
    if summary["by"] == "noise" and max(summary["noise"]) > 0:
        sentence = f"The noise of an axis is {amount(summary['noise'])}"
        if max(summary["first row"]) > 0:
            sentence += (
                f"; from the first row alone the motion is off by {amount(summary['first row'])}, so its start is fitted"
            )
        sentences.append(f"{sentence}.")
    if summary["undecided"]:
        sentences.append(f"{summary['undecided']}.")
    proven = [summary["diagnosis"]] if summary["diagnosis"] else summary["equally good"]
    left = [
        "" if not max(each.plain) else f" This leaves {amount(each.left)} of an error of {amount(each.plain)}."
        for each in proven
    ]
    reasons = [f"{each.sentence}.{more}" for each, more in zip(proven, left, strict=True)]
    candidates = [f"{each.sentence}: leaves {amount(each.left)} of {amount(each.plain)}" for each in summary["candidates"]]
    heading = "These explain the file equally well:" if len(proven) > 1 else ""
    unproven = (
        ("No known mistake explains the error" + (": none of these candidates is proven." if candidates else "."))
        if summary["verdict"] == "wrong" and not proven
        else ""
    )
    compared = "; ".join(f"{kind}: {', '.join(columns)}" for kind, columns in summary["compared"].items())
    rows = summary["rows"]
    used = [f"Compared: {compared} ({rows['compared']:,} of {rows['in file']:,} rows)."] if compared else []
    unused = [f"Not used: {column}, {reason}." for column, reason in summary["not used"].items()]
    quantities = [[each["quantity"], bound(each["largest"]), bound(each["final"])] for each in summary["quantities"]]
    blocks = filled(
        Paragraph(" ".join(sentences), Emphasis.LEAD),
        Paragraph(heading or unproven) if heading or unproven else None,
        *(Paragraph(reason) for reason in reasons),
        Items.of(candidates if unproven else []),
        Table(["quantity", "largest", "at the end"], quantities),
        Table(["hypothesis", "error that is left"], [[each.name, amount(each.left)] for each in summary["tried"][:LISTED]]),
        Items.of([*used, *unused, *summary["notes"]]),
    )
    failures = [verdict] if summary["verdict"] == "wrong" else []
    return Document("conservative judge", f"Judged: {name}", blocks, data={"judged": name, **summary}, failures=failures)
