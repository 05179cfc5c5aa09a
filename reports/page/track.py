"""The page of an engine over its versions: one HTML file with everything in it, that opens from disk."""

from __future__ import annotations

from jinja2 import Environment, PackageLoader, StrictUndefined

from ..tables.track import NOTHING_CHANGED, UNFINISHED, Answer


def render(answer: Answer) -> str:
    """Return the page."""
    loader = PackageLoader("conservative.reports")
    environment = Environment(loader=loader, undefined=StrictUndefined, autoescape=True, trim_blocks=True, lstrip_blocks=True)
    template = environment.get_template("track.html.j2")
    return template.render(answer=answer, nothing_changed=NOTHING_CHANGED, unfinished=UNFINISHED)
