"""A table as LaTeX, for a paper, by the styler of pandas.

It needs the packages booktabs, longtable, amssymb and textcomp. Text of other alphabets stays as it is.
"""

from __future__ import annotations

import re

import pandas as pd

from .model import Table

LATEX_MARK = "% Written by conservative. It needs \\usepackage{booktabs,longtable,amssymb,textcomp}"
"""The first line of a file with a table."""
LONGEST = 40
"""Largest number of rows of a table on one page."""
_SIGNS = str.maketrans(  # signs of our tables in LaTeX
    {
        "✓": r"$\checkmark$",
        "✗": r"$\times$",
        "≈": r"$\approx$",
        "±": r"$\pm$",
        "≤": r"$\le$",
        "–": "--",
        "µ": r"\textmu{}",
        "°": r"\textdegree{}",
        "²": r"\textsuperscript{2}",
        "π": r"$\pi$",
        "ω": r"$\omega$",
        "↕": "",
    }
)


def table(content: Table) -> str:
    """Return a table, with its caption, numbers such as 1e-3 as powers of ten, and columns of numbers to the right."""
    texts = [[str(cell) for cell in row] for row in content.rows]
    header = [_typeset(name) for name in content.header]
    style = (
        pd.DataFrame(texts, columns=range(len(header)))
        .style.format(_typeset)
        .format_index(lambda k: header[int(str(k))], axis=1)
    )
    form, kind = "l" + "r" * (len(header) - 1), "longtable" if len(texts) > LONGEST else None
    caption = _typeset(content.caption) or None
    made = style.hide(axis="index").to_latex(hrules=True, caption=caption, column_format=form, environment=kind)
    return f"{LATEX_MARK}\n{made}"


def _typeset(text: object) -> str:
    """Return a text as LaTeX prints it: special characters escaped, and powers of ten and signs in its own form."""
    escaped = re.sub(r"[&%$#_{}]", r"\\\g<0>", re.sub(r"\\", r"\\textbackslash ", str(text)))
    escaped = escaped.replace("~", r"\textasciitilde{}").replace("^", r"\textasciicircum{}")
    powers = re.sub(r"(?<![\w.])(\d+(?:\.\d+)?)e(-?\d{1,3})\b", r"$\1\\times10^{\2}$", escaped)
    # 1e-3 is 10^-3.
    return powers.replace(r"$1\times10", "$10").translate(_SIGNS)
