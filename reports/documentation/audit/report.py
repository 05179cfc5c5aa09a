"""A finished report against its own rows: the sentences of report.md and of index.html, a block at a time.

Which sentences there are stands here and in `contests_told`: what has a number and is none of them has no support. Numbers in
names of methods and of scenes that are in the rows belong to the names. The words of templates that have numbers which nobody
measures are allowed one by one, in `allowed.toml`.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from conservative.benchmarks.measures.drift_class import CONSERVED, SMALL
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies import each_step, ensembles, long_runs, random, step_ladder, throughput_extent
from conservative.outcome import OutcomeKind
from conservative.scene import Scene
from conservative.scenes.random_body import CONDITION

from ...charts.figures import FLOOR
from ...tables.cells import tolerance
from ...tables.engine_rows import ERROR, ONE_STEP
from ...tables.hard_cases import RIGHT, USABLE
from ...tables.summary import MIDDLE
from . import contests_told, tables_told
from .blocks import Block, of_html, of_markdown
from .contests_told import Tellers
from .rows import Rows
from .sentences import Sentence, Values, judge
from .text import Number, Page

CONSTANTS: tuple[tuple[str, Values], ...] = (
    ("the cheapest engine gets to {middle:text} rad. Kept", {"middle": tolerance(MIDDLE)}),
    ("✓ within {kept:text}, ≈ within {small:text}, ✗ more", {"kept": tolerance(CONSERVED), "small": tolerance(SMALL)}),
    ("✓ up to {right:text} rad, ≈ up to {usable} rad, ✗ more", {"right": tolerance(RIGHT), "usable": USABLE}),
    ("stays within {usable} rad", {"usable": USABLE}),
    ("µs per s at {error} rad", {"error": ERROR}),
    ("over {durations} durations", {"durations": int(long_runs.DURATIONS)}),
    ("The picture shows {durations} durations of the scene", {"durations": int(long_runs.DURATIONS)}),
    ("zero is drawn at {floor:text}.", {"floor": tolerance(FLOOR)}),
    ("of condition {low} to {high}, in a turned frame", dict(zip(("low", "high"), CONDITION, strict=True))),
    ("The error is the largest of {samples} instants", {"samples": random.SAMPLES}),
    ("its largest attitude error at {samples} instants", {"samples": throughput_extent.SAMPLES}),
    ("errors are read at: {samples} in the duration of a scene", {"samples": step_ladder.SAMPLES}),
    ("A sample is one of {samples} in the duration", {"samples": step_ladder.SAMPLES}),
    ("is one, at {error:text} rad over all of them", {"error": tolerance(each_step.ERROR)}),
    ("or the {most:text}th percentile", {"most": throughput_extent.MOST.removesuffix(" %")}),
    ("Each runs for {duration} s of its motion", {"duration": ensembles.DURATION}),
    ("solutions take steps of {step} s", {"step": ensembles.DURATION / throughput_extent.EXACT_STEPS}),
)
"""What is said of limits that the code has."""
ALLOWED = Path(__file__).with_name("allowed.toml")
_DRAWN = re.compile(r"random_body:.*seed=(?P<seed>\d+),index=(?P<index>\d+)")
FILES: dict[str, Callable[[str, str], Iterator[Block]]] = {"report.md": of_markdown, "index.html": of_html}


def audit(folder: Path) -> list[str]:
    """Return what the report in a folder says without support, a line each."""
    return list(find(Rows.of(folder), {name: (folder / name).read_text(encoding="utf-8") for name in FILES}))


def find(rows: Rows, texts: dict[str, str]) -> Iterator[str]:
    """Yield what the files of a report say without support by its rows."""
    allowed = [*(literal(text) for text in allowed_texts()), *_of_scenes(rows)]
    names = "|".join(re.escape(name) for name in sorted(rows.names, key=len, reverse=True)) or "(?!)"
    for name, text in texts.items():
        for block in FILES[name](name, text):
            yield from _judge(rows, block, allowed, names)
    yield from (wrong for name, text in texts.items() if name.endswith(".md") for wrong in tables_told.find(rows, name, text))


def _judge(rows: Rows, block: Block, allowed: list[Sentence], names: str) -> Iterator[str]:
    if block.page.numbers:
        listed = f"(?:{names})(?:, (?:{names}))*"
        told = [Sentence(text, values, (), listed) for text, values in sentences(rows, block)]
        yield from judge(block.page, [*told, *allowed], _in_names(block.page, names))


def _in_names(page: Page, names: str) -> set[Number]:
    spans = [found.span() for found in re.finditer(rf"(?<![\w.])(?:{names})(?![\w]|\.\d)", page.text)]
    return {number for number in page.numbers if any(first <= number.start and number.end <= last for first, last in spans)}


def allowed_texts() -> list[str]:
    """Return the words of templates with numbers that are allowed."""
    return [entry["text"] for entry in tomllib.loads(ALLOWED.read_text(encoding="utf-8"))["allowed"]]


def literal(text: str) -> Sentence:
    """Return a sentence all of whose numbers are allowed as they stand there."""
    return Sentence(text, dict, tuple(number.text for number in Page("", text).numbers))


def sentences(rows: Rows, block: Block) -> Tellers:
    """Yield the sentences that may stand in a block, by its heading and by what it is about."""
    yield from ((text, partial(dict, values)) for text, values in CONSTANTS)
    yield from _of_the_bodies(rows)
    scene = block.heading.partition(":")[0]
    if block.heading.startswith("Verdict"):
        yield from contests_told.of_random_bodies(rows)
        scene = block.heading.partition(": ")[2] or _first(rows)
    if scene in rows.table["scene"].unique():
        yield from contests_told.of_scene(rows, scene)
    if block.lead in rows.points["scene"].unique():
        yield from contests_told.of_decades(rows, block.lead)
        yield from contests_told.of_each_step(rows, block.lead)
    if scene in rows.scenes:
        yield _of_engines(rows, rows.scenes[scene])
    field = block.lead.removeprefix("random bodies, ")
    if any(contest.field == field for contest in rows.contests):
        yield from contests_told.of_field(rows, field)
    if contests_told.MANY in block.lead:
        yield from contests_told.of_many_bodies(rows, block.lead)


def _first(rows: Rows) -> str:
    """Return the scene that the page's verdict is about."""
    named = [str(name) for name in rows.table["scene"].dropna().unique() if name in rows.scenes]
    return min(named, key=lambda name: rows.scenes[name].integrable, default="")


