"""All registered scenes and methods, and which of them can run here."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import groupby

from conservative import registry
from conservative.errors import BadInput, MissingEngine
from conservative.method import Method, Role

from ..document.model import Document, Table

SCENE_HEADER = ("name", "t_end, s", "dt, s", "conserved by the motion", "source")
TITLES = {Role.OURS: "ours", Role.ENGINE: "engines", Role.TRUTH: "reference solutions", None: "not available"}
METHOD_HEADER = ("name", "order", "conserves", "version, or why it cannot run")


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
    """A method in the list. Without its engine, `available` is False and `reason` contains the command that installs it."""

    name: str
    role: Role | None
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
    entries = [entry for name in registry.list_methods() for entry in _variants(name)]
    return sorted(entries, key=lambda entry: (*Role, None).index(entry.role))


def _variants(name: str) -> list[MethodEntry]:
    try:
        return [_method(method) for method in registry.method(name).settings_for("variants")]
    except (MissingEngine, BadInput) as missing:
        # An engine that is not installed, or a registered package that is not whole: shown, never fatal for the list.
        return [MethodEntry(name, None, "", None, (), False, str(missing))]


def _method(method: Method) -> MethodEntry:
    try:
        label, reason = method.label, ""
    except MissingEngine as missing:
        label, reason = "", str(missing)
    return MethodEntry(method.name, method.role, label, method.order, tuple(sorted(method.conserves)), not reason, reason)


def build() -> Document:
    """Return a table for each group of scenes, then for each role of methods."""
    every_scene, every_method = scenes(), methods()
    tables = [
        Table(SCENE_HEADER, [_scene_row(entry) for entry in members], f"Scenes: {group}")
        for group, members in groupby(every_scene, key=lambda entry: entry.group)
    ]
    tables += [
        Table(METHOD_HEADER, [_method_row(entry) for entry in members], f"Methods: {TITLES[role]}")
        for role, members in groupby(every_method, key=lambda entry: entry.role)
    ]
    data = {"scenes": every_scene, "methods": [{**vars(entry), "role": entry.role or ""} for entry in every_method]}
    return Document("conservative list", "Scenes and methods", tables, data=data)


def _scene_row(entry: SceneEntry) -> tuple[str, ...]:
    return entry.name, f"{entry.t_end:.4g}", f"{entry.dt:.4g}", ", ".join(entry.invariants), entry.source


def _method_row(entry: MethodEntry) -> tuple[str, ...]:
    order = "-" if entry.order is None else str(entry.order)
    return entry.name, order, ", ".join(entry.conserves) or "-", entry.label or entry.reason
