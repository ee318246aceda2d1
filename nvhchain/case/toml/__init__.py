"""Case files as text: their tables, the lines of their keys, their schema, and the file of a case."""

from nvhchain.case.toml.save import save_case

__all__ = ["save_case"]
