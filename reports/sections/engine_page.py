"""A page for each engine, for its authors to link to: errors on the scenes and the exact motions, and how to repeat them."""

from __future__ import annotations

import math
import re
import shlex
from collections.abc import Sequence
from functools import partial

from conservative.benchmarks.studies.paper import AS_INSTALLED
from conservative.references.environments.engine_method import EngineMethod
from conservative.references.environments.kind import version_key
from conservative.version import VERSION

from ..document.attempt import attempt
from ..document.cells import DASH, angle
from ..document.model import Block, Document, Emphasis, Item, Items, Paragraph, Row, Section, Table
from . import verified_engines
from .engines import AT_ITS_BEST, EngineRow, chosen, comparison_cells, engine_rows
from .measured import Measured

COLUMNS = ("error, rad", "energy drift", "world momentum drift", "axial momentum drift", "turns over")
SAME = 0.1
"""Largest relative difference of two errors that are called equal, between versions."""
TERMS = (
    "As installed: only the step size is set. At its best: the setting with the smallest error at this step. Drifts are the "
    "largest of the run, relative."
)
OBJECT = (
    "The authors of an engine have the first word about its settings. Is a number wrong, or does a setting exist that gives a "
    "better one? Open an issue with the template `Wrong result`, with the row and the command or the setting. We aim to repeat "
    "both within two weeks and answer there, with commands, versions and the date. If we still disagree, this page gets a note "
    "with both positions. An engine is made for more than one rotating body: this page says nothing about contacts and joints."
)
"""The rules of reports/documentation/neutrality.md for the author of an engine."""


def file_name(engine: str) -> str:
    """Return the name of the page of an engine, without an ending."""
    return "engine_" + re.sub(r"[^\w.-]", "_", engine)


def pages(measured: Measured) -> dict[str, Document]:
    """Return the page of each engine that the report names, by the name of its file without an ending."""
    scenes = {scene.name: engine_rows(measured, scene.name) for scene in measured.plan.scenes}
    measured_ones = dict.fromkeys((row.family, row.version) for rows in scenes.values() for row in rows)
    families: dict[str, list[str]] = {}
    for family, version in sorted(measured_ones, key=lambda engine: version_key(engine[1]), reverse=True):
        families.setdefault(family, []).append(version)
    found = dict[str, Document]()
    for family, versions in families.items():
        page = attempt(f"The page of {family}", partial(_page, measured, family, versions, scenes))
        found[file_name(family)] = page if isinstance(page, Document) else Document("conservative report", family, [page])
    return found


def _page(measured: Measured, family: str, versions: Sequence[str], scenes: dict[str, list[EngineRow]]) -> Document:
    newest, blocks, facts = versions[0], list[Block](), list[Item]()
    for scene in measured.plan.scenes:
        if shown := chosen(scenes[scene.name], family, newest):
            facts.append(Item("; ".join(map(_sentence, shown)) + ".", scene.name))
            caption = f"{scene.name}: {scene.t_end:g} s at dt = {scene.dt:g} s, against the exact motion"
            blocks.append(Table(["setting", *COLUMNS], [comparison_cells(row, COLUMNS) for row in shown], caption))
    blocks.append(Section("Since which version", _since(family, versions, scenes)))
    verified = [setting for setting in measured.measurements.verified if setting.names["engine"] == family]
    if verified:
        blocks.append(attempt("The section 'verification'", partial(verified_engines.section, verified)))
    blocks.append(Section("Repeat it", [Paragraph(command) for command in _commands(measured, family, versions)]))
    blocks.append(Section("What its authors can say", [Paragraph(OBJECT)]))
    name = _title(family, newest)
    lead = Paragraph(f"Rotation of one rigid body in {name}, measured with conservative {VERSION}.", Emphasis.LEAD)
    facts.append(Item(TERMS))
    return Document("conservative report", name, [lead, Items(facts), *blocks])


def _title(family: str, version: str) -> str:
    return f"{family} {version}".rstrip()


def _sentence(row: EngineRow) -> str:
    name, energy = f"{row.taken or 'run'} ({row.setting or 'default'})", row.energy_text
    found = f"attitude error {angle(row.error)} rad, energy drift {energy}"
    return f"{name}: {found if row.outcome.ok else row.outcome}"


def _since(family: str, versions: Sequence[str], scenes: dict[str, list[EngineRow]]) -> list[Block]:
    """Return the first measured version whose errors equal the errors of the newest one, and the errors of all versions."""
    if len(versions) == 1:
        command = f"`conservative track {family} --last 3` finds the version since which an error changed."
        return [Paragraph(f"Only {versions[0] or 'one version'} was measured here. {command}")]
    kinds, items, tables = (AS_INSTALLED, AT_ITS_BEST), list[Item](), list[Block]()
    for scene, rows in scenes.items():
        of_versions = [
            {kind: row for row in chosen(rows, family, version) for kind in kinds if row.taken in (kind, "both")}
            for version in versions
        ]
        for kind in kinds:
            errors = [by_kind[kind].error if kind in by_kind else math.nan for by_kind in of_versions]
            same = [abs(error - errors[0]) <= SAME * errors[0] for error in errors]  # False for NaN
            if same[0]:
                count = (*same, False).index(False)
                since = f"since {'at least ' * (count == len(errors))}{versions[count - 1]}"
                text = f"{kind}: {angle(errors[0])} rad {since}"
                if count < len(errors):
                    text += f", {angle(errors[count])} rad in {versions[count]}"
                items.append(Item(text, scene))
        body = list[Row]()
        for version, by_kind in zip(versions, of_versions, strict=True):
            both = [by_kind.get(kind) for kind in kinds]
            cells = [cell for row in both for cell in ((row.setting, row.cells["error, rad"]) if row else (DASH, DASH))]
            body.append([_title(family, version), *cells])
        header = ["version", *(name for kind in kinds for name in (kind, "error, rad"))]
        tables.append(Table(header, body, f"{scene}: versions"))
    return [Items(items), *tables]


def _commands(measured: Measured, family: str, versions: Sequence[str]) -> list[str]:
    """Return the commands that repeat a page."""
    plan = measured.plan
    apart = {(engine.maker.package, engine.maker.version) for engine in plan.engines if isinstance(engine, EngineMethod)}
    own = [f"{family}@{version}" for version in versions if (family, version) in apart]
    names = [*own, *([family] if len(own) < len(versions) else [])]
    install = " ".join(own)
    scenes = shlex.quote(",".join(plan.arguments.get(scene.name, scene.name) for scene in plan.scenes))
    command = f"conservative report --methods reduced --scenes {scenes} --engines {','.join(names)}" + " --quick" * plan.quick
    commands = [command, f"conservative verify {' '.join(names)}"]
    return [f"`{line}`" for line in [*[f"conservative engines install {install}"] * bool(install), *commands]]
