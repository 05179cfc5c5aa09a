"""`conservative track`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from conservative.errors import require_extra

from . import completion
from .options import (
    FilePath,
    Output,
    OutputCommand,
    allow_build_option,
    epilog,
    find_links_option,
    json_option,
    names_option,
    option,
    output_files,
    show,
    split_names,
)

PAGE = {"track.html": "<title>conservative track", "track.md": "# Versions of ", "track.json": '{\n  "made": {'}
"""The files of `--out`, and how each is recognized."""


@click.command(
    cls=OutputCommand,
    short_help="Compare versions of an engine.",
    codes={1: "with --against: an order, an invariant, the attitude or the end of a run is lost"},
    epilog=epilog(
        "conservative track mujoco 3.6.0 3.7.0 4.0.0",
        "conservative track exudyn --last 3 --out exudyn_track",
        "conservative track mujoco --bump main        what a new version in requirements.txt or uv.lock changes",
        "conservative track mujoco --against dist/mujoco-4.1.0-cp311-cp311-linux_x86_64.whl --junit track.xml",
        "conservative track mujoco 4.0.0 --against ~/mujoco/python --allow-build --settings Euler,RK4",
    ),
)
@click.argument("engine", shell_complete=completion.engines)
@click.argument("versions", nargs=-1)
@click.option("--last", type=click.IntRange(1), metavar="N", help="Also compare the newest N versions.")
@click.option(
    "--against",
    type=FilePath(),
    metavar="WHEEL|FOLDER",
    help="Compare your own build with the last version. The exit code is 1 if it loses an order of convergence, "
    "an invariant or the attitude, or if a run fails that succeeded before.",
)
@click.option(
    "--bump", metavar="REF", help="Compare the versions in the lock or requirements files of a git ref and of this folder."
)
@names_option("scenes", "Scenes to run.  [default: the paper's two]", complete=completion.scenes)
@names_option("settings", "Settings of the engine, such as RK4.  [default: the settings that a report shows]")
@names_option(
    "verify",
    "Also run these checks (motions, pairs), and show the version in which a case became right or wrong.",
    "CHECKS",
)
@json_option
@click.option("--junit", type=Output('name="conservative track '), help="Write a JUnit report.")
@click.option("--markdown", type=Output(PAGE["track.md"]), help="Write tables and changes as Markdown.")
@option("out", f"Write {', '.join(PAGE)} into this folder.", type=Output(PAGE))
@find_links_option
@allow_build_option
def track(engine: str, versions: tuple[str, ...], as_json: bool, **options: Any) -> None:
    """Run the same scenes and steps in each of the VERSIONS of an ENGINE, and show what changed from one to the next.

    ENGINE can contain the first version, as in mujoco@3.6.0. Versions without an environment are installed first, each in an
    environment of its own. With --against, the exit code is 1 if an order, an invariant, the attitude (an error above
    1 rad) or the end of a run is lost.
    """
    require_extra("conservative track", "report")
    require_extra("conservative track", "environments")
    from conservative.benchmarks.versions.bumps import find_bump
    from conservative.benchmarks.versions.engine import compare_engine, plan_versions, require_several
    from conservative.benchmarks.versions.version import Version
    from conservative.check import choice
    from conservative.references.environments.environment import distribution_of
    from conservative.references.environments.install import install_build, install_releases, newest_releases
    from conservative.references.environments.kind import Source
    from conservative.registry import read_name

    from ..run.provenance import provenance
    from ..run.verification import CHECKS, verify_methods
    from ..sections.track import build
    from ..sections.verified_engines import changes
    from ..terminal.progress import progress

    def echo(what: str) -> None:
        click.echo(what, err=True)

    engine, first, _ = read_name(engine, "engine", settings=False)
    versions = *([first] if first else []), *versions
    if options["bump"] is not None:
        bump = find_bump(distribution_of(engine).package, options["bump"], Path())
        if bump is None:
            return click.echo(f"No file has another version of {engine} than {options['bump']}.")
        versions = *versions, *bump
    scenes, settings, checks = (split_names(name, options[name]) for name in ("scenes", "settings", "verify"))
    for name in checks:
        choice("verify", name, CHECKS)
    with output_files(options["out"], PAGE, junit=options["junit"], markdown=options["markdown"]) as write:
        made = provenance().facts
        source, against = Source(options["find_links"], options["allow_build"]), options["against"]
        last = options["last"] or (1 if against is not None and not versions else 0)
        newest = newest_releases(engine, last, source) if last else ()
        wanted = [*versions, *(version for version in newest if version not in versions)]
        require_several([*wanted, *([str(against)] if against is not None else [])])
        environments = install_releases(engine, wanted, source, echo)
        if against is not None:
            echo(f"installing {against}")
            environments += (install_build(engine, against, source).environment,)
        sides = plan_versions([Version(environment.version, "", environment) for environment in environments], settings, scenes)
        with progress() as tell:
            compared = compare_engine(sides, tell)
        with progress() as tell:
            verified = (
                [(side.version.name, list(verify_methods(side.methods, tell, checks))) for side in sides] if checks else []
            )
        answer = build(compared, against is not None, made, changes(verified) if checks else None)
        answer = write(answer)
    show(answer, as_json, silent=True)
