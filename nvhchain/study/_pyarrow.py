"""Tables as Parquet files by pyarrow."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from nvhchain.runtime.extras import installed


def write_parquet(records: Sequence[Mapping[str, Any]], path: Path) -> None:
    """Write a table of records; without pyarrow only remove an earlier file.

    records: column → value of every row. Columns of mixed kinds become texts.
    """
    path.unlink(missing_ok=True)
    if not installed("pyarrow") or not records:
        return
    import pyarrow
    from pyarrow import parquet

    columns = {}
    for name in records[0]:
        values = [record[name] for record in records]
        kinds = {type(value) for value in values if value is not None}
        mixed = len(kinds) > 1 and not kinds <= {int, float}
        if kinds == {int, float}:
            values = [None if value is None else float(value) for value in values]
        columns[name] = [None if value is None else str(value) for value in values] if mixed else values
    parquet.write_table(pyarrow.table(columns), path)
