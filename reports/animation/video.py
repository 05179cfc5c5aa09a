"""Animations as .gif, and their last frame as .png: the scene of the page, drawn by matplotlib."""

from __future__ import annotations

import io
import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from conservative.attitude import Array
from conservative.errors import require_extra

from .frames import COLOURS, FACES, Panel, speeds

ARROW, TRACE, OUTLINE, INK = (str(COLOURS[name]) for name in ("arrow", "trace", "outline", "ink"))
RATE = 12.5
"""Frames per second; a GIF counts in hundredths of a second."""
PAUSE = 2000
"""Time, ms, for which the last frame of a GIF stays before the motion starts again."""
SIDE, BELOW, DPI, FINE = 1.92, 0.64, 100, 300
"""Sides of the picture of a panel and of the least text below it, inches. Pixels per inch of a GIF, and of a single frame."""
TITLE, LINE = 0.17, 0.117
"""Heights of the title of a panel and of a line of numbers, inches."""
TILT, TURN = 20.0, 34.4
"""Direction to the eye, degrees, as in the page."""
EYE = np.array([math.cos(math.radians(TURN)), math.sin(math.radians(TURN)), math.tan(math.radians(TILT))])
_CORNERS = np.array([[x, y, z] for x in (1, -1) for y in (1, -1) for z in (1, -1)]) / 2
_SIDES = [np.flatnonzero(_CORNERS[:, axis] == sign / 2)[[0, 1, 3, 2]] for axis in range(3) for sign in (1, -1)]


