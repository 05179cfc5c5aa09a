"""Animations as .gif, and their last frame as .png: the scene of the page, drawn by Pillow.

Its fonts have letters of ASCII only, so that others are written without accents, or as question marks.
"""

from __future__ import annotations

import io
import math
import unicodedata
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from conservative.attitude import Array
from conservative.errors import require_extra

from .frames import COLOURS, FACES, GRADES, Panel, legend, speeds

ARROW, TRACE, OUTLINE, INK = (str(COLOURS[name]) for name in ("arrow", "trace", "outline", "ink"))
RATE = 12.5
"""Frames per second; a GIF counts in hundredths of a second."""
PAUSE = 2000
"""Time, ms, for which the last frame of a GIF stays before the motion starts again."""
SIDE, LINE, TITLE, MARGIN = 192, 12, 15, 4
"""Sizes in a GIF, pixels: the picture of a panel, a line of numbers, a title, and the margin of texts."""
FINE, OVER = 3, 3
"""Factors of pixels: of a single frame, for print, and of what is drawn and then averaged, so that edges are smooth."""
TURN, TILT, DISTANCE, FIELD = 0.6, 0.35, 6.8, 30.0
"""The camera of the page: its direction, rad, its distance, and its field of view, degrees."""
EYE = np.array([math.cos(TILT) * math.cos(TURN), math.cos(TILT) * math.sin(TURN), math.sin(TILT)])
_RIGHT = np.array([-math.sin(TURN), math.cos(TURN), 0.0])
_UP = np.cross(EYE, _RIGHT)
_FOCAL = 1 / math.tan(math.radians(FIELD / 2))
LONGEST_ARROW = 1.25
"""Largest angular momentum that is drawn, relative to the initial one, as on the page."""


