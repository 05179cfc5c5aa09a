"""The columns of a table of samples, the chart of a trajectory, and an HTML table. Altair is imported on demand.

The argument `trajectory` is always a `Trajectory`, whose file imports this one.
"""

from __future__ import annotations

from contextlib import suppress
from html import escape
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from .attitude import Array
from .errors import BadInput, require_extra
from .invariants import sizes

if TYPE_CHECKING:
    import altair

COLUMNS = (
    "t",
    *(f"R_WB_{row}{column}" for row in "123" for column in "123"),
    *(f"q_WB_{part}" for part in "wxyz"),
    *(f"w_WB_B_{axis}" for axis in "123"),
    "energy",
    *(f"momentum_W_{axis}" for axis in "123"),
)
"""Columns of a table of samples: attitudes by rows and as quaternions, rates in body axes, momentum in world axes."""
FLIGHT_COLUMNS = tuple(f"{name}_{axis}" for name in ("p_WB", "v_WB") for axis in "123")
"""Further columns in free flight, world axes."""

UNITS = {"t": "s", "w": "rad/s", "energy": "J", "momentum": "kg m^2/s", "p": "m", "v": "m/s"}
"""Units of the columns, by the first part of their names; attitudes have none."""

LEAST_DRAWN = 1e-17
"""Smallest relative drift in a chart, also drawn for smaller ones and 0: a tenth of the round-off of one number."""

MOST_DRAWN = 480
"""Largest number of points of a line, as many as its pixels: more samples are drawn as an envelope, as fast motions need it."""
TIME_UNITS = (("days", 86400.0), ("h", 3600.0), ("s", 1.0))
"""Units of time axes by their length, s. A unit is used from a duration of two on."""

_WIDTH, _HEIGHT = 480, 160


def samples(trajectory: Any) -> Array:
    """Return a row for each of n samples under `columns`, (n, 21) or (n, 27), in SI units."""
    R_by_rows = trajectory.R_WB.reshape(len(trajectory), 9)
    state = trajectory.t, R_by_rows, trajectory.quaternion_wxyz, trajectory.w_WB_B, trajectory.energy, trajectory.momentum_W
    return np.column_stack([*state, *trajectory.place])


def columns(trajectory: Any) -> list[str]:
    """Return the columns of a table of samples: `COLUMNS` and, in free flight, `FLIGHT_COLUMNS`."""
    return [*COLUMNS, *FLIGHT_COLUMNS] if trajectory.scene.flight else list(COLUMNS)


def header(trajectory: Any) -> list[str]:
    """Return the columns with their units, such as `w_WB_B_1 (rad/s)`."""
    units = {name: UNITS.get(name.split("_")[0]) for name in columns(trajectory)}
    return [f"{name} ({unit})" if unit else name for name, unit in units.items()]


def picture(trajectory: Any) -> altair.VConcatChart:
    """Return an interactive chart of the body rates and of the drift of every invariant over time (`Trajectory.plot`)."""
    require_extra("Trajectory.plot", "report", "altair", "pandas")
    import altair as alt

    if not len(trajectory):
        raise BadInput("trajectory", repr(trajectory), "a trajectory with at least one sample")
    rates = {f"about axis {number}": rate for number, rate in enumerate(trajectory.w_WB_B.T, start=1)}
    drifts = {
        invariant.name: np.maximum(sizes(trajectory.drift(invariant)), LEAST_DRAWN) for invariant in trajectory.scene.invariants
    }
    title = alt.Title(trajectory.scene.name, subtitle=[trajectory.label, str(trajectory.outcome)])
    rows = [
        _lines(trajectory, rates, "body rate, rad/s", "linear"),
        _lines(trajectory, drifts, "relative drift", "log"),
    ]
    return _offline(alt.vconcat(*rows, title=title).resolve_scale(color="independent"))


def _offline(chart: altair.VConcatChart) -> altair.VConcatChart:
    """Return a chart that a notebook shows without a network.

    A notebook that renders Vega-Lite itself, such as JupyterLab, gets the specification, others an SVG if `vl-convert` is
    installed. Altair's default is a page that loads scripts from a server.
    """
    import altair as alt

    class Offline(alt.VConcatChart):
        def _repr_mimebundle_(self, *args: object, **kwds: object) -> dict[str, Any]:
            specification = self.to_dict()
            version = str(specification["$schema"]).rpartition("/")[2].partition(".")[0]
            name = "chart of body rates and drifts"
            shown: dict[str, Any] = {f"application/vnd.vegalite.{version}+json": specification, "text/plain": name}
            with suppress(ImportError):
                import vl_convert

                shown["image/svg+xml"] = vl_convert.vegalite_to_svg(specification)
            return shown

    return Offline.from_dict(chart.to_dict(), validate=False)


def time_unit(duration: float) -> tuple[str, float]:
    """Return the unit of an axis of time for a duration in s, "s", "h" or "days", and its length, s."""
    return next(((name, length) for name, length in TIME_UNITS if duration >= 2 * length), TIME_UNITS[-1])


def _lines(trajectory: Any, series: dict[str, Array], quantity: str, scale: Literal["linear", "log"]) -> Any:
    """Return one line for each of `series`, (n,), over time.

    Of many samples, each interval has its largest value on a logarithmic axis, and the band of all values on a linear one.
    """
    import altair as alt
    import pandas as pd

    n, (unit, length) = len(trajectory), time_unit(float(trajectory.t[-1]))
    starts = ends = np.arange(n)
    if many := n > MOST_DRAWN:
        starts, ends = (np.linspace(0, n - 1, MOST_DRAWN + 1).astype(int)[part] for part in (slice(-1), slice(1, None)))
    t, tables = (trajectory.t[starts] + trajectory.t[ends]) / 2 / length, []
    for name, values in series.items():  # an interval has both its ends, so that bands join
        low, high = (extreme(extreme.reduceat(values, starts), values[ends]) for extreme in (np.minimum, np.maximum))
        tables.append(pd.DataFrame({"t": t, "of": name, "value": high, "low": low}))
    base = alt.Chart(pd.concat(tables), width=_WIDTH, height=_HEIGHT).encode(
        x=alt.X("t:Q", title=f"time, {unit}"),
        y=alt.Y("value:Q", title=quantity, axis=alt.Axis(format=".0e") if scale == "log" else {}, scale=alt.Scale(type=scale)),
        color=alt.Color("of:N", title=quantity, sort=list(series)),
        tooltip=[
            alt.Tooltip("of:N", title="what"),
            alt.Tooltip("t:Q", title=f"time, {unit}"),
            *(alt.Tooltip(f"{name}:Q", format=".6g") for name in ("value", "low")[: 1 + (many and scale == "linear")]),
        ],
    )
    line: Any = base.mark_line(strokeWidth=1.5)
    if many and scale == "linear":  # the lines show where the band is thin, as in slow motions
        line = base.mark_area(opacity=0.35).encode(y2="low:Q") + line + line.encode(y="low:Q")
    return line.interactive(name=f"zoom_{scale}", bind_y=False)


def html_table(caption: str, rows: list[tuple[str, str]]) -> str:
    """Return an HTML table with a row for each pair of a heading and a text."""
    body = "".join(f'<tr><th scope="row" style="text-align:left">{escape(k)}</th><td>{escape(v)}</td></tr>' for k, v in rows)
    return f"<table><caption>{caption}</caption>{body}</table>"