def draw(
    times: Array, panels: Sequence[Panel], truth: int | None, kind: str, mark: str, progress: Callable[[float], None]
) -> bytes:
    """Return a GIF at the default speed, or the last frame, .png, with `mark` as its comment.

    Raises
    ------
    MissingExtra
        matplotlib is not installed.
    """
    require_extra(f"Writing {kind}", "video")
    if kind == ".png":
        from PIL import Image, PngImagePlugin

        out, comment = io.BytesIO(), PngImagePlugin.PngInfo()
        comment.add_text("Comment", mark)
        (image,) = _images(times, panels, truth, [len(times) - 1], FINE, progress)
        Image.fromarray(image).save(out, "PNG", pnginfo=comment, dpi=(FINE, FINE))
        return out.getvalue()
    from PIL import Image, ImageColor

    count = max(2, round(times[-1] / speeds(times[-1])[2] * RATE))
    shown = np.linspace(0, len(times) - 1, count).round().astype(int).tolist()
    images = _images(times, panels, truth, shown, DPI, progress)
    inks = np.array([ImageColor.getrgb(colour) for colour in (*FACES, ARROW, TRACE, OUTLINE, INK)])
    shades = np.concatenate([[[255] * 3], inks, (inks + 255) // 2])  # edges blend into the background
    palette = Image.new("P", (1, 1))
    palette.putpalette(shades.ravel().tolist())
    first, *rest = (Image.fromarray(image).quantize(palette=palette, dither=Image.Dither.NONE) for image in images)
    out, options = io.BytesIO(), {"save_all": True, "append_images": rest, "loop": 0, "comment": mark, "optimize": True}
    first.save(out, "GIF", duration=[*[round(1000 / RATE)] * (count - 1), PAUSE], **options)
    return out.getvalue()


def _images(
    times: Array, panels: Sequence[Panel], truth: int | None, shown: Sequence[int], dpi: int, progress: Callable[[float], None]
) -> Iterator[Any]:
    """Yield the images (height, width, 3), bytes, of the frames with the numbers `shown`."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    columns, rows = min(len(panels), 4), math.ceil(len(panels) / 4)
    below = max(BELOW, TITLE + LINE * max(len(panel.sizes) for panel in panels))
    figure = Figure(figsize=(columns * SIDE, rows * (SIDE + below)), dpi=dpi)
    canvas: Any = FigureCanvasAgg(figure)
    axes = [figure.add_subplot(rows, columns, k + 1, projection="3d", computed_zorder=False) for k in range(len(panels))]
    figure.subplots_adjust(0, below / (SIDE + below) / rows, 1, 1 - 0.06 / rows, wspace=0, hspace=below / SIDE)
    clock = figure.text(0.01, 0.99, "", va="top", size=8, color=INK)
    for number, frame in enumerate(shown):
        progress(number / len(shown))
        exact = None if truth is None else panels[truth]
        for axis, panel in zip(axes, panels, strict=True):
            _draw_panel(axis, panel, frame, None if panel is exact else exact)
        clock.set_text(f"{times[frame]:.2f} s")
        canvas.draw()
        yield np.asarray(canvas.buffer_rgba())[..., :3].copy()


def _draw_panel(axes: Any, panel: Panel, frame: int, exact: Panel | None) -> None:
    from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

    axes.clear()
    axes.set_axis_off()
    axes.view_init(elev=TILT, azim=TURN)
    axes.set(xlim=(-1, 1), ylim=(-1, 1), zlim=(-1, 1))
    axes.set_box_aspect((1, 1, 1), zoom=1.05)
    if exact is not None:
        corners = (_CORNERS * panel.size) @ exact.R_WP[min(frame, len(exact.R_WP) - 1)].T
        edges = [corners[side] for side in _SIDES]
        axes.add_collection3d(Poly3DCollection(edges, facecolors="none", edgecolors=OUTLINE, linewidths=0.7, zorder=4))
    frame = min(frame, len(panel.R_WP) - 1)
    R, arrow = panel.R_WP[frame], 1.45 * panel.L_W[frame]
    towards = np.repeat(EYE @ R, 2) * np.tile([1.0, -1.0], 3)
    corners, seen = (_CORNERS * panel.size) @ R.T, np.flatnonzero(towards > 0)  # a seen face of a convex body hides no other
    faces, colours = [corners[_SIDES[k]] for k in seen], [FACES[k] for k in seen]
    axes.add_collection3d(Poly3DCollection(faces, facecolors=colours, edgecolors=INK, linewidths=0.6, zorder=2))
    trace = panel.R_WP[: frame + 1] @ panel.tip
    with np.errstate(divide="ignore"):  # rod and arrow are drawn from where they leave the box
        rods = [np.stack([min(np.min(panel.size / 2 / np.abs(end @ R)), 1.0) * end, end]) for end in (trace[-1], arrow)]
    segments = np.stack([trace[:-1], trace[1:]], axis=1)
    for lines, colour, width in ((segments, TRACE, 1.0), (rods[0][None], TRACE, 2.0), (rods[1][None], ARROW, 2.6)):
        near = lines.mean(axis=1) @ EYE > 0  # nearer to the eye than the fixed point: drawn after the box, the rest before
        for part, order in ((lines[~near], 1), (lines[near], 3)):
            if len(part):
                axes.add_collection3d(Line3DCollection(part, colors=colour, linewidths=width, zorder=order))
    axes.scatter(*arrow, color=ARROW, marker="^", s=34, depthshade=False, zorder=3)
    values = "\n".join(f"{name}: {panel.text(name, frame)[0]}" for name in panel.sizes)
    widest = max((len(f"{name}: ✓ 1.1e-11") for name in panel.sizes), default=0)  # the same in all frames
    where: dict[str, Any] = {"transform": axes.transAxes, "ha": "center", "va": "top", "color": INK}
    axes.text2D(0.5, 0.0, panel.label, size=_fit(8, len(panel.label), 25), weight="bold", **where)
    axes.text2D(0.5, -0.08, values, size=_fit(7, widest, 33), **where)


def _fit(size: float, length: int, most: int) -> float:
    """Return the size of a text of a length, so that it is not wider than a panel, which has room for `most` characters."""
    return size * min(1.0, most / max(1, length))
