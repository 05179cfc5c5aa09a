"""All registered scenes and methods, and which of them can run here."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby
from typing import Any

from conservative import registry
from conservative.errors import BadInput, MissingEngine
from conservative.method import Role

from ..document.model import Document, Table

SCENE_HEADER = ("name", "t_end, s", "dt, s", "conserved by the motion", "source")
METHOD_HEADER = ("name", "order", "conserves", "version, or why it cannot run")
TITLES = {
    Role.OURS: "ours",
    Role.BASELINE: "textbook baselines",
    Role.ENGINE: "engines",
    Role.TRUTH: "reference solutions",
    "": "not available",
}


def build() -> Document:
    """Return a table for each group of scenes, then for each role of methods."""
    every_scene, every_method = scenes(), methods()
    tables = [
        Table(
            SCENE_HEADER,
            [
                (
                    member["name"],
                    f"{member['t_end']:.4g}",
                    f"{member['dt']:.4g}",
                    ", ".join(member["invariants"]),
                    member["source"],
                )
                for member in members
            ],
            f"Scenes: {group}",
        )
        for group, members in groupby(every_scene, key=lambda entry: str(entry["group"]))
    ]
    tables += [
        Table(
            METHOD_HEADER,
            [
                (
                    member["name"],
                    "-" if member["order"] is None else str(member["order"]),
                    ", ".join(member["conserves"]) or "-",
                    member["label"] or member["reason"],
                )
                for member in members
            ],
            f"Methods: {TITLES[role]}",
        )
        for role, members in groupby(every_method, key=lambda entry: entry["role"])
    ]
    return Document("conservative list", "Scenes and methods", tables, data={"scenes": every_scene, "methods": every_method})


def scenes() -> list[dict[str, Any]]:
    """Return every registered scene, sorted by group and name; times in s."""
    entries = []
    for name in registry.list_scenes():
        scene = registry.scene(name)
        names = [invariant.name for invariant in scene.invariants]
        about = {"name": name, "group": scene.group, "source": scene.source, "invariants": names}
        entries.append({**about, "t_end": scene.t_end, "dt": scene.dt or scene.t_end})
    return sorted(entries, key=lambda entry: (entry["group"], entry["name"]))


def methods() -> list[dict[str, Any]]:
    """Return every variant of every registered method: ours, engines, reference solutions, then those that are missing."""
    return sorted(
        (entry for name in registry.list_methods() for entry in _variants(name)),
        key=lambda entry: list(TITLES).index(entry["role"]),
    )


def _variants(name: str) -> Iterator[dict[str, Any]]:
    """Yield the variants of a method. If its engine is not installed, `reason` contains the command that installs it."""
    try:
        for method in registry.method(name).settings_for("variants"):
            try:
                label, reason = method.label, ""
            except MissingEngine as missing:
                label, reason = "", str(missing)
            about = {"name": method.name, "role": method.role, "label": label, "order": method.order}
            yield {**about, "conserves": sorted(method.conserves), "available": not reason, "reason": reason}
    except (MissingEngine, BadInput) as missing:
        # An engine that is not installed, or a registered package that is damaged: shown, never an error of the list.
        about = {"name": name, "role": "", "label": "", "order": None}
        yield {**about, "conserves": [], "available": False, "reason": str(missing)}
