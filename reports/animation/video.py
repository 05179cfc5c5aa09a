"""Animations as .gif and .mp4: the scene of the page, drawn by matplotlib."""

from __future__ import annotations

import io
import math
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from conservative.attitude import Array
from conservative.errors import require_extra

from .frames import Clock, Panel

FACES = ("#d55e00", "#f2b48a", "#0072b2", "#8fc4e8", "#e0a800", "#f7e3a1")
"""Colours of the faces +x, -x, +y, -y, +z and -z, as in the page."""
ARROW, TRACE, OUTLINE, INK = "#009e73", "#cc3399", "#808890", "#202428"
RATES = {".gif": 12.5, ".mp4": 30.0}
"""Frames per second; a GIF counts in hundredths of a second."""
SIDE, DPI = 1.92, 100
"""Side of a panel, inches, and pixels per inch: multiples of 16 pixels, which encoders ask for."""
EYE = np.array([math.cos(0.35) * math.cos(0.6), math.cos(0.35) * math.sin(0.6), math.sin(0.35)])
"""Direction from the body to the eye, world axes, as in the page."""
_CORNERS = np.array([[x, y, z] for x in (1, -1) for y in (1, -1) for z in (1, -1)]) / 2
_SIDES = [np.flatnonzero(_CORNERS[:, axis] == sign / 2)[[0, 1, 3, 2]] for axis in range(3) for sign in (1, -1)]


def draw(
    clock: Clock, panels: Sequence[Panel], truth: int | None, kind: str, mark: str, progress: Callable[[float], None]
) -> bytes:
    """Return a video with an ending of `RATES`, at the default speed, with `mark` as its comment.

    Raises
    ------
    MissingExtra
        matplotlib, or for .mp4 imageio-ffmpeg, is not installed.
    """
    require_extra(f"Writing {kind}", "video", "matplotlib", *["imageio_ffmpeg"] * (kind == ".mp4"))
    images = _images(clock, panels, truth, RATES[kind], progress)
    if kind == ".gif":
        from PIL import Image

        inks = np.array([_rgb(colour) for colour in (*FACES, ARROW, TRACE, OUTLINE, INK)])
        shades = np.concatenate([[np.full(3, 255)], inks, (inks + 255) / 2, (inks + _rgb(INK)) / 2])  # blended at their edges
        palette = Image.new("P", (1, 1))
        palette.putpalette(shades.astype(np.uint8).ravel().tolist())
        first, *rest = (Image.fromarray(image).quantize(palette=palette, dither=Image.Dither.NONE) for image in images)
        out = io.BytesIO()
        first.save(
            out,
            "GIF",
            save_all=True,
            append_images=rest,
            duration=round(1000 / RATES[kind]),
            loop=0,
            comment=mark,
            optimize=True,
        )
        return out.getvalue()
    import imageio_ffmpeg

    with tempfile.TemporaryDirectory() as folder:
        file, first_image = Path(folder, "video.mp4"), next(images)
        height, width = first_image.shape[:2]
        options = ["-movflags", "+faststart", "-metadata", f"comment={mark}"]  # faststart: the comment comes first
        writer = imageio_ffmpeg.write_frames(str(file), (width, height), fps=RATES[kind], quality=8, output_params=options)
        writer.send(None)
        for image in (first_image, *images):
            writer.send(np.ascontiguousarray(image))
        writer.close()
        return file.read_bytes()


