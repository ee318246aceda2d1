"""What is made for people: figures, tables, sound files and summary.json."""

from nvhchain.report.comparison import compare

__all__ = ["compare"]
