"""`conservative gate`: results of benchmarks against a baseline, or two versions of a project against each other."""

from __future__ import annotations

import os
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import click

from conservative.errors import BadInput, require_extra

from . import completion
from .options import (
    FilePath,
    Output,
    OutputCommand,
    allow_build_option,
    epilog,
    find_links_option,
    names_option,
    output_files,
    show,
    split_names,
)

if TYPE_CHECKING:
    from ..document.model import Document

FILES = ("junit", "markdown", "html")
LIMITS = ["scene", "method", "measure", "measured", "limit"]
OF_BASELINE = ("results", "baseline", "update")
OF_VERSIONS = (
    *("project", "scenes", "methods", "requirements", "accept_slower", "processes", "build", "find_links", "allow_build"),
    *FILES,
)


@click.command(
    cls=OutputCommand,
    short_help="Compare benchmarks with a baseline, or two versions with each other.",
    codes={1: "the gate did not pass"},
    epilog=epilog(
        "conservative gate --against main              compare the files in this folder with a branch; needs no baseline",
        "conservative gate --against v1.2 --methods my_method --html gate.html",
        "conservative gate --against main --build 'cmake -B build && cmake --build build'",
        "pytest --benchmark --gate                     run benchmarks, compare with the baseline, keep the results",
        "conservative gate                             compare these results again",
        'conservative gate --update "Fewer corrections"   accept these results as the baseline, with the reason',
        "conservative gate --json | jq '.verdicts[].violations'",
    ),
)
@click.argument("results", nargs=-1, type=FilePath())
@click.option("--baseline", type=FilePath(), help="The baseline.  [default: benchmarks/baseline.json]")
@click.option(
    "--update",
    metavar="REASON",
    help="Accept RESULTS, which must be of one commit, as the new baseline, and record the reason in its history.",
)
@click.option(
    "--against",
    metavar="REF|FOLDER|WHEEL",
    help="The older version. Both versions run in turn, each in its own environment; no baseline is needed.",
)
@click.option("--project", metavar="REF|FOLDER|WHEEL", help="With --against: the newer version.  [default: this folder]")
@names_option("scenes", "With --against: scenes.  [default: the scenes of the benchmarks]", complete=completion.scenes)
@names_option("methods", "With --against: methods.  [default: those that the project registers]")
@click.option(
    "--with",
    "requirements",
    multiple=True,
    metavar="PACKAGE|WHEEL",
    help="With --against: more packages for both environments.",
)
@click.option(
    "--accept-slower",
    multiple=True,
    metavar="NAME=6x[: REASON]",
    help="With --against: accept that a method takes up to this many times as long. In CI, use conservative.toml instead.",
)
@click.option(
    "--processes", type=click.IntRange(2), metavar="N", help="With --against: number of processes per version.  [default: 7]"
)
@click.option(
    "--build",
    metavar="COMMAND",
    help="With --against: compare the programs of conservative.toml, in any language. COMMAND builds a version in its folder.",
)
@find_links_option
@allow_build_option
@click.option("--junit", type=Output('name="conservative gate"'), help="With --against: write a JUnit report.")
@click.option(
    "--markdown",
    type=Output("**gate: "),
    help="With --against: write what changed as Markdown, for a comment; everything else is folded.",
)
@click.option(
    "--html", type=Output("<title>conservative gate"), help="With --against: write a page with rows, ratios and filters."
)
@click.option("--json", "as_json", is_flag=True, help="Print violations and notes, or the new entry of the history, as JSON.")
@click.pass_context
def gate(context: click.Context, /, as_json: bool, **options: Any) -> None:
    """Compare RESULTS of `pytest --benchmark` with the baseline; by default the results of the last run with --gate.

    With --against, measure two versions and compare their errors, drifts, orders, work counts and times. A row that is 5 %
    slower with 99 % confidence is measured again in new processes, and fails if it is slower again.

    The exit code is 1, with a line for each violation, or 2 if the comparison cannot be made.
    """
    two_versions = options["against"] is not None
    for name in OF_BASELINE if two_versions else OF_VERSIONS:
        if options[name]:
            parameter = next(param for param in context.command.params if param.name == name)
            problem = "cannot be used with --against" if two_versions else "needs --against"
            raise click.UsageError(f"{parameter.get_error_hint(context)} {problem}")
    if not two_versions:
        answer = _judge(options)
    else:
        # Missing packages and bad paths are reported before any work.
        require_extra("conservative gate --against", "environments")
        require_extra("conservative gate --against", "gate", "heyoka")
        if options["html"]:
            require_extra("conservative gate --html", "report", "jinja2", "itables")
        with output_files(None, (), **{name: options[name] for name in FILES}) as write:
            answer = _compare(options)
            answer = write(answer)
    show(answer, as_json, silent=True)


