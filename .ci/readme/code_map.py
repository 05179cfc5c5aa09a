"""Where the code is: a line for each file and folder of a package, from its docstring."""

from __future__ import annotations

import ast
import re
from pathlib import Path

from marks import table

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("conservative", "references", "benchmarks", "reports")


def summary(text: str | None) -> str:
    """Return the sentences that end in the first line of a text, or its first sentence if that is longer."""
    first = (text or "").partition("\n\n")[0]
    whole = re.match(r".*\.(?=\s|$)", first) or re.match(r".*?\.(?=\s|$)", first, re.DOTALL)
    return " ".join((whole[0] if whole else first).split())


def map_of(room: Path) -> str:
    """Return a row for each folder of a package that has a docstring, then for each of its files."""
    files = {f"{path.parent.name}/": path for path in room.glob("*/__init__.py") if not path.parent.is_symlink()}
    files |= {path.name: path for path in room.glob("*.py") if path.name != "__init__.py"}
    words = {name: ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) for name, path in files.items()}
    ordered = sorted((name for name in words if words[name]), key=lambda name: (not name.endswith("/"), name))
    return table(["file or folder", "contents"], [[f"`{name}`", summary(words[name])] for name in ordered])
