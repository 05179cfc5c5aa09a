"""`conservative twins`."""

from __future__ import annotations

from pathlib import Path

import click

from conservative.errors import require_extra

from . import completion
from .options import (
    FilePath,
    Output,
    OutputCommand,
    epilog,
    json_option,
    names_option,
    output_files,
    require_replaceable,
    show,
    split_names,
)


@click.command(
    cls=OutputCommand,
    short_help="Check that two descriptions of one body move equally.",
    codes={1: "a pair differs, or an engine crashes"},
    epilog=epilog(
        "conservative twins mujoco",
        "conservative twins mujoco@3.13.0 mujoco@3.14.0",
        "conservative twins mujoco:implicitfast --pairs 'inertia on a fixed child'",
        "conservative twins my_engine --junit twins.xml",
    ),
)
@click.argument("engines", nargs=-1, required=True, shell_complete=completion.methods)
@names_option("pairs", "Pairs to compare.  [default: all]")
@json_option
@click.option("--junit", type=Output('name="conservative twins"'), help="Write a JUnit report.")
@click.option("--markdown", type=Output("# Twins: "), help="Write the tables as Markdown.")
@click.option("--scripts", type=FilePath(), help="Folder for a script of each pair that differs, in the engine's own language.")
def twins(
    engines: tuple[str, ...], pairs: tuple[str, ...], as_json: bool, scripts: Path | None, **outputs: Path | None
) -> None:
    """Run pairs of descriptions of one motion in each of ENGINES, without a reference solution.

    A pair is a body and the same body in other units, axes, joints, files or batches, run again, continued, or reset. A bare
    name stands for all settings that tables show; NAME:SETTING for one. A pair that differs is reduced to the simplest body
    and the fewest steps. The exit code is 1 if a pair differs, or an engine crashes.
    """
    require_extra("conservative twins", "report")
    from conservative.benchmarks.studies.selection import methods as select_methods
    from conservative.benchmarks.studies.twins import compare_methods
    from conservative.benchmarks.verification.pairs.script import MARK, script_name
    from conservative.benchmarks.verification.pairs.verify import select_pairs
    from conservative.files import make_folder, write_text

    from ..run.provenance import provenance
    from ..sections.twins import build
    from ..terminal.progress import progress

    methods, chosen = select_methods(split_names("engines", engines)), select_pairs(split_names("pairs", pairs))
    force = click.get_current_context().meta["force"]
    for name in (script_name(method, pair.name) for method in methods for pair in chosen):
        if scripts:
            require_replaceable(scripts / name, MARK, "scripts", force)
    with output_files(None, (), **outputs) as write:
        made = provenance().facts
        with progress() as step:
            results = list(compare_methods(methods, step, [pair.name for pair in chosen]))
        document = build(results, made)
        document = write(document)
        for _, found in results:
            if scripts and found.script:
                make_folder(scripts, "scripts")
                write_text(scripts / found.script_file, found.script, "scripts")
    show(document, as_json, silent=True)
