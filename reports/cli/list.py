"""What `conservative list` shows: every registered scene and method, and which of them can run here."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from itertools import groupby

from conservative import registry
from conservative.errors import BadInput, MissingEngine
from conservative.method import Method


@dataclass(frozen=True)
class SceneEntry:
    """A scene as the list shows it; times in s."""

    name: str
    group: str
    source: str
    invariants: tuple[str, ...]
    t_end: float
    dt: float


@dataclass(frozen=True)
class MethodEntry:
    """A method as the list shows it. Without its engine, `available` is False and `reason` says how to get it."""

    name: str
    role: str
    label: str
    order: int | None
    conserves: tuple[str, ...]
    available: bool
    reason: str


def scenes() -> list[SceneEntry]:
    """Return every registered scene, sorted by group and name."""
    return sorted((_scene(name) for name in registry.list_scenes()), key=lambda entry: (entry.group, entry.name))


def _scene(name: str) -> SceneEntry:
    scene = registry.scene(name)
    return SceneEntry(
        name, scene.group, scene.source, tuple(i.name for i in scene.invariants), scene.t_end, scene.dt or scene.t_end
    )


def methods() -> list[MethodEntry]:
    """Return every variant of every registered method, ours first, then engines, then truths."""
    found = [entry for name in registry.list_methods() for entry in _variants(name)]
    return sorted(found, key=lambda entry: ("ours", "engine", "truth", "").index(entry.role))


def _variants(name: str) -> list[MethodEntry]:
    try:
        return [_method(method) for method in registry.method(name).variants()]
    except (MissingEngine, BadInput) as missing:
        # An engine that is not installed, or a registered package that is not whole: shown, never fatal for the list.
        return [MethodEntry(name, "", "", None, (), False, str(missing))]


def _method(method: Method) -> MethodEntry:
    try:
        label, reason = method.label, ""
    except MissingEngine as missing:
        label, reason = "", str(missing)
    return MethodEntry(method.name, method.role, label, method.order, tuple(sorted(method.conserves)), not reason, reason)


def as_json() -> str:
    """Return scenes and methods as JSON."""
    content = {"scenes": [asdict(entry) for entry in scenes()], "methods": [asdict(entry) for entry in methods()]}
    return json.dumps(content, indent=2, ensure_ascii=False)


def show() -> None:
    """Print scenes and methods as tables, as wide as the terminal."""
    from rich.console import Console

    console = Console(soft_wrap=False)
    for group, members in groupby(scenes(), key=lambda entry: entry.group):
        rows = [(e.name, f"{e.t_end:.4g}", f"{e.dt:.4g}", ", ".join(e.invariants), e.source) for e in members]
        console.print(_table(f"Scenes: {group}", ("name", "t_end, s", "dt, s", "conserved by the motion", "source"), rows))
    for role, found in groupby(methods(), key=lambda entry: entry.role):
        lines = [(e.name, _order(e), ", ".join(e.conserves) or "-", e.label or e.reason) for e in found]
        title = f"Methods: {role or 'not available'}"
        console.print(_table(title, ("name", "order", "conserves", "version, or why it cannot run"), lines))


def _order(entry: MethodEntry) -> str:
    return "-" if entry.order is None else str(entry.order)


def _table(title: str, header: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> object:
    from rich import box
    from rich.markup import escape
    from rich.table import Table

    table = Table(title=title, box=box.SIMPLE_HEAD, title_justify="left", title_style="bold")
    for position, name in enumerate(header):
        table.add_column(name, overflow="fold", no_wrap=position == 0)
    for row in rows:
        table.add_row(*(escape(cell) for cell in row))
    return table
