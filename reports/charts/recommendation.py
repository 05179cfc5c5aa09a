"""The chart of a recommendation: expected error over step size and over tolerance, and cost."""

from __future__ import annotations

import math
from typing import Any

import altair as alt
import pandas as pd

from conservative.benchmarks.recommendation.recommend import Recommendation
from conservative.benchmarks.studies.selection import tolerance_setting

from ..rows.names import method_text, setting_text
from .figures import log_channel
from .style import HEIGHT, PALETTE, WIDTH, Families, apply_style, families_of, look

STEP, TOLERANCE = "step, s", "tolerance"


def points(recommendation: Recommendation) -> pd.DataFrame:
    """Return a row for each probe, which is a trial run of a method with a setting.

    Columns: name and family of the method, kind and value of the setting, expected error in rad, number of the run, and whether
    the setting is recommended.
    """
    rows = [
        {
            "name": method_text(advice),
            "family": probe.method.family,
            "kind": STEP if tolerance_setting(probe.method) is None else TOLERANCE,
            "setting": probe.setting,
            "expected": min(probe.expected, math.pi),  # the largest angle; an axis has no place for infinity
            "run": number,
            "recommended": probe is advice.best and advice.reached,
        }
        for advice in recommendation.advice
        for number, probe in enumerate(advice.probes)
    ]
    return pd.DataFrame(rows)


def costs(recommendation: Recommendation) -> pd.DataFrame:
    """Return a row for each method that reaches the error: name, setting, cost in µs per simulated second."""
    rows = [
        {"name": method_text(advice), "setting": setting_text(advice.best), "cost": advice.cost * 1e6}
        for advice in recommendation.advice
        if advice.reached and advice.best and not math.isnan(advice.cost)
    ]
    return pd.DataFrame(rows, columns=["name", "setting", "cost"])


def picture(recommendation: Recommendation) -> Any:
    """Return the chart."""
    data, prices, question = points(recommendation), costs(recommendation), recommendation.conditions
    families = families_of(data)
    panels = [_probes(part, str(kind), families, question.error) for kind, part in data.groupby("kind", sort=True)]
    rows: list[Any] = [alt.hconcat(*panels)]
    if len(prices):
        rows.append(_costs(prices, families))
    title = f"{question.scene.name}: {question.error:g} rad over {question.duration:g} s"
    subtitle = "marks: probe runs in their order; dashed: the error asked for; ringed: recommended; pi: no estimate"
    return apply_style(alt.vconcat(*rows, title=alt.Title(title, subtitle=subtitle)))


def _probes(data: pd.DataFrame, kind: str, families: Families, error: float) -> Any:
    reach = pd.concat([data["expected"], pd.Series([error])])
    x = alt.X(**log_channel("setting", kind, data["setting"]))
    y = alt.Y(**log_channel("expected", "error to expect, rad", reach))
    channels = look(families, "shape", title="method")
    base = alt.Chart(data, width=WIDTH, height=HEIGHT).encode(x=x, y=y)
    lines = base.mark_line(strokeWidth=1.2).encode(color=channels["color"], detail="name:N", order="run:Q")
    marks = base.mark_point(filled=True, size=48, opacity=1).encode(**channels)
    rings = base.transform_filter("datum.recommended").mark_point(size=200, color=PALETTE["black"], strokeWidth=1.5)
    wanted = alt.Chart(pd.DataFrame({"expected": [error]})).mark_rule(strokeDash=[6, 3], color=PALETTE["black"]).encode(y=y)
    return wanted + lines + marks + rings


def _costs(data: pd.DataFrame, families: Families) -> Any:
    x = alt.X(**log_channel("cost", "wall time per simulated second, µs", data["cost"]))
    y = alt.Y("name:N", sort=alt.EncodingSortField("cost"), title=None, axis=alt.Axis(labelLimit=320))
    base = alt.Chart(data, width=WIDTH, height=alt.Step(22), title="cost of what reaches it").encode(x=x, y=y)
    colour = look(families, "shape")["color"].legend(None)
    return base.mark_point(filled=True, size=90, opacity=1).encode(color=colour) + base.mark_text(
        align="left", dx=9, fontSize=11
    ).encode(text="setting:N")
