"""`conservative gate`: results of benchmarks against a baseline, or two versions of a project against each other."""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from conservative.errors import require_extra

from . import completion
from .options import FilePath, OutputCommand, OutputFile, allow_build_option, epilog, find_links_option, split_names

if TYPE_CHECKING:
    from ..tables.comparison import Answer

FILES = ("junit", "markdown", "html")
OF_BASELINE = ("results", "baseline", "update")
OF_VERSIONS = ("project", "scenes", "methods", "requirements", "processes", "find_links", "allow_build", *FILES)


@click.command(
    cls=OutputCommand,
    short_help="Compare benchmarks with a baseline, or two versions with each other.",
    epilog=epilog(
        "conservative gate --against main              compare the files in this folder with a branch; needs no baseline",
        "conservative gate --against v1.2 --methods my_method --html gate.html",
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
    help="Accept RESULTS, all of one commit, as the new baseline, and record the reason in its history.",
)
@click.option(
    "--against",
    metavar="REF|FOLDER|WHEEL",
    help="The older version. Both versions run in turn, each in its own environment; no baseline is needed.",
)
@click.option("--project", metavar="REF|FOLDER|WHEEL", help="With --against: the newer version.  [default: this folder]")
@click.option(
    "--scenes",
    multiple=True,
    metavar="A,B",
    shell_complete=completion.scenes,
    help="With --against: scenes.  [default: those of the benchmarks]",
)
@click.option(
    "--methods",
    multiple=True,
    metavar="A,B",
    help="With --against: methods.  [default: all except engines and reference solutions]",
)
@click.option(
    "--with",
    "requirements",
    multiple=True,
    metavar="PACKAGE|WHEEL",
    help="With --against: more packages for both environments.",
)
@click.option(
    "--processes", type=click.IntRange(2), metavar="N", help="With --against: number of processes per version.  [default: 7]"
)
@find_links_option
@allow_build_option
@click.option("--junit", type=OutputFile('name="conservative gate"'), help="With --against: write a JUnit report.")
@click.option("--markdown", type=OutputFile("**gate: "), help="With --against: write verdict and table as Markdown.")
@click.option(
    "--html", type=OutputFile("<title>conservative gate: "), help="With --against: write a page with rows, ratios and filters."
)
@click.option("--json", "as_json", is_flag=True, help="Print violations and notes, or the new entry of the history, as JSON.")
@click.pass_context
def gate(context: click.Context, /, as_json: bool, **options: Any) -> None:
    """Compare RESULTS of `pytest --benchmark` with the baseline; by default those of the last run with --gate.

    With --against, measure two versions and compare their errors, drifts, orders, work counts and times. A row that is 5 %
    slower with 99 % confidence is measured again in new processes, and fails if it is slower again.

    The exit code is 1, with a line for each violation, or 2 if the comparison cannot be made.
    """
    two_versions = options["against"] is not None
    for name in OF_BASELINE if two_versions else OF_VERSIONS:
        if options[name]:
            parameter = next(each for each in context.command.params if each.name == name)
            problem = "cannot be used with --against" if two_versions else "needs --against"
            raise click.UsageError(f"{parameter.get_error_hint(context)} {problem}")
    if two_versions:
        answer = _compare_and_write(options)
        passed, text, json_text = answer.passed, str(answer), answer.json_text
    else:
        passed, text, content = _judge(options)
        json_text = lambda: json.dumps({"passed": passed, **content}, indent=2, ensure_ascii=False)  # noqa: E731
    click.echo(json_text() if as_json else text)
    if not passed:
        raise click.exceptions.Exit(1)


def _judge(options: dict[str, Any]) -> tuple[bool, str, dict[str, Any]]:
    """Compare results with the baseline, or accept them; return whether they pass, and the answer as text and for JSON.

    Raises
    ------
    BadInput
        A file holds no results, there is no baseline, or the results cannot be accepted.
    """
    from conservative.benchmarks.gate import baseline, results
    from conservative.benchmarks.gate.compare import judge

    path = options["baseline"] or baseline.PATH
    runs = [results.read(each) for each in options["results"] or [results.FOLDER / results.FILE]]
    if options["update"] is None:
        before = baseline.read(path)
        verdicts = [judge(before, run) for run in runs]
        records = [{"passed": each.passed, **asdict(each)} for each in verdicts]
        return all(each.passed for each in verdicts), "\n".join(map(str, verdicts)), {"verdicts": records}
    old = baseline.read(path, also_with_times=True) if path.exists() else None
    new = baseline.update_baseline(old, runs, options["update"])
    baseline.write(new, path)
    entry = new.history[-1]
    changes = ", ".join(f"{len(entry[kind])} {kind}" for kind in ("added", "changed", "removed"))
    text = f"{path}: {len(new.rows)} rows from {entry['runs']} runs; {changes}"
    return True, text, {"baseline": str(path), "rows": len(new.rows), "entry": dict(entry)}


def _compare_and_write(options: dict[str, Any]) -> Answer:
    """Compare two versions and write the files that are asked for; missing packages and bad paths end it before any work."""
    from conservative.files import text_file

    require_extra("conservative gate --against", "environments")
    require_extra("conservative gate --against", "gate", "heyoka")
    if options["html"]:
        require_extra("conservative gate --html", "report", "jinja2")
    with ExitStack() as files:
        streams = {name: files.enter_context(text_file(options[name], name)) for name in FILES if options[name] is not None}
        answer = _compare(options)
        for name, stream in streams.items():
            stream.write(_text_of(answer, name))
    return answer


def _text_of(answer: Answer, name: str) -> str:
    """Return the answer as `FILES` names it."""
    if name == "html":  # which needs jinja2, the others do not
        from ..page.versions import render_comparison

        return render_comparison(answer)
    texts: dict[str, Callable[[], str]] = {"junit": answer.junit_text, "markdown": answer.markdown_text}
    return texts[name]()


def _compare(options: dict[str, Any]) -> Answer:
    """Install both versions and compare them.

    Raises
    ------
    BadInput
        A version or a scene cannot be used, or neither version has a method.
    """
    from conservative.benchmarks.comparison.compare import compare_versions
    from conservative.benchmarks.comparison.version import install_version
    from conservative.references.environments.lock import Source

    from ..run.provenance import describe_origin
    from ..tables.comparison import Answer
    from ..terminal.progress import progress

    made = describe_origin()
    source, head = Source(options["find_links"], options["allow_build"]), options["project"] or "."
    project = Path(head) if Path(head).is_dir() else Path()
    asked: dict[str, Any] = {name: split_names(name, options[name]) for name in ("scenes", "methods") if options[name]}
    if options["processes"]:
        asked["processes"] = options["processes"]
    versions = []
    for name in (options["against"], head):
        click.echo(f"preparing {name}", err=True)
        versions.append(install_version(name, project, source, options["requirements"]))
    with progress() as step:
        return Answer(compare_versions(versions[0], versions[1], tell=step, **asked), made)
