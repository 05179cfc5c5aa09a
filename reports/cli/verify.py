"""`conservative verify`."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from conservative.errors import BadInput, require_extra

from ..document import SVG_MARK
from . import completion
from .options import (
    FilePath,
    Output,
    OutputCommand,
    epilog,
    error_option,
    json_option,
    names_option,
    option,
    output_files,
    picture_file,
    picture_option,
    require_replaceable,
    show,
    split_names,
)

if TYPE_CHECKING:
    from conservative.benchmarks.verification.finding import Verification
    from conservative.benchmarks.verification.verify import Kind

FILES = {
    "verify.md": "# Verified: ",
    "verify.json": '{\n  "verified": ',
    "verify.csv": "subject,check,case",
    "verify.html": "<title>conservative verify",
    "errors.csv": "t,quantity,value",
    "errors.svg": SVG_MARK,
}
"""The files of `--out`, and how each begins. Only model files have a page, and only a recording and --pairs have errors over
time."""
MARK = "# Known errors on exact motions."
"""The beginning of a file of known errors (`known.MARK`, which `--help` does not import)."""
TWO = "subjects"
"""The value of --pairs without names, which compares two subjects with each other."""
WITH_TWO = ("pairs", "only", "body", "seed", "record", "known", "picture")
"""Options of two subjects that are compared with each other, beside those of the output."""
LISTS = ("only", "pairs", "engines")
"""Options that take names between commas."""


@click.command(
    cls=OutputCommand,
    short_help="Verify a recording, an engine, a program or a model file.",
    codes={
        1: "a subject is wrong, or with --known, a failure is new",
        3: "no subject is wrong, and one is undecided or not tested",
    },
    epilog=epilog(
        "conservative verify run.csv --body my_body.toml                 is this recorded motion right?",
        "conservative verify a.csv b.csv --body my_body.toml             they disagree: which one is wrong?",
        "conservative verify a.csv b.csv                                 the same without the body, if it rotates freely",
        "conservative verify ./my_engine 'python my_engine.py'           programs",
        "conservative verify mujoco@3.12.0 drake:discrete                engines",
        "conservative verify mujoco:RK4 pinocchio --pairs                two back ends differ: which one is wrong?",
        "conservative verify ./my_engine --seed 7                        by new exact motions",
        "conservative verify ./my_engine --record known.txt              its errors are known, later ones fail:",
        "conservative verify ./my_engine --known known.txt",
        "conservative verify my_robot.urdf --engines mujoco,drake        do they load the body that the file describes?",
        "conservative verify robots --only links --out page              are masses and inertias of a library plausible?",
        "conservative verify mujoco --only pairs --scripts scripts       a script for each pair that differs",
        "conservative verify flight.csv --body brick_flip --euler zyx --rates world --error 1e-3 --json",
    ),
)
@click.argument("subjects", nargs=-1, metavar="SUBJECT...", shell_complete=completion.subjects)
@click.option(
    "--body",
    shell_complete=completion.scenes,
    help="Recordings: scene (file or name) with the body, the field and the initial state. Two recordings of a body that "
    "rotates freely need none.",
)
@click.option(
    "--columns",
    metavar="MAP",
    help="Recordings: columns by name or number, such as time=1,w=2:3:4,q=5:6:7:8 (also R, euler, rotvec, mrp, crp).",
)
@click.option(
    "--quaternion",
    type=click.Choice(["wxyz", "xyzw"]),
    help="Recordings: order in numbered columns.  [default: the one that fits]",
)
@click.option("--euler", metavar="ZYX", help="Recordings: sequence of Euler angles, zyx for yaw, pitch, roll.")
@click.option(
    "--rates", type=click.Choice(["body", "world"]), default="body", show_default=True, help="Recordings: axes of the rates."
)
@click.option(
    "--units",
    type=click.Choice(["deg", "rad", "deg/s", "rad/s"]),
    help="Recordings: unit of angles and rates if their columns have none; deg/s and rad/s for rates only.",
)
@click.option(
    "--start",
    type=click.Choice(["row", "scene"]),
    default="row",
    show_default=True,
    help="Recordings: initial state from the first row, or from the scene at t = 0.",
)
@click.option("--from", "start_time", type=float, metavar="S", help="Recordings: time of the first row to compare, s.")
@click.option("--until", "end_time", type=float, metavar="S", help="Recordings: time of the last row to compare, s.")
@error_option("Recordings: allowed error, rad, or relative to the largest rate.  [default: from digits and noise]")
@names_option(
    "only",
    "Methods, engines, programs: motions, order, repeatability, pairs, and for programs protocol, times. Model files: links, "
    "bodies.  [default: all]",
    "CHECKS",
)
@option(
    "pairs",
    "Without names, after two engines, methods or programs: which of them is wrong? With names: pairs of descriptions of one "
    "body to compare.  [default: all]",
    multiple=True,
    is_flag=False,
    flag_value=TWO,
    metavar="[A,B]",
)
@click.option(
    "--seed",
    type=click.IntRange(0),
    metavar="N",
    help="Methods, engines and programs: the fresh motions of this seed instead of the published ones.",
)
@click.option("--scripts", type=FilePath(), help="Folder for a script of each pair that differs, in the engine's own language.")
@names_option(
    "engines",
    "Model files: engines or programs that load them.  [default: the installed engines; without one, only links are checked]",
    "E,F",
    completion.engine_lists,
)
@click.option("--search", multiple=True, type=FilePath(), help="Model files: folder of meshes and packages; repeatable.")
@option(
    "record",
    "Write today's errors and mistakes into this file of known errors. The exit code is 0 if the subjects run.",
    type=Output(MARK),
    envvar="ROTATION_RECORD",
    metavar="FILE",
)
@option(
    "known",
    "Compare with this file of known errors. The exit code is 1 only for a new failure.",
    type=FilePath(),
    envvar="ROTATION_KNOWN",
    metavar="FILE",
)
@json_option
@click.option("--junit", type=Output('name="conservative verify"'), help="Write a JUnit report.")
@click.option("--markdown", type=Output(FILES["verify.md"]), help="Write the tables as Markdown.")
@click.option("--csv", type=Output(FILES["verify.csv"]), help="Write the findings as CSV.")
@option(
    "out",
    f"Write {', '.join(FILES)} into this folder; the page only for model files, errors only for a recording or --pairs.",
    type=Output(FILES),
)
@picture_option
@click.pass_context
def verify(
    ctx: click.Context,
    /,
    subjects: tuple[str, ...],
    as_json: bool,
    junit: Path | None,
    markdown: Path | None,
    csv: Path | None,
    out: Path | None,
    picture: Path | None,
    scripts: Path | None,
    **values: Any,
) -> None:
    """Decide whether each SUBJECT is right, and name the mistakes that explain the errors.

    A SUBJECT is a recording (CSV or JSON lines), an engine with a version or a setting, a method of this package, a program
    (its name, its file, or a quoted command line), a model file (URDF, SDF, MJCF, USD), or a folder of recordings or of model
    files. A folder without such files stands for the models in the folders below it. Two recordings are also compared with each
    other, and two engines, methods or programs with --pairs. The links of model files are checked without an engine. With
    --engines and no SUBJECT, engines load the small model files of this package, each of which tests one rule of a format.

    The exit code is 0 if all subjects are right, 1 if one is wrong, and 3 if one is undecided or not tested. With --known, it
    is 1 only if an error is larger than in the file, has another mistake without being smaller, or is new. If a motion changed,
    the last line is a sentence for a pull request.
    """
    if picture is not None:
        require_extra("conservative verify --picture", "report")
    from conservative.benchmarks.verification.verify import Kind, expand, verify

    from ..sections import verification as section
    from ..terminal.progress import progress

    names = [name for text in subjects for name in split_subject(text)]
    if not names:
        if not values["engines"]:
            raise click.UsageError("Missing argument 'SUBJECT...'.")
        from conservative.benchmarks.verification.bodies.loaded import CATALOGUE

        names = [str(CATALOGUE)]
    kinds_in_order = [subject.kind for subject in expand(names)]
    kinds, alone = set(kinds_in_order), kinds_in_order == [Kind.RECORDING]
    together = TWO in values["pairs"]
    given = {"picture": picture, "scripts": scripts, **values}
    require_descriptions(values["pairs"])
    options = used_by_two(given, names) if together else used(given, kinds)
    if not subjects:  # the masses of the small files are no robot's
        options.setdefault("only", ["bodies"])
    over_time = alone or together
    if picture is not None and not over_time:
        raise BadInput("picture", f"{len(kinds_in_order)} subjects", "one recording, or two subjects with --pairs")
    drawn = over_time and find_spec("pandas") is not None and find_spec("altair") is not None
    left_out = [] if drawn else ["errors.svg"] if over_time else ["errors.svg", "errors.csv"]
    if Kind.MODEL not in kinds:
        left_out.append("verify.html")
    elif out is not None:
        require_extra("a page of model files", "report", "jinja2", "itables")
    outputs = {"junit": junit, "markdown": markdown, "csv": csv, "picture": picture}
    title = f"verifying {', '.join(names)}"
    with output_files(out, [name for name in FILES if name not in left_out], **outputs) as write, progress(title) as tell:
        verifications = [verify_two(*names, tell=tell, **options)] if together else verify(names, tell=tell, **options)
        made = {
            "csv": lambda: section.findings_text(verifications),
            "errors.csv": lambda: section.errors_text(verifications),
            "errors.svg": lambda: draw(verifications),
            "picture": lambda: draw(verifications, picture),
        }
        document = section.build(verifications, {} if kinds == {Kind.RECORDING} else facts())
        written = write(document, **made)
    show(replace(written, failures=written.failures[len(document.failures) :]), as_json)
    for verification in verifications:  # not a part of the document, whose lines are wrapped
        if verification.change and not as_json:
            click.echo(verification.change)
    if scripts is not None:  # after the result, which a script that cannot be written must not cost
        write_scripts(verifications, scripts, ctx.meta["force"])
    ctx.exit(section.exit_code(verifications))


def split_subject(text: str) -> list[str]:
    """Return the subjects in an argument: a file or a command line is one, names of engines can be separated by commas."""
    return [text] if Path(text).exists() or " " in text or "," not in text else split_names("subjects", (text,))


def used(values: Mapping[str, Any], kinds: Collection[Kind]) -> dict[str, Any]:
    """Return the options on the command line as `verify` takes them. Raise `BadInput` for one that no subject uses."""
    from conservative.benchmarks.verification.verify import USED_BY, Kind

    ctx, options = click.get_current_context(), dict[str, Any]()
    users_of = USED_BY | {"scripts": USED_BY["pairs"], **dict.fromkeys(("only", "record", "known"), tuple(Kind))}
    for name, value in values.items():
        if ctx.get_parameter_source(name) is ParameterSource.DEFAULT:
            continue
        users = users_of.get(name, (Kind.RECORDING,))
        if not set(kinds) & set(users):
            flag = next(param.opts[0] for param in ctx.command.params if param.name == name)
            got = f"{flag}, which none of the subjects uses ({', '.join(sorted(kinds))})"
            raise BadInput(flag.lstrip("-"), got, f"a subject of the kind {', '.join(users)}")
        if name not in ("picture", "scripts"):
            options[name] = split_names(name, value) if name in LISTS else value
    return options


def verify_two(first: str, second: str, **options: Any) -> Verification:
    """Return the verification of two back ends."""
    from conservative.benchmarks.verification import parity  # here: recordings need no kernels

    return parity(first, second, **options)


def require_descriptions(texts: Sequence[str]) -> None:
    """Raise `BadInput` for a subject that follows --pairs, which would be the name of a pair of descriptions."""
    from conservative import registry

    subjects = {*registry.list_engines(), *registry.list_methods()}
    for text in texts:
        if text.partition(":")[0].partition("@")[0] in subjects:
            allowed = f"names of pairs of descriptions; two subjects go before it: conservative verify {text} OTHER --pairs"
            raise BadInput("pairs", f"the subject {text!r}", allowed)


def used_by_two(values: Mapping[str, Any], names: Sequence[str]) -> dict[str, Any]:
    """Return the options of two back ends on the command line as `parity` takes them. Raise `BadInput` for others."""
    ctx = click.get_current_context()
    if len(names) != 2:
        got = f"--pairs without names, and {len(names)} subjects ({', '.join(names)})"
        raise BadInput(
            "pairs", got, "two subjects before --pairs, or names of pairs of descriptions, such as --pairs 'mass x 10^k'"
        )
    if values["pairs"] != (TWO,):
        raise BadInput("pairs", "--pairs without names and with names", "one of them")
    given = {name: value for name, value in values.items() if ctx.get_parameter_source(name) is not ParameterSource.DEFAULT}
    for name in given:
        if name not in WITH_TWO:
            flag = next(param.opts[0] for param in ctx.command.params if param.name == name)
            got = f"{flag}, which two subjects with --pairs do not use"
            raise BadInput(flag.lstrip("-"), got, f"one of {', '.join(f'--{other}' for other in WITH_TWO)}")
    if "only" in given:
        given["only"] = split_names("only", given["only"])
    return {name: value for name, value in given.items() if name not in ("pairs", "picture")}


def facts() -> dict[str, str]:
    """Return the machine and the versions that runs were made with; a recording has none."""
    from ..run.provenance import provenance  # here: numba takes a second

    return provenance().facts


def draw(verifications: Sequence[Verification], path: Path | None = None) -> bytes:
    """Return errors of a recording or of two back ends over time, in the format of a file, by default SVG."""
    import pandas as pd

    from ..charts import figures

    (recording,) = verifications
    details: Any = recording.details
    if recording.kind == "back ends":
        if details.curves is None:
            raise BadInput("picture", f"{recording.subject}, which have no common motion", "two subjects that run one motion")
        return picture_file(figures.two_back_ends(pd.DataFrame(details.rows()), details.curves.motion), path)
    limits = {quantity.name: quantity.allowed for quantity in details.quantities if math.isfinite(quantity.allowed)}
    return picture_file(figures.recorded(pd.DataFrame(details.rows()), recording.subject, limits), path)


def write_scripts(verifications: Sequence[Verification], folder: Path, force: bool) -> None:
    """Write a script of each pair that differs into a folder."""
    from conservative.benchmarks.verification.pairs import PairFinding
    from conservative.benchmarks.verification.pairs.script import MARK
    from conservative.files import make_folder, write_text

    findings = [finding for verification in verifications for finding in verification.findings]
    scripts = {pair.script_file: pair.script for pair in findings if isinstance(pair, PairFinding) and pair.script}
    for name in scripts:
        require_replaceable(folder / name, MARK, "scripts", force)
    if scripts:
        make_folder(folder, "scripts")
    for name, text in scripts.items():
        write_text(folder / name, text, "scripts")
