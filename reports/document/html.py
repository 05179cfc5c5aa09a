"""One HTML file of a document. It opens from disk without a network: style, scripts, libraries and data are in the file.

Vega, Vega-Lite and Vega-Embed draw the charts; DataTables sorts and filters the tables. They are packed with gzip (45 % of
their length) and unpacked by the browser. A document without charts or tables does not carry their library.
"""

from __future__ import annotations

import base64
import gzip
import json
import math
import re
from collections.abc import Iterable, Iterator, Mapping
from functools import lru_cache
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup, escape

from .. import animation
from . import contrast
from .model import AT_FIRST, Block, Cell, Document, Motion, Section, Style, Table, walk

LONGEST_PACKED = 600_000
"""Largest length of the packed measurements in a page, characters; longer ones are only in measurements.csv."""
WIDEST = 1.35
"""Largest ratio in the drawing of an interval, and the reciprocal of the smallest."""


def render(document: Document) -> str:
    """Return the page of a document."""
    loader = FileSystemLoader(Path(__file__).parent)
    environment = Environment(loader=loader, undefined=StrictUndefined, autoescape=True, trim_blocks=True, lstrip_blocks=True)
    environment.filters |= {"whole": _whole, "narrow": _narrow, "place": _place}
    environment.filters |= {"cell": _cell, "order": _order, "numeric_columns": _numeric_columns, "motion": motion}
    blocks = list(walk(document.blocks))
    linked = [block for block in _outer(document.blocks) if isinstance(block, Section) and block.anchor]
    scripts: dict[str, str] = {}
    if charts := {figure.name: list(figure.panels) for figure in document.figures if figure.panels}:
        # Some colours have too little contrast on a light or a dark page and are replaced there.
        colours = contrast.colours_in(json.dumps(charts))
        papers = {"light": contrast.LIGHT_PAPER, "dark": contrast.DARK_PAPER}
        instead = {name: contrast.stand_ins(colours, paper) for name, paper in papers.items()}
        packed = pack(json.dumps({"figures": charts, "colours": instead}, separators=(",", ":")))
        scripts |= {"charts": packed, "vega": _vega()}
    if any(isinstance(block, Table) and block.style in (Style.SORTED, Style.FILTERED) for block in blocks):
        scripts["datatables"] = _datatables()
    rows = document.data.get("rows", ()) if isinstance(document.data, Mapping) else ()
    has_rows = any(isinstance(block, Section) and block.source for block in blocks)  # a table from measurements.csv
    if rows and has_rows:
        packed = pack(json.dumps([list(rows[0]), *(list(row.values()) for row in rows)], separators=(",", ":")))
        if len(packed) <= LONGEST_PACKED:
            scripts["rows"] = packed
    player = Markup(animation.script()) if any(isinstance(block, Motion) for block in blocks) else ""
    template = environment.get_template("page.html.j2")
    shown = {"document": document, "linked": linked, "scripts": scripts, "player": player}
    return re.sub(r"\n{2,}", "\n", template.render(shown, has_rows=has_rows, at_first=AT_FIRST)) + "\n"


def _outer(blocks: Iterable[Block]) -> Iterator[Block]:
    """Yield the outer blocks of a document. A folded section without an anchor is no block of its own, but those in it are."""
    for block in blocks:
        if isinstance(block, Section) and block.folded and not block.anchor:
            yield from block.blocks
        else:
            yield block


def pack(text: str) -> str:
    """Return a text compressed by gzip, in base64."""
    return base64.b64encode(gzip.compress(text.encode(), mtime=0)).decode()


@lru_cache(maxsize=1)
def _vega() -> str:
    import vl_convert

    return pack(vl_convert.javascript_bundle("export default vegaEmbed;"))


@lru_cache(maxsize=1)
def _datatables() -> str:
    import itables.options

    return pack(Path(itables.options.dt_bundle).read_text(encoding="utf-8"))


@lru_cache(maxsize=4)
def motion(block: Motion) -> Markup:
    """Return an animation. It is cached, because a report tries it before it renders the page."""
    return Markup(animation.element(block.trajectories, block.labels, "animation", block.truth, block.values))


def _whole(text: str) -> Markup:
    """Return a text in which no line breaks within a number such as 1e-3, or before its unit; words in backticks are code."""
    return Markup(re.sub(r"`(.+?)`", r"<code>\1</code>", _with_whole_numbers(text)))


def _with_whole_numbers(text: str) -> str:
    return re.sub(r"[\d.]+e-\d+(?: rad)?", r'<span class="n">\g<0></span>', str(escape(text)))


def _narrow(name: str) -> Markup:
    """Return a name in which a line may break after each underscore, so that a narrow column has whole words."""
    return Markup(_with_whole_numbers(name).replace("_", "_<wbr>"))


def _cell(value: str | Cell) -> Cell:
    return value if isinstance(value, Cell) else Cell(value)


def _numeric_columns(table: Table) -> list[bool]:
    """Return for each column whether it is sorted by numbers."""
    return [any(_cell(row[j]).value is not None for row in table.rows) for j in range(len(table.header))]


def _order(cell: Cell) -> str:
    """Return the number of a cell as JavaScript reads it; empty without one."""
    finite = cell.value is not None and not math.isnan(cell.value)
    return str(cell.value).replace("inf", "Infinity") if finite else ""


def _place(ratio: float) -> float:
    """Return the place of a ratio on a logarithmic axis with 1 in the middle, in percent of its length."""
    share = 0.5 + 0.5 * math.log(ratio) / math.log(WIDEST)
    return round(100 * min(max(share, 0.0), 1.0), 2)
