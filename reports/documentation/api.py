"""Pages for every public name, made from the docstrings by pdoc, into the folder api/.

    python -m conservative.reports.documentation.api

They open from disk without a network.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import conservative
from conservative.errors import require_extra
from conservative.version import VERSION

MODULES = (
    "conservative",
    "conservative.attitude",
    "conservative.methods.automatic",
    "conservative.methods.coefficients.compositions",
    "conservative.methods.non_spinning",
    "conservative.invariants",
    "conservative.methods.lame",
    "conservative.registry",
    "conservative.scene_files.scene_file",
    "conservative.references",
    "!conservative.references.exact.",
    "conservative.references.exact.method",
)
"""Modules that users import, as pdoc specifies them: with their submodules, except those after an exclamation mark."""
ALIASES = {"Array": "A NumPy array of float64.", "ArrayLike": "Anything that NumPy converts to an array."}
"""Short names in signatures for NumPy's long types."""


def write(folder: Path) -> Path:
    """Write the pages into a folder, over earlier ones, and return the first of them; needs a process of its own.

    Raises
    ------
    MissingExtra
        pdoc is not installed.
    """
    require_extra("the API pages", "dev", "pdoc")
    import pdoc

    tuple(pdoc.extract.load_module(name) for name in pdoc.extract.walk_specs(MODULES))
    tuple(getattr(conservative, name) for name in conservative.__all__)  # pdoc shows imported names only
    # The aliases in our imported modules become classes with only a name.
    stand_ins = {name: type(name, (), {"__module__": "builtins", "__doc__": words}) for name, words in ALIASES.items()}
    for module in [module for name, module in sys.modules.items() if name.partition(".")[0] == "conservative"]:
        vars(module).update({name: stand_ins[name] for name in ALIASES if name in vars(module)})
    pdoc.render.configure(docformat="numpy", footer_text=f"conservative {VERSION}")
    pdoc.pdoc(*MODULES, output_directory=folder)
    return folder / "conservative.html"


def main() -> None:
    """Write the pages, and print the path of the first."""
    parser = argparse.ArgumentParser(prog="python -m conservative.reports.documentation.api", description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, default=Path("api"), help="[default: api]")
    print(write(parser.parse_args().folder))


if __name__ == "__main__":
    main()
