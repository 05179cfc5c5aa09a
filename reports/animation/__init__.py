"""Animations of motions: several trajectories side by side on one clock, as a page, as part of a page, or as a video.

Each panel draws the body as its inertia box, the box of constant density with the same moments, centred at the fixed point. An
arrow is the angular momentum, relative to its initial size. A rod along one axis of the body leaves a trace.
`player.js` draws with three.js, which `.ci/three/build` bundles.
"""

from __future__ import annotations

import base64
import gzip
import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from html import escape
from pathlib import Path

from conservative.errors import BadInput
from conservative.files import write_bytes
from conservative.trajectory import Trajectory

from .frames import Panel, make_panels

KINDS = (".html", ".gif", ".mp4")
"""Endings of files that contain an animation."""
MARK = "Written by conservative watch"
"""Text near the beginning of each such file."""
_LIMITS = {"attitude error": "1e-3 0.1"}
"""Values up to which a number is green and amber; see `_DRIFTS` for the others."""
_DRIFTS = "1e-10 1e-3"


@dataclass(frozen=True, eq=False)
class Animation:
    """An animation of trajectories. A notebook shows it; `save` writes it into a file.

    Attributes
    ----------
    trajectories, labels
        The motions and the title of each panel.
    truth
        Index of the trajectory that is the reference solution, which the other panels show as an outline; None without one.
    """

    trajectories: Sequence[Trajectory]
    labels: Sequence[str]
    truth: int | None = None

    def save(self, path: str | Path) -> None:
        """Write a page (.html), or a video (.gif, .mp4); an existing file is replaced.

        Raises
        ------
        BadInput
            The name has another ending, or the file cannot be written.
        MissingExtra
            matplotlib or imageio-ffmpeg, of the extra `video`, is not installed.
        """
        write_bytes(Path(path), self.render(Path(path).suffix), "path")

    def render(self, kind: str, progress: Callable[[float], None] = lambda share: None) -> bytes:
        """Return the contents of a file of a kind in `KINDS`, as `save` does. `progress` gets the share of a video."""
        if kind not in KINDS:
            raise BadInput("path", f"a file that ends in {kind!r}", f"one that ends in {', '.join(KINDS)}")
        if kind == ".html":
            return self._page().encode()
        from .video import draw

        clock, panels = make_panels(self.trajectories, self.labels, self.truth)
        return draw(clock, panels, self.truth, kind, MARK, progress)

    def _page(self) -> str:
        title = escape(self.trajectories[0].scene.name)
        return (
            f'<!DOCTYPE html>\n<!-- {MARK} -->\n<html lang="en"><head><meta charset="utf-8"><title>{title}</title>\n'
            '<meta name="viewport" content="width=device-width, initial-scale=1"><link rel="icon" href="data:,">\n'
            "<style>:root { color-scheme: light; } body { font: 16px/1.4 system-ui, sans-serif; margin: 1rem auto; "
            f"max-width: 78rem; padding: 0 1rem; }} h1 {{ font-size: 1.35rem; }}</style></head>\n<body><main><h1>{title}</h1>\n"
            f"{element(self.trajectories, self.labels, truth=self.truth)}</main>\n{script()}</body></html>\n"
        )

    def _repr_html_(self) -> str:
        height = 160 + 330 * math.ceil(len(self.trajectories) / 4)
        return f'<iframe srcdoc="{escape(self._page())}" style="width: 100%; height: {height}px; border: 0"></iframe>'


def script() -> str:
    """Return the style, the packed library and the player of all animations of a page, for the end of the page."""
    style, library, player = ((Path(__file__).parent / name).read_bytes() for name in ("player.css", "three.js", "player.js"))
    packed = base64.b64encode(gzip.compress(library, mtime=0)).decode()
    return (
        f'<style>\n{style.decode()}</style>\n<script type="application/gzip" id="three">{packed}</script>\n'
        f"<script>\n{player.decode()}</script>\n"
    )


def element(
    trajectories: Sequence[Trajectory],
    labels: Sequence[str],
    id: str = "motion",
    truth: int | None = None,
    numbers: bool = True,
) -> str:
    """Return the HTML of an animation with its data; `script` makes it move.

    Parameters
    ----------
    trajectories, labels
        The motions, from t = 0, and the title of each panel. They share one clock, so their steps can differ.
    id
        Identifier of the element on the page.
    truth
        Index of the reference solution, or None. The other panels show its attitude as an outline, and their attitude error.
    numbers
        True to show the largest drifts and attitude error so far below each panel. The error is correct to the interpolation
        between the samples of the truth, if the times of the samples differ.

    Raises
    ------
    BadInput
        A trajectory has no samples, there is not one label for each, or the body turns too often to be watched.
    """
    clock, panels = make_panels(trajectories, labels, truth)
    if not numbers:
        panels = [replace(panel, sizes={}) for panel in panels]
    data = {
        "duration": clock.duration,
        "frames": len(clock.times),
        "truth": truth,
        "panels": [panel.data() for panel in panels],
    }
    content = json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    speeds = "".join(f'<option value="{s:g}"{" selected" if s == clock.speed else ""}>{s:g}</option>' for s in clock.speeds)
    return (
        f'<div class="motion" id="{escape(id)}" role="group" aria-label="Animation of {escape(trajectories[0].scene.name)}">\n'
        '<p class="missing" hidden>This browser has no WebGL, so the bodies are not drawn. The numbers below still follow the '
        "slider. Open the page in another browser, or switch on hardware acceleration.</p>\n"
        f'<div class="panels">{"".join(map(_panel, panels))}</div>\n<div class="controls">'
        '<button type="button" class="play">Play</button><input class="time" type="range" min="0" '
        f'max="{clock.duration!r}" step="{clock.duration / 1000!r}" value="0" aria-label="time, s">'
        '<output class="clock"></output>'
        f'<label>simulated s per s <select class="speed">{speeds}</select></label></div>\n'
        f'<script type="application/json" class="data">{content}</script>\n</div>\n'
    )


def _panel(panel: Panel) -> str:
    values = "".join(
        f'<dt>{escape(name)}{", rad" * (name in _LIMITS)}</dt><dd data-limits="{_LIMITS.get(name, _DRIFTS)}"></dd>'
        for name in panel.sizes
    )
    failed = f'<div class="ended" hidden>{escape(panel.outcome)}</div>' if panel.outcome else ""
    return (
        f'<figure><canvas role="img" aria-label="{escape(panel.label)}: the moving body"></canvas>'
        f'<figcaption><strong>{escape(panel.label)}</strong><dl class="values">{values}{failed}</dl></figcaption></figure>'
    )
