"""Import of gear units in REXS as case folders, and export of cases."""

from nvhchain.case.rexs.export import export_rexs
from nvhchain.case.rexs.write import ImportResult, import_rexs

__all__ = ["ImportResult", "export_rexs", "import_rexs"]
