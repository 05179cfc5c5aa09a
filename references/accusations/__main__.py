"""Run the scripts that show what is wrong in engines, in all installed versions, and write what they print into measured.csv.

    python -m conservative.references.accusations                   # all installed engines
    python -m conservative.references.accusations jolt rapier_js    # some engines
    python -m conservative.references.accusations jolt_damping.mjs  # one script
    python -m conservative.references.accusations --check           # write nothing; exit with 1 if a verdict has changed
    python -m conservative.references.accusations --missing         # names for `conservative engines install`

The pages are written from the rows by `python .ci/readme`.
"""

from __future__ import annotations

import argparse
import sys

from conservative.errors import BadInput

from .measure import differences, measure, merge, missing_engines
from .rows import read_accusations, read_results, write_results


def main(arguments: list[str] | None = None) -> int:
    """Run the scripts, and write or check the rows. Return the exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m conservative.references.accusations",
        description=__doc__,
        formatter_class=argparse.RawTextHelpFormatter,
    )
    parser.add_argument("names", nargs="*", metavar="NAME", help="an engine or a script; by default all")
    parser.add_argument("--check", action="store_true", help="write nothing; exit with 1 if a verdict has changed")
    parser.add_argument("--missing", action="store_true", help="print the engines that are not installed, and end")
    options = parser.parse_args(arguments)
    accusations = read_accusations()
    engines = dict.fromkeys(accusation.engine for accusation in accusations)
    scripts = {accusation.script for accusation in accusations}
    if unknown := [name for name in options.names if name not in {*engines, *scripts}]:
        raise BadInput("name", repr(unknown[0]), f"a script, or one of {', '.join(engines)}")
    if options.missing:
        print(" ".join(missing_engines(accusations)))
        return 0
    old, new = read_results(), []
    for result in measure(set(options.names) or None):
        print(f"{result.script} {result.version}: {result.printed}: {result.verdict}", flush=True)
        new.append(result)
    if changed := differences(old, new):
        print("changed:", *changed, sep="\n  ")
    if options.check:
        if changed:
            print("Run: python -m conservative.references.accusations, then python .ci/readme")
        return int(bool(changed))
    write_results(merge(old, new))
    return 0


if __name__ == "__main__":
    sys.exit(main())
