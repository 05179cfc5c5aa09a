"""Tables of what the code declares: methods, the features that each supports, engines, and exact motions."""

from __future__ import annotations

import dataclasses
import inspect
import os
import re
import tomllib
from collections.abc import Callable, Iterator
from functools import cache, partial
from importlib import import_module
from pathlib import Path
from typing import Any

from pages import ROOT, summary, table

from conservative.benchmarks.verification.motions import files, one_file
from conservative.benchmarks.verification.motions.motion import load
from conservative.benchmarks.verification.motions.signatures import remedies

GROUPS = ("conservative.methods", "conservative.engines")


def entries(group: str) -> Iterator[tuple[str, Any]]:
    """Yield names and objects of a group of entry points of pyproject.toml, in its order; what is installed does not matter."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    for name, place in project["entry-points"][group].items():
        module, _, attribute = place.partition(":")
        yield name, getattr(import_module(module), attribute)


def methods() -> str:
    """Return a row for each method that is not an engine."""
    header = ["method", "order", "symmetric", "symplectic", "conserves to round-off", "what it is"]
    kinds = [kind for _, kind in entries(GROUPS[0]) if kind.role != "engine"]
    return table(header, [_method_row(kind) for kind in kinds])


def _method_row(kind: Any) -> list[str]:
    default, variants = kind(), dict(zip(kind.method_info.variants, kind.settings_for("variants"), strict=True))
    orders = sorted({variant.order for variant in variants.values() if variant.order})
    order = [" to ".join(str(each) for each in dict.fromkeys([*orders[:1], *orders[-1:]]))] if orders else []
    if None in {variant.order for variant in variants.values()}:
        order += ["exact"] if kind.method_info.exact else ["adaptive"] if orders else ["–"]
    structures = {text: kind.method_info.structure(each) for text, each in variants.items()}
    found = [structure for structure in structures.values() if structure]
    kept = [word for word in ("energy", "momentum", "axial momentum") if any(map(_is(word), default.conserves))]
    how = "imposed" if any(each.imposed for each in found) else "inherited"
    symmetric = _which({text: each.symmetric for text, each in structures.items() if each})
    symplectic = _which({text: each.symplectic for text, each in structures.items() if each})
    settings = ", ".join(f"{field.name}={getattr(default, field.name)}" for field in dataclasses.fields(kind))
    conserved = ", ".join(kept) + f"; {how}" * bool(kept and found)
    return [f"`{kind.__name__}({settings})`", ", ".join(order), symmetric, symplectic, conserved, summary(kind.__doc__)]


def _is(word: str) -> Callable[[str], bool]:
    """Return whether a name of an invariant is meant by a word: the vertical momentum is one, the axial momentum is not."""
    return lambda name: name == word or (word == "momentum" and "momentum" in name and "axial" not in name)


def _which(answers: dict[str, bool]) -> str:
    """Return yes, no, or the settings for which the answer is yes; a dash if none has an answer."""
    if len({*answers.values()}) < 2:
        return {True: "yes", False: "no", None: "–"}[next(iter(answers.values()), None)]
    return ", ".join(f"`{text}`" for text, yes in answers.items() if yes)


def support() -> str:
    """Return a row for the methods and engines that take the same parts of scenes, and a column for parts taken by the same."""
    from conservative.features import Feature

    rows: dict[frozenset[Feature], list[str]] = {}
    for group in GROUPS:
        for name, kind in entries(group):
            rows.setdefault(kind.method_info.supports, []).append(f"`{name}`")
    columns: dict[tuple[bool, ...], list[Feature]] = {}
    for feature in Feature:
        columns.setdefault(tuple(feature in supports for supports in rows), []).append(feature)
    header = ["", *(", ".join(feature.name.lower() for feature in features) for features in columns.values())]
    lines = [
        [", ".join(dict.fromkeys(names)), *("✓" if features[0] in supports else "" for features in columns.values())]
        for supports, names in sorted(rows.items(), key=lambda row: -len(row[0]))
    ]
    words = [f"*{feature.name.lower()}*: {feature.value}" for feature in Feature]
    return table(header, lines) + f"\n{'; '.join(words)}.\n"


def engines(group: str, page: Path) -> str:
    """Return a row for each engine of a group of entry points, with links from a page."""
    return table(
        ["name", "package", "settings", "bits", "what it is"],
        [_engine_row(name, kind, page) for name, kind in entries(group) if kind.role == "engine"],
    )


def _engine_row(name: str, kind: Any, page: Path) -> list[str]:
    data = getattr(kind, "data", None)  # none: the engine is a class of its own
    file, words = (kind.adapter.__file__, kind.adapter.__doc__) if data else (inspect.getfile(kind), kind.__doc__)
    apart = data and data.oldest and hasattr(kind, "at_version")  # of those in this process pyproject.toml has the bounds
    package = f"{data.package} ≥ {data.oldest}" if apart else data.package if data else name
    origin = {"npm": "npm", "apt": "Debian"}.get(data.kind) if data else None
    texts = [
        _settings(field.name, field.default, data, _quoted(kind, field.name))
        for field in dataclasses.fields(kind)
        if field.name != "precision"
    ]
    precision = dict(data.settings).get("precision") if data else None
    bits = "64 or 32" if precision else "32" if data and data.precision == "f32" else "64"
    link = os.path.relpath(os.path.realpath(file), page.parent)
    package += f" ({origin})" if origin else ""
    return [f"[`{name}`]({link})", package, "; ".join(texts), bits, summary(words)]


def _settings(name: str, default: object, data: Any, quoted: list[str]) -> str:
    """Return a setting with its default first, then its other values: those of an engine's data, or that its class quotes."""
    first = data and next(iter(data.settings), "") == name
    values = [*(data.choices.get(name) or (data.orders if first else ()))] if data else quoted
    values = [f"`{each}`" for each in dict.fromkeys([default, *values]) if each != ""]
    if first and data.orders:
        return ", ".join(values)
    return f"`{name}`" if isinstance(default, bool) else f"`{name}` = {', '.join(values)}" if values else f"`{name}`"


