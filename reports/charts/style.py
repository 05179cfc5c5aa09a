"""One look for every picture: colours by family, marks by setting, sizes, and a number format.

The colours are from Okabe and Ito (2008), then from Tol's muted scheme; colour-blind readers can distinguish them. Marks and
dashes distinguish settings.
"""

from __future__ import annotations

import math
import re
import struct
import zlib
from collections.abc import Mapping, Sequence
from typing import Any

import altair as alt
import pandas as pd
import vl_convert

from conservative import registry
from conservative.method import Method, Role

from ..document import MARK, SVG_MARK

Families = Mapping[str, str]
"""The family of each line of a picture by its name, in the order of legends."""

PALETTE = {
    "blue": "#0072B2",
    "sky": "#56B4E9",
    "indigo": "#332288",
    "wine": "#882255",
    "olive": "#999933",
    "teal": "#44AA99",
    "green": "#009E73",
    "vermilion": "#D55E00",
    "orange": "#E69F00",
    "purple": "#CC79A7",
    "black": "#000000",
    "grey": "#7F7F7F",
}
"""Colours that `MethodInfo.colour` can name; legends list families of one role in this order."""
_OTHERS = ("#661100", "#117733", "#AA4499", "#DDCC77", "#88CCEE", "#CC6677", "#6699CC")
"""For families that name no colour, in the order of their names (Tol's muted scheme)."""

SHAPES = ("circle", "square", "triangle-up", "diamond", "cross", "triangle-down", "triangle-left", "triangle-right")
DASHES = ([1, 0], [6, 3], [2, 2], [8, 3, 2, 3], [4, 4], [10, 4], [1, 3], [6, 2, 1, 2])

WIDTH, HEIGHT = 420, 260


def family_colours() -> dict[str, str]:
    """Return the colours that registered families name, in the order of legends: by role, then by the palette."""
    places = list(PALETTE)

    def place(family: type[Method]) -> tuple[int, int]:
        colour = family.method_info.colour
        return list(Role).index(family.role), places.index(colour) if colour in places else len(places)

    families = [family for family in registry.list_families().values() if family.method_info.colour is not None]
    return {
        family.family: PALETTE.get(str(family.method_info.colour), str(family.method_info.colour))
        for family in sorted(families, key=place)
    }


def order_lines(families: Mapping[str, str]) -> Families:
    """Return lines in the order of legends: families in the order of their colours, numbers by value."""
    coloured = list(family_colours())
    rank = {name: coloured.index(family) if family in coloured else len(coloured) for name, family in families.items()}
    return {name: families[name] for name in sorted(rank, key=lambda name: (rank[name], _by_value(name)))}


def families_of(rows: pd.DataFrame) -> Families:
    """Return the lines of data with columns name and family, in the order of legends."""
    return order_lines(dict(zip(rows["name"], rows["family"], strict=True)))


def _by_value(name: str) -> list[tuple[float, str]]:
    """Return a name as a key by which order=4 comes before order=10."""
    parts = filter(None, re.split(r"(\d+(?:\.\d+)?(?:e[+-]?\d+)?)", name))
    return [(float(part), "") if part[0].isdigit() else (math.inf, part) for part in parts]


def colours(families: Families) -> dict[str, str]:
    """Return the colour of each line: the colour of its family, which is the same in every picture."""
    named = family_colours()
    nameless = sorted(name for name, family in registry.list_families().items() if family.role in (Role.OURS, Role.BASELINE))
    strangers = [name for name in dict.fromkeys([*nameless, *sorted(set(families.values()))]) if name not in named]
    assigned = named | {family: _OTHERS[i % len(_OTHERS)] for i, family in enumerate(strangers)}
    return {name: assigned[family] for name, family in families.items()}


def number_in_family(families: Families) -> dict[str, int]:
    """Return the number of each line within its family, from 0."""
    lines = pd.Series(list(families.values()), dtype="object")
    return dict(zip(families, lines.groupby(lines).cumcount().tolist(), strict=True))


