"""Verification of model files with all checks: their links, and the bodies that engines load from them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from ..finding import Verdict, Verification
from .links import verify_links
from .loaded import installed_loaders, verify_files


def verify_models(
    files: Sequence[Path],
    checks: Sequence[str],
    engines: Sequence[str] = (),
    tell: Callable[[float, str], object] = lambda share, what: None,
    search: Sequence[Path] = (),
) -> list[Verification]:
    """Return a verification for each model file, with the findings of the `checks`: "links", "bodies".

    If no engine is named or installed, and both checks are wanted, only the links are checked. Raise as `verify_links` and
    `verify_files`.
    """
    load = "bodies" in checks and bool(engines or installed_loaders() or "links" not in checks)
    if "links" not in checks:
        return verify_files(files, engines, tell, search)
    share = 0.5 if load else 1.0
    links = verify_links(files, lambda done, what: tell(share * done, what), search)
    if not load:
        return links
    paths = list(dict.fromkeys(files))
    readable = [path for path, first in zip(paths, links, strict=True) if first.verdict is not Verdict.NOT_TESTED]
    readable = readable if len(paths) > 1 else paths  # a file that is alone and cannot be read is bad input
    if not readable:
        return links
    bodies = verify_files(readable, engines, lambda done, what: tell(share + (1 - share) * done, what), search)
    loaded = dict(zip(readable, bodies, strict=True))
    return [_joined(first, loaded[path]) if path in loaded else first for path, first in zip(paths, links, strict=True)]


def _joined(links: Verification, bodies: Verification) -> Verification:
    """Return one verification of a file from the two."""
    return replace(
        bodies,
        subject=links.subject,
        findings=(*links.findings, *bodies.findings),
        reason="; ".join(filter(None, [links.reason, bodies.reason])),
        notes=tuple(dict.fromkeys([*links.notes, *bodies.notes])),
    )
