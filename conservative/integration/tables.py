"""How an ensemble looks: as tables, and as a card in a notebook. pandas is imported when asked for.

Source: our own.
"""

from __future__ import annotations

from collections import Counter
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import require_extra
from ..presentation import COLUMNS, samples

if TYPE_CHECKING:
    import pandas

MOST_LISTED = 5
"""Bodies that a card names at most."""


def sample_table(ensemble: Any) -> pandas.DataFrame:
    """Return a row for each body and sample of an `Ensemble`: its number, and what a trajectory's table has.

    Raises
    ------
    MissingExtra
        pandas, of the extra `report`, is not installed.
    """
    require_extra("Ensemble.to_pandas", "report", "pandas")
    import pandas as pd

    rows = [samples(ensemble[i]) for i in range(len(ensemble))]
    frame = pd.DataFrame(np.concatenate(rows), columns=list(COLUMNS))
    frame.insert(0, "body", np.repeat(np.arange(len(rows)), [len(each) for each in rows]))
    frame.attrs = _attributes(ensemble)
    return frame


def body_table(ensemble: Any) -> pandas.DataFrame:
    """Return a row for each body of an `Ensemble`, with its number as index: outcome, time reached, s, and largest drifts.

    Raises
    ------
    MissingExtra
        pandas, of the extra `report`, is not installed.
    """
    require_extra("Ensemble.to_pandas", "report", "pandas")
    import pandas as pd

    outcomes = np.full(len(ensemble), "ok", dtype=object)
    reached = np.full(len(ensemble), ensemble.t[-1])
    for i, failure in ensemble.failures.items():
        outcomes[i], reached[i] = str(failure.outcome), max(ensemble[i].t, default=0.0)
    drifts = {f"drift of {name}": values for name, values in ensemble.drifts.items()}
    frame = pd.DataFrame({"outcome": outcomes, "t": reached, **drifts})
    frame.index.name, frame.attrs = "body", _attributes(ensemble)
    return frame


def _attributes(ensemble: Any) -> dict[Any, Any]:
    return {"scene": ensemble.bodies.scene.name, "method": ensemble.label}


def card(ensemble: Any) -> str:
    """Return a small HTML table: what was run, how it ended and what drifted most."""
    t = ensemble.t
    rows = [
        ("scene", ensemble.bodies.scene.name),
        ("method", ensemble.label),
        ("bodies", str(len(ensemble))),
        ("samples", f"{len(t)} of each, to {t[-1]:g} s"),
        ("outcomes", describe_outcomes(ensemble)),
        *((f"drift of {name}", describe_drift(values)) for name, values in ensemble.drifts.items()),
    ]
    body = "".join(f'<tr><th scope="row" style="text-align:left">{escape(k)}</th><td>{escape(v)}</td></tr>' for k, v in rows)
    return f"<table><caption>Ensemble</caption>{body}</table>"


def describe_outcomes(ensemble: Any) -> str:
    """Return how many runs ended in which way, and some of the bodies whose runs failed."""
    failed = sorted(ensemble.failures)
    kinds = Counter(ensemble.failures[i].outcome.kind.value for i in failed)
    counts = [f"{len(ensemble) - len(failed)} ok", *(f"{count} {kind}" for kind, count in kinds.most_common())]
    named = ", ".join(map(str, failed[:MOST_LISTED])) + (", ..." if len(failed) > MOST_LISTED else "")
    return ", ".join(counts) + (f" (body {named})" if failed else "")


def describe_drift(values: Any) -> str:
    """Return the largest of drifts (n,), dimensionless, and whose it is."""
    if np.isnan(values).all():
        return "none"
    worst = int(np.nanargmax(values))
    return f"{values[worst]:.2e} at most (relative, body {worst})"
