"""Parquet files, with pyarrow."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from conservative.attitude import Array
from conservative.errors import BadInput, MissingEngine
from conservative.files import open_file

from .table import CHUNK, UNREADABLE, Start, Table


def read(start: Start) -> Table | None:
    """Return the table of a file; None for another ending. Raises `MissingEngine` without pyarrow."""
    if start.ending != ".parquet":
        return None
    try:
        names = [str(name) for name in _open(start).schema_arrow.names]
    except ImportError:
        raise MissingEngine("pyarrow", "pyarrow") from None
    except BadInput:
        raise
    except UNREADABLE as error:
        raise start.fail(error) from None
    return Table(names, partial(_rows, start))


def _open(start: Start) -> Any:
    from pyarrow.parquet import ParquetFile

    open_file(start.path).close()  # refuses a pipe or a device
    return ParquetFile(start.path)


def _rows(start: Start, wanted: Sequence[str]) -> Iterator[Array]:
    try:
        for batch in _open(start).iter_batches(CHUNK, columns=list(wanted)):
            yield np.column_stack([batch.column(name).to_numpy(zero_copy_only=False).astype(float) for name in wanted])
    except UNREADABLE as error:
        raise start.fail(error) from None