def _of_the_bodies(rows: Rows) -> Tellers:
    """Yield how many random bodies there are in each field, and from which seed."""
    drawn = [_DRAWN.search(str(scene)) for scene in rows.table["scene"].dropna().unique()]
    seeds, bodies = ({int(found[kind]) for found in drawn if found} for kind in ("seed", "index"))
    values: Values = {"bodies": len(bodies), "seed": list(seeds)}
    yield "Bodies in each field: {bodies}, from seed {seed}", lambda: values
    yield "Bodies in each field: {bodies}.", lambda: values


def _of_engines(rows: Rows, scene: Scene) -> tuple[str, Callable[[], Values]]:
    """Return how many engines do a scene, and how."""
    table = rows.table
    ran = table[(table["study"] == ONE_STEP) & (table["scene"] == scene.name) & (table["outcome"] == OutcomeKind.OK)]
    found = {str(label).partition("/")[0] for label in ran["label"][ran["measure"] == Measure.ATTITUDE_MAX.text]}
    values = {"count": len(found), "t_end": f"{scene.t_end:g}", "dt": f"{scene.dt:g}"}
    return "{count} engines do this scene. {t_end:text} s at dt = {dt:text} s.", partial(dict, values)


def _of_scenes(rows: Rows) -> Iterator[Sentence]:
    """Yield what the scenes say of themselves."""
    for scene in rows.scenes.values():
        source = f"{scene.source}. " if scene.source else ""
        yield literal(f"{source}{scene.t_end:g} s; the scene's own step is {scene.dt:g} s.")