def _images(
    clock: Clock, panels: Sequence[Panel], truth: int | None, rate: float, progress: Callable[[float], None]
) -> Iterator[Any]:
    """Yield the images (height, width, 3) of a video, bytes."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    columns = min(len(panels), 4)
    rows = math.ceil(len(panels) / columns)
    figure = Figure(figsize=(columns * SIDE, rows * (SIDE + 0.64)), dpi=DPI)
    canvas: Any = FigureCanvasAgg(figure)
    axes = [figure.add_subplot(rows, columns, k + 1, projection="3d", computed_zorder=False) for k in range(len(panels))]
    figure.subplots_adjust(0, 0.64 / (SIDE + 0.64) / rows, 1, 1 - 0.06 / rows, wspace=0, hspace=0.2)
    count = max(2, round(clock.duration / clock.speed * rate))
    for number, frame in enumerate(np.linspace(0, len(clock.times) - 1, count).round().astype(int)):
        progress(number / count)
        for axis, panel in zip(axes, panels, strict=True):
            outline = (
                None if truth is None or panel is panels[truth] else panels[truth].R_WP[min(frame, len(panels[truth].R_WP) - 1)]
            )
            _draw_panel(axis, panel, min(frame, len(panel.R_WP) - 1), outline)
        figure.texts.clear()
        figure.text(0.01, 0.99, f"{clock.times[frame]:.2f} s", va="top", size=8, color=INK)
        canvas.draw()
        yield np.asarray(canvas.buffer_rgba())[..., :3].copy()


def _draw_panel(axes: Any, panel: Panel, frame: int, outline: Array | None) -> None:
    from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

    axes.clear()
    axes.set_axis_off()
    axes.view_init(elev=math.degrees(math.asin(EYE[2])), azim=math.degrees(math.atan2(EYE[1], EYE[0])))
    axes.set(xlim=(-1, 1), ylim=(-1, 1), zlim=(-1, 1))
    axes.set_box_aspect((1, 1, 1), zoom=1.05)
    R = panel.R_WP[frame]
    corners = (_CORNERS * panel.size) @ R.T
    normals = np.repeat(R.T, 2, axis=0) * np.tile([1.0, -1.0], 3)[:, None]
    faces = [corners[side] for side in _SIDES]
    seen = [k for k in range(6) if normals[k] @ EYE > 0]  # of a convex body, no face that is seen hides another one
    axes.add_collection3d(
        Poly3DCollection(
            [faces[k] for k in seen], facecolors=[FACES[k] for k in seen], edgecolors=INK, linewidths=0.6, zorder=2
        )
    )
    # What lies nearer to the eye than the fixed point is drawn after the box, the rest before it.
    trace = panel.R_WP[: frame + 1] @ panel.tip
    segments = np.stack([trace[:-1], trace[1:]], axis=1)
    rod, arrow = (_outside(end, R, panel.size) for end in (trace[-1], 1.45 * panel.L_W[frame]))
    for lines, colour, width in ((segments, TRACE, 1.0), (rod, TRACE, 2.0), (arrow, ARROW, 2.6)):
        near = lines.mean(axis=1) @ EYE > 0
        for part, order in ((lines[~near], 1), (lines[near], 3)):
            if len(part):
                axes.add_collection3d(Line3DCollection(part, colors=colour, linewidths=width, zorder=order))
    axes.scatter(*1.45 * panel.L_W[frame], color=ARROW, marker="^", s=34, depthshade=False, zorder=3)
    if outline is not None:
        corners = (_CORNERS * panel.size) @ outline.T
        edges = [corners[side] for side in _SIDES]
        axes.add_collection3d(Poly3DCollection(edges, facecolors="none", edgecolors=OUTLINE, linewidths=0.7, zorder=4))
    values = [f"{name}{', rad:' * (name == 'attitude error')} {_text(series[frame])}" for name, series in panel.sizes.items()]
    axes.text2D(0.5, 0.0, panel.label, transform=axes.transAxes, ha="center", va="top", size=8, weight="bold", color=INK)
    axes.text2D(0.5, -0.08, "\n".join(values), transform=axes.transAxes, ha="center", va="top", size=7, color=INK)


def _outside(end: Array, R_WP: Array, size: Array) -> Array:
    """Return the part outside the box of the segment from the fixed point to `end` (3,), (1, 2, 3)."""
    with np.errstate(divide="ignore"):
        leaves = float(np.min(size / 2 / np.abs(end @ R_WP)))
    return np.stack([min(leaves, 1.0) * end, end])[None]


def _rgb(colour: str) -> Array:
    return np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)], dtype=float)


def _text(value: float) -> str:
    return "< 1e-15" if value < 1e-15 else f"{value:.1g}" if 0.1 <= value < 10 else f"{value:.0e}".replace("e-0", "e-")
