"""The first picture of a scene and of random bodies: work against precision, the best of each family; single settings thin."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import altair as alt
import pandas as pd

from ..rows.names import MethodClass
from .figures import log_channel
from .style import HEIGHT, WIDTH, Families, apply_style, colour_scale, families_of

SINGLE = "single"
"""Name of the parameter that says whether single settings are drawn."""
SHAPES: Mapping[str, str] = {
    MethodClass.GENERAL.value: "circle",
    MethodClass.SOLUTION.value: "diamond",
    MethodClass.SOLVER.value: "square",
    MethodClass.ENGINE.value: "triangle-up",
}
"""The mark of each class."""
DASHES: Mapping[str, list[int]] = {
    MethodClass.GENERAL.value: [1, 0],
    MethodClass.SOLUTION.value: [1, 0],
    MethodClass.SOLVER.value: [6, 3],
    MethodClass.ENGINE.value: [2, 2],
}
"""The dash of each class: solid lines are ours."""


def work_precision(picture: pd.DataFrame) -> Any:
    """Return time against error, from the columns of `tables.families`."""
    data = picture.assign(microseconds=picture["time"] * 1e6, sample=picture["sample"] * 1e6, rank=range(len(picture)))
    families = families_of(data)
    x = alt.X(**log_channel("error", "largest attitude error, rad", data["error"]))
    y = alt.Y(**log_channel("microseconds", "µs per simulated second", data["microseconds"]))
    single = data["single"].astype(bool)
    thin = _lines(data[single], families, 0.8, 12).transform_filter(SINGLE)
    layers = (thin + _lines(data[~single], families, 2.2, 50)).encode(x=x, y=y).properties(width=WIDTH, height=HEIGHT)
    return apply_style(layers.add_params(alt.param(name=SINGLE, value=False)))


def _lines(data: pd.DataFrame, families: Families, width: float, size: float) -> Any:
    return (
        alt.Chart(data)
        .mark_line(strokeWidth=width, point=alt.OverlayMarkDef(size=size, filled=True, opacity=1))
        .encode(
            color=alt.Color("name:N", scale=colour_scale(families), sort=list(families)),
            shape=alt.Shape("class:N", scale=_scale(SHAPES)),
            strokeDash=alt.StrokeDash("class:N", scale=_scale(DASHES)),
            detail="line:N",
            order=alt.Order("rank:Q"),
        )
    )


def _scale(looks: Mapping[str, Any]) -> alt.Scale:
    return alt.Scale(domain=list(looks), range=list(looks.values()))
