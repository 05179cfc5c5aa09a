"""`conservative gate --against`: two versions of a project, each in its environment, against each other."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import click

from conservative.errors import require_extra

if TYPE_CHECKING:
    from ..tables.comparison import Answer

FILES = ("junit", "markdown", "html")
DEFAULT = "."
"""What is compared where nobody says: the folder that the command is started in."""


def compare(options: dict[str, Any]) -> Answer:
    """Return what two versions differ in, and write the files that are asked for.

    Raises
    ------
    BadInput
        A version, a scene or a file cannot be used, or neither version has a method.
    """
    require_extra("conservative gate --against", "environments")
    if options["html"]:
        require_extra("conservative gate --html", "report", "jinja2")
    with ExitStack() as files:
        streams = _open(files, options)
        answer = _compare(options)
        _write(answer, streams)
    return answer


def _open(files: ExitStack, options: dict[str, Any]) -> dict[str, IO[str]]:
    """Return the files to write, by option: a place that cannot be written is an error before any work."""
    from conservative.files import text_file

    return {name: files.enter_context(text_file(options[name], name)) for name in FILES if options[name] is not None}


def _compare(options: dict[str, Any]) -> Answer:
    from conservative.benchmarks.comparison.compare import Question, compare_versions
    from conservative.benchmarks.comparison.version import install_version
    from conservative.references.environments.lock import Source

    from ..run.provenance import describe_origin
    from ..tables.comparison import Answer
    from ..terminal.progress import progress

    made = describe_origin()
    source, head = Source(options["find_links"], options["allow_build"]), options["project"] or DEFAULT
    project = Path(head) if Path(head).is_dir() else Path()
    asked = {name: options[name] for name in ("scenes", "methods", "processes") if options[name]}
    versions = []
    for name in (options["against"], head):
        click.echo(f"preparing {name}", err=True)
        versions.append(install_version(name, project, source, options["requirements"]))
    with progress() as step:
        found = compare_versions(versions[0], versions[1], Question(**asked), step)
    return Answer(found, made)


def _write(answer: Answer, streams: dict[str, IO[str]]) -> None:
    from ..page.comparison import render

    contents: dict[str, Callable[[], str]] = {"junit": answer.junit_text, "markdown": answer.markdown_text}
    contents["html"] = partial(render, answer)
    for name, stream in streams.items():
        stream.write(contents[name]())