def _quoted(kind: Any, name: str) -> list[str]:
    """Return the values of a setting that are in quotation marks under `Parameters` of a class."""
    text = inspect.cleandoc(kind.__doc__ or "")
    entry = re.search(rf"^(?:\w+, )*{name}(?:, \w+)*\n((?:    .*\n?)+)", text, re.MULTILINE)
    return re.findall(r'"(\w+)"', entry[1]) if entry and isinstance(getattr(kind, name), str) else []


def motions() -> str:
    """Return a row for the motions with the same features."""
    names: dict[str, list[str]] = {}
    for motion in load():
        features = ", ".join(files.read(motion.name)["features"]) or "free rotation"
        names.setdefault(features, []).append(f"`{motion.name}`")
    return table(["needs", "motions"], [[features, ", ".join(motions)] for features, motions in names.items()])


def changes() -> str:
    """Return a row for the mistakes that need the same change."""
    names: dict[str, list[str]] = {}
    for name, change in remedies().items():
        names.setdefault(change, []).append(f"`{name}`")
    return table(["NAME", "the line to change"], [[", ".join(named), change] for change, named in names.items()])


def embed_motions(name: str, text: str) -> str:
    """Return the text of a test of references/motions with the motions that it should have."""
    return one_file.fill(MOTION_TESTS[name], text, _small_set())


@cache
def _small_set() -> list[one_file.Description]:
    return one_file.small_set([files.read(motion.name) for motion in load()])


MOTION_TESTS = {name: language for language, name in one_file.LANGUAGES.items()}
"""Languages by the names of the tests."""


def pairs() -> str:
    """Return a row for each pair that needs a description of its own, with the engines whose adapters declare it."""
    from conservative.benchmarks.verification.pairs.pairs import PAIRS

    kinds = {name: kind for group in GROUPS for name, kind in entries(group)}
    declared = {name: kind.data.descriptions for name, kind in kinds.items() if hasattr(kind, "data")}
    rows = ([pair, sorted(name for name, those in declared.items() if pair.variant in those)] for pair in PAIRS)
    lines = [[pair.name, f"`{pair.variant}`", ", ".join(map("`{}`".format, names))] for pair, names in rows if names]
    return table(["pair", "description", "engines"], lines)


TABLES: dict[str, Callable[[], str]] = {
    "methods": methods,
    "support": support,
    "engines": partial(engines, GROUPS[0], ROOT / "references" / "README.md"),
    "engines in environments": partial(engines, GROUPS[1], ROOT / "references" / "README.md"),
    "motions": motions,
    "changes": changes,
    "pairs of engines": pairs,
}
"""Tables by the name of their mark."""
