"""`conservative motions`."""

from __future__ import annotations

from pathlib import Path

import click

from conservative.errors import BadInput

from .options import Command, FilePath, epilog, json_option, option, require_replaceable

LANGUAGES = ("c", "csharp", "javascript", "python", "rust")
"""Languages of tests (`one_file.LANGUAGES`, which `--help` does not import)."""


@click.command(
    cls=Command,
    short_help="Write exact motions as files, for the tests of an engine.",
    epilog=epilog(
        "conservative motions --out motions                                     the published motions",
        "conservative motions --seed 7 --out fresh                              new exact motions",
        "conservative motions --seed 7 --language rust --out rotation_test.rs   a test with some of them",
    ),
)
@option("out", "Folder for the files, two for each motion; or with --language, the file.", required=True, type=FilePath())
@click.option("--seed", type=click.IntRange(0), metavar="N", help="Fresh motions of this seed instead of the published ones.")
@click.option("--language", type=click.Choice(LANGUAGES), help="One file, a test in this language with twelve of the motions.")
@click.option("--force", is_flag=True, help="Replace files that this command did not write.")
@json_option
def motions(out: Path, seed: int | None, language: str | None, force: bool, as_json: bool) -> None:
    """Write short motions as JSON and CSV, with tolerances and the mistakes that each motion reveals.

    Without a seed, they are the 48 published motions, whose files equal those of references/motions to the last digit. A seed
    gives other bodies and starts: one motion of each of 43 families, under the names of the published motions. All motions are
    solved again, and all tolerances measured again with right programs of all designs, which takes up to a minute. A motion of
    a seed is solved twice, and not written unless both solutions agree to 1e-15. The same seed gives the same files.
    """
    from conservative.benchmarks.verification.motions import files, one_file
    from conservative.files import write_text

    from ..document import json

    if language is None:
        for name, mark in files.marks(seed):
            require_replaceable(out / name, mark, "out", force)
        names = files.write(out, seed)
        text = f"{len(names)} files in {out}"
    else:
        if out.exists() and not (force and out.is_file()):  # an earlier result has the engine of the user in it
            allowed = f"a new file, such as {one_file.LANGUAGES[language]}, or --force to replace a file"
            raise BadInput("out", f"{str(out)!r}, which exists", allowed)
        write_text(out, one_file.one_file(language, one_file.small_set(list(files.descriptions(seed)))), "out")
        names, text = [out.name], str(out)
    click.echo(json.render({"out": str(out), "files": names}) if as_json else text)