def scale(looks: Mapping[str, Any]) -> alt.Scale:
    """Return the scale that maps names to their colours, marks or dashes."""
    return alt.Scale(domain=list(looks), range=list(looks.values()))


def look(families: Families, second: str, **legend: Any) -> dict[str, Any]:
    """Return the channels of lines: the colour of the family, and the mark ("shape") or dash ("strokeDash") of the setting."""
    shown = alt.Legend(**({"columns": 1 + len(families) // 32, "symbolLimit": 0} | legend))  # 0: without a limit
    looks: Sequence[Any] = SHAPES if second == "shape" else DASHES
    of_settings = [looks[number % len(looks)] for number in number_in_family(families).values()]
    looks_of = {"color": colours(families), second: dict(zip(families, of_settings, strict=True))}
    channels = {"color": alt.Color, "shape": alt.Shape, "strokeDash": alt.StrokeDash}
    return {
        name: channels[name]("name:N", scale=scale(values), sort=list(families), legend=shown)
        for name, values in looks_of.items()
    }


_POWER = "datum.value >= 0.01 && datum.value < 1e6 ? format(datum.value, ',~r') : format(datum.value, '~e')"
"""Vega expression for the numbers of an axis: plain, or with an exponent if very small or large."""


def power_axis(title: str, low: float, high: float) -> alt.Axis:
    """Return a logarithmic axis with labels at powers of ten: not at all of many, and between few."""
    first, last = math.ceil(math.log10(low)), math.floor(math.log10(high))
    every = 1 + (last - first) // 12
    powers = [10.0**k for k in range(first, last + 1) if k % every == 0]
    within = range(math.floor(math.log10(low)), last + 1)
    few, many = (
        [m * 10.0**k for k in within for m in mantissas if low <= m * 10.0**k <= high]
        for mantissas in ((1, 2, 5), range(1, 10))
    )
    values = powers if len(powers) > 2 else few if len(few) > 1 else many
    return alt.Axis(title=title, labelExpr=_POWER, values=values if len(values) > 1 else alt.Undefined)


def apply_style(chart: Any) -> Any:
    """Return a whole picture with the common fonts, on white, so that it reads the same on any page."""
    return chart.configure(  # in one call, as each copies the whole picture
        background="white",
        padding=12,
        font="sans-serif",
        axis=alt.AxisConfig(
            labelFontSize=11, titleFontSize=12, titleFontWeight="normal", gridColor="#E6E6E6", domainColor=PALETTE["grey"]
        ),
        view=alt.ViewConfig(stroke=None),
        legend=alt.LegendConfig(labelFontSize=11, titleFontSize=12, labelLimit=320, symbolStrokeWidth=2, symbolSize=80),
        title=alt.TitleConfig(fontSize=13, fontWeight="bold", anchor="start", offset=8),
    )


def specification(chart: Any) -> dict[str, Any]:
    """Return a picture in Vega-Lite, with any number of rows: Altair refuses more than 5,000, which a full report has."""
    with alt.data_transformers.disable_max_rows():
        whole: dict[str, Any] = chart.to_dict()
    return whole


def svg_text(chart: Any) -> str:
    """Return a picture as SVG that begins with the mark by which a command knows its own files."""
    return f"{SVG_MARK}\n{vl_convert.vegalite_to_svg(specification(chart))}"


def picture_file(chart: Any, kind: str) -> bytes:
    """Return the file of a picture of a kind in `PICTURES`, with the mark."""
    if kind == ".svg":
        return svg_text(chart).encode()
    png, text = vl_convert.vegalite_to_png(specification(chart), scale=2), f"tEXtSoftware\0{MARK}".encode()
    chunk = struct.pack(">I", len(text) - 4) + text + struct.pack(">I", zlib.crc32(text))
    return png[:33] + chunk + png[33:]  # after the header
