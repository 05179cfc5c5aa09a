"""Animations: trajectories side by side on one clock, as a page, as part of a page (`script`, `element`), or as a GIF.

Each panel draws the body as the box of constant density with the same moments, centred at the fixed point, and a symmetric top
as the cone that stands on it. An arrow is the angular momentum, relative to its initial size. A rod along one axis of the body
leaves a trace.
`player.js` draws with `vendor/three.js`, which `.ci/three/build` bundles.
"""

from __future__ import annotations

import base64
import gzip
import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path

from conservative.errors import require_extra
from conservative.files import require_ending, write_bytes
from conservative.trajectory import Trajectory

from .frames import COLOURS, Values, legend, make_panels, speeds
from .frames import largest_values as largest_values
from .frames import longest as longest

KINDS = (".html", ".gif", ".png")
"""Endings of files that contain an animation, or its last frame."""
MARK = "Written by conservative watch"
"""Text near the beginning of each such file."""
_HERE = Path(__file__).parent


@dataclass(frozen=True, eq=False)
class Animation:
    """An animation of trajectories. A notebook shows it; `save` writes it into a file.

    Attributes: `trajectories`, `labels` (the titles of the panels), and `truth`, the index of the reference solution, which the
    other panels show as an outline, or None. `values` as in `element`.
    """

    trajectories: Sequence[Trajectory]
    labels: Sequence[str]
    truth: int | None = None
    values: Sequence[Values | None] | None = None

    def save(self, path: str | Path) -> None:
        """Write a page (.html), a GIF (.gif), or the last frame (.png); an existing file is replaced.

        Raises
        ------
        BadInput
            The name has another ending, or the file cannot be written; or as in `element`.
        MissingExtra
            A package is not installed: for pages of the extra `report`, for GIFs and frames of `video`.
        """
        require_ending("path", Path(path), KINDS)
        write_bytes(Path(path), self.render(Path(path).suffix), "path")

    def render(self, kind: str, progress: Callable[[float], None] = lambda share: None) -> bytes:
        """Return the contents of a file of a kind in `KINDS`, as `save` does. `progress` gets the finished share of a GIF."""
        if kind == ".html":
            motion = element(self.trajectories, self.labels, truth=self.truth, values=self.values)
            name = self.trajectories[0].scene.name
            page = {"name": name, "mark": MARK, "motion": motion, "script": script(), "panels": len(self.trajectories)}
            return _fill("page.html.j2", **page).encode()
        from .video import draw

        return draw(*make_panels(self.trajectories, self.labels, self.truth, self.values), self.truth, kind, MARK, progress)

    def _repr_html_(self) -> str:
        height = 160 + 330 * math.ceil(len(self.trajectories) / 4)
        page = escape(self.render(".html").decode())
        return f'<iframe srcdoc="{page}" style="width: 100%; height: {height}px; border: 0"></iframe>'


def script() -> str:
    """Return the style, the packed library and the player of all animations of a page, for the end of the page."""
    style, library, player = ((_HERE / name).read_bytes() for name in ("player.css", "vendor/three.js", "player.js"))
    packed = base64.b64encode(gzip.compress(library, mtime=0)).decode()
    three = f'<script type="application/gzip" id="three">{packed}</script>'
    return f"<style>\n{style.decode()}</style>\n{three}\n<script>\n{player.decode()}</script>\n"


def element(
    trajectories: Sequence[Trajectory],
    labels: Sequence[str],
    id: str = "motion",
    truth: int | None = None,
    values: Sequence[Values | None] | None = None,
) -> str:
    """Return the HTML of an animation with its data; `script` makes it move.

    Parameters
    ----------
    trajectories, labels
        The motions, from t = 0, and the title of each panel. They share one clock, so their steps can differ.
    id
        Identifier of the element on the page.
    truth
        Index of the reference solution, or None. The other panels show its attitude as an outline.
    values
        The numbers of each panel (see `largest_values`), or None for the drifts at the samples and, with a reference solution,
        for the attitude errors there. Samples of the reference solution at other times are moved there by integration.

    Raises
    ------
    BadInput
        A trajectory has no samples, there is not one label for each, or the body turns too often to be watched.
    """
    times, panels = make_panels(trajectories, labels, truth, values)
    duration, name = float(times[-1]), trajectories[0].scene.name
    content = {"duration": duration, "frames": len(times), "truth": truth, "colours": COLOURS}
    data = json.dumps(content | {"panels": [panel.data() for panel in panels]}, separators=(",", ":"), allow_nan=False)
    data = data.replace("<", "\\u003c")  # a label with </script> must not end the script that contains the data
    return frame(panels, name, duration, id, data, legend(panels, truth))


def frame(
    panels: Sequence[object], name: str, duration: float, id: str, data: str, legend: Sequence[tuple[str, str]] = ()
) -> str:
    """Return the HTML of an animation of panels with `label`, `outcome` and names of `sizes`.

    `data` is JSON. A script of the page can set the property `content` of the element instead, in the same form, and dispatch
    an event of that name after each change. A panel with `moments` in place of `q` shows its `L` in principal axes. `legend`
    has colours and texts.
    """
    return _fill(
        "motion.html.j2", id=id, name=name, panels=panels, duration=duration, speeds=speeds(duration), data=data, legend=legend
    )


def _fill(template: str, **values: object) -> str:
    require_extra("An animation", "report", "jinja2")
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    loader = FileSystemLoader(_HERE)
    environment = Environment(loader=loader, undefined=StrictUndefined, autoescape=True, trim_blocks=True, lstrip_blocks=True)
    return environment.get_template(template).render(values)