def _judge(options: dict[str, Any]) -> Document:
    """Compare results with the baseline, or accept them."""
    from conservative.benchmarks.gate import baseline, results
    from conservative.benchmarks.gate.compare import decide

    from ..document.model import Document, Paragraph, Table, filled

    path = options["baseline"] or baseline.PATH
    runs = [results.read(path) for path in options["results"] or [results.FOLDER / results.FILE]]
    if options["update"] is None:
        before = baseline.read(path)
        verdicts = [decide(before, run) for run in runs]
        failed = [str(verdict) for verdict in verdicts if not verdict.passed]
        data = {"passed": not failed, "verdicts": [verdict.record for verdict in verdicts]}
        texts = [Paragraph(str(verdict)) for verdict in verdicts]
        return Document("conservative gate", "Results against the baseline", texts, data=data, failures=failed)
    old = baseline.read(path, also_with_times=True) if path.exists() else None
    new = baseline.update_baseline(old, runs, options["update"])
    baseline.write(new, path)
    entry = new.history[-1]
    changes = ", ".join(f"{len(entry[kind])} {kind}" for kind in ("added", "changed", "removed"))
    text = f"{path}: {len(new.rows)} rows from {entry['runs']} runs; {changes}"
    limits = [
        [new.rows[id].scene, new.rows[id].method, name, f"{allowed.value:.6g}", f"{allowed.limit:.6g}"]
        for id in (*entry["added"], *entry["changed"])
        for name, allowed in new.rows[id].measures.items()
    ]
    blocks = filled(Paragraph(text), Table(LIMITS, limits, "Limits that are new or changed"))
    data = {"passed": True, "baseline": path, "rows": len(new.rows), "entry": entry}
    return Document("conservative gate", "A new baseline", blocks, data=data)


def _compare(options: dict[str, Any]) -> Document:
    """Install both versions and compare them."""
    from conservative.benchmarks.versions.prices import read_prices
    from conservative.benchmarks.versions.project import compare_projects
    from conservative.benchmarks.versions.version import Version, build_version, install_version
    from conservative.programs import list_programs, project_file
    from conservative.references.environments.folders import temporary_folder
    from conservative.references.environments.kind import Source
    from conservative.registry import read_name

    from ..run.causes import find_causes
    from ..run.provenance import provenance
    from ..sections.comparison import build
    from ..terminal.progress import progress

    made = provenance().facts
    source, head = Source(options["find_links"], options["allow_build"]), options["project"] or "."
    programs = [program.name for program in list_programs().values() if program.file == project_file()]
    if options["build"] and not programs:
        raise BadInput("build", "no program", "one in the project: conservative engines add ./my_engine --project")
    prices = read_prices(options["accept_slower"], project_file())
    project = Path(head) if Path(head).is_dir() else Path()
    asked: dict[str, Any] = {name: split_names(name, options[name]) for name in ("scenes", "methods") if options[name]}
    for name in asked.get("methods", ()):
        if read_name(name, "methods").version:
            raise BadInput("methods", repr(name), "a method that the project registers, without a version of an engine")
    if options["build"]:
        asked = {"methods": programs, **asked}
    if options["processes"]:
        asked["processes"] = options["processes"]

    def prepare(name: str) -> Version:
        click.echo(f"preparing {name}", err=True)
        if options["build"]:
            return build_version(name, options["build"], Path(folder))
        return install_version(name, project, source, options["requirements"])

    with TemporaryDirectory(dir=temporary_folder(), prefix=f"build-{os.getpid()}-") as folder:
        base, latest = prepare(options["against"]), prepare(head)
        with progress() as tell:
            return build(compare_projects(base, latest, tell=tell, explain=find_causes, **asked), made, prices)