def draw(
    times: Array, panels: Sequence[Panel], truth: int | None, kind: str, mark: str, progress: Callable[[float], None]
) -> bytes:
    """Return a GIF at the default speed, or the last frame, .png, with `mark` as its comment.

    Raises
    ------
    MissingExtra
        Pillow is not installed.
    """
    require_extra(f"Writing {kind}", "video")
    from PIL import Image, ImageColor, PngImagePlugin

    out = io.BytesIO()
    if kind == ".png":
        comment = PngImagePlugin.PngInfo()
        comment.add_text("Comment", mark)
        (image,) = _images(times, panels, truth, [len(times) - 1], FINE, progress)
        image.save(out, "PNG", pnginfo=comment, dpi=(300, 300))
        return out.getvalue()
    count = max(2, round(times[-1] / speeds(times[-1])[2] * RATE))
    shown = np.linspace(0, len(times) - 1, count).round().astype(int).tolist()
    inks = np.array([ImageColor.getrgb(colour) for colour in (*FACES, ARROW, TRACE, OUTLINE, INK, *GRADES.values())])
    shades = np.concatenate([[[255] * 3], inks, (inks + 255) // 2, [[74] * 3, [150] * 3]])  # edges blend into the background
    palette = Image.new("P", (1, 1))
    palette.putpalette(shades.ravel().tolist())
    images = _images(times, panels, truth, shown, 1, progress)
    first, *rest = (image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images)
    durations = [*[round(1000 / RATE)] * (count - 1), PAUSE]
    first.save(out, "GIF", save_all=True, append_images=rest, loop=0, comment=mark, optimize=True, duration=durations)
    return out.getvalue()


def _images(
    times: Array,
    panels: Sequence[Panel],
    truth: int | None,
    shown: Sequence[int],
    scale: int,
    progress: Callable[[float], None],
) -> Iterator[Any]:
    """Yield the images of the frames with the numbers `shown`, `scale` times as large as in a GIF."""
    from PIL import Image, ImageDraw

    columns = min(len(panels), 4)
    rows, width = math.ceil(len(panels) / columns), columns * SIDE
    below = TITLE + LINE * max(len(panel.sizes) + bool(panel.outcome) for panel in panels) + MARGIN
    sheet = _Sheet(ImageDraw.Draw(Image.new("RGB", (1, 1))), scale * OVER)
    places, end = _place_legend(sheet, legend(panels, truth), width, rows * (SIDE + below) + MARGIN)
    for number, frame in enumerate(shown):
        progress(number / len(shown))
        image = Image.new("RGB", (width * sheet.scale, end * sheet.scale), "white")
        sheet = _Sheet(ImageDraw.Draw(image), sheet.scale)
        exact = None if truth is None else panels[truth]
        for k, panel in enumerate(panels):
            corner = (k % columns * SIDE, k // columns * (SIDE + below))
            _draw_panel(sheet, corner, panel, frame, None if panel is exact else exact)
        for x, y, colour, text in places:
            sheet.chip(x, y, colour)
            sheet.text(x + LINE, y, text, 8)
        sheet.text(MARGIN, MARGIN, f"{times[frame]:.2f} s", 9)
        yield image.reduce(OVER)


@dataclass(frozen=True)
class _Sheet:
    """A drawing in the pixels of a GIF, which has `scale` times as many pixels."""

    pencil: Any
    scale: int

    def lines(self, points: Array, colour: str, width: float) -> None:
        """Draw a line through points (n, 2)."""
        self.pencil.line((points * self.scale).ravel().tolist(), colour, max(1, round(width * self.scale)), "curve")

    def fill(self, points: Array, colour: str) -> None:
        """Fill a polygon (n, 2)."""
        self.pencil.polygon((points * self.scale).ravel().tolist(), colour)

    def ball(self, rod: Array) -> None:
        """Draw a ball at the end of a rod (2, 2)."""
        (x, y), r = rod[1] * self.scale, 2.4 * self.scale
        self.pencil.ellipse((x - r, y - r, x + r, y + r), TRACE)

    def head(self, shaft: Array) -> None:
        """Draw the head of an arrow at the end of its shaft (2, 2)."""
        along = shaft[1] - shaft[0]
        length = float(np.linalg.norm(along))
        if length > 1.0:
            along = along / length
            across = 3.6 * np.array([-along[1], along[0]])
            self.fill(np.array([shaft[1] + 5 * along, shaft[1] - 4 * along + across, shaft[1] - 4 * along - across]), ARROW)

    def chip(self, x: float, y: float, colour: str) -> None:
        """Fill a small square, beside the text in the line at y."""
        self.fill(np.array([[x, y + 2], [x + 8, y + 2], [x + 8, y + 10], [x, y + 10]]), colour)

    def font(self, size: float) -> Any:
        """Return the font of a size in pixels of a GIF."""
        from PIL import ImageFont

        return ImageFont.load_default(size * self.scale)

    def width(self, text: str, size: float) -> float:
        """Return the width of a text."""
        return float(self.font(size).getlength(text) / self.scale)

    def text(self, x: float, y: float, text: str, size: float, bold: bool = False, anchor: str = "la") -> None:
        """Write a text with its upper edge at y."""
        weight = 0.1 * self.scale if bold else 0
        place = (x * self.scale, y * self.scale)
        self.pencil.text(place, text, INK, self.font(size), anchor, stroke_width=weight)

    def fit(self, text: str, size: float, room: float) -> float:
        """Return the size of a text that is not wider than the room."""
        return size * min(1.0, room / max(self.width(text, size), 1e-9))


def _ascii(text: str) -> str:
    """Return a text in the letters of the font."""
    plain = unicodedata.normalize("NFKD", text.replace("π", "pi").replace("–", "-").replace("µ", "u"))
    return "".join(letter for letter in plain if not unicodedata.combining(letter)).encode("ascii", "replace").decode()


def _place_legend(
    sheet: _Sheet, entries: Sequence[tuple[str, str]], width: float, top: int
) -> tuple[list[tuple[float, float, str, str]], int]:
    """Return place, colour and text of each entry of a legend, in lines, and where the legend ends."""
    places, x, y = list[tuple[float, float, str, str]](), float(MARGIN), top
    for colour, text in entries:
        wide = LINE + sheet.width(text, 8)
        if x > MARGIN and x + wide > width:
            x, y = float(MARGIN), y + LINE
        places.append((x, y, colour, text))
        x += wide + LINE
    return places, y + LINE + MARGIN


def _draw_panel(sheet: _Sheet, corner: tuple[int, int], panel: Panel, frame: int, exact: Panel | None) -> None:
    def seen(points: Array) -> Array:
        """Return points of the world (n, 3) on the sheet (n, 2)."""
        depth = DISTANCE - points @ EYE
        flat = np.stack([points @ _RIGHT, -points @ _UP], axis=-1) * (_FOCAL / depth)[..., None]
        return np.asarray(corner) + SIDE / 2 * (1 + flat)

    now, frame = frame, min(frame, len(panel.R_WP) - 1)  # a run that ended early stands still
    R, solid = panel.R_WP[frame], panel.solid
    arrow = panel.L_W[frame] * 1.45
    arrow = arrow * min(1.0, 1.45 * LONGEST_ARROW / max(float(np.linalg.norm(arrow)), 1e-300))
    trace, middle = panel.R_WP[: frame + 1] @ panel.tip, float(EYE @ (R @ solid.centre))
    # Strokes nearer to the eye than the middle of the body are drawn after it. Rod and arrow begin where they leave it.
    rods = [np.stack([solid.share_inside(end @ R) * end, end]) for end in (trace[-1], arrow)]
    strokes: list[tuple[Array, str, float, Callable[[Array], None] | None]]
    strokes = [*((np.stack(pair), TRACE, 1.0, None) for pair in pairwise(trace)), (rods[0], TRACE, 2.0, sheet.ball)]
    strokes.append((rods[1], ARROW, 2.4, sheet.head))
    nearer = [float(points.mean(axis=0) @ EYE) > middle for points, *_ in strokes]
    for after in (False, True):
        for (points, colour, width, end), near in zip(strokes, nearer, strict=True):
            if near is after:
                sheet.lines(seen(points), colour, width)
                if end is not None:
                    end(seen(points))
        if not after:
            for face in solid.faces:
                world = face.corners @ R.T
                normal = np.cross(world[1] - world[0], world[2] - world[0])
                if normal @ (DISTANCE * EYE - world[0]) > 0:  # a seen face of a convex body hides no other
                    sheet.fill(seen(world), face.colour)
                    for edge in face.edges:
                        sheet.lines(seen(world[list(edge)]), INK, 0.6)
    if exact is not None:
        last = exact.R_WP[min(now, len(exact.R_WP) - 1)]
        for face in exact.solid.faces:
            for edge in face.edges:
                sheet.lines(seen(face.corners[list(edge)] @ last.T), OUTLINE, 0.8)
    _write_numbers(sheet, corner, panel, frame)


def _write_numbers(sheet: _Sheet, corner: tuple[int, int], panel: Panel, frame: int) -> None:
    """Write the title of a panel, why its run ended early, and its numbers, each on the colour of its grade."""
    middle, y, room = corner[0] + SIDE / 2, float(corner[1] + SIDE), SIDE - 2 * MARGIN
    label = _ascii(panel.label)
    sheet.text(middle, y, label, sheet.fit(label, 9, room - 4), bold=True, anchor="ma")
    y += TITLE
    if panel.outcome:
        text = _ascii(panel.outcome)
        sheet.text(middle, y, text, sheet.fit(text, 8, room), anchor="ma")
        y += LINE
    rows = [(f"{_ascii(name)}: ", *panel.number(name, frame)) for name in panel.sizes]
    widest = max((sheet.width(name + "1.1e-11", 8) for name, *_ in rows), default=0.0)  # the same in all frames
    size = 8 * min(1.0, (room - LINE) / max(widest, 1e-9))
    for name, _, size_text, grade in rows:
        left = middle - widest * size / 16 - LINE / 2
        sheet.chip(left, y, GRADES[grade])
        sheet.text(left + LINE, y, name + _ascii(size_text), size)
        y += LINE
