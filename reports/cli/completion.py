"""Tab completion: registered names, and scene files in addition to the names of scenes."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import click
from click.shell_completion import CompletionItem

SPREADS = ("attitude", "rate", "inertia")
"""Quantities that can be spread for every scene."""


def methods(ctx: click.Context, parameter: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Return the registered methods that complete the last of several, separated by commas."""
    before, last = _last(incomplete)
    return [CompletionItem(before + name) for name in _registered("methods", last)]


def engines(ctx: click.Context, parameter: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Return the registered engines that complete the text."""
    return [CompletionItem(name) for name in _registered("engines", incomplete)]


def engine_lists(ctx: click.Context, parameter: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Return `all` and the registered engines that complete the last of several, separated by commas."""
    before, last = _last(incomplete)
    return [CompletionItem(before + name) for name in ["all"] * "all".startswith(last) + _registered("engines", last)]


def subjects(ctx: click.Context, parameter: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Return the registered methods and engines that complete the text, and files."""
    names = dict.fromkeys([*_registered("methods", incomplete), *_registered("engines", incomplete)])
    return [*map(CompletionItem, names), CompletionItem(incomplete, type="file")]


def scenes(ctx: click.Context, parameter: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Return the registered scenes, scene files and folders that complete the last of several."""
    before, last = _last(incomplete)
    names = [*_registered("scenes", last), *_files(last)]
    if not before and (not names or names == [f"{names[0].rstrip('/')}/"]):
        return [CompletionItem(incomplete, type="file")]  # the shell knows ~ and puts no space after the only folder
    return [CompletionItem(before + name) for name in names]


def studies(ctx: click.Context, parameter: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Return the studies that complete the text."""
    from conservative.benchmarks.studies.studies import STUDIES

    return [CompletionItem(name) for name in STUDIES if name.startswith(incomplete)]


def spreads(ctx: click.Context, parameter: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Return the quantities that can be spread for the scene on the line, with an equals sign."""
    from conservative import registry
    from conservative.integration.spread import list_parameters

    before, last = _last(incomplete)
    names = list(SPREADS)
    with suppress(Exception):  # the scene is invalid, and an error cannot be shown during completion
        # Click does not parse a line that ends in an option without its value; the arguments before it are then in ctx.args.
        scene = registry.scene(ctx.params.get("scene") or "".join(ctx.args[:1]))
        names += [f"potential.{name}" for name in list_parameters(scene)]
    return [CompletionItem(f"{before}{name}=") for name in names if name.startswith(last)]


def _last(incomplete: str) -> tuple[str, str]:
    before, comma, last = incomplete.rpartition(",")
    return before + comma, last


def _registered(group: str, start: str) -> list[str]:
    from conservative.deferred_imports import list_entries

    return [name for name in list_entries(f"conservative.{group}") if name.startswith(start)]


def _files(start: str) -> list[str]:
    """Return files that end in .toml, and folders, that begin with `start`; hidden ones only if `start` names them."""
    folder, slash, name = start.rpartition("/")
    try:
        entries = sorted(Path(folder + slash).iterdir())
    except OSError:
        return []
    visible = [path for path in entries if path.name.startswith(name) and (name or not path.name.startswith("."))]
    endings = ((path, "/" if path.is_dir() else "") for path in visible)
    return [f"{folder}{slash}{path.name}{end}" for path, end in endings if end or path.suffix == ".toml"]
