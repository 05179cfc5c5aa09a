"""`conservative importers`."""

from __future__ import annotations

from pathlib import Path

import click

from conservative.errors import require_extra

from .options import FilePath, Output, OutputCommand, epilog, json_option, names_option, output_files, show, split_names


@click.command(
    cls=OutputCommand,
    short_help="Compare the body that an engine loads with its file.",
    codes={1: "an engine loads another body, refuses a valid file, or accepts a body that cannot exist"},
    epilog=epilog(
        "conservative importers my_body.urdf",
        "conservative importers my_body.sdf --engines drake,pybullet --junit importers.xml",
        "conservative importers --engines newton@1.0.0,newton@1.1.0",
        "conservative importers my_body.urdf --engines my_engine",
    ),
)
@click.argument("files", nargs=-1, type=FilePath())
@names_option("engines", "Engines or programs: NAME or NAME@VERSION.  [default: engines that are installed]", "E,F")
@click.option(
    "--search", multiple=True, type=FilePath(), help="Folder of meshes and packages, next to that of the file; repeatable."
)
@json_option
@click.option("--junit", type=Output('name="conservative importers"'), help="Write a JUnit report.")
@click.option("--markdown", type=Output("# Importers: "), help="Write the tables as Markdown.")
def importers(
    files: tuple[Path, ...], engines: tuple[str, ...], search: tuple[Path, ...], as_json: bool, **outputs: Path | None
) -> None:
    """Load each of FILES (URDF, SDF, MJCF or USD) in each engine, and compare its motion with that of the body in the file.

    Without FILES: small models of this package, each with one trap. Every link of a robot is a free body of its own. The
    engine's own loader reads the file. If its motion is wrong, the mistake that explains it is named. If the reference reader
    of the format and that of this package disagree, the answer is undecided. The exit code is 1 if an engine is wrong, refuses
    a valid file, or accepts a body that cannot exist.
    """
    require_extra("conservative importers", "report")
    from conservative.benchmarks.verification.bodies.loaded import verify_files
    from conservative.benchmarks.verification.finding import Verdict

    from ..document.model import Check, Document
    from ..sections.bodies import body_blocks
    from ..terminal.progress import progress

    with output_files(None, (), **outputs) as write:
        with progress() as step:
            verifications = verify_files(files, split_names("engines", engines), step, search)
        findings = [finding for each in verifications for finding in each.findings]
        wrong = {id(each): each.detail for each in findings if each.verdict is Verdict.WRONG}
        checks = [
            Check(each.subject, each.case, failure=wrong.get(id(each), ""))
            for each in findings
            if each.verdict is not Verdict.NOT_TESTED
        ]
        failures = [f"{each.subject}, {each.case}: {each.detail}" for each in findings if id(each) in wrong]
        blocks = body_blocks(verifications)
        data = {"right": not wrong, "verifications": verifications}
        document = write(Document("conservative importers", "Importers", blocks, data=data, checks=checks, failures=failures))
    show(document, as_json, silent=True)
