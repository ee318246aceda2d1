"""Case files as text: their tables, the lines of their keys, their schema, and the file of a case."""

from nvhchain.case.toml.save import save_case
from nvhchain.case.toml.schema import case_schema

__all__ = ["case_schema", "save_case"]
