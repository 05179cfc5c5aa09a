"""The live figure of the page `why_does_it_flip.md`: motions that `flip.js` computes, in the player of `reports/animation`.

    python -m conservative.reports.documentation.flip

writes it again as one file that works without a network, flip.html beside the page.
"""

from __future__ import annotations

import json
from pathlib import Path

from ..animation import frame, script
from ..animation.frames import COLOURS, ERROR

HERE = Path(__file__).parent
FILE = HERE / "flip.html"
DURATION = 12.0
"""Simulated time, s."""


def figure(sliders: bool) -> str:
    """Return the HTML of the figure: body and polhode, exactly and with implicit Euler, and its sliders."""
    from jinja2 import Environment, StrictUndefined

    surfaces = ("energy", "momentum")
    panels = [
        {"label": label, "outcome": "", "sizes": sizes}
        for label, sizes in (
            ("exact", ()),
            ("exact: polhode", surfaces),
            ("implicit Euler, 1/60 s", (ERROR,)),
            ("implicit Euler: polhode", surfaces),
        )
    ]
    motion = frame(panels, "a box that spins about an axis", DURATION, "flip", json.dumps({"colours": COLOURS}))
    template = (HERE / "flip.html.j2").read_text(encoding="utf-8")
    environment = Environment(undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    physics = (HERE / "flip.js").read_text(encoding="utf-8")
    return environment.from_string(template).render(sliders=sliders, motion=motion, script=script(), physics=physics)


def page() -> str:
    """Return the figure with its sliders as a page."""
    head = '<!DOCTYPE html><html lang="en"><meta charset="utf-8"><meta name="viewport" content="width=device-width">'
    return f"{head}<title>Why does it flip?</title><main>{figure(sliders=True)}</main>\n"


if __name__ == "__main__":
    FILE.write_text(page(), encoding="utf-8")
