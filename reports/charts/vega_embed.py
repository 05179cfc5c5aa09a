"""Charts for the page: the pictures' own specifications, without their legends, with hovering and switches.

A legend inside a chart answers to a pointer only. So the page draws its own, of buttons, which set the parameter `hidden` of
every chart of a figure.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from conservative.benchmarks.studies import step_ladder

from ..document.model import LegendEntry
from .style import DASHES, SHAPES, Families, colours, number_in_family, specification

HIDDEN = "hidden"
"""Name of the parameter that lists the lines not to draw."""
DIGITS = 7
"""Significant digits of a number in a chart; hovering shows six."""
PATHS = {
    "circle": "M1 0A1 1 0 1 1-1 0A1 1 0 1 1 1 0Z",
    "square": "M-.9-.9H.9V.9H-.9Z",
    "triangle-up": "M0-1L1 .8H-1Z",
    "diamond": "M0-1.1L.9 0L0 1.1L-.9 0Z",
    "cross": "M-.35-1H.35V-.35H1V.35H.35V1H-.35V.35H-1V-.35H-.35Z",
    "triangle-down": "M0 1L1-.8H-1Z",
    "triangle-left": "M-1 0L.8-1V1Z",
    "triangle-right": "M1 0L-.8-1V1Z",
}
"""Outlines of the marks in a square of side 2, as Vega draws them."""

Spec = dict[str, Any]
Shown = tuple[str, str, str]
"""Fields shown on hovering: field, "Q" or "N", and title."""
SHOWN: dict[str, Shown] = {
    field: (field, kind, title)
    for field, kind, title in (
        ("error", "Q", "attitude error, rad"),
        ("microseconds", "Q", "µs per simulated second"),
        ("sample", "Q", f"µs a sample, of {step_ladder.SAMPLES}"),
        ("dt", "Q", "step, s"),
        ("t", "Q", "t"),
        ("drift", "Q", "largest drift so far"),
        ("name", "N", "method"),
        ("setting", "N", "setting"),
        ("within", "N", "bodies"),
        ("kind", "N", "taken"),  # of an engine: as installed, or at its best (`sections.engines`)
        ("size", "Q", "number of bodies"),
        ("time", "Q", "µs a body and simulated second"),
    )
}
"""Fields that most charts can show on hovering."""


def legend(families: Families, marks: bool) -> tuple[LegendEntry, ...]:
    """Return the buttons for lines: with the marks of the pictures, or else with their dashes."""
    colour, number = colours(families), number_in_family(families)
    return tuple(
        LegendEntry(
            name,
            colour[name],
            PATHS[SHAPES[number[name] % len(SHAPES)]] if marks else "",
            " ".join(map(str, DASHES[number[name] % len(DASHES)])),
        )
        for name in families
    )


def embed(chart: Any, shown: Sequence[str | Shown], height: int = 420) -> list[Spec]:
    """Return a picture as the page embeds it: one specification for each of its panels.

    Tooltips contain `shown`: keys of `SHOWN`, or fields with kind and title.
    """
    tooltip = [SHOWN[key] if isinstance(key, str) else key for key in shown]
    whole: Spec = specification(chart)
    if _parts(whole) is None:
        for unit in (whole, *whole.get("layer", ())):
            unit.pop("title", None)  # it is in the caption of the figure
    parameters = [{"name": HIDDEN, "value": []}, *whole.get("params", ())]
    return [_panel(panel, whole, tooltip, height) | {"params": parameters} for panel in _panels(whole, {})]


def _panels(spec: Spec, shared: Spec) -> Iterator[Spec]:
    """Yield the panels of a picture, each with its data, which Altair can move to the part around it."""
    shared = {"data": spec["data"]} if "data" in spec else shared
    parts = _parts(spec)
    if parts is None:
        yield shared | spec
    for part in parts or ():
        yield from _panels(part, shared)


def _parts(spec: Spec) -> Sequence[Spec] | None:
    return next((spec[direction] for direction in ("vconcat", "hconcat", "concat") if direction in spec), None)


def _panel(panel: Spec, whole: Spec, tooltip: Sequence[Shown], height: int) -> Spec:
    units = [panel, *panel.get("layer", ())]
    data = whole["datasets"]
    for unit in units:
        rows = data[unit.get("data", panel.get("data"))["name"]] if "data" in unit or "data" in panel else ()
        _prepare(unit, [entry for entry in tooltip if not rows or entry[0] in rows[0]])
    fields = set(_fields(panel))
    tables = {unit["data"]["name"]: as_csv(data[unit["data"]["name"]], fields) for unit in units if "data" in unit}
    for unit in units:
        if "data" in unit:
            unit["data"] = {"name": unit["data"]["name"], "format": tables[unit["data"]["name"]]["format"]}
    rest = {key: value for key, value in panel.items() if key not in ("config", "$schema")}
    values = {name: table["values"] for name, table in tables.items()}
    return rest | {"datasets": values, "width": "container", "height": height}


def _prepare(unit: Spec, tooltip: Sequence[Shown]) -> None:
    """Remove the legend from a chart or a layer, and add the filter and the tooltip."""
    encoding = unit.get("encoding", {})
    for channel in ("color", "shape", "strokeDash"):
        if channel in encoding:
            encoding[channel] = encoding[channel] | {"legend": None}
    if series := encoding.get("color", {}).get("field"):
        unit["transform"] = [{"filter": f"indexof({HIDDEN}, datum[{json.dumps(series)}]) < 0"}, *unit.get("transform", ())]
        unit["mark"] = unit["mark"] | {"tooltip": True}
        kinds = {"Q": {"type": "quantitative", "format": ".6g"}, "N": {"type": "nominal"}}
        encoding["tooltip"] = [{"field": field, **kinds[kind], "title": title} for field, kind, title in tooltip]


def _fields(spec: Any) -> Iterator[str]:
    """Yield every field that a specification refers to."""
    if isinstance(spec, dict):
        if isinstance(spec.get("field"), str):
            yield spec["field"]
        for value in spec.values():
            yield from _fields(value)
    elif isinstance(spec, list):
        for value in spec:
            yield from _fields(value)


def as_csv(rows: Sequence[dict[str, Any]], fields: Iterable[str]) -> Spec:
    """Return the columns `fields` of rows as Vega data in CSV, with `DIGITS` digits: a third of the length of JSON."""
    first = rows[0] if rows else {}
    columns = [name for name in first if name in set(fields)]
    text = io.StringIO()
    lines = csv.writer(text, lineterminator="\n")
    lines.writerow(columns)
    lines.writerows([_cell(row[name]) for name in columns] for row in rows)
    numbers = [name for name in columns if isinstance(first[name], int | float)]
    return {"values": text.getvalue(), "format": {"type": "csv", "parse": dict.fromkeys(numbers, "number")}}


def _cell(value: Any) -> str:
    return f"{value:.{DIGITS}g}" if isinstance(value, float) else str(value)
