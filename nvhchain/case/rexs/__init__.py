"""Import of gear units in REXS as case folders."""

from nvhchain.case.rexs.write import ImportResult, import_rexs

__all__ = ["ImportResult", "import_rexs"]
