"""A recorded motion: the verdict, what explains its error, and errors and drifts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ..document.cells import number
from ..document.model import Document, Emphasis, Items, Paragraph, Table, filled


def build(summary: Mapping[str, Any], name: str, allowed: float) -> Document:
    """Return the document of `diagnose.judge` on the file `name`, whose error may be up to `allowed` (rad, or relative)."""

    def amount(errors: Sequence[float]) -> str:
        units = zip(errors, summary["units"], strict=True)
        return " and ".join(f"{number(error * size)} {unit}" for error, (unit, size) in units if size)

    found, right = summary["diagnosis"], max(summary["error"]) <= allowed
    verdict = f"{name} is {'right' if right else 'WRONG'}: its largest error is {amount(summary['error'])}."
    reason = "No fault found." if right else "No hypothesis explains half of the error."
    if found is not None:
        reason = f"{found.sentence}. This leaves {amount(found.left)} of an error of {amount(found.plain)}."
    quantities = [[each["quantity"], number(each["largest"]), number(each["final"])] for each in summary["quantities"]]
    blocks = filled(
        Paragraph(verdict, Emphasis.LEAD),
        Paragraph(reason),
        Table(["quantity", "largest", "at the end"], quantities),
        Table(["hypothesis", "error that is left"], [[each.name, amount(each.left)] for each in summary["tried"]]),
        Items.of(summary["notes"]),
    )
    data = {"judged": name, "right": right, "allowed": allowed, **summary}
    return Document("conservative judge", f"Judged: {name}", blocks, data=data, failures=[] if right else [verdict])
